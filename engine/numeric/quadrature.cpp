#include "engine/numeric/quadrature.h"

#include <cmath>
#include <numbers>

namespace palpate {

Quadrature gauss_legendre(int n, double length) {
  const size_t count = static_cast<size_t>(n);
  Quadrature q{std::vector<double>(count), std::vector<double>(count)};
  for (int i = 0; i < n; ++i) {
    double x = std::cos(std::numbers::pi * (i + 0.75) / (n + 0.5)), slope = 1;
    for (int iteration = 0; iteration < 50; ++iteration) {
      double p0 = 1, p1 = x;
      for (int k = 2; k <= n; ++k) {
        const double p2 = ((2 * k - 1) * x * p1 - (k - 1) * p0) / k;
        p0 = p1;
        p1 = p2;
      }
      slope = n * (x * p1 - p0) / (x * x - 1);
      const double step = p1 / slope;
      x -= step;
      if (std::abs(step) < 1e-15) break;
    }
    q.x[i] = length * (1 - x) / 2;
    q.w[i] = length / ((1 - x * x) * slope * slope);
  }
  return q;
}

Quadrature end_clustered(int n, double from, double to) {
  Quadrature q;
  if (!(to > from)) return q;
  q = gauss_legendre(n, 1);
  for (size_t i = 0; i < q.x.size(); ++i) {
    const double t = q.x[i];
    q.x[i] = from + (to - from) * t * t * (3 - 2 * t);
    q.w[i] *= (to - from) * 6 * t * (1 - t);
  }
  return q;
}

}  // namespace palpate
