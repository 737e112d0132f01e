// A sensor's observation of a pressed block, and the estimate of the lump in it.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "engine/tissue/inclusion_shape.h"
#include "engine/tissue/pressure_map.h"

namespace palpate::lump {

/// Standard error of a window's place in the block, along x and along y, where nothing else is known, mm.
inline constexpr double kPlaceSd_mm = 0.2;

/// What is known of a skin: a layer of another modulus on top of the tissue, bonded to it and counted in the
/// block's thickness. Lumps lie below it.
struct Skin {
  double thickness_mm = 0, stiffness_ratio = 1;  ///< its Young's modulus over that of the tissue below
  double thickness_sd = 0, ratio_sd = 0;         ///< standard deviations of their logarithms
};

/// Plate that does not slide freely on the tissue, as far as it is known.
struct Plate {
  bool sticks = false;  ///< it holds the tissue sideways, and has no friction then
  double friction = 0;  ///< coefficient with which the tissue slides along it, 0 to 2
  double friction_sd = 0;
};

/// What is known of how tissue relaxes, and of when it was read: the plate moves for `move_s` to each load in
/// turn, rests for `rest_s`, and is read.
struct Relaxation {
  struct Term {
    double share = 0;   ///< of the modulus right after a step that is lost in the end, 0 to 1 in all
    double time_s = 1;  ///< in which all but 1/e of it is
  };
  std::vector<Term> terms;
  double move_s = 0, rest_s = 0;
  double share_error = 0.2;  ///< relative error of all shares, 90 % interval
};

/// Pressure maps of one block at rising loads, all of the same window, and what else is known.
struct Observation {
  /// True pressure, Pa, as seen by the sensor in the plate, one map per load: at each node the mean over a
  /// square of the pitch around it. The window's middle lies at `window_mm` from the block's middle. NaN: not
  /// seen.
  std::vector<PressureMap> pressure_Pa;
  std::array<double, 2> window_mm = {0, 0};
  double place_sd_mm = kPlaceSd_mm;  ///< of window_mm, along each axis
  std::vector<double> force_N;       ///< on the whole block at each load, of the gauge
  /// Way of the plate at each load from where it touches, by which the modulus is found; empty: not measured.
  std::vector<double> press_mm;
  double press_sd_mm = 0.05;  ///< standard error of each way, half of it where the plate touches
  /// Standard deviation of a map's value, independent from node to node. Where the maps are rougher than it
  /// says (roughness()), that counts.
  double noise_Pa = 0;
  double uneven_sd = 0.01;  ///< slow errors across the window that calibration leaves, share of pressure
  double saturated_fraction = 0;  ///< of the window's values at the highest load, at the sensor's limit

