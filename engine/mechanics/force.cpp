#include "engine/mechanics/force.h"

#include <cmath>

namespace palpate {

Estimate force_from_gray(const ForceCalibration& c, double gray_sum, bool contact, bool saturated) {
  if (!contact) return {0, 0, Validity::NoContact};
  const auto& [var_c0, covariance, var_c1] = c.covariance;
  const double variance =
      c.residual_sd_N * c.residual_sd_N + var_c0 + 2 * gray_sum * covariance + gray_sum * gray_sum * var_c1;
  Estimate force{c.c1_N_per_gray * gray_sum + c.c0_N, std::sqrt(variance), Validity::Valid};
  if (gray_sum < c.gray_min) force.validity = Validity::BelowRange;
  if (gray_sum > c.gray_max) force.validity = Validity::AboveRange;
  if (saturated) force.validity = Validity::Saturated;
  return force;
}

}  // namespace palpate
