// Pieces of HTML pages.
#pragma once

#include <string>

namespace palpate {

/// Text as HTML shows it: no tag, entity or attribute can come out of it.
std::string html_escaped(const std::string& text);
/// The <svg> element alone, without the XML declaration before it.
std::string svg_element(const std::string& svg);

}  // namespace palpate
