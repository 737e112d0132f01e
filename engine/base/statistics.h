// Median of values.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace palpate {

/// Of an even number the upper one of the middle two; 0 of none. Values are finite.
template <typename Number>
Number median(std::vector<Number> values) {
  if (values.empty()) return {};
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace palpate
