// One fit of a modulus to the readings of a press, by each of the methods of modulus.h; no interval.
#pragma once

#include <vector>

#include "engine/elasticity/modulus/press_frames.h"

namespace palpate {

/// Standard error of where a picture puts a contact's edge and of what the model makes of it, as a fraction
/// of the radius; common to a press.
inline constexpr double kFlatEdge = 0.015, kBallEdge = 0.004;
inline double edge_sd(const Sample& sample) {
  return sample.flat() ? kFlatEdge : kBallEdge;
}

/// Inputs that a fit takes as given, over their nominal values: for intervals these are drawn from their
/// errors.
struct ModulusGiven {
  double pad = 1;      ///< the pad's modulus
  double size = 1;     ///< the sample's
  double zero_mm = 0;  ///< of the approach
  double edge = 0;     ///< how far outside the picture puts the contact's edge: fraction of the radius
  /// Logarithm of a modulus (MPa) that the answer lies within a factor of 20 of; NaN: anywhere.
  double near = std::numeric_limits<double>::quiet_NaN();
};

struct ModulusFit {
  bool found = false;
  ModulusState state = ModulusState::Valid;  ///< why not found
  std::string reason;
  double log_young = 0;        ///< of MPa
  double chi2 = 0;             ///< sum of squares over the standard errors
  double chi2_at_rigid = 0;    ///< of a sample as stiff as the model goes
  double bound_log_young = 0;  ///< the least modulus with chi2 within 2.71 of the least: 95 %, one-sided
  uint32_t readings = 0, unknowns = 1;
  double strain_max = 0;
  std::vector<ModulusPoint> points;
};

/// Quantities that a method compares: the readings themselves, and those that (a) and (b) derive from them.
enum class Seen : uint8_t { Radius, Depth, MeanDepth, Approach, Strain, Shortening, Modulus };
inline constexpr size_t kSeen = 7;
/// Standard errors of those whose readings state none; 0 on entry: from the scatter about the fit.
using ScatterErrors = std::array<double, kSeen>;

/// `with_points`: also the readings with the fit.
ModulusFit fit_modulus(ModulusMethod way, const std::vector<PressFrame>& frames, const ModulusSetup& setup,
                       const PressModel& model, const ModulusGiven& given, ScatterErrors& errors,
                       bool with_points);

}  // namespace palpate
