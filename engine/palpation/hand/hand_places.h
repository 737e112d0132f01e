// Places of presses by hand: each pad's place and turn from the skin's texture that two presses share.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "engine/base/stop.h"
#include "engine/palpation/hand/hand_press.h"

namespace palpate {

struct HandPlaceOptions {
  /// Middle of the first press's window, from the block's middle, as the hand aims at it.
  std::array<double, 2> first_mm = {0, 0};
  double first_sd_mm = 1;  ///< along x and along y; and of its turn against the block's sides:
  double first_turn_sd_rad = 0.035;
  double most_turn_rad = 0.2;  ///< between two presses
  /// Of each press about either axis: a tilted pad stretches the skin around the block's middle.
  double tilt_sd_rad = 0.05;
  /// Standard errors of a pair that its reliefs do not show: what else stretches the skin under one press.
  double skin_sd_mm = 0.03, skin_sd_rad = 0.003;
  StopAsked stop;  ///< asked at each pair
};

struct HandPlace {
  bool placed = false;
  std::string reason;  ///< where it is not
  std::array<double, 2> at_mm = {0, 0};
  double turn_rad = 0;  ///< from +x towards +y
};

/// Two presses whose reliefs fit each other.
struct PlacedPair {
  size_t first = 0, second = 0;
  double overlap = 0;  ///< of the smaller relief
  double misfit = 0;   ///< its distance from the places that all pairs agree on, in standard errors
};

struct HandPlaces {
  std::vector<HandPlace> places;  ///< one for each press
  std::vector<PlacedPair> pairs;
  /// Of x, y (mm) and turn (radians) of each press against the first; the first one's own error, which moves
  /// all of them alike, is not in it. Wider where the pairs miss each other by more than their errors. Row by
  /// row; 0 of presses that are not placed.
  std::vector<double> covariance;
};

/// Each press is looked for in those that are placed (find_skin_overlap) until one shows it, the other pairs
/// where the places say that they overlap; fit_skin() makes each pair exact, and least squares over all pairs
/// the places and the tilts that stretch the skin. A pair far from what the others agree on is dropped. A
/// press without texture, or that overlaps none that is placed, is left out. Throws Error(Failure::Input) on
/// fewer than two presses, reliefs of unlike size or pitch, and where no two presses fit each other; Stopped
/// soon after options.stop says so.
HandPlaces place_presses(const std::vector<HandPress>& presses, const HandPlaceOptions& options = {});

}  // namespace palpate
