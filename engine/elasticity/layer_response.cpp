#include "engine/elasticity/layer_response.h"

#include <cmath>

namespace palpate {

double missing_response(double s, double poisson, Base base) {
  const double e = std::exp(-2 * s);  // in e both parts of K's fraction stay finite
  if (base == Base::Frictionless) return 1 - (1 - e) * (1 - e) / (1 - e * e + 4 * s * e);
  const double k = 3 - 4 * poisson;
  return 1 - (k * (1 - e * e) - 4 * s * e) / (k * (1 + e * e) + (4 * s * s + 1 + k * k) * e);
}

}  // namespace palpate
