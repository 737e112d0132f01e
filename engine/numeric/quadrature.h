// Gauss-Legendre quadrature, plain and for integrands with a root at either end.
#pragma once

#include <vector>

namespace palpate {

struct Quadrature {
  std::vector<double> x, w;  ///< nodes in rising order or falling, and their weights
};

/// `n` nodes and weights on [0, length]: exact for polynomials up to degree 2 n - 1.
Quadrature gauss_legendre(int n, double length);

/// `n` nodes and weights on [from, to] through x = from + (to - from) t^2 (3 - 2 t), which makes integrands
/// smooth that behave like a square root or its inverse at an end. Empty where to <= from.
Quadrature end_clustered(int n, double from, double to);

}  // namespace palpate
