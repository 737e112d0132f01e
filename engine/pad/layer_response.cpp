#include "engine/pad/layer_response.h"

#include <cmath>

namespace palpate {

double missing_response(double s, double poisson, Base base) {
  const double e = std::exp(-2 * s);  // in e both parts of K's fraction stay finite
  if (base == Base::Frictionless) return 1 - (1 - e) * (1 - e) / (1 - e * e + 4 * s * e);
  return 1 - layer_response(s, poisson).normal / (1 - poisson);
}

LayerResponse layer_response(double s, double poisson) {
  const double e = std::exp(-2 * s), k = 3 - 4 * poisson;
  // Four times hyperbolic functions of s, times exp(-2 s), which keeps all of it finite.
  const double sinh_cosh = 1 - e * e, sinh_2 = (1 - e) * (1 - e), s_2 = 4 * s * s * e;
  const double determinant = k * (1 + e * e) + (4 * s * s + 1 + k * k) * e;
  return {.normal = (1 - poisson) * (k * sinh_cosh - 4 * s * e) / determinant,
          .along = (1 - poisson) * (k * sinh_cosh + 4 * s * e) / determinant,
          .across = std::tanh(s),
          .coupling = 0.5 * (k * (1 - 2 * poisson) * sinh_2 - s_2) / determinant};
}

}  // namespace palpate
