// Numbers in an option's text.
#pragma once

#include <charconv>
#include <optional>
#include <string_view>

namespace palpate {

/// The number that a text is, with nothing before or after it; none of another text.
inline std::optional<double> number_in(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace palpate
