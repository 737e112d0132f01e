// Text with numbers in it.
#pragma once

#include <string>

namespace palpate {

/// printf into a string of the length that it takes.
std::string text(const char* format, ...) __attribute__((format(printf, 1, 2)));

}  // namespace palpate
