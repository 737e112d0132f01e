// Tangential stiffness and friction from a pulled contact with a gauge.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "palpate/sensor.h"

namespace palpate {

/// One touched frame with a tangential gauge. In order; frames of one contact in a row.
struct ShearSample {
  double ux_mm = 0, uy_mm = 0;  ///< since the contact's onset
  double fx_N = 0, fy_N = 0;    ///< gauge
  double normal_N = 0;          ///< normal force; NaN: not known
  uint32_t contact = 0;
  enum class Phase : uint8_t {
    Sticks,   ///< F = K u holds: used for K
    Departs,  ///< of a contact that has slipped before: its shift holds the way slipped
    Slips,    ///< that, and the force is at its limit: used for the friction
  } phase = Phase::Sticks;
};

/// One direction's F = K u.
struct Stiffness {
  double k_N_per_mm = 0;
  double sd_N_per_mm = 0;  ///< by leaving out stretches of time, since neighbouring frames err alike
  double r_squared = 0;    ///< about 0, as the line goes through the origin
  double residual_N = 0;   ///< RMS
  double offset_N = 0;     ///< what a free line would read at no shift: a gauge that is not at zero
  double shift_max_mm = 0;
  size_t readings = 0;
};

struct ShearFit {
  Stiffness x, y;
  bool has_friction = false;  ///< the contact slipped somewhere, and normal forces are known
  double friction = 0;
  double friction_sd = 0;
  size_t slip_readings = 0;
  double largest_ratio = 0;  ///< of tangential to normal force while it sticks: friction is at least that
};

/// K of both directions through the origin from the frames before each contact's first slip, found by where
/// the force falls behind K u for good; friction from the plateaus of |F_t| / F_z after it. Sets the phase of
/// each sample. `noise_mm`: of a shift. Throws Error(Failure::Input) that names the direction which was not
/// pulled in, or where nothing sticks.
ShearFit fit_shear(std::vector<ShearSample>& samples, double noise_mm);

}  // namespace palpate
