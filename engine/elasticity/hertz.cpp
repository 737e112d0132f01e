#include "engine/elasticity/hertz.h"

#include <cmath>

#include "engine/base/numbers.h"
#include "palpate/error.h"

namespace palpate {

void check_number(bool good, const std::string& wanted, double found) {
  if (!good) throw Error(Failure::Input, wanted, std::to_string(found), "checking the number and its unit");
}

namespace {

void check_load(double force_N, double modulus_MPa, double radius_mm, double thickness_mm) {
  check_number(force_N >= 0 && std::isfinite(force_N), "a force >= 0 N", force_N);
  check_number(modulus_MPa > 0 && std::isfinite(modulus_MPa), "a modulus E* > 0 MPa", modulus_MPa);
  check_number(radius_mm > 0 && std::isfinite(radius_mm), "an indenter radius > 0 mm", radius_mm);
  check_number(thickness_mm > 0, "a pad thickness > 0 mm", thickness_mm);
}

uint32_t strain_warnings(double indentation_mm, double radius_mm, double thickness_mm) {
  return indentation_mm > 0.3 * thickness_mm || indentation_mm > radius_mm ? kDeepIndentation : 0u;
}

}  // namespace

double effective_radius_mm(double radius1_mm, double radius2_mm) {
  check_number(radius1_mm > 0, "a radius > 0 mm", radius1_mm);
  check_number(radius2_mm > 0, "a radius > 0 mm", radius2_mm);
  return 1 / (1 / radius1_mm + 1 / radius2_mm);
}

double paper_series_modulus_MPa(std::span<const double> young_MPa) {
  double compliance = 0;
  for (const double e : young_MPa) {
    check_number(e > 0, "a Young's modulus > 0 MPa", e);
    compliance += 1 / e;
  }
  check_number(compliance > 0, "at least one layer, layers", static_cast<double>(young_MPa.size()));
  return 1 / compliance;
}

double series_modulus_MPa(std::span<const double> young_MPa, std::span<const double> thickness_mm) {
  check_number(!young_MPa.empty() && young_MPa.size() == thickness_mm.size(),
               "one thickness for each modulus, thicknesses", static_cast<double>(thickness_mm.size()));
  double thickness = 0, compliance = 0;
  for (size_t i = 0; i < young_MPa.size(); ++i) {
    check_number(young_MPa[i] > 0, "a Young's modulus > 0 MPa", young_MPa[i]);
    check_number(thickness_mm[i] > 0, "a layer thickness > 0 mm", thickness_mm[i]);
    thickness += thickness_mm[i];
    compliance += thickness_mm[i] / young_MPa[i];
  }
  return thickness / compliance;
}

std::vector<std::string> describe_warnings(uint32_t warnings) {
  std::vector<std::string> lines;
  if (warnings & kWideContact)
    lines.emplace_back(
        "the contact radius exceeds 0.4 of the indenter's radius: a parabola no longer stands for the "
        "sphere");
  if (warnings & kDeepIndentation)
    lines.emplace_back(
        "the indentation exceeds 0.3 of the pad's thickness or the indenter's radius: strains are not small");
  if (warnings & kThinPad)
    lines.emplace_back("the pad is thin for this contact: plain Hertz is off by more than 10 % in force");
  if (warnings & kBeyondCorrection)
    lines.emplace_back("the contact is wider than the thickness correction is good for");
  return lines;
}

IndenterContact hertz_contact(double force_N, double effective_modulus_MPa, double radius_mm,
                              double thickness_mm) {
  check_load(force_N, effective_modulus_MPa, radius_mm, thickness_mm);
  IndenterContact c;
  c.force_N = force_N;
  c.radius_mm = std::cbrt(3 * force_N * radius_mm / (4 * effective_modulus_MPa));
  c.indentation_mm = c.radius_mm * c.radius_mm / radius_mm;
  c.pressure_max_MPa = force_N > 0 ? 3 * force_N / (2 * kPi * c.radius_mm * c.radius_mm) : 0;
  c.warnings = strain_warnings(c.indentation_mm, radius_mm, thickness_mm);
  if (c.radius_mm > 0.4 * radius_mm) c.warnings |= kWideContact;
  if (sphere_thickness_factor(ThicknessModel::Garcia, c.radius_mm / thickness_mm) > 1.1)
    c.warnings |= kThinPad;
  return c;
}

double hertz_pressure_MPa(const IndenterContact& contact, double r_mm) {
  const double a = contact.radius_mm;
  return std::abs(r_mm) < a ? contact.pressure_max_MPa * std::sqrt(1 - r_mm * r_mm / (a * a)) : 0;
}

double hertz_deflection_mm(const IndenterContact& contact, double r_mm) {
  if (contact.radius_mm <= 0) return 0;
  const double q = std::abs(r_mm) / contact.radius_mm;
  if (q <= 1) return contact.indentation_mm * (1 - q * q / 2);
  return contact.indentation_mm / kPi * ((2 - q * q) * std::asin(1 / q) + std::sqrt(q * q - 1));
}

IndenterContact flat_punch_contact(double force_N, double effective_modulus_MPa, double punch_radius_mm,
                                   double thickness_mm) {
  check_load(force_N, effective_modulus_MPa, punch_radius_mm, thickness_mm);
  IndenterContact c;
  c.force_N = force_N;
  c.radius_mm = punch_radius_mm;
  c.indentation_mm = force_N / (2 * effective_modulus_MPa * punch_radius_mm);
  c.pressure_max_MPa = force_N > 0 ? std::numeric_limits<double>::infinity() : 0;
  c.warnings = strain_warnings(c.indentation_mm, punch_radius_mm, thickness_mm);
  if (flat_punch_thickness_factor(punch_radius_mm / thickness_mm) > 1.1 ||
      punch_radius_mm > 0.7 * thickness_mm)
    c.warnings |= kThinPad;
  return c;
}

double flat_punch_pressure_MPa(const IndenterContact& contact, double r_mm) {
  const double b = contact.radius_mm, r = std::abs(r_mm);
  if (r > b || contact.force_N <= 0) return 0;
  return contact.force_N / (2 * kPi * b * std::sqrt(b * b - r * r));
}

double flat_punch_deflection_mm(const IndenterContact& contact, double r_mm) {
  const double b = contact.radius_mm, r = std::abs(r_mm);
  return r <= b ? contact.indentation_mm : 2 * contact.indentation_mm / kPi * std::asin(b / r);
}

double thickness_model_limit(ThicknessModel model) {
  return model == ThicknessModel::Garcia ? 0.55 : 0.3;
}

double sphere_thickness_factor(ThicknessModel model, double chi) {
  switch (model) {
    case ThicknessModel::Dimitriadis:
      return 1 + chi * (1.133 + chi * (1.283 + chi * (0.769 + chi * 0.0975)));
    case ThicknessModel::DimitriadisUnbonded:
      return 1 + chi * (0.884 + chi * (0.781 + chi * (0.386 + chi * 0.0048)));
    case ThicknessModel::Garcia:
      return 1 + chi * (1.133 + chi * (1.497 + chi * (1.469 + chi * 0.755)));
  }
  return 1;
}

double flat_punch_thickness_factor(double x) {
  return 1 + x * (1.133 + x * (1.283 + x * (0.598 - x * 0.291)));
}

double sphere_force_N(ThicknessModel model, double indentation_mm, double effective_modulus_MPa,
                      double radius_mm, double thickness_mm) {
  check_number(indentation_mm >= 0, "an indentation >= 0 mm", indentation_mm);
  check_load(0, effective_modulus_MPa, radius_mm, thickness_mm);
  const double chi = std::sqrt(radius_mm * indentation_mm) / thickness_mm;
  return 4.0 / 3 * effective_modulus_MPa * std::sqrt(radius_mm) * std::pow(indentation_mm, 1.5) *
         sphere_thickness_factor(model, chi);
}

double sphere_indentation_mm(ThicknessModel model, double force_N, double effective_modulus_MPa,
                             double radius_mm, double thickness_mm, uint32_t* warnings) {
  // The force rises with depth and is at least Hertz's, so Hertz's depth bounds the answer from above.
  double low = 0, high = hertz_contact(force_N, effective_modulus_MPa, radius_mm).indentation_mm;
  for (int i = 0; i < 100 && high - low > 1e-14 * high; ++i) {
    const double middle = (low + high) / 2;
    const double force = sphere_force_N(model, middle, effective_modulus_MPa, radius_mm, thickness_mm);
    (force < force_N ? low : high) = middle;
  }
  if (warnings && std::sqrt(radius_mm * high) / thickness_mm > thickness_model_limit(model))
    *warnings |= kBeyondCorrection;
  return high;
}

double sphere_contact_radius_mm(ThicknessModel model, double indentation_mm, double radius_mm,
                                double thickness_mm) {
  check_number(indentation_mm >= 0, "an indentation >= 0 mm", indentation_mm);
  check_load(0, 1, radius_mm, thickness_mm);
  // d/dd of 4/3 sqrt(R) d^1.5 S(chi) is 2 sqrt(R d) (S + chi S' / 3), and it must be 2 a s(a/H).
  const double hertz_radius_mm = std::sqrt(radius_mm * indentation_mm);
  const double chi = hertz_radius_mm / thickness_mm, h = 1e-5;
  const double slope =
      (sphere_thickness_factor(model, chi + h) - sphere_thickness_factor(model, chi - h)) / (2 * h);
  const double target_mm = hertz_radius_mm * (sphere_thickness_factor(model, chi) + chi * slope / 3);
  double low = 0, high = 2 * hertz_radius_mm;  // a^2 is between R d (half space) and 2 R d (thin,
                                               // incompressible: below 4 R d)
  for (int i = 0; i < 100 && high - low > 1e-14 * high; ++i) {
    const double a = (low + high) / 2;
    (a * flat_punch_thickness_factor(a / thickness_mm) < target_mm ? low : high) = a;
  }
  return high;
}

double mindlin_stiffness_N_per_mm(const Material& pad, double contact_radius_mm) {
  const double shear_modulus_MPa = pad.young_MPa / (2 * (1 + pad.poisson));
  return 8 * shear_modulus_MPa * contact_radius_mm / (2 - pad.poisson);
}

}  // namespace palpate
