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
#include "tests/reference/rubber_element.h"

namespace palpate::fem {
namespace {

constexpr double kPenalty = 500;      // pressure over what is let through, in moduli per cell
constexpr double kBeyond = 8;         // thicknesses from where cells grow to the rim
constexpr double kStep = 0.03;        // of the thickness or the radius, whichever is less: of the press
constexpr double kGoal = 1e-8;        // forces out of balance over the contact's
constexpr double kNearGoal = 1e-5;    // of them where rounding lets a step gain nothing more
constexpr double kLeastGain = 1e-12;  // of the energy: rounding
constexpr int kMostNewton = 80, kMostCuts = 10, kMostHalvings = 12;
constexpr int kMostPlaces = 12;                           // of a point on a quadratic edge
constexpr double kBallEnd = 70 * std::numbers::pi / 180;  // of a soft ball, from its axis

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

/// Nodes of several bodies, elements between them, and which of their displacements are free.
struct Mesh {
  std::vector<Eigen::Vector2d> nodes;  ///< r and z at rest; z counts down from the layer's surface
  struct Element {
    std::array<size_t, 9> nodes;
    Rubber rubber;
  };
  std::vector<Element> elements;
  std::vector<int> unknown;  ///< of both components of each node; -1: held
  int unknowns = 0;

  /// A grid of nodes, `columns` along r and `rows` downwards, both odd; `place` says where. Those of the row
  /// `held` stay, and those on the axis stay there. Returns the first node.
  template <typename Place>
  size_t add(size_t columns, size_t rows, size_t held, const Rubber& rubber, const Place& place) {
    const size_t first = nodes.size();
    for (size_t row = 0; row < rows; ++row)
      for (size_t column = 0; column < columns; ++column) {
        nodes.push_back(place(column, row));
        unknown.push_back(row == held || column == 0 ? -1 : unknowns++);
        unknown.push_back(row == held ? -1 : unknowns++);
      }
    for (size_t row = 0; row + 2 < rows; row += 2)
      for (size_t column = 0; column + 2 < columns; column += 2) {
        Element element{{}, rubber};
        for (size_t n = 0; n < 9; ++n) element.nodes[n] = first + (row + n / 3) * columns + column + n % 3;
        elements.push_back(element);
      }
    return first;
  }
};

Eigen::Index at(size_t i) {
  return static_cast<Eigen::Index>(i);
}

/// Nodes lie on lines and in their middles.
double place(const std::vector<double>& lines, size_t node) {
  return node % 2 == 0 ? lines[node / 2] : 0.5 * (lines[node / 2] + lines[node / 2 + 1]);
}

/// A point of the layer's surface that the indenter has passed by `gap`.
struct Contact {
  std::array<size_t, 6> nodes{};  ///< of the layer's edge, and of a soft indenter's where one is
  size_t count = 3;               ///< of nodes
  double weight = 0, gap = 0, radius = 0;
  double stretch = 1;                               ///< area as it lies over area at rest
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();  ///< of the gap, by where the point lies
  // Derivatives of the gap by both components of each node.
  Eigen::Matrix<double, 12, 1> first = Eigen::Matrix<double, 12, 1>::Zero();
  Eigen::Matrix<double, 12, 12> second = Eigen::Matrix<double, 12, 12>::Zero();
};

class PressedModel {
 public:
  explicit PressedModel(const IndenterOnLayer& what)
      : what_(what),
        plane_(what.indenter == Indenter::Cylinder),
        soft_(std::isfinite(what.indenter_young_MPa)),
        r_(lines(what.cell_mm, what.reach_mm, what.reach_mm + kBeyond * what.thickness_mm, 1.35,
                 0.4 * what.thickness_mm)),
        penalty_(kPenalty * std::max(what.young_MPa, soft_ ? what.indenter_young_MPa : 0) / what.cell_mm),
        points_(gauss_legendre(3, 2)) {
    const auto z = lines(what.cell_mm, std::min(what.reach_mm, 0.4 * what.thickness_mm), what.thickness_mm,
                         1.3, 0.15 * what.thickness_mm);
    columns_ = 2 * r_.size() - 1;
    mesh_.add(columns_, 2 * z.size() - 1, 2 * z.size() - 2,
              rubber(what.young_MPa, what.poisson, what.large_strain),
              [&](size_t column, size_t row) { return Eigen::Vector2d(place(r_, column), place(z, row)); });
    ball_ = mesh_.nodes.size();
    if (soft_) add_ball();
    moved_ = Eigen::VectorXd::Zero(at(mesh_.unknown.size()));
    before_ = moved_;
  }

