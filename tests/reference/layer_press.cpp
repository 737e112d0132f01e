#include "tests/reference/layer_press.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "engine/numeric/quadrature.h"
#include "engine/numeric/sparse.h"
#include "palpate/error.h"

namespace palpate::fem {
namespace {

constexpr double kPenalty = 500;      // pressure over what is let through, in moduli per cell
constexpr double kBeyond = 8;         // thicknesses from where cells grow to the rim
constexpr double kStep = 0.03;        // of the thickness or the radius, whichever is less: of the press
constexpr double kGoal = 1e-8;        // forces out of balance over the contact's
constexpr double kNearGoal = 1e-5;    // of them where rounding lets a step gain nothing more
constexpr double kLeastGain = 1e-12;  // of the energy: rounding
constexpr int kMostNewton = 80, kMostCuts = 10, kMostHalvings = 12;

// Components of the displacement's gradient: rr, rz, zr, zz and around the axis.
using Gradient = Eigen::Matrix<double, 5, 1>;
using Stiff = Eigen::Matrix<double, 5, 5>;
using Element = Eigen::Matrix<double, 18, 1>;
using ElementMatrix = Eigen::Matrix<double, 18, 18>;

/// From 0 to `fine` even cells, from there to `end` growing ones.
std::vector<double> lines(double cell, double fine, double end, double growth, double largest) {
  const int even = std::max(1, static_cast<int>(std::ceil(fine / cell - 1e-9)));
  std::vector<double> at;
  for (int i = 0; i <= even; ++i) at.push_back(std::min(end, fine * i / even));
  for (double size = fine / even; at.back() < end - 1e-9;) {
    size = std::min(size * growth, largest);
    at.push_back(at.back() + size > end - 0.5 * size ? end : at.back() + size);
  }
  return at;
}

/// Energy, and its first and second derivatives.
template <typename First, typename Second>
struct Energy {
  double value = 0;
  First first = First::Zero();
  Second second = Second::Zero();
};

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
  j.value = plane * around - 1;
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
  const double squares = f.squaredNorm(), scale = std::pow(ratio, -2.0 / 3);
  w.value = 0.5 * (scale * squares - 3);
  w.first = scale * (f - squares / (3 * ratio) * j.first);
  w.second =
      scale *
      (Stiff::Identity() - 2 / (3 * ratio) * (f * j.first.transpose() + j.first * f.transpose()) +
       5 * squares / (9 * ratio * ratio) * j.first * j.first.transpose() - squares / (3 * ratio) * j.second);
  return w;
}

/// Quadratic polynomials through -1, 0 and 1, and their slopes.
struct Line {
  std::array<double, 3> value, slope;
  explicit Line(double x)
      : value{x * (x - 1) / 2, 1 - x * x, x * (x + 1) / 2}, slope{x - 0.5, -2 * x, x + 0.5} {}
};

class PressedModel {
 public:
  explicit PressedModel(const IndenterOnLayer& what)
      : what_(what),
        plane_(what.indenter == Indenter::Cylinder),
        r_(lines(what.cell_mm, what.reach_mm, what.reach_mm + kBeyond * what.thickness_mm, 1.35,
                 0.4 * what.thickness_mm)),
        z_(lines(what.cell_mm, std::min(what.reach_mm, 0.4 * what.thickness_mm), what.thickness_mm, 1.3,
                 0.15 * what.thickness_mm)),
        columns_(2 * r_.size() - 1),
        rows_(2 * z_.size() - 1),
        shear_(what.young_MPa / (2 * (1 + what.poisson))),
        bulk_(what.young_MPa / (3 * (1 - 2 * what.poisson))),
        penalty_(kPenalty * what.young_MPa / what.cell_mm),
        points_(gauss_legendre(3, 2)) {
    unknown_.assign(2 * columns_ * rows_, -1);
    for (size_t row = 0; row + 1 < rows_; ++row)
      for (size_t column = 0; column < columns_; ++column)
        for (size_t c = 0; c < 2; ++c)
          if (c == 1 || column > 0) unknown_[2 * (row * columns_ + column) + c] = unknowns_++;
    moved_ = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(unknown_.size()));
    before_ = moved_;
  }

