#include "engine/elasticity/modulus/indentation.h"

#include <Eigen/Core>
#include <cmath>
#include <numeric>
#include <string>

#include "engine/base/numbers.h"
#include "engine/numeric/dense.h"
#include "engine/numeric/quadrature.h"
#include "engine/pad/layer_response.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr int kIndentationNodes = 28;  // of the integral equation on [0, a]
using Nodes = Eigen::Matrix<double, kIndentationNodes, 1>;

const Quadrature& indentation_unit() {
  static const Quadrature q = gauss_legendre(kIndentationNodes, 1);
  return q;
}

}  // namespace

Pad layered_pad(std::span<const double> young_MPa, double poisson, std::span<const double> thickness_mm,
                bool paper, Base base) {
  Pad pad{.material = {young_MPa.front(), poisson}, .base = base};
  if (young_MPa.size() > 1)
    pad.material.young_MPa =
        paper ? paper_series_modulus_MPa(young_MPa) : series_modulus_MPa(young_MPa, thickness_mm);
  if (!thickness_mm.empty())
    pad.thickness_mm = std::accumulate(thickness_mm.begin(), thickness_mm.end(), 0.0);
  return pad;
}

/// The contact's equation phi(x) = g(x) + w(x), solved for the right sides g = 2/pi (depth 1) and 2/pi times
/// the shape's term. w is what the thickness adds: (2/pi) sum over waves s of missing(s) cos(s x) Phi(s).
struct PadIndenter::Solution {
  double radius_mm = 0;
  Eigen::RowVector2d rim, integral;  // phi at x = a, and over [0, a]
  Eigen::Matrix<double, kResponseWaves, 2>
      spectrum;  // missing times Phi, weights included; zero on a half space
};

PadIndenter::PadIndenter(const Pad& pad, const Indenter& indenter) : pad_(pad), indenter_(indenter) {
  modulus_MPa_ = palpate::effective_modulus_MPa(pad.material, indenter.material);
  check_number(std::isfinite(pad.material.young_MPa), "a pad's Young's modulus > 0 MPa, finite",
               pad.material.young_MPa);
  pad_share_ = modulus_MPa_ / palpate::effective_modulus_MPa(pad.material);
  check_number(pad.thickness_mm > 0, "a pad thickness > 0 mm", pad.thickness_mm);
  if (indenter.shape == IndenterShape::Cone)
    check_number(indenter.half_angle_rad > 0 && indenter.half_angle_rad < kPi / 2 * (1 - 1e-12),
                 "a cone's half angle above 0 and below 90 deg, degrees",
                 indenter.half_angle_rad * 180 / kPi);
  else
    check_number(indenter.radius_mm > 0 && std::isfinite(indenter.radius_mm), "an indenter radius > 0 mm",
                 indenter.radius_mm);
}

double PadIndenter::shape_term(double x) const {
  const double r = indenter_.radius_mm;
  switch (indenter_.shape) {
    case IndenterShape::Paraboloid:
      return x * x / r;
    case IndenterShape::Sphere:
      return x * std::atanh(x / r);
    case IndenterShape::Cone:
      return kPi / 2 * x / std::tan(indenter_.half_angle_rad);
    case IndenterShape::FlatPunch:
      return 0;
  }
  return 0;
}

double PadIndenter::shape_integral(double a) const {
  const double r = indenter_.radius_mm;
  switch (indenter_.shape) {
    case IndenterShape::Paraboloid:
      return a * a * a / (3 * r);
    case IndenterShape::Sphere: {
      const double q = a / r;
      // The closed form cancels for small contacts; there its series is exact to rounding.
      if (q < 0.02) return r * r * q * q * q * (1.0 / 3 + q * q * (1.0 / 15 + q * q / 35));
      return ((a - r) * (a + r) * std::atanh(q) + r * a) / 2;
    }
    case IndenterShape::Cone:
      return kPi / 4 * a * a / std::tan(indenter_.half_angle_rad);
    case IndenterShape::FlatPunch:
      return 0;
  }
  return 0;
}

double PadIndenter::widest_mm() const {
  const double layer = kWidestContact * pad_.thickness_mm;
  return indenter_.shape == IndenterShape::Sphere ? std::min(layer, indenter_.radius_mm * (1 - 1e-13))
                                                  : layer;
}