  /// False where no equilibrium is found; the layer then stands as before.
  bool press(double way_mm) {
    const Eigen::VectorXd before = moved_;
    const double from = way_mm_;
    way_mm_ = way_mm;
    // On as before: the contact is then nearly where it will be.
    if (from > before_way_mm_) moved_ += (way_mm - from) / (from - before_way_mm_) * (moved_ - before_);
    if (from <= before_way_mm_ || !std::isfinite(assemble(false))) {
      moved_ = before;
      for (size_t node = ball_; node < mesh_.nodes.size(); ++node) moved_[at(2 * node + 1)] += way_mm - from;
    }
    if (search()) {
      before_ = before;
      before_way_mm_ = from;
      return true;
    }
    moved_ = before;
    way_mm_ = from;
    return false;
  }

  PressedLayer measure() {
    PressedLayer pressed;
    pressed.press_mm = way_mm_;
    each_contact([&](const Contact& c) {
      pressed.force_N -= c.weight * penalty_ * c.gap * c.slope(1);
      pressed.contact_radius_mm = std::max(pressed.contact_radius_mm, c.radius);
      pressed.pressure_max_MPa =
          std::max(pressed.pressure_max_MPa, penalty_ * c.gap * c.slope.norm() / c.stretch);
    });
    for (size_t column = 0; column < columns_; ++column) {
      const double aside = what_.large_strain ? moved_[at(2 * column)] : 0;
      pressed.surface_mm.push_back({place(r_, column) + aside, moved_[at(2 * column + 1)]});
    }
    return pressed;
  }

 private:
  /// The lower half of a ball that touches the layer, cut kBallEnd from its axis; its upper face is held.
  void add_ball() {
    const double radius = what_.radius_mm, end = radius * std::sin(kBallEnd);
    const auto r = lines(what_.cell_mm, std::min(what_.reach_mm, end), end, 1.3, 0.15 * radius);
    const auto up = lines(what_.cell_mm, std::min(what_.reach_mm, 0.4 * radius), radius, 1.3, 0.15 * radius);
    ball_columns_ = 2 * r.size() - 1;
    const size_t rows = 2 * up.size() - 1;
    mesh_.add(ball_columns_, rows, 0, rubber(what_.indenter_young_MPa, what_.indenter_poisson, true),
              [&](size_t column, size_t row) {
                const double x = place(r, column), above = place(up, rows - 1 - row) / radius;
                return Eigen::Vector2d(x, -radius + std::sqrt(radius * radius - x * x) * (1 - above));
              });
    ball_surface_ = mesh_.nodes.size() - ball_columns_;
  }

  Eigen::Vector2d moved(size_t node) const { return moved_.segment<2>(at(2 * node)); }
  Eigen::Vector2d now(size_t node) const { return mesh_.nodes[node] + moved(node); }

  /// Newton's, from where the layer stands.
  bool search() {
    for (int round = 0; round < kMostNewton; ++round) {
      const double energy = assemble(true);
      if (residual_.norm() <= kGoal * contact_norm_) return true;
      const sparse::Factor factor(sparse::Factor::Kind::Ldlt, mesh_.unknowns, entries_);
      if (!factor.ok()) return false;
      const Eigen::VectorXd step = factor.solve(-residual_), start = moved_;
      const double slope = step.dot(residual_);
      const bool near = residual_.norm() <= kNearGoal * contact_norm_;
      if (near && -slope <= kLeastGain * energy) return true;
      if (!(slope < 0)) return false;
      double part = 1;
      bool lower = false;
      for (int i = 0; i < kMostHalvings && !lower; ++i, part /= 2) {
        for (size_t k = 0; k < mesh_.unknown.size(); ++k)
          if (mesh_.unknown[k] >= 0) moved_[at(k)] = start[at(k)] + part * step[mesh_.unknown[k]];
        lower = assemble(false) <= energy + 1e-4 * part * slope + kLeastGain * energy;
      }
      if (!lower) return near;
    }
    return false;
  }

