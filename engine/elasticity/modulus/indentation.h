// A sphere, cone or flat punch pressed into a pad of any thickness, both ways: force from depth, depth from
// force. Frictionless, small strains, linear elasticity; exact within these, so that the closed forms of
// hertz.h (Hertz, Dimitriadis, Garcia) can be compared with it. layer.h solves the same equation
// for the paraboloid and gives the surface around the contact too. Lengths in mm, forces in N, moduli in MPa.
#pragma once

#include <limits>
#include <span>

#include "engine/elasticity/hertz.h"
#include "engine/elasticity/layer.h"

namespace palpate {

enum class IndenterShape {
  Paraboloid,  ///< r^2 / (2 R): what Hertz takes for a sphere
  Sphere,      ///< the sphere itself (Sneddon, Int. J. Eng. Sci. 3 (1965) 47); its contact is narrower than R
  Cone,        ///< a tip of half angle theta from its axis (Sneddon, the same)
  FlatPunch,   ///< a cylinder's flat end
};

struct Indenter {
  IndenterShape shape = IndenterShape::Sphere;
  double radius_mm = 1;       ///< of sphere or punch; against a curved body 1/R = 1/R1 + 1/R2
  double half_angle_rad = 0;  ///< of a cone, in (0, pi/2)
  Material material = {};     ///< rigid unless given; an elastic one yields as a half space does
};

/// Layers (one or more) of one Poisson ratio on one base, taken as one pad of their modulus in series: sum(t)
/// / sum(t/E), or with `paper` 1 / sum(1/E). Thicknesses, mm, one a layer; none of them: a half space. Throws
/// Error(Failure::Input) as series_modulus_MPa does.
Pad layered_pad(std::span<const double> young_MPa, double poisson, std::span<const double> thickness_mm,
                bool paper, Base base);

struct Indentation {
  double force_N = 0;
  double depth_mm = 0;          ///< of the deepest point below the rest level
  double radius_mm = 0;         ///< of the contact circle
  double pressure_max_MPa = 0;  ///< at the middle; infinity under a cone's tip and a punch's rim
};

class PadIndenter {
 public:
  /// Throws Error(Failure::Input) on moduli, Poisson ratios, radii, angles or thicknesses out of range.
  PadIndenter(const Pad& pad, const Indenter& indenter);

  double effective_modulus_MPa() const { return modulus_MPa_; }

  /// Each throws Error(Failure::Input) on a negative or infinite number, and where the contact would be wider
  /// than 6 pad thicknesses. For a punch the radius is its own.
  Indentation at_force(double force_N) const;
  Indentation at_depth(double depth_mm) const;
  Indentation at_radius(double contact_radius_mm) const;

  /// Pressure at a distance from the axis: 0 outside of the contact. Its integral is the force.
  double pressure_MPa(const Indentation& contact, double r_mm) const;

 private:
  struct Solution;
  Solution solve(double contact_radius_mm) const;
  Indentation find(double wanted, double Indentation::*quantity) const;
  double shape_term(double x_mm) const;
  double shape_integral(double a_mm) const;
  double widest_mm() const;

  Pad pad_;
  Indenter indenter_;
  double modulus_MPa_ = 1;  // E*, pad and indenter
  double pad_share_ = 1;    // of the compliance: what the thickness can take away
};

/// How far a number is from what it stands for, as a share: 0.1 is 10 % too high.
struct HertzErrors {
  double parabola = 0;   ///< force at the same depth, a paraboloid for the sphere
  double thickness = 0;  ///< force at the same depth, a half space for the pad (same shape)
  double together = 0;   ///< plain Hertz against the sphere on the pad
  double strain = 0;     ///< 0.2 a/R, Tabor's measure for spheres; 0.2 cot(theta) of a cone; 0 of a punch
};
/// At the contact `found` by PadIndenter(pad, indenter).
HertzErrors hertz_errors(const Pad& pad, const Indenter& indenter, const Indentation& found);

/// Sneddon's cone on a half space: F = (2/pi) E* d^2 tan(theta), contact radius (2/pi) d tan(theta).
double cone_force_N(double depth_mm, double effective_modulus_MPa, double half_angle_rad);

}  // namespace palpate
