// Scatter of single force readings about their curve, as an interval with its stated coverage.
#pragma once

#include <cmath>
#include <span>

namespace palpate {

/// Scatter that is constant and scatter that grows with the force: sd^2 = still^2 + (share F)^2.
struct Scatter {
  double still_N = 0;
  double fraction = 0;
  double at(double force_N) const { return std::hypot(still_N, fraction * force_N); }
};

/// By weighted least squares of the squared residuals, neither part negative; fewer than 20 residuals: their
/// RMS, constant.
Scatter fit_scatter(std::span<const double> residual_N, std::span<const double> force_N);

/// Factor on a scatter with which +-1.96 of it holds 95 % of further residuals: the quantile
/// of split conformal prediction.
double widening(const Scatter& scatter, std::span<const double> residual_N, std::span<const double> force_N);

}  // namespace palpate
