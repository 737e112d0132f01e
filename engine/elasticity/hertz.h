// Contact of a rigid indenter with an elastic pad in closed form: Hertz, the flat punch, and corrections for
// a thin pad. Lengths in mm, forces in N, moduli and pressures in MPa. The exact solution for a pad of any
// thickness is in layer.h.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "engine/pad/pad.h"

namespace palpate {

/// Throws Error(Failure::Input) that names what was wanted and the number found, unless that is good.
void check_number(bool good, const std::string& wanted, double found);

/// 1/R = 1/R1 + 1/R2 (Eq. 46); infinity is a plane.
double effective_radius_mm(double radius1_mm, double radius2_mm);

/// Modulus of stacked layers as the paper computes it, 1 / sum(1/E_i): n equal layers come out n times too
/// soft.
double paper_series_modulus_MPa(std::span<const double> young_MPa);
/// Modulus of stacked layers under one normal stress, sum(t_i) / sum(t_i/E_i).
double series_modulus_MPa(std::span<const double> young_MPa, std::span<const double> thickness_mm);

/// Why a contact's numbers may be off. Bits of IndenterContact::warnings.
enum ContactWarning : uint32_t {
  kWideContact = 1,      ///< a > 0.4 R: the parabola that stands for the sphere is off by more than 4 %
  kDeepIndentation = 2,  ///< indentation > 0.3 of the pad's thickness, or > R: strains are not small
  kThinPad = 4,  ///< the pad's thickness changes the force by more than 10 %: plain Hertz does not hold
  kBeyondCorrection = 8,  ///< outside the range in which the thickness correction is good to its stated error
};
/// One line per warning, in words; empty when nothing is wrong.
std::vector<std::string> describe_warnings(uint32_t warnings);

/// A contact in numbers.
struct IndenterContact {
  double force_N = 0;
  double radius_mm = 0;         ///< of the contact circle
  double indentation_mm = 0;    ///< of the deepest point, below the rest level
  double pressure_max_MPa = 0;  ///< infinity under a flat punch (at its rim)
  uint32_t warnings = 0;        ///< ContactWarning bits
};

/// Hertz (Eq. 47-52): a^3 = 3 F R / (4 E*), indentation a^2 / R, p_max = 3 F / (2 pi a^2). `thickness_mm` of
/// the pad changes no number here, only the warnings. Throws Error(Failure::Input) on a negative force or R,
/// E* <= 0.
IndenterContact hertz_contact(double force_N, double effective_modulus_MPa, double radius_mm,
                              double thickness_mm = std::numeric_limits<double>::infinity());
/// p(r) = p_max sqrt(1 - r^2/a^2) inside, 0 outside; its integral over the plane is the force.
double hertz_pressure_MPa(const IndenterContact& contact, double r_mm);
/// Depth of the pad's surface: d - r^2/(2R) inside; outside a^2/(pi R) ((2 - q^2) asin(1/q) + sqrt(q^2 - 1)),
/// q = r/a (Johnson 1985, Eq. 3.42).
double hertz_deflection_mm(const IndenterContact& contact, double r_mm);

/// Rigid cylinder with a flat end: F = 2 E* b d (Johnson 1985, Eq. 3.36).
IndenterContact flat_punch_contact(double force_N, double effective_modulus_MPa, double punch_radius_mm,
                                   double thickness_mm = std::numeric_limits<double>::infinity());
/// p(r) = F / (2 pi b sqrt(b^2 - r^2)) inside, infinite at the rim, 0 outside.
double flat_punch_pressure_MPa(const IndenterContact& contact, double r_mm);
/// d inside, (2 d / pi) asin(b / r) outside.
double flat_punch_deflection_mm(const IndenterContact& contact, double r_mm);

/// Published corrections for an incompressible pad (Poisson 0.5) on a rigid base. Errors are against
/// LayerContact.
enum class ThicknessModel {
  Dimitriadis,  ///< bonded; Biophys. J. 82 (2002) 2798, Eq. 12: force within 3 % to chi = 0.3, 14 % low at
                ///< 0.75
  DimitriadisUnbonded,  ///< sliding base; the same, Eq. 11: force within 5 % (high) to chi = 0.3
  Garcia,  ///< bonded; Garcia and Garcia, Biophys. J. 114 (2018) 2923: within 1.5 % to chi = 0.55
};
/// Largest chi = sqrt(R d)/H up to which the model keeps the error stated above.
double thickness_model_limit(ThicknessModel model);
/// Force over the Hertz force at the same indentation, a polynomial in chi = sqrt(R d)/H.
double sphere_thickness_factor(ThicknessModel model, double chi);
/// Force over the half-space force of a flat punch, in b/H (Garcia and Garcia 2018): within 1.5 % to b/H =
/// 0.7.
double flat_punch_thickness_factor(double radius_over_thickness);

/// F(d) = 4/3 E* sqrt(R) d^1.5 times the thickness factor.
double sphere_force_N(ThicknessModel model, double indentation_mm, double effective_modulus_MPa,
                      double radius_mm, double thickness_mm);
/// The same inverted. Sets kBeyondCorrection in `warnings` past thickness_model_limit.
double sphere_indentation_mm(ThicknessModel model, double force_N, double effective_modulus_MPa,
                             double radius_mm, double thickness_mm, uint32_t* warnings = nullptr);

/// Contact radius at that indentation: every shape of this contact obeys dF/dd = 2 E* a s with s the flat
/// punch's thickness factor at a/H (the punch that replaces the contact for a small further press); solved
/// for a.
double sphere_contact_radius_mm(ThicknessModel model, double indentation_mm, double radius_mm,
                                double thickness_mm);

/// Tangential stiffness of a contact circle on a half space that sticks, 8 G a / (2 - v) (Mindlin 1949),
/// N/mm.
double mindlin_stiffness_N_per_mm(const Material& pad, double contact_radius_mm);

}  // namespace palpate
