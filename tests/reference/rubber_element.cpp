#include "tests/reference/rubber_element.h"

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <numbers>

#include "engine/numeric/quadrature.h"

namespace palpate::fem {
namespace {

// Components of the displacement's gradient: rr, rz, zr, zz and around the axis.
using Gradient = Eigen::Matrix<double, 5, 1>;
using Stiff = Eigen::Matrix<double, 5, 5>;

/// Volume ratio less one.
Energy<Gradient, Stiff> volume(const Gradient& u, bool large_strain) {
  Energy<Gradient, Stiff> j;
  if (!large_strain) {
    j.value = u(0) + u(3) + u(4);
    j.first << 1, 0, 0, 1, 1;
    return j;
  }
  const double rr = 1 + u(0), rz = u(1), zr = u(2), zz = 1 + u(3), around = 1 + u(4);
  const double plane = rr * zz - rz * zr;
  // As 1 less, so that small strains keep their digits.
  const double in_plane = u(0) + u(3) + u(0) * u(3) - rz * zr;
  j.value = in_plane + u(4) + in_plane * u(4);
  j.first << zz * around, -zr * around, -rz * around, rr * around, plane;
  const auto pair = [&](int a, int b, double value) { j.second(a, b) = j.second(b, a) = value; };
  pair(0, 3, around);
  pair(1, 2, -around);
  pair(0, 4, zz);
  pair(1, 4, -zr);
  pair(2, 4, -rz);
  pair(3, 4, rr);
  return j;
}

/// What distortion costs, of shear modulus 1: infinite where a point is turned inside out.
Energy<Gradient, Stiff> distortion(const Gradient& u, bool large_strain) {
  Energy<Gradient, Stiff> w;
  if (!large_strain) {
    Stiff& d = w.second;
    for (const int a : {0, 3, 4})
      for (const int b : {0, 3, 4}) d(a, b) = (a == b ? 2.0 : 0.0) - 2.0 / 3;
    d(1, 1) = d(2, 2) = d(1, 2) = d(2, 1) = 1;
    w.first = d * u;
    w.value = 0.5 * u.dot(w.first);
    return w;
  }
  const Energy<Gradient, Stiff> j = volume(u, true);
  const double ratio = j.value + 1;
  if (ratio <= 0) {
    w.value = std::numeric_limits<double>::infinity();
    return w;
  }
  Gradient f = u;
  for (const int a : {0, 3, 4}) f(a) += 1;
  const double more_squares = 2 * (u(0) + u(3) + u(4)) + u.squaredNorm(), squares = 3 + more_squares;
  const double more_scale = std::expm1(-2.0 / 3 * std::log1p(j.value)), scale = 1 + more_scale;
  w.value = 0.5 * (3 * more_scale + more_squares + more_scale * more_squares);
  w.first = scale * (f - squares / (3 * ratio) * j.first);
  w.second =
      scale *
      (Stiff::Identity() - 2 / (3 * ratio) * (f * j.first.transpose() + j.first * f.transpose()) +
       5 * squares / (9 * ratio * ratio) * j.first * j.first.transpose() - squares / (3 * ratio) * j.second);
  return w;
}

struct Point {
  Eigen::Matrix<double, 5, 18> by_node = Eigen::Matrix<double, 5, 18>::Zero();
  Energy<Gradient, Stiff> volume;
  double weight = 0;
  Eigen::Vector3d linear;
};
Point point_at(const ElementNodes& rest, double x, double y, double weight, bool plane) {
  const QuadraticLine along(x), down(y);
  Eigen::Matrix<double, 9, 1> value;
  Eigen::Matrix<double, 9, 2> by_xy;
  for (Eigen::Index n = 0; n < 9; ++n) {
    const auto i = static_cast<size_t>(n % 3), j = static_cast<size_t>(n / 3);
    value(n) = along.value[i] * down.value[j];
    by_xy.row(n) << along.slope[i] * down.value[j], along.value[i] * down.slope[j];
  }
  const Eigen::Matrix2d jacobian = rest * by_xy;
  const Eigen::Matrix<double, 9, 2> by_rz = by_xy * jacobian.inverse();
  const double r = rest.row(0) * value;
  Point point;
  point.weight = length_around(r, plane) * jacobian.determinant() * weight;
  point.linear << 1, x, y;
  for (Eigen::Index n = 0; n < 9; ++n) {
    point.by_node.block<2, 1>(0, 2 * n) = by_rz.row(n).transpose();
    point.by_node.block<2, 1>(2, 2 * n + 1) = by_rz.row(n).transpose();
    point.by_node(4, 2 * n) = plane ? 0 : value(n) / r;
  }
  return point;
}

}  // namespace

Rubber rubber(double young_MPa, double poisson, bool large_strain) {
  return {young_MPa / (2 * (1 + poisson)), young_MPa / (3 * (1 - 2 * poisson)), large_strain};
}

double length_around(double r, bool plane) {
  return plane ? 2 : 2 * std::numbers::pi * r;
}

ElementEnergy element_energy(const ElementNodes& rest, const ElementVector& moved, const Rubber& of,
                             bool plane, bool derivatives) {
  static const Quadrature gauss = gauss_legendre(3, 2);  // on [0, 2]
  ElementEnergy sum;
  std::array<Point, 9> points;
  // Volume changes as polynomials 1, x and y, made orthonormal over the element.
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  for (size_t p = 0; p < 9; ++p) {
    Point& point = points[p];
    point = point_at(rest, gauss.x[p % 3] - 1, gauss.x[p / 3] - 1, gauss.w[p % 3] * gauss.w[p / 3], plane);
    squares += point.weight * point.linear * point.linear.transpose();
    const Gradient gradient = point.by_node * moved;
    point.volume = volume(gradient, of.large_strain);
    const Energy<Gradient, Stiff> w = distortion(gradient, of.large_strain);
    sum.value += point.weight * of.shear_MPa * w.value;
    if (!derivatives || !std::isfinite(w.value)) continue;
    sum.first += point.weight * of.shear_MPa * point.by_node.transpose() * w.first;
    sum.second += point.weight * of.shear_MPa * point.by_node.transpose() * w.second * point.by_node;
  }
  // Gram and Schmidt.
  Eigen::Matrix3d basis = Eigen::Matrix3d::Identity();
  for (int a = 0; a < 3; ++a) {
    for (int b = 0; b < a; ++b) basis.col(a) -= basis.col(b).dot(squares * basis.col(a)) * basis.col(b);
    basis.col(a) /= std::sqrt(basis.col(a).dot(squares * basis.col(a)));
  }
  for (int a = 0; a < 3; ++a) {
    double change = 0;
    ElementVector first = ElementVector::Zero();
    for (const Point& point : points) {
      const double weight = point.weight * basis.col(a).dot(point.linear);
      change += weight * point.volume.value;
      if (derivatives) first += weight * point.by_node.transpose() * point.volume.first;
    }
    sum.value += 0.5 * of.bulk_MPa * change * change;
    if (!derivatives) continue;
    sum.first += of.bulk_MPa * change * first;
    sum.second += of.bulk_MPa * first * first.transpose();
    for (const Point& point : points) {
      const double weight = point.weight * basis.col(a).dot(point.linear) * of.bulk_MPa * change;
      sum.second += weight * point.by_node.transpose() * point.volume.second * point.by_node;
    }
  }
  return sum;
}

}  // namespace palpate::fem
