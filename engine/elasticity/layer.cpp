#include "engine/elasticity/layer.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "engine/base/numbers.h"
#include "engine/numeric/dense.h"
#include "engine/numeric/quadrature.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr int kLayerNodes = 24;    // of the integral equation on [0, a]
constexpr int kLayerTerms = 12;    // of phi in even polynomials
constexpr int kKernelSteps = 256;  // per thickness
constexpr double kFarthest = 16;   // deflection grid, thicknesses
constexpr int kFarSteps = 32;      // per thickness

const Quadrature& layer_unit() {
  static const Quadrature q = gauss_legendre(kLayerNodes, 1);
  return q;
}

/// J0 at every (distance, wave number) of the deflection grid; the same for every layer.
const Eigen::MatrixXd& bessel_grid() {
  static const Eigen::MatrixXd grid = [] {
    const int rows = static_cast<int>(kFarthest) * kFarSteps + 1;
    Eigen::MatrixXd j0(rows, kResponseWaves);
    for (int i = 0; i < rows; ++i)
      for (int j = 0; j < kResponseWaves; ++j)
        j0(i, j) = std::cyl_bessel_j(0.0, response_waves().x[j] * i / kFarSteps);
    return j0;
  }();
  return grid;
}

/// Cubic through the four nearest points of an even function sampled at i / steps.
double interpolate(const std::vector<double>& table, double position) {
  const int last = static_cast<int>(table.size()) - 1;
  const int i = std::clamp(static_cast<int>(position), 0, last - 2);
  const double t = position - i;
  const double before = table[i == 0 ? 1 : i - 1];
  const double y0 = table[i], y1 = table[i + 1], y2 = table[i + 2];
  return before * (-t * (t - 1) * (t - 2) / 6) + y0 * ((t + 1) * (t - 1) * (t - 2) / 2) +
         y1 * (-(t + 1) * t * (t - 2) / 2) + y2 * ((t + 1) * t * (t - 1) / 6);
}

Eigen::VectorXd chebyshev(double t_over_a) {
  const double x = 2 * t_over_a * t_over_a - 1;
  Eigen::VectorXd v(kLayerTerms);
  v[0] = 1;
  v[1] = x;
  for (int k = 2; k < kLayerTerms; ++k) v[k] = 2 * x * v[k - 1] - v[k - 2];
  return v;
}

}  // namespace

const Quadrature& response_waves() {
  static const Quadrature q = gauss_legendre(kResponseWaves, kMissingResponseEnd);
  return q;
}

PointLoadLoss::PointLoadLoss(double poisson, Base base) {
  Eigen::VectorXd spectrum(kResponseWaves);
  for (int j = 0; j < kResponseWaves; ++j)
    spectrum[j] = missing_response(response_waves().x[j], poisson, base) * response_waves().w[j];
  const Eigen::VectorXd loss = bessel_grid() * spectrum;
  table_.assign(loss.data(), loss.data() + loss.size());
}

double PointLoadLoss::operator()(double r_over_thickness) const {
  const double r = std::abs(r_over_thickness);
  return r >= kFarthest ? 1 / r : interpolate(table_, r * kFarSteps);
}

double LayerContact::phi(double t_over_a) const {
  const double x = 2 * t_over_a * t_over_a - 1;
  double b1 = 0, b2 = 0;
  for (int k = kLayerTerms - 1; k > 0; --k) {
    const double b0 = coefficients_[k] + 2 * x * b1 - b2;
    b2 = b1;
    b1 = b0;
  }
  return coefficients_[0] + x * b1 - b2;
}

double LayerContact::phi_slope_over_t(double t_over_a) const {
  // d/dt T_k(2 t^2/a^2 - 1) = k U_{k-1}(x) 4 t / a^2.
  const double x = 2 * t_over_a * t_over_a - 1;
  double u0 = 0, u1 = 1, sum = 0;
  for (int k = 1; k < kLayerTerms; ++k) {
    sum += k * coefficients_[k] * u1;
    const double u2 = 2 * x * u1 - u0;
    u0 = u1;
    u1 = u2;
  }
  return 4 * sum / (summary_.radius_mm * summary_.radius_mm);
}

double LayerContact::pressure_MPa(double r_mm) const {
  const double a = summary_.radius_mm, r = std::abs(r_mm);
  if (summary_.force_N <= 0 || r > a) return 0;
  const double q = r / a, v = std::sqrt(std::max(0.0, 1 - q * q));
  double integral = 0;
  for (int i = 0; i < kLayerNodes; ++i) {
    const double y = layer_unit().x[i] * v;
    integral += layer_unit().w[i] * phi_slope_over_t(std::sqrt(q * q + y * y));
  }
  const double rim = curvature_per_mm_ > 0 ? 0 : phi(1) / (a * v);
  return modulus_MPa_ / 2 * (rim - a * v * integral);
}