  /// False where no equilibrium is found; the layer then stands as before.
  bool press(double way_mm) {
    const Eigen::VectorXd before = moved_;
    const double from = way_mm_;
    // On as before: the contact is then nearly where it will be.
    if (from > before_way_mm_) moved_ += (way_mm - from) / (from - before_way_mm_) * (moved_ - before_);
    way_mm_ = way_mm;
    if (!std::isfinite(assemble(false))) moved_ = before;
    if (search()) {
      before_ = before;
      before_way_mm_ = from;
      return true;
    }
    moved_ = before;
    way_mm_ = from;
    return false;
  }

  /// Newton's, from where the layer stands.
  bool search() {
    for (int round = 0; round < kMostNewton; ++round) {
      const double energy = assemble(true);
      if (residual_.norm() <= kGoal * contact_norm_) return true;
      const sparse::Factor factor(sparse::Factor::Kind::Ldlt, unknowns_, entries_);
      if (!factor.ok()) return false;
      const Eigen::VectorXd step = factor.solve(-residual_), start = moved_;
      const double slope = step.dot(residual_);
      const bool near = residual_.norm() <= kNearGoal * contact_norm_;
      if (near && -slope <= kLeastGain * energy) return true;
      if (!(slope < 0)) return false;
      double part = 1;
      bool lower = false;
      for (int i = 0; i < kMostHalvings && !lower; ++i, part /= 2) {
        for (size_t k = 0; k < unknown_.size(); ++k)
          if (unknown_[k] >= 0) moved_[at(k)] = start[at(k)] + part * step[unknown_[k]];
        lower = assemble(false) <= energy + 1e-4 * part * slope + kLeastGain * energy;
      }
      if (!lower) return near;
    }
    return false;
  }

  PressedLayer measure() {
    PressedLayer pressed;
    pressed.press_mm = way_mm_;
    each_contact([&](const Contact& c) {
      pressed.force_N -= c.weight * penalty_ * c.gap * c.first(1);
      pressed.contact_radius_mm = std::max(pressed.contact_radius_mm, c.radius);
      pressed.pressure_max_MPa = std::max(pressed.pressure_max_MPa, penalty_ * c.gap / c.stretch);
    });
    for (size_t column = 0; column < columns_; ++column) {
      const double aside = what_.large_strain ? moved_[at(2 * column)] : 0;
      pressed.surface_mm.push_back({place(r_, column) + aside, moved_[at(2 * column + 1)]});
    }
    return pressed;
  }

 private:
  static Eigen::Index at(size_t i) { return static_cast<Eigen::Index>(i); }
  /// Of the model's half: the ring's length, or both halves of 1 mm.
  double around(double r) const { return plane_ ? 2 : 2 * std::numbers::pi * r; }
  /// Nodes lie on lines and in their middles.
  static double place(const std::vector<double>& lines, size_t node) {
    return node % 2 == 0 ? lines[node / 2] : 0.5 * (lines[node / 2] + lines[node / 2 + 1]);
  }