  template <typename With>
  void each_contact(const With& with) const {
    for (size_t edge = 0; edge + 1 < r_.size(); ++edge)
      for (size_t p = 0; p < 3; ++p) {
        const QuadraticLine line(points_.x[p] - 1);
        const double half = 0.5 * (r_[edge + 1] - r_[edge]);
        Contact c{.nodes = {2 * edge, 2 * edge + 1, 2 * edge + 2}};
        Eigen::Vector2d u = Eigen::Vector2d::Zero(), stretch = Eigen::Vector2d::Zero();
        for (size_t i = 0; i < 3; ++i) {
          u += line.value[i] * moved(c.nodes[i]);
          stretch += line.slope[i] / half * moved(c.nodes[i]);
        }
        const double r = 0.5 * (r_[edge] + r_[edge + 1]) + half * (points_.x[p] - 1);
        c.weight = length_around(r, plane_) * half * points_.w[p];
        if (what_.large_strain) {
          c.radius = r + u(0);
          c.stretch = (plane_ ? 1 : c.radius / r) * std::hypot(1 + stretch(0), stretch(1));
        } else {
          c.radius = r;
        }
        soft_ ? meet_ball(c, u(1), line) : meet_rigid(c, u(1), line);
        if (c.gap > 0) with(c);
      }
  }

  void meet_rigid(Contact& c, double z, const QuadraticLine& line) const {
    Eigen::Matrix2d second = Eigen::Matrix2d::Zero();
    // A flat face is level up to where its rim's round begins.
    const double bend = what_.indenter == Indenter::Flat ? what_.rim_mm : what_.radius_mm;
    const double level = what_.radius_mm - bend;
    if (!what_.large_strain) {
      c.gap = way_mm_ - c.radius * c.radius / (2 * what_.radius_mm) - z;
      c.slope << 0, -1;
    } else if (c.radius <= level) {
      c.gap = way_mm_ - z;
      c.slope << 0, -1;
    } else {
      const Eigen::Vector2d from(c.radius - level, z - (way_mm_ - bend));
      const double distance = from.norm();
      const Eigen::Vector2d normal = from / distance;
      // Above the middle the other half is no obstacle.
      c.gap = from(1) > 0 ? bend - distance : -1;
      c.slope = -normal;
      second = -(Eigen::Matrix2d::Identity() - normal * normal.transpose()) / distance;
    }
    for (size_t i = 0; i < 3; ++i) {
      c.first.segment<2>(at(2 * i)) = line.value[i] * c.slope;
      for (size_t j = 0; j < 3; ++j)
        c.second.block<2, 2>(at(2 * i), at(2 * j)) = line.value[i] * line.value[j] * second;
    }
  }

  /// How far the ball's surface lies below the point, along z: its derivative is normal to the ball, so
  /// that nothing holds the point aside.
  void meet_ball(Contact& c, double z, const QuadraticLine& line) const {
    c.gap = -1;
    size_t edge = 0;
    while (edge + 2 < ball_columns_ && now(ball_surface_ + edge + 2)(0) < c.radius) edge += 2;
    if (edge + 2 >= ball_columns_) return;
    std::array<Eigen::Vector2d, 3> node;
    for (size_t i = 0; i < 3; ++i) {
      c.nodes[3 + i] = ball_surface_ + edge + i;
      node[i] = now(c.nodes[3 + i]);
    }
    c.count = 6;
    const Eigen::Vector2d bend = node[0] - 2 * node[1] + node[2];
    double x = 0;
    Eigen::Vector2d point, tangent;
    for (int i = 0; i < kMostPlaces; ++i) {
      const QuadraticLine there(x);
      point = there.value[0] * node[0] + there.value[1] * node[1] + there.value[2] * node[2];
      tangent = there.slope[0] * node[0] + there.slope[1] * node[1] + there.slope[2] * node[2];
      x = std::clamp(x - (point(0) - c.radius) / tangent(0), -1.0, 1.0);
    }
    c.gap = point(1) - z;
    const QuadraticLine there(x);
    const double steep = tangent(1) / tangent(0);
    c.slope << steep, -1;
    // How far the point runs ahead of the ball's, and how the ball's slope turns, by all that may move.
    Eigen::Matrix<double, 12, 1> ahead = Eigen::Matrix<double, 12, 1>::Zero(), turn = ahead;
    for (size_t i = 0; i < 3; ++i) {
      c.first.segment<2>(at(2 * i)) = line.value[i] * c.slope;
      c.first.segment<2>(at(6 + 2 * i)) = -there.value[i] * c.slope;
      ahead(at(2 * i)) = line.value[i];
      ahead(at(6 + 2 * i)) = -there.value[i];
      turn(at(6 + 2 * i)) = -steep * there.slope[i];
      turn(at(6 + 2 * i + 1)) = there.slope[i];
    }
    const double curvature = (bend(1) - steep * bend(0)) / (tangent(0) * tangent(0));
    c.second = curvature * ahead * ahead.transpose() +
               (turn * ahead.transpose() + ahead * turn.transpose()) / tangent(0);
  }

