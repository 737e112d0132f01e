// Press reader: one press by hand, or places along a slide, from its frames.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "engine/palpation/hand/hand_press.h"
#include "engine/palpation/hand/load_law.h"
#include "engine/palpation/press_observation.h"

namespace palpate {

/// Presses of a scan by hand as they were read.
struct HandRecording {
  std::vector<HandPress> presses;
  std::vector<std::pair<std::string, std::string>> left_out;  ///< presses that could not be read, and why
};

struct PressReading {
  std::array<double, 3> block_mm = {40, 40, 20};
  double young_Pa = 4000;
  uint32_t loads = 4;
  double pitch_mm = 1.25;  ///< of the maps
};

/// Throws Error(Failure::Sensor) where the sensor does not read pressure or has no scale,
/// Error(Failure::Usage) where the block's sizes and modulus are not above 0 and finite, or where the pad, of
/// frames of `format`, is larger than the block.
void check_hand(const Sensor& sensor, const FrameFormat& format, const PressReading& reading);
/// Least force of a press by hand, on the whole block.
double least_hand_press_N(const PressReading& reading);
/// The highest force that nearly all presses have reached, from the highest of each (one or more): those
/// below half of their median do not count; the first one, where the map lies, from a quarter on.
double common_force_N(const std::vector<double>& highest_N);

/// A press and the frames that it is read from.
struct PressPlan {
  std::string name;
  std::vector<double> force_N;             ///< of all its frames
  double top_N = 0;                        ///< force of the highest load
  std::vector<std::vector<size_t>> loads;  ///< its frames for each load
  std::vector<std::vector<size_t>> above;  ///< the same for loads from there up to its highest force
  std::array<size_t, 2> held = {};         ///< first and last frame at nine tenths of its highest force
  std::vector<size_t> looked;              ///< of a slide: places are chosen from these
  std::string trouble;                     ///< why it cannot be read; empty: it can

  bool wants(size_t frame) const;
};
/// While it loads, at hand_load()'s forces up to `top_N`.
PressPlan plan_press(std::string name, std::vector<double> force_N, double top_N, uint32_t loads);

/// What one press was read as.
struct ReadPress {
  std::vector<HandPress> presses;  ///< one; of a slide each place, at the scan's loads
  bool slid = false;
};

class PressReader {
 public:
  /// As PressureNodes wants them. `background`: the untouched image.
  PressReader(const Sensor& sensor, const Frame& background, const PressReading& reading);
  /// `frame`: that of a number which the plan wants.
  ReadPress read(const PressPlan& plan, const std::function<const Frame&(size_t)>& frame) const;

 private:
  struct Sums;
  HandPress press_of(const PressPlan& plan, const Sums& sums) const;
  SkinRelief relief_of(const NodeSums& sums, double force_N) const;
  double slid_mm(const Sums& sums) const;
  bool stayed(const PressPlan& slide, const Sums& sums, const LoadLaw& law,
              const std::function<const Frame&(size_t)>& frame) const;
  HandPress place_of(const PressPlan& slide, size_t looked, const Frame& frame, const LoadLaw& law,
                     const SlideWay& way) const;
  std::vector<HandPress> places_of(const PressPlan& slide, const Sums& sums,
                                   const std::function<const Frame&(size_t)>& frame) const;

  PressReading reading_;
  PressureNodes nodes_, fine_;
};

/// Puts presses that were read, in their order, behind those of `to`. Throws Error(Failure::Input) where the
/// first of all cannot be read: the map lies where it was aimed at.
void take_press(HandRecording& to, const PressPlan& plan, ReadPress read);

}  // namespace palpate