  std::array<double, 3> block_mm = {40, 40, 20};  ///< length, width, thickness of the tissue
  /// Modulus of the tissue, known from a place without a lump; 0, with press_mm: not known.
  double young_Pa = 4000;
  /// Taken off by an Estimator (error_sources.h) alone; modulus and stiffness ratio are then those of, and
  /// over, the tissue below it. None: the block is of one tissue.
  std::optional<Skin> skin;
  std::optional<Plate> plate;            ///< taken off likewise; none: it slides without friction
  std::optional<Relaxation> relaxation;  ///< young_Pa is that right after a step
};

/// Each load as force over the block's area and the tissue's modulus.
std::vector<double> loads_of(const Observation& observation);

/// How a trained model answers.
enum class Method : uint8_t {
  Network,  ///< the network from observations to lumps alone
  Refined,  ///< its answer, refined by least squares through the network from lumps to observations
};

/// A value with the interval that holds the truth nine times out of ten.
struct Value {
  double value = 0, low = 0, high = 0;
};

/// An interval of the stiffness ratio that spans more than this factor leaves it open.
inline constexpr double kOpenRatio = 4;

/// Why an estimate, or a part of it, is not to be used.
enum class Status : uint8_t {
  Found,            ///< a lump, all of it determined
  StiffnessOpen,    ///< a lump; the interval of its stiffness ratio spans more than a factor of four
  NoLump,           ///< nothing above what noise alone reaches in one of 100 observations
  OutsideTraining,  ///< the observation is not like what the model was made for
  SeveralLumps,     ///< bumps at two places or more; of two each is estimated, see Estimate::lumps
  NotSeparable,     ///< one bump that two lumps explain and one does not: no numbers
  Saturated,        ///< the highest pressure is beyond the sensor's limit in every load: no numbers
  Inconsistent,     ///< the observation contradicts itself: a unit, the pitch, the window ... is wrong
  Unusable,         ///< too few values, not converged: see the reasons
};
inline constexpr size_t kStatuses = 9;

const char* to_string(Status verdict);    ///< "found", "stiffness open", ...
const char* status_text(Status verdict);  ///< for people: "a lump", "no lump", ...
/// Whether an estimate's numbers may be shown as what they are; of StiffnessOpen all but the ratio's middle.
constexpr bool reports_numbers(Status verdict) {
  return verdict == Status::Found || verdict == Status::StiffnessOpen;
}

/// Effect on an estimate of an input that is stated wrong: relative changes of size, depth and ratio where it
/// is `error` lower and higher than stated; NaN where the estimate then reports no numbers.
struct InputEffect {
  /// "modulus", "thickness", "pitch", "light" of the window's middle, "place along x", "place along y",
  /// "relaxation", "skin's thickness", "skin's stiffness", "plate's friction", "skin's effect", ...
  std::string input;
  double error = 0;  ///< share; of a place mm, of a friction the coefficient itself
  std::array<double, 3> lower{}, higher{};
};

/// Diameter down to which limits of detection are followed: below a model's smallest lump bumps fall with its
/// volume.
inline constexpr double kLeastSeen_mm = 2;

/// The smallest ball that would be seen nine times in ten, by depth of its top and stiffness ratio.
struct DetectionLimit {
  double depth_mm = 0, stiffness_ratio = 0;
  double size_mm = 0;  ///< diameter; NaN: no ball that fits
};

/// Tissue as the way of the plate tells it.
struct Tissue {
  Value young_Pa, thickness_mm;
};

struct Estimate {
  Status verdict = Status::Unusable;
  double detection_statistic = 0;  ///< for a lump; at 1 and above there is one
  double false_alarm_rate = 0;     ///< of observations without a lump that reach this detection statistic
  Value size_mm;                   ///< diameter; of elongated shapes the smaller one
  Value depth_mm;                  ///< surface to the top
  Value stiffness_ratio;
  Value x_mm, y_mm;  ///< of its centre from the block's middle
  InclusionShape shape = InclusionShape::Sphere;
  std::array<double, 4> shape_probability{};  ///< in the order of InclusionShape
  std::string method;                         ///< who estimated: "network", "refined", "direct inversion"
  double wall_s = 0;
  /// Where the observation has several bumps: their tops from the block's middle, the highest first. Else
  /// empty.
  std::vector<std::array<double, 2>> bumps_mm;
  /// Where there are two lumps that are told apart, each by itself, in the order of bumps_mm; the values
  /// above are then NaN. Else empty.
  std::vector<Estimate> lumps;
  double separable_from_mm = 0;  ///< NotSeparable: distance from which on two such lumps have two tops
  std::vector<DetectionLimit> detection_limits;  ///< where there is NoLump
  std::vector<std::string> reasons;              ///< one line each, for people
  std::vector<InputEffect> input_effects;        ///< of the sources that were covered, see error_sources.h
  std::optional<Tissue> tissue;                  ///< where Observation::press_mm is given and told it
};

/// A map's noise by its roughness: mixed second differences of neighbours, of which smooth pressure has next
/// to none. Right to 4 % on 700 nodes. 0 for a map that has no 3 x 3 nodes with values.
double roughness(const PressureMap& map);

/// Widens `value`'s interval so that it contains that of `other`.
void widen(Value& value, const Value& other);
/// A lump that was found is StiffnessOpen, with a reason, where the ratio's interval spans too much.
void open_wide_ratio(Estimate& estimate);

}  // namespace palpate::lump