  /// A point of the surface that the sphere has passed by `gap`; derivatives by its own displacement.
  struct Contact {
    size_t column = 0;  ///< of the edge's first node
    std::array<double, 3> shapes{};
    double weight = 0, gap = 0, radius = 0;
    double stretch = 1;  ///< area as it lies over area at rest
    Eigen::Vector2d first = Eigen::Vector2d::Zero();
    Eigen::Matrix2d second = Eigen::Matrix2d::Zero();
  };
  template <typename With>
  void each_contact(const With& with) const {
    for (size_t edge = 0; edge + 1 < r_.size(); ++edge)
      for (size_t p = 0; p < 3; ++p) {
        const Line line(points_.x[p] - 1);
        const double half = 0.5 * (r_[edge + 1] - r_[edge]);
        Contact c{.column = 2 * edge, .shapes = line.value};
        Eigen::Vector2d u = Eigen::Vector2d::Zero(), slope = Eigen::Vector2d::Zero();
        for (size_t i = 0; i < 3; ++i) {
          const Eigen::Vector2d node(moved_[at(2 * (c.column + i))], moved_[at(2 * (c.column + i) + 1)]);
          u += line.value[i] * node;
          slope += line.slope[i] / half * node;
        }
        const double r = 0.5 * (r_[edge] + r_[edge + 1]) + half * (points_.x[p] - 1);
        c.weight = around(r) * half * points_.w[p];
        // z counts down from the surface at rest.
        if (!what_.large_strain) {
          c.gap = way_mm_ - r * r / (2 * what_.radius_mm) - u(1);
          c.first << 0, -1;
          c.radius = r;
        } else {
          // A flat face is level up to where its rim's round begins.
          const bool flat = what_.indenter == Indenter::Flat;
          const double bend = flat ? what_.rim_mm : what_.radius_mm;
          const double level = what_.radius_mm - bend;
          c.radius = r + u(0);
          if (c.radius <= level) {
            c.gap = way_mm_ - u(1);
            c.first << 0, -1;
          } else {
            const Eigen::Vector2d from(c.radius - level, u(1) - (way_mm_ - bend));
            const double distance = from.norm();
            const Eigen::Vector2d normal = from / distance;
            // Above the middle the other half is no obstacle.
            c.gap = from(1) > 0 ? bend - distance : -1;
            c.first = -normal;
            c.second = -(Eigen::Matrix2d::Identity() - normal * normal.transpose()) / distance;
          }
          c.stretch = (plane_ ? 1 : c.radius / r) * std::hypot(1 + slope(0), slope(1));
        }
        if (c.gap > 0) with(c);
      }
  }

  /// The energy; with `derivatives` also residual_, entries_ and contact_norm_.
  double assemble(bool derivatives) {
    double energy = 0;
    if (derivatives) {
      residual_ = Eigen::VectorXd::Zero(unknowns_);
      entries_.clear();
    }
    for (size_t row = 0; row + 1 < z_.size(); ++row)
      for (size_t column = 0; column + 1 < r_.size(); ++column)
        energy += add_element(row, column, derivatives);
    Eigen::VectorXd pushed = Eigen::VectorXd::Zero(derivatives ? unknowns_ : 0);
    each_contact([&](const Contact& c) {
      energy += 0.5 * penalty_ * c.weight * c.gap * c.gap;
      if (!derivatives) return;
      const Eigen::Matrix2d second = penalty_ * c.weight * (c.first * c.first.transpose() + c.gap * c.second);
      for (size_t i = 0; i < 6; ++i) {
        const int row = unknown_[2 * c.column + i];
        if (row < 0) continue;
        pushed[row] += penalty_ * c.weight * c.gap * c.first(at(i % 2)) * c.shapes[i / 2];
        for (size_t j = 0; j < 6; ++j) {
          const int column = unknown_[2 * c.column + j];
          if (column >= 0 && column <= row)
            entries_.emplace_back(row, column,
                                  second(at(i % 2), at(j % 2)) * c.shapes[i / 2] * c.shapes[j / 2]);
        }
      }
    });
    if (derivatives) {
      contact_norm_ = pushed.norm();
      residual_ += pushed;
    }
    return energy;
  }

