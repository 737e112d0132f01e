#include "engine/calibrate/linear_fit.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <string>

#include "palpate/error.h"

namespace palpate {
namespace {

double mean(std::span<const double> values) {
  double sum = 0;
  for (const double v : values) sum += v;
  return sum / static_cast<double>(values.size());
}

}  // namespace

ForceFit fit_force(std::span<const double> gray_sum, std::span<const double> force_N) {
  assert(gray_sum.size() == force_N.size());
  const size_t n = gray_sum.size();
  if (n < 3) {
    throw Error(Failure::Input, "at least 3 readings of gray sum and force", std::to_string(n),
                "a recording with more presses");
  }
  // About the means, so that G of 1e8 loses no digits in its squares.
  const double g_mean = mean(gray_sum), f_mean = mean(force_N);
  double gg = 0, gf = 0, ff = 0;
  for (size_t i = 0; i < n; ++i) {
    const double g = gray_sum[i] - g_mean, f = force_N[i] - f_mean;
    gg += g * g;
    gf += g * f;
    ff += f * f;
  }
  if (!(gg > 0) || !(ff > 0)) {
    throw Error(Failure::Input, "readings at different forces", "the same reading every time",
                "a recording with more presses");
  }
  if (!(gf > 0)) {
    throw Error(Failure::Input, "a gray sum that grows with force", "one that does not",
                "checking the sensor's signal (brighter, darker)");
  }
  ForceFit fit;
  ForceCalibration& c = fit.calibration;
  c.c1_N_per_gray = gf / gg;
  c.c0_N = f_mean - c.c1_N_per_gray * g_mean;
  double squares = 0;
  for (size_t i = 0; i < n; ++i) {
    const double residual = force_N[i] - (c.c1_N_per_gray * gray_sum[i] + c.c0_N);
    squares += residual * residual;
    fit.largest_residual_N = std::max(fit.largest_residual_N, std::abs(residual));
  }
  const double variance = squares / static_cast<double>(n - 2);
  c.residual_sd_N = std::sqrt(variance);
  c.covariance = {variance * (1 / static_cast<double>(n) + g_mean * g_mean / gg), -variance * g_mean / gg,
                  variance / gg};
  c.gray_min = *std::min_element(gray_sum.begin(), gray_sum.end());
  c.gray_max = *std::max_element(gray_sum.begin(), gray_sum.end());
  fit.r_squared = 1 - squares / ff;
  return fit;
}

StiffnessFit fit_stiffness(std::span<const double> shift_mm, std::span<const double> force_N) {
  assert(shift_mm.size() == force_N.size());
  const size_t n = shift_mm.size();
  double uu = 0, uf = 0;
  for (size_t i = 0; i < n; ++i) {
    uu += shift_mm[i] * shift_mm[i];
    uf += shift_mm[i] * force_N[i];
  }
  if (n < 2 || !(uu > 0) || !(uf > 0)) {
    throw Error(Failure::Input, "readings of a contact that shifts with the tangential force",
                std::to_string(n) + " that do not", "a recording with shear");
  }
  StiffnessFit fit;
  fit.k_N_per_mm = uf / uu;
  double squares = 0;
  for (size_t i = 0; i < n; ++i) {
    const double residual = force_N[i] - fit.k_N_per_mm * shift_mm[i];
    squares += residual * residual;
  }
  fit.relative_sd = std::sqrt(squares / static_cast<double>(n - 1) / uu) / fit.k_N_per_mm;
  return fit;
}

}  // namespace palpate
