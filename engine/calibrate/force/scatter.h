// Scatter of single force readings about their curve, as an interval with its stated coverage.
#pragma once

#include <algorithm>
#include <cmath>
#include <span>

namespace palpate {

/// Scatter that is constant and scatter that grows with the force, up to `grows_to_N`:
/// sd^2 = still^2 + (share min(F, grows_to))^2.
struct Scatter {
  double still_N = 0;
  double fraction = 0;
  double grows_to_N = 0;  ///< 0: without end
  double at(double force_N) const {
    const double size_N = std::abs(force_N);
    return std::hypot(still_N, fraction * (grows_to_N > 0 ? std::min(size_N, grows_to_N) : size_N));
  }
};

/// By weighted least squares of the squared residuals, neither part negative, without end unless an end
/// explains their sizes clearly better (by 0.02 of log likelihood a residual); fewer than 20 residuals: their
/// RMS, constant.
Scatter fit_scatter(std::span<const double> residual_N, std::span<const double> force_N);

/// Factor on a scatter with which +-1.96 of it holds 95 % of further residuals: the quantile
/// of split conformal prediction.
double widening(const Scatter& scatter, std::span<const double> residual_N, std::span<const double> force_N);

}  // namespace palpate