double LayerContact::force_within_N(double r_mm) const {
  const double a = summary_.radius_mm, r = std::abs(r_mm);
  if (r >= a) return summary_.force_N;
  const double q = r / a, v = std::sqrt(1 - q * q);
  double outside = 0;
  for (int i = 0; i < kLayerNodes; ++i) {
    const double y = layer_unit().x[i] * v;
    outside += layer_unit().w[i] * phi(std::sqrt(q * q + y * y));
  }
  return summary_.force_N - kPi * modulus_MPa_ * a * v * outside;
}

double LayerContact::deflection_mm(double r_mm) const {
  const double a = summary_.radius_mm, r = std::abs(r_mm);
  if (summary_.force_N <= 0) return 0;
  if (r <= a) return summary_.indentation_mm - r * r * curvature_per_mm_ / 2;
  const double far = r / thickness_mm_;
  if (far >= kFarthest) return 0;
  const double angle = std::asin(a / r);
  double half_space = 0;
  for (int i = 0; i < kLayerNodes; ++i)
    half_space += layer_unit().w[i] * phi(r * std::sin(layer_unit().x[i] * angle) / a);
  return angle * half_space - interpolate(layer_deflection_mm_, far * kFarSteps);
}

Layer::Layer(const Material& pad, double thickness_mm, Base base)
    : pad_(pad),
      thickness_mm_(thickness_mm),
      modulus_MPa_(palpate::effective_modulus_MPa(pad)),
      missing_(kResponseWaves) {
  if (!(thickness_mm > 0) || !std::isfinite(thickness_mm))
    throw Error(Failure::Input, "a pad thickness > 0 mm", std::to_string(thickness_mm),
                "checking the number and its unit");
  for (int j = 0; j < kResponseWaves; ++j)
    missing_[j] = missing_response(response_waves().x[j], pad.poisson, base) * response_waves().w[j];
  const int points = static_cast<int>(2 * kWidestContact) * kKernelSteps + 4;
  std::vector<double> table(points);
  for (int i = 0; i < points; ++i) {
    double sum = 0;
    for (int j = 0; j < kResponseWaves; ++j)
      sum += missing_[j] * std::cos(response_waves().x[j] * i / kKernelSteps);
    table[i] = sum;
  }
  kernel_ = std::make_shared<const std::vector<double>>(std::move(table));
}

double Layer::kernel(double y_over_thickness) const {
  return interpolate(*kernel_, y_over_thickness * kKernelSteps);
}

/// Answers phi to the right sides 2/pi and 2/pi x^2, at the nodes and at x = a.
struct Layer::Solution {
  double radius_mm;
  Eigen::Matrix<double, kLayerNodes, 2> phi;
  Eigen::RowVector2d rim;
  Eigen::RowVector2d integral;  // over [0, a]
};

Layer::Solution Layer::solve(double a) const {
  if (!(a <= kWidestContact * thickness_mm_))
    throw Error(Failure::Input, "a contact no wider than 6 pad thicknesses",
                std::to_string(a / thickness_mm_), "a smaller force or a thicker pad");
  const double scale = a / thickness_mm_;
  Eigen::Matrix<double, kLayerNodes, kLayerNodes> system =
      Eigen::Matrix<double, kLayerNodes, kLayerNodes>::Identity();
  Eigen::Matrix<double, kLayerNodes, 2> right;
  Eigen::Matrix<double, 1, kLayerNodes> rim;
  const auto& [x, w] = layer_unit();
  for (int i = 0; i < kLayerNodes; ++i) {
    for (int j = 0; j < kLayerNodes; ++j)
      system(i, j) -=
          scale * w[j] / kPi * (kernel(scale * std::abs(x[i] - x[j])) + kernel(scale * (x[i] + x[j])));
    right.row(i) << 2 / kPi, 2 / kPi * a * a * x[i] * x[i];
    rim[i] = scale * w[i] / kPi * (kernel(scale * (1 - x[i])) + kernel(scale * (1 + x[i])));
  }
  Solution s;
  s.radius_mm = a;
  s.phi = dense::solve_lu(system, Eigen::MatrixXd(right));
  s.rim = Eigen::RowVector2d(2 / kPi, 2 / kPi * a * a) + rim * s.phi;
  s.integral.setZero();
  for (int i = 0; i < kLayerNodes; ++i) s.integral += w[i] * a * s.phi.row(i);
  return s;
}

