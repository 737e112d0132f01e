// A scan by hand: presses without a stage made ready for stitch().
#pragma once

#include <array>
#include <string>
#include <vector>

#include "engine/lump/observation/scan_stitch.h"
#include "engine/palpation/hand/hand_places.h"

namespace palpate {

namespace lump {
struct Model;
}

struct HandScanOptions {
  HandPlaceOptions places;
  double tremor_sd_mm = 0.07;               ///< of a load's place against that of the relief
  double tilt_sd_deg = 3;                   ///< of the hand, along x and along y
  double most_tilt_deg = 7;                 ///< presses with more are left out
  double gain_sd = 0.04, unlike_sd = 0.02;  ///< as StitchOptions has them
};

/// A press's part in it.
struct HandTilt {
  double x_deg = 0, y_deg = 0, sd_deg = 0;
};

struct HandScan {
  std::vector<lump::ScanPress> presses;  ///< those with a place, at it
  lump::StitchOptions stitch;            ///< with the error of their places
  HandPlaces places;                     ///< of all presses
  std::vector<HandTilt> tilt;            ///< of all presses; NaN of those left out
  std::vector<std::string> left_out;     ///< of all presses: why; empty: it is used
};

/// Places by the skin; tilts by the pressure that presses share and by the block's, which is even about its
/// middle. The whole scan lies where the first press was aimed at, and as far off. Throws as
/// place_presses() and stitch() do, and Stopped soon after options.places.stop says so.
HandScan hand_scan(const std::vector<HandPress>& presses, const lump::Model& model,
                   const HandScanOptions& options = {});

}  // namespace palpate