PadIndenter::Solution PadIndenter::solve(double a) const {
  Solution s;
  s.radius_mm = a;
  s.rim = Eigen::RowVector2d(1, shape_term(a)) * (2 / kPi);
  s.integral = Eigen::RowVector2d(a, shape_integral(a)) * (2 / kPi);
  s.spectrum.setZero();
  if (std::isinf(pad_.thickness_mm)) return s;
  const double h = pad_.thickness_mm;
  Eigen::Matrix<double, kResponseWaves, 1> missing, rim_cos, integral_cos;
  Eigen::Matrix<double, kResponseWaves, kIndentationNodes> cosines;
  for (int j = 0; j < kResponseWaves; ++j) {
    const double k = response_waves().x[j] / h;
    missing[j] = pad_share_ * response_waves().w[j] / h *
                 missing_response(response_waves().x[j], pad_.material.poisson, pad_.base);
    rim_cos[j] = std::cos(k * a);
    integral_cos[j] = std::sin(k * a) / k;
    for (int i = 0; i < kIndentationNodes; ++i) cosines(j, i) = std::cos(k * a * indentation_unit().x[i]);
  }
  Nodes weights;
  Eigen::Matrix<double, kIndentationNodes, 2> right;
  for (int i = 0; i < kIndentationNodes; ++i) {
    weights[i] = indentation_unit().w[i] * a;
    right.row(i) = Eigen::RowVector2d(1, shape_term(a * indentation_unit().x[i])) * (2 / kPi);
  }
  const Eigen::Matrix<double, kIndentationNodes, kIndentationNodes> system =
      Eigen::Matrix<double, kIndentationNodes, kIndentationNodes>::Identity() -
      (2 / kPi) * cosines.transpose() * missing.asDiagonal() * cosines * weights.asDiagonal();
  const Eigen::Matrix<double, kIndentationNodes, 2> phi = dense::solve_lu(system, Eigen::MatrixXd(right));
  s.spectrum = missing.asDiagonal() * (cosines * (weights.asDiagonal() * phi));
  s.rim += (2 / kPi) * rim_cos.transpose() * s.spectrum;
  s.integral += (2 / kPi) * integral_cos.transpose() * s.spectrum;
  return s;
}

Indentation PadIndenter::at_radius(double a) const {
  check_number(a >= 0 && std::isfinite(a), "a contact radius >= 0 mm", a);
  const bool punch = indenter_.shape == IndenterShape::FlatPunch;
  if (a > widest_mm())
    throw Error(Failure::Input,
                a > kWidestContact * pad_.thickness_mm ? "a contact no wider than 6 pad thicknesses"
                                                       : "a contact narrower than the sphere",
                "a contact radius of " + std::to_string(a) + " mm", "a smaller force or a thicker pad");
  Indentation c;
  if (a == 0 || punch) return c;  // a punch's depth is not its radius's
  const Solution s = solve(a);
  c.radius_mm = a;
  c.depth_mm = s.rim[1] / s.rim[0];  // the pressure vanishes at the rim: phi(a) = 0
  c.force_N = kPi * modulus_MPa_ * (c.depth_mm * s.integral[0] - s.integral[1]);
  c.pressure_max_MPa =
      indenter_.shape == IndenterShape::Cone ? std::numeric_limits<double>::infinity() : pressure_MPa(c, 0);
  return c;
}

Indentation PadIndenter::find(double wanted, double Indentation::*quantity) const {
  Indentation c;
  if (wanted == 0) return c;
  if (indenter_.shape == IndenterShape::FlatPunch) {
    if (indenter_.radius_mm > widest_mm())
      throw Error(Failure::Input, "a punch no wider than 6 pad thicknesses",
                  std::to_string(indenter_.radius_mm) + " mm", "a thicker pad");
    const double stiffness = kPi * modulus_MPa_ * solve(indenter_.radius_mm).integral[0];
    c.radius_mm = indenter_.radius_mm;
    c.force_N = quantity == &Indentation::force_N ? wanted : wanted * stiffness;
    c.depth_mm = c.force_N / stiffness;
    c.pressure_max_MPa = std::numeric_limits<double>::infinity();
    return c;
  }
  // Force and depth rise with the contact radius, nearly as powers of it: false position in logarithms.
  const auto off = [&](double log_a) {
    const Solution s = solve(std::exp(log_a));
    const double depth = s.rim[1] / s.rim[0];
    const double value = quantity == &Indentation::depth_mm
                             ? depth
                             : kPi * modulus_MPa_ * (depth * s.integral[0] - s.integral[1]);
    return std::log(value / wanted);
  };
  const double widest = widest_mm();
  double high = std::log(std::isinf(widest) ? 1.0 : widest), at_high = off(high);
  while (at_high < 0) {
    if (!std::isinf(widest))
      throw Error(Failure::Input,
                  widest < indenter_.radius_mm * 0.999 || indenter_.shape != IndenterShape::Sphere
                      ? "a contact no wider than 6 pad thicknesses"
                      : "a contact narrower than the sphere",
                  (quantity == &Indentation::force_N ? "a force of " : "a depth of ") +
                      std::to_string(wanted) + (quantity == &Indentation::force_N ? " N" : " mm"),
                  "less, or a thicker pad");
    high += 1;
    at_high = off(high);
  }
  double low = high - 1, at_low = off(low);
  while (at_low > 0) {
    high = low;
    at_high = at_low;
    low -= 1;
    at_low = off(low);
  }
  int side = 0;
  for (int i = 0; i < 200 && high - low > 1e-15 * std::max(1.0, std::abs(high)); ++i) {
    const double next = (low * at_high - high * at_low) / (at_high - at_low);
    const double at_next = off(next);
    if (std::abs(at_next) < 1e-14) return at_radius(std::exp(next));
    if (at_next < 0) {
      low = next;
      at_low = at_next;
      if (side == -1) at_high /= 2;
      side = -1;
    } else {
      high = next;
      at_high = at_next;
      if (side == 1) at_low /= 2;
      side = 1;
    }
  }
  return at_radius(std::exp((low + high) / 2));
}

