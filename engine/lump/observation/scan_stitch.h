// Several presses of one block, each seen through a window at another place of the plate, as one observation
// of the block.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "engine/lump/observation/observation.h"

namespace palpate::lump {

/// One press of a scan. `observation.window_mm` is where the stage says that the window's middle was; all
/// presses show the same block. Their forces may differ: pressure over force is interpolated to common ones.
struct ScanPress {
  std::string name;  ///< for people
  Observation observation;
  double turn_rad = 0;  ///< of the window in the block, from +x towards +y
};

struct StitchOptions {
  double stage_sd_mm = kPlaceSd_mm;  ///< of a stated position, along x and along y
  /// Standard errors of the presses' positions, in their order, where these are known better than pressure
  /// tells and stay as they are; empty: stage_sd_mm, and the overlaps refine them.
  std::vector<double> held_sd_mm;
  /// Standard deviation of a press's tilt, see PressPlace, and what all presses' tilts are expected to be;
  /// 0: the plate is level.
  double tilt_sd_per_mm = 0;
  std::array<double, 2> tilt_per_mm = {0, 0};
  double gain_sd = 0.02;  ///< of a press's scale: calibration and gauge
  /// By what presses differ where noise, place and scale do not explain it, share of the mean pressure: it
  /// keeps them from being moved for its sake.
  double unlike_sd = 0;
  double feather_mm = 3;  ///< from a window's edge on, its weight grows over so much
  double pitch_mm = 0;    ///< of the map; 0: the presses' (the median)
};

/// How a press was put into the map.
struct PressPlace {
  std::string name;
  bool used = false;
  std::string reason;                       ///< where it is not used
  std::array<double, 2> stage_mm = {0, 0};  ///< as stated
  std::array<double, 2> shift_mm = {0, 0};  ///< found by the overlaps, added to the stated place
  std::array<double, 2> shift_sd_mm = {0,
                                       0};  ///< that of the stage where the maps do not determine it better
  double gain = 1, gain_sd = 0;             ///< its pressure over the scan's
  /// A tilted plate compresses the tissue by tilt x + tilt y of its thickness more at a place x, y of the
  /// block.
  std::array<double, 2> tilt_per_mm = {0, 0}, tilt_sd_per_mm = {0, 0};
  double deviation =
      0;  ///< its rms distance from the others over what its noise makes; about 1. 0: no overlap
};

/// The block's map. Places that no press saw are NaN, and its rim.
struct ScanMap {
  /// Loads at the presses' common forces, window in the block's middle, as large as the block. `noise_Pa` is
  /// that of a blended value, by the presses' own noise or by how far they disagree, whichever is larger;
  /// `place_sd_mm` that of the press whose place is known worst, `uneven_sd` the largest of the presses'.
  Observation observation;
  PressureMap disagreement_Pa;     ///< at the highest load: standard deviation between presses; NaN below two
  PressureMap presses;             ///< how many saw each place at the highest load
  double seen_fraction = 0;        ///< of the block's places, but its rim, which no sensor sees
  double between_presses_Pa = 0;   ///< pooled standard deviation between presses, 0: no overlap
  std::vector<PressPlace> places;  ///< in the presses' order
  std::vector<std::string> warnings;
};

/// Positions and scales are refined by the overlaps, all at once, against what stage and calibration are good
/// for (Gauss-Newton; one press far from its stated place does not drag the others). A press that ended far
/// below the others' forces, or that is unlike what the others saw of the same places, is left out and says
/// why. Throws Error(Failure::Input) on no presses, presses of different blocks, maps that do not match their
/// forces, or forces that do not rise.
ScanMap stitch(const std::vector<ScanPress>& presses, const StitchOptions& options = {});

}  // namespace palpate::lump
