// Frictionless contact of a rigid indenter with an elastic layer on a rigid base, exact within linear
// elasticity.
//
// The surface of a layer answers a pressure p of Hankel transform P(k) with the deflection 2 P(k) K(k H) /
// (E* k), where K is 1 for a half space. Writing P(k) = E*/2 int_0^a phi(t) cos(k t) dt turns the contact
// into a Fredholm equation
//   phi(x) - 1/pi int_0^a phi(t) [m(x - t) + m(x + t)] dt = g(x),   m(y) = int_0^inf (1 - K(k H)) cos(k y) dk
// (Lebedev and Ufliand, J. Appl. Math. Mech. 22 (1958) 442). Lengths in mm, forces in N, moduli and pressures
// in MPa.
#pragma once

#include <memory>
#include <vector>

#include "engine/elasticity/hertz.h"
#include "engine/numeric/quadrature.h"
#include "engine/pad/layer_response.h"

namespace palpate {

/// Largest a/H that is solved.
inline constexpr double kWidestContact = 6;
/// Wave numbers times H at which a layer differs from a half space: enough for the widest contact.
inline constexpr int kResponseWaves = 176;
const Quadrature& response_waves();

/// How far a layer falls short of the half space under a point load: F deflects the half space by F / (pi E*
/// r), the layer of thickness H by F / (pi E*) (1 / r - loss(r / H) / H).
class PointLoadLoss {
 public:
  /// Poisson's ratio in [0, 0.5].
  explicit PointLoadLoss(double poisson, Base base = Base::Bonded);
  double operator()(double r_over_thickness) const;

 private:
  std::vector<double> table_;
};

/// A solved contact. Copies are cheap; safe to read from many threads.
class LayerContact {
 public:
  /// Force, contact radius, indentation, largest pressure and warnings.
  const IndenterContact& summary() const { return summary_; }

  double pressure_MPa(double r_mm) const;  ///< 0 outside; infinite at the rim of a flat punch
  double force_within_N(
      double r_mm) const;  ///< carried by the disc of that radius; the whole force from a on
  /// Depth of the surface below its rest level, > 0 into the pad. An incompressible pad rises (< 0) around
  /// the contact. Taken as 0 beyond 16 thicknesses from the centre.
  double deflection_mm(double r_mm) const;

 private:
  friend class Layer;
  double phi(double t_over_a) const;
  double phi_slope_over_t(double t_over_a) const;

  IndenterContact summary_;
  double modulus_MPa_ = 1;  // E*
  double thickness_mm_ = 1;
  double curvature_per_mm_ = 0;              // 1/R of the indenter, 0 for the flat punch
  std::vector<double> coefficients_;         // of phi in Chebyshev polynomials of 2 (t/a)^2 - 1
  std::vector<double> layer_deflection_mm_;  // what the finite thickness takes away, on a grid of r/H
};

class Layer {
 public:
  /// Throws Error(Failure::Input) on E <= 0, Poisson outside [0, 0.5], thickness <= 0.
  Layer(const Material& pad, double thickness_mm, Base base = Base::Bonded);

  double effective_modulus_MPa() const { return modulus_MPa_; }
  double thickness_mm() const { return thickness_mm_; }

  /// Sphere of radius R (as a paraboloid), by force or by contact radius; flat-ended cylinder of radius b.
  /// Throws Error(Failure::Input) where the contact would be wider than 6 thicknesses.
  LayerContact press_sphere(double force_N, double radius_mm) const;
  LayerContact press_sphere_to_radius(double contact_radius_mm, double radius_mm) const;
  LayerContact press_flat(double force_N, double punch_radius_mm) const;

 private:
  struct Solution;
  Solution solve(double contact_radius_mm) const;
  double kernel(double y_over_thickness) const;
  LayerContact finish(const Solution& solution, const IndenterContact& contact, double constant,
                      double quadratic) const;

  Material pad_;
  double thickness_mm_;
  double modulus_MPa_;
  std::vector<double> missing_;  // 1 - K at the nodes of the wave number, times their weights
  std::shared_ptr<const std::vector<double>> kernel_;  // m(y) on a grid of y/H
};

}  // namespace palpate