LayerContact Layer::finish(const Solution& s, const IndenterContact& contact, double constant,
                           double quadratic) const {
  LayerContact c;
  c.summary_ = contact;
  c.modulus_MPa_ = modulus_MPa_;
  c.thickness_mm_ = thickness_mm_;
  c.curvature_per_mm_ = -quadratic;
  static const auto fit = [] {
    Eigen::Matrix<double, kLayerNodes, kLayerTerms> basis;
    for (int i = 0; i < kLayerNodes; ++i) basis.row(i) = chebyshev(layer_unit().x[i]).transpose();
    return Eigen::Matrix<double, kLayerTerms, kLayerNodes>(dense::pseudo_inverse(basis));
  }();
  const Eigen::Matrix<double, kLayerNodes, 1> phi = constant * s.phi.col(0) + quadratic * s.phi.col(1);
  const Eigen::Matrix<double, kLayerTerms, 1> coefficients = fit * phi;
  c.coefficients_.assign(coefficients.data(), coefficients.data() + kLayerTerms);

  const double scale = s.radius_mm / thickness_mm_;
  Eigen::VectorXd spectrum(kResponseWaves);
  for (int j = 0; j < kResponseWaves; ++j) {
    double sum = 0;
    for (int i = 0; i < kLayerNodes; ++i)
      sum += layer_unit().w[i] * phi[i] * std::cos(response_waves().x[j] * scale * layer_unit().x[i]);
    spectrum[j] = missing_[j] * sum * scale;
  }
  const Eigen::VectorXd taken = bessel_grid() * spectrum;
  c.layer_deflection_mm_.assign(taken.data(), taken.data() + taken.size());
  c.summary_.pressure_max_MPa = quadratic < 0 ? c.pressure_MPa(0) : std::numeric_limits<double>::infinity();
  if (c.summary_.indentation_mm > 0.3 * thickness_mm_) c.summary_.warnings |= kDeepIndentation;
  return c;
}

LayerContact Layer::press_sphere_to_radius(double contact_radius_mm, double radius_mm) const {
  if (!(contact_radius_mm > 0) || !(radius_mm > 0))
    throw Error(Failure::Input, "radii > 0 mm", std::to_string(std::min(contact_radius_mm, radius_mm)),
                "checking the number and its unit");
  const Solution s = solve(contact_radius_mm);
  IndenterContact c;
  c.radius_mm = contact_radius_mm;
  c.indentation_mm = s.rim[1] / s.rim[0] / radius_mm;  // the pressure vanishes at the rim: phi(a) = 0
  c.force_N = kPi * modulus_MPa_ * (c.indentation_mm * s.integral[0] - s.integral[1] / radius_mm);
  if (contact_radius_mm > 0.4 * radius_mm) c.warnings |= kWideContact;
  if (c.indentation_mm > radius_mm) c.warnings |= kDeepIndentation;
  return finish(s, c, c.indentation_mm, -1 / radius_mm);
}

LayerContact Layer::press_sphere(double force_N, double radius_mm) const {
  // A layer on a rigid base is stiffer than the half space, so Hertz's radius bounds the answer from above.
  double high = hertz_contact(force_N, modulus_MPa_, radius_mm).radius_mm, low = 0;
  if (force_N <= 0) {
    LayerContact none;
    none.modulus_MPa_ = modulus_MPa_;
    none.thickness_mm_ = thickness_mm_;
    none.curvature_per_mm_ = 1 / radius_mm;
    return none;
  }
  const auto force_at = [&](double a) {
    const Solution s = solve(a);
    return kPi * modulus_MPa_ * (s.rim[1] / s.rim[0] * s.integral[0] - s.integral[1]) / radius_mm;
  };
  high = std::min(high, kWidestContact * thickness_mm_);
  double a = high, force = force_at(a), exponent = 3;  // locally F ~ a^exponent
  if (force < force_N * (1 - 1e-9))
    throw Error(Failure::Input, "a contact no wider than 6 pad thicknesses", std::to_string(force_N) + " N",
                "a smaller force or a thicker pad");
  for (int i = 0; i < 60 && std::abs(force / force_N - 1) > 1e-12 && high - low > 1e-14 * high; ++i) {
    double next = a * std::pow(force_N / force, 1 / exponent);
    if (!(next > low && next < high)) next = (low + high) / 2;
    const double next_force = force_at(next);
    if (next != a && next_force != force)
      exponent = std::clamp(std::log(next_force / force) / std::log(next / a), 1.0, 8.0);
    a = next;
    force = next_force;
    (force < force_N ? low : high) = a;
  }
  return press_sphere_to_radius(a, radius_mm);
}

LayerContact Layer::press_flat(double force_N, double punch_radius_mm) const {
  IndenterContact c = flat_punch_contact(force_N, modulus_MPa_, punch_radius_mm);
  const Solution s = solve(punch_radius_mm);
  c.indentation_mm = force_N / (kPi * modulus_MPa_ * s.integral[0]);
  c.warnings = c.indentation_mm > punch_radius_mm ? kDeepIndentation : 0u;
  return finish(s, c, c.indentation_mm, 0);
}

}  // namespace palpate
