#include "engine/base/text.h"

#include <algorithm>
#include <cstdarg>
#include <cstdio>

namespace palpate {

std::string text(const char* format, ...) {
  va_list arguments, again;
  va_start(arguments, format);
  va_copy(again, arguments);
  const int length = std::vsnprintf(nullptr, 0, format, arguments);
  va_end(arguments);
  std::string written(static_cast<size_t>(std::max(length, 0)), '\0');
  std::vsnprintf(written.data(), written.size() + 1, format, again);
  va_end(again);
  return written;
}

}  // namespace palpate