  double add_element(size_t row, size_t column, bool derivatives) {
    const double half_r = 0.5 * (r_[column + 1] - r_[column]), half_z = 0.5 * (z_[row + 1] - z_[row]);
    std::array<size_t, 18> of;
    Element u;
    for (size_t n = 0; n < 9; ++n)
      for (size_t c = 0; c < 2; ++c) {
        of[2 * n + c] = 2 * ((2 * row + n / 3) * columns_ + 2 * column + n % 3) + c;
        u(at(2 * n + c)) = moved_[at(of[2 * n + c])];
      }
    Energy<Element, ElementMatrix> sum;
    // Volume changes as polynomials 1, x and y, made orthonormal over the element.
    struct Point {
      Eigen::Matrix<double, 5, 18> by_node;
      Energy<Gradient, Stiff> volume;
      double weight;
      Eigen::Vector3d linear;
    };
    std::array<Point, 9> points;
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
    for (size_t p = 0; p < 9; ++p) {
      const double x = points_.x[p % 3] - 1, y = points_.x[p / 3] - 1;
      const Line along(x), down(y);
      const double r = 0.5 * (r_[column] + r_[column + 1]) + half_r * x;
      Point& point = points[p];
      point.by_node.setZero();
      for (size_t n = 0; n < 9; ++n) {
        const double value = along.value[n % 3] * down.value[n / 3];
        const double by_r = along.slope[n % 3] * down.value[n / 3] / half_r;
        const double by_z = along.value[n % 3] * down.slope[n / 3] / half_z;
        const Eigen::Index radial = at(2 * n), axial = radial + 1;
        point.by_node(0, radial) = by_r;
        point.by_node(1, radial) = by_z;
        point.by_node(2, axial) = by_r;
        point.by_node(3, axial) = by_z;
        point.by_node(4, radial) = plane_ ? 0 : value / r;
      }
      point.weight = around(r) * half_r * half_z * points_.w[p % 3] * points_.w[p / 3];
      point.linear << 1, x, y;
      squares += point.weight * point.linear * point.linear.transpose();
      const Gradient gradient = point.by_node * u;
      point.volume = volume(gradient, what_.large_strain);
      const Energy<Gradient, Stiff> w = distortion(gradient, what_.large_strain);
      sum.value += point.weight * shear_ * w.value;
      if (!derivatives || !std::isfinite(w.value)) continue;
      sum.first += point.weight * shear_ * point.by_node.transpose() * w.first;
      sum.second += point.weight * shear_ * point.by_node.transpose() * w.second * point.by_node;
    }
    // Gram and Schmidt.
    Eigen::Matrix3d basis = Eigen::Matrix3d::Identity();
    for (int a = 0; a < 3; ++a) {
      for (int b = 0; b < a; ++b) basis.col(a) -= basis.col(b).dot(squares * basis.col(a)) * basis.col(b);
      basis.col(a) /= std::sqrt(basis.col(a).dot(squares * basis.col(a)));
    }
    for (int a = 0; a < 3; ++a) {
      double change = 0;
      Element first = Element::Zero();
      for (const Point& point : points) {
        const double weight = point.weight * basis.col(a).dot(point.linear);
        change += weight * point.volume.value;
        if (derivatives) first += weight * point.by_node.transpose() * point.volume.first;
      }
      sum.value += 0.5 * bulk_ * change * change;
      if (!derivatives) continue;
      sum.first += bulk_ * change * first;
      sum.second += bulk_ * first * first.transpose();
      for (const Point& point : points) {
        const double weight = point.weight * basis.col(a).dot(point.linear) * bulk_ * change;
        sum.second += weight * point.by_node.transpose() * point.volume.second * point.by_node;
      }
    }
    if (!derivatives) return sum.value;
    for (size_t i = 0; i < 18; ++i) {
      const int to = unknown_[of[i]];
      if (to < 0) continue;
      residual_[to] += sum.first(at(i));
      for (size_t j = 0; j < 18; ++j)
        if (const int from = unknown_[of[j]]; from >= 0 && from <= to)
          entries_.emplace_back(to, from, sum.second(at(i), at(j)));
    }
    return sum.value;
  }

