#include "engine/calibrate/time_series.h"

#include <algorithm>
#include <vector>

namespace palpate {

double usual_step(std::span<const double> time_s) {
  std::vector<double> steps;
  for (size_t i = 1; i < time_s.size(); ++i) steps.push_back(time_s[i] - time_s[i - 1]);
  if (steps.empty()) return 0;
  const auto middle = steps.begin() + static_cast<ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

double longest_step(std::span<const double> time_s) {
  constexpr double kUsual = 5, kLeast_s = 0.02;
  return std::max(kUsual * usual_step(time_s), kLeast_s);
}

SeriesPlace place_in(std::span<const double> time_s, double at_s) {
  const auto after = std::ranges::lower_bound(time_s, at_s);
  const auto i = static_cast<size_t>(after - time_s.begin());
  if (time_s[i] == at_s) return {i, i, 0};
  return {i - 1, i, (at_s - time_s[i - 1]) / (time_s[i] - time_s[i - 1])};
}

}  // namespace palpate
