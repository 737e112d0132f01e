#include "engine/calibrate/force/scatter.h"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace palpate {

namespace {

constexpr int kEnds = 8;  // tried, up to the largest force
constexpr double kClearlyBetter =
    0.02;  // of log likelihood a residual: noise of one kind gains a tenth of it

/// The two parts where the growth ends at `grows_to_N`.
Scatter fit_parts(std::span<const double> residual_N, std::span<const double> force_N, double mean,
                  double grows_to_N) {
  const double floor = 0.01 * mean;
  const Scatter shape{0, 1, grows_to_N};
  double a = mean, b = 0;
  for (int round = 0; round < 10; ++round) {
    double w1 = 0, wx = 0, wxx = 0, wy = 0, wxy = 0;
    for (size_t i = 0; i < residual_N.size(); ++i) {
      const double x = std::pow(shape.at(force_N[i]), 2), y = residual_N[i] * residual_N[i];
      const double expected = std::max(a + b * x, floor), w = 1 / (expected * expected);
      w1 += w;
      wx += w * x;
      wxx += w * x * x;
      wy += w * y;
      wxy += w * x * y;
    }
    const double determinant = w1 * wxx - wx * wx;
    if (!(determinant > 0)) break;
    a = (wxx * wy - wx * wxy) / determinant;
    b = (w1 * wxy - wx * wy) / determinant;
    if (b < 0) {
      b = 0;
      a = wy / w1;
    } else if (a < floor) {
      a = floor;
      b = std::max(0.0, (wxy - a * wx) / wxx);
    }
  }
  return {std::sqrt(std::max(a, floor)), std::sqrt(b), grows_to_N};
}

/// Negative log likelihood a residual, of a normal distribution.
double surprise(const Scatter& scatter, std::span<const double> residual_N, std::span<const double> force_N) {
  double sum = 0;
  for (size_t i = 0; i < residual_N.size(); ++i) {
    const double sd = scatter.at(force_N[i]);
    sum += std::log(sd) + 0.5 * std::pow(residual_N[i] / sd, 2);
  }
  return sum / static_cast<double>(residual_N.size());
}

}  // namespace

Scatter fit_scatter(std::span<const double> residual_N, std::span<const double> force_N) {
  double mean = 0, most_N = 0;
  for (const double r : residual_N) mean += r * r / static_cast<double>(residual_N.size());
  for (const double f : force_N) most_N = std::max(most_N, std::abs(f));
  if (residual_N.size() < 20 || !(mean > 0)) return {std::sqrt(mean), 0};
  Scatter best = fit_parts(residual_N, force_N, mean, 0);
  double least = surprise(best, residual_N, force_N) - kClearlyBetter;
  for (int k = 1; k < kEnds; ++k) {
    const Scatter ends = fit_parts(residual_N, force_N, mean, most_N * k / kEnds);
    const double now = surprise(ends, residual_N, force_N);
    if (!(now < least)) continue;
    least = now;
    best = ends;
  }
  return best;
}

double widening(const Scatter& scatter, std::span<const double> residual_N, std::span<const double> force_N) {
  constexpr double kNormal95 = 1.959964;
  std::vector<double> size;
  for (size_t i = 0; i < residual_N.size(); ++i)
    size.push_back(std::abs(residual_N[i]) / scatter.at(force_N[i]));
  if (size.empty()) return 1;
  const auto rank = static_cast<size_t>(std::ceil(0.95 * static_cast<double>(size.size() + 1)));
  const auto at = size.begin() + static_cast<ptrdiff_t>(std::min(rank, size.size()) - 1);
  std::nth_element(size.begin(), at, size.end());
  return *at / kNormal95;
}

}  // namespace palpate
