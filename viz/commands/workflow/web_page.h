// The page of viz/web, which the server of live data sends to browsers.
#pragma once

#include <string>

namespace palpate {

std::string web_page();

}  // namespace palpate