  IndenterOnLayer what_;
  bool plane_;
  std::vector<double> r_, z_;  ///< lines of the elements; z from the surface down
  size_t columns_, rows_;      ///< of nodes
  double shear_, bulk_, penalty_;
  Quadrature points_;         ///< on [0, 2]
  std::vector<int> unknown_;  ///< of each component of each node; -1: held
  int unknowns_ = 0;
  Eigen::VectorXd moved_, residual_;
  Eigen::VectorXd before_;  ///< one press earlier
  std::vector<sparse::Entry> entries_;
  double contact_norm_ = 0, way_mm_ = 0, before_way_mm_ = 0;
};

void check(const IndenterOnLayer& what, const std::vector<double>& press_mm) {
  const auto refuse = [](const char* wanted, double found) {
    throw Error(Failure::Usage, wanted, std::to_string(found), "another press");
  };
  for (const double length : {what.thickness_mm, what.radius_mm, what.young_MPa, what.cell_mm, what.reach_mm})
    if (!(length > 0) || !std::isfinite(length)) refuse("lengths and a modulus > 0", length);
  if (!(what.poisson >= 0 && what.poisson <= 0.4999))
    refuse("a Poisson's ratio from 0 to 0.4999", what.poisson);
  if (what.indenter != Indenter::Sphere && !what.large_strain) refuse("large strain, but under a sphere", 0);
  if (what.indenter == Indenter::Flat && !(what.rim_mm > 0 && what.rim_mm < what.radius_mm))
    refuse("a rim > 0 mm and less than the radius", what.rim_mm);
  if (what.cell_mm > what.thickness_mm / 4)
    refuse("cells of at most a quarter of the thickness", what.cell_mm);
  double before = 0;
  for (const double press : press_mm) {
    if (!(press > before && press < what.thickness_mm))
      refuse("presses in rising order, within the layer", press);
    before = press;
  }
}

}  // namespace

std::vector<PressedLayer> press_layer(const IndenterOnLayer& what, const std::vector<double>& press_mm) {
  check(what, press_mm);
  PressedModel model(what);
  const double largest =
      what.large_strain ? kStep * std::min(what.thickness_mm, what.radius_mm) : what.thickness_mm;
  std::vector<PressedLayer> out;
  double at = 0, step = largest;
  for (const double press : press_mm) {
    while (at < press) {
      const double to = at + step > press - 1e-9 * press ? press : at + step;
      if (model.press(to)) {
        at = to;
        step = std::min(1.5 * step, largest);
      } else if ((step /= 2) < largest / (1 << kMostCuts)) {
        return out;
      }
    }
    out.push_back(model.measure());
  }
  return out;
}

SeenPress seen_by_camera(const PressedLayer& pressed, uint32_t along, double cell_mm, double margin,
                         bool plane) {
  const auto& nodes = pressed.surface_mm;
  // Through an element's three nodes.
  const auto depth_at = [&](double r) {
    size_t i = 2;
    while (i + 2 < nodes.size() && nodes[i][0] < r) i += 2;
    double sum = 0;
    for (size_t a = i - 2; a <= i; ++a) {
      double shape = nodes[a][1];
      for (size_t b = i - 2; b <= i; ++b)
        if (b != a) shape *= (r - nodes[b][0]) / (nodes[a][0] - nodes[b][0]);
      sum += shape;
    }
    return sum;
  };
  SeenPress seen;
  for (size_t i = 0; i < size_t{along} * along; ++i) {
    const auto place = [&](size_t k, double part) {
      return (static_cast<double>(k) + part - along / 2.0) * cell_mm;
    };
    const auto radius = [&](double a, double b) {
      return std::hypot(place(i % along, a), plane ? 0 : place(i / along, b));
    };
    double sum = 0;
    for (const double a : {0.125, 0.375, 0.625, 0.875})
      for (const double b : {0.125, 0.375, 0.625, 0.875}) sum += depth_at(radius(a, b));
    seen.depth_mm.push_back(static_cast<float>(sum / 16));
    const double r = radius(0.5, 0.5);
    seen.contact.push_back(r < pressed.contact_radius_mm + margin * cell_mm ? 1 : 0);
  }
  return seen;
}

}  // namespace palpate::fem