  /// The energy; with `derivatives` also residual_, entries_ and contact_norm_.
  double assemble(bool derivatives) {
    double energy = 0;
    if (derivatives) {
      residual_ = Eigen::VectorXd::Zero(mesh_.unknowns);
      entries_.clear();
    }
    const auto enter = [&](size_t to_component, size_t from_component, double value) {
      const int to = mesh_.unknown[to_component], from = mesh_.unknown[from_component];
      if (to >= 0 && from >= 0 && from <= to) entries_.emplace_back(to, from, value);
    };
    for (const Mesh::Element& element : mesh_.elements) {
      ElementNodes rest;
      ElementVector u;
      for (size_t n = 0; n < 9; ++n) {
        rest.col(at(n)) = mesh_.nodes[element.nodes[n]];
        u.segment<2>(at(2 * n)) = moved(element.nodes[n]);
      }
      const ElementEnergy sum = element_energy(rest, u, element.rubber, plane_, derivatives);
      energy += sum.value;
      if (!derivatives) continue;
      const auto component = [&](size_t i) { return 2 * element.nodes[i / 2] + i % 2; };
      for (size_t i = 0; i < 18; ++i) {
        if (const int to = mesh_.unknown[component(i)]; to >= 0) residual_[to] += sum.first(at(i));
        for (size_t j = 0; j < 18; ++j) enter(component(i), component(j), sum.second(at(i), at(j)));
      }
    }
    Eigen::VectorXd pushed = Eigen::VectorXd::Zero(derivatives ? mesh_.unknowns : 0);
    each_contact([&](const Contact& c) {
      energy += 0.5 * penalty_ * c.weight * c.gap * c.gap;
      if (!derivatives) return;
      const auto component = [&](size_t i) { return 2 * c.nodes[i / 2] + i % 2; };
      for (size_t i = 0; i < 2 * c.count; ++i) {
        if (const int to = mesh_.unknown[component(i)]; to >= 0)
          pushed[to] += penalty_ * c.weight * c.gap * c.first(at(i));
        for (size_t j = 0; j < 2 * c.count; ++j)
          enter(component(i), component(j),
                penalty_ * c.weight * (c.first(at(i)) * c.first(at(j)) + c.gap * c.second(at(i), at(j))));
      }
    });
    if (derivatives) {
      contact_norm_ = pushed.norm();
      residual_ += pushed;
    }
    return energy;
  }

  IndenterOnLayer what_;
  bool plane_, soft_;
  std::vector<double> r_;  ///< lines of the layer's elements
  Mesh mesh_;
  size_t columns_ = 0;  ///< of the layer's nodes; the first are its surface
  size_t ball_ = 0, ball_columns_ = 0, ball_surface_ = 0;
  double penalty_;
  Quadrature points_;  ///< on [0, 2]
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
  const bool soft = std::isfinite(what.indenter_young_MPa);
  if (!(what.indenter_young_MPa > 0) || !(what.indenter_poisson >= 0 && what.indenter_poisson <= 0.4999))
    refuse("an indenter's modulus > 0 and its Poisson's ratio from 0 to 0.4999", what.indenter_young_MPa);
  if (soft && (what.indenter != Indenter::Sphere || !what.large_strain))
    refuse("a sphere and large strain for a soft indenter", what.indenter_young_MPa);
  if (what.cell_mm > what.thickness_mm / 4)
    refuse("cells of at most a quarter of the thickness", what.cell_mm);
  double before = 0;
  for (const double press : press_mm) {
    if (!(press > before && press < what.thickness_mm + (soft ? what.radius_mm / 2 : 0)))
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