Indentation PadIndenter::at_force(double force_N) const {
  check_number(force_N >= 0 && std::isfinite(force_N), "a force >= 0 N", force_N);
  return find(force_N, &Indentation::force_N);
}

Indentation PadIndenter::at_depth(double depth_mm) const {
  check_number(depth_mm >= 0 && std::isfinite(depth_mm), "a depth >= 0 mm", depth_mm);
  return find(depth_mm, &Indentation::depth_mm);
}

double PadIndenter::pressure_MPa(const Indentation& contact, double r_mm) const {
  const double a = contact.radius_mm, r = std::abs(r_mm);
  if (!(contact.force_N > 0) || r > a) return 0;
  const Solution s = solve(a);
  const double reach = std::sqrt((a - r) * (a + r));
  // p = E*/2 (phi(a) / sqrt(a^2 - r^2) - int_r^a phi'(t) / sqrt(t^2 - r^2) dt), t^2 = r^2 + y^2.
  double half = 0;
  if (indenter_.shape == IndenterShape::FlatPunch) half = contact.depth_mm * s.rim[0] / reach;
  if (indenter_.shape == IndenterShape::Paraboloid) half = 4 / kPi * reach / indenter_.radius_mm;
  if (indenter_.shape == IndenterShape::Cone) half = std::acosh(a / r) / std::tan(indenter_.half_angle_rad);
  const Eigen::Matrix<double, kResponseWaves, 1> spectrum =
      contact.depth_mm * s.spectrum.col(0) -
      (indenter_.shape == IndenterShape::FlatPunch ? 0.0 : 1.0) * s.spectrum.col(1);
  const Quadrature ys = end_clustered(2 * kIndentationNodes, 0, reach);
  const bool layer = !std::isinf(pad_.thickness_mm);
  for (size_t i = 0; i < ys.x.size(); ++i) {
    const double t = std::hypot(r, ys.x[i]);
    double slope_over_t = 0;  // of what has no closed form above
    if (indenter_.shape == IndenterShape::Sphere) {
      const double q = t / indenter_.radius_mm;
      slope_over_t -= 2 / kPi * (std::atanh(q) / t + 1 / (indenter_.radius_mm * (1 - q) * (1 + q)));
    }
    if (layer) {
      double sum = 0;
      for (int j = 0; j < kResponseWaves; ++j) {
        const double k = response_waves().x[j] / pad_.thickness_mm;
        sum += spectrum[j] * k * std::sin(k * t);
      }
      slope_over_t -= 2 / kPi * sum / t;
    }
    half -= ys.w[i] * slope_over_t;
  }
  return modulus_MPa_ / 2 * half;
}

HertzErrors hertz_errors(const Pad& pad, const Indenter& indenter, const Indentation& found) {
  HertzErrors e;
  if (!(found.depth_mm > 0)) return e;
  Pad deep = pad;
  deep.thickness_mm = std::numeric_limits<double>::infinity();
  Indenter parabola = indenter;
  if (indenter.shape == IndenterShape::Sphere) parabola.shape = IndenterShape::Paraboloid;
  const double same_shape = PadIndenter(deep, indenter).at_depth(found.depth_mm).force_N;
  const double plain = PadIndenter(deep, parabola).at_depth(found.depth_mm).force_N;
  e.parabola = plain / same_shape - 1;
  e.thickness = same_shape / found.force_N - 1;
  e.together = plain / found.force_N - 1;
  if (indenter.shape == IndenterShape::Cone)
    e.strain = 0.2 / std::tan(indenter.half_angle_rad);
  else if (indenter.shape != IndenterShape::FlatPunch)
    e.strain = 0.2 * found.radius_mm / indenter.radius_mm;
  return e;
}

double cone_force_N(double depth_mm, double effective_modulus_MPa, double half_angle_rad) {
  check_number(depth_mm >= 0 && std::isfinite(depth_mm), "a depth >= 0 mm", depth_mm);
  check_number(effective_modulus_MPa > 0, "a modulus E* > 0 MPa", effective_modulus_MPa);
  check_number(half_angle_rad > 0 && half_angle_rad < kPi / 2, "a cone's half angle above 0 and below 90 deg",
               half_angle_rad * 180 / kPi);
  return 2 / kPi * effective_modulus_MPa * depth_mm * depth_mm * std::tan(half_angle_rad);
}

}  // namespace palpate
