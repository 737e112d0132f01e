// Presses of a sample, and the estimate of its modulus from them.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "engine/elasticity/modulus/press_model.h"

namespace palpate {

/// A measured number. `sd` 0: not stated, taken from the scatter about the fit.
struct PressValue {
  double value = std::numeric_limits<double>::quiet_NaN();  ///< NaN: not measured
  double sd = 0;
  bool known() const { return value == value; }
};

/// One press, or one frame of a press. Contact radii are of the circle of the contact's area.
struct PressFrame {
  double force_N = 0;
  double force_sd_N = 0;
  PressValue radius_mm, depth_mm, mean_depth_mm, approach_mm;
};

/// Stress over strain of a flat sample.
enum class MaterialLaw : uint8_t {
  Linear,  ///< force over the face at rest is E times the shortening over the height
  Rubber,  ///< incompressible neo-Hookean, smooth faces: E/3 (1/l^2 - l), l = 1 - shortening/height
};

struct ModulusSetup {
  Pad pad;
  Sample sample;
  double pad_relative_sd = 0;     ///< standard errors as shares: of the pad's modulus,
  double force_relative_sd = 0;   ///< of the force's scale, common to all frames,
  double length_relative_sd = 0;  ///< of the camera's scale
  double zero_sd_mm = std::numeric_limits<double>::infinity();  ///< of the approach's zero
  bool depth_by_pressure = false;  ///< depths were computed from pressures with the pad's modulus
  MaterialLaw law = MaterialLaw::Linear;
  uint64_t seed = 1;
  uint32_t replicates = 200;  ///< of the bootstrap, 50 to 10000
};

enum class ModulusMethod : uint8_t {
  StressStrain,       ///< Eq. 79: mean stress over axial strain; of a ball by a / R, pad as a half space
  DisplacementRatio,  ///< Eq. 78: the sample's displacement over the pad's; needs no force
  Hertz,              ///< contact radius against force over the press, finite pad
  Joint,              ///< everything that was measured, all frames at once
};
inline constexpr size_t kModulusMethods = 4;
const char* to_string(ModulusMethod way);

enum class ModulusState : uint8_t {
  Valid,
  NotApplicable,  ///< this way has no meaning for the sample or lacks its readings
  TooFew,         ///< fewer readings than unknowns
  NotDetermined,  ///< the readings' errors cover the answer: only bounds, if any
  PadLimited,     ///< the sample is too stiff for the pad: only a lower bound
  OutOfRange,     ///< contact too wide, strain beyond small ones, ratio of moduli beyond the model
  DoesNotFit,  ///< readings, or two methods' intervals, contradict each other or the model by more than their
               ///< errors
};
const char* to_string(ModulusState state);

/// One reading and what the fit makes of it.
struct ModulusPoint {
  uint32_t frame = 0;
  const char* quantity = "";  ///< with its unit; what `measured` and `fitted` are
  double against = 0;  ///< the abscissa: stress in MPa of (a), pad's depth in mm of (b), else force in N
  double measured = 0, fitted = 0, sd = 0;
};

struct ModulusEstimate {
  ModulusMethod way = ModulusMethod::Joint;
  ModulusState state = ModulusState::NotApplicable;
  std::string reason;    ///< one line, of a state other than Valid; else what to know, or empty
  double young_MPa = 0;  ///< to be given of Valid alone
  /// 95 % interval, where it has bounds; of PadLimited low_MPa is the lower bound and high infinite.
  double low_MPa = 0;
  double high_MPa = std::numeric_limits<double>::infinity();
  double residual = 0;    ///< RMS over the readings' standard errors
  double strain_max = 0;  ///< largest axial strain of the sample (a ball: 0.2 a/R)
  uint32_t readings = 0;
  std::vector<ModulusPoint> points;

  bool has_value() const { return state == ModulusState::Valid; }
  /// An interval or a lower bound that may be given: not of a fit that its readings reject.
  bool has_bounds() const {
    return low_MPa > 0 &&
           (has_value() || state == ModulusState::PadLimited || state == ModulusState::NotDetermined);
  }
};

struct ModulusAnswer {
  std::array<ModulusEstimate, kModulusMethods> methods;
  ModulusMethod chosen = ModulusMethod::Joint;
  std::string why;
  const ModulusEstimate& best() const& { return methods[static_cast<size_t>(chosen)]; }
  ModulusEstimate best() && { return std::move(methods[static_cast<size_t>(chosen)]); }
};

}  // namespace palpate
