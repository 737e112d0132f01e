// An element of rubber about an axis: the energy of its nodes' displacements and its derivatives.
#pragma once

#include <Eigen/Core>
#include <array>

namespace palpate::fem {

/// Energy, and its first and second derivatives.
template <typename First, typename Second>
struct Energy {
  double value = 0;
  First first = First::Zero();
  Second second = Second::Zero();
};

/// Quadratic polynomials through -1, 0 and 1, and their slopes.
struct QuadraticLine {
  std::array<double, 3> value, slope;
  explicit QuadraticLine(double x)
      : value{x * (x - 1) / 2, 1 - x * x, x * (x + 1) / 2}, slope{x - 0.5, -2 * x, x + 0.5} {}
};

struct Rubber {
  double shear_MPa = 0, bulk_MPa = 0;
  bool large_strain = true;  ///< neo-Hookean, the energy of neo_hookean.h; false: linear
};
/// Of Young's modulus and Poisson's ratio below 0.5.
Rubber rubber(double young_MPa, double poisson, bool large_strain);

using ElementNodes = Eigen::Matrix<double, 2, 9>;  ///< r and z of three rows of three nodes, mm
using ElementVector = Eigen::Matrix<double, 18, 1>;
using ElementMatrix = Eigen::Matrix<double, 18, 18>;
using ElementEnergy = Energy<ElementVector, ElementMatrix>;

/// Around the axis, or (`plane`) of both halves of 1 mm in plane strain, N mm. Nine nodes, volume changes
/// projected on linear ones (Q2-P1); infinite where a point is turned inside out. Derivatives where wanted.
ElementEnergy element_energy(const ElementNodes& rest, const ElementVector& moved, const Rubber& of,
                             bool plane, bool derivatives);

/// The length of a ring of that radius, or of both halves of 1 mm.
double length_around(double r, bool plane);

}  // namespace palpate::fem
