// Median and quantiles of values.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace palpate {

/// Median; the upper one of the middle two of an even number, 0 of none. Values are finite, and reordered.
template <typename Number>
Number median_in_place(std::vector<Number>& values) {
  if (values.empty()) return {};
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The value below which `share` (0 to 1) of the others lie; 0 of none. Values are finite, and reordered.
template <typename Number>
Number quantile_in_place(std::vector<Number>& values, double share) {
  if (values.empty()) return {};
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// As median_in_place(), of a copy.
template <typename Number>
Number median(std::vector<Number> values) {
  return median_in_place(values);
}

}  // namespace palpate
