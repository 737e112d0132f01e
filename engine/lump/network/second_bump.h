// Whether a block's pressure stands out at two places: an estimate is of one lump only.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "engine/lump/observation/observation.h"

namespace palpate::lump {

struct Model;
struct PressedNodes;

/// Two tops of what stands out of the block alone, with lower ground on every way from one to the other.
struct SecondBump {
  std::array<std::array<double, 2>, 2> place_mm{};  ///< from the block's middle, the higher one first
  double distance_mm = 0;
  double height = 0;  ///< of the lower top, over the higher one's
  double fall = 0;    ///< from the lower top to the highest way between them, over the higher one's height
  double noises = 0;  ///< the same fall over the noise of what is compared
  /// Further tops that reports_two() would report beside the higher one.
  std::vector<std::array<double, 2>> others_mm;
};

/// The pair with the greatest fall, all loads together. Tops at the edge of what was seen do not count: there
/// the rim's own error is. None where there is one top alone; noise makes small falls.
std::optional<SecondBump> find_second_bump(const PressedNodes& nodes);

/// Whether a fall is beyond what noise and single lumps make. Of 666 single lumps of all shapes one is
/// reported as two, at one load; two balls of 8 mm, 5 mm deep, are reported from 10 mm apart on, noise of 5 %
/// included.
bool reports_two(const SecondBump& bump);

/// Both of an observation, told by the model's block alone. None also where the observation cannot be used.
std::optional<SecondBump> second_bump_reported(const Model& model, const Observation& observation);

/// Says so in the estimate of an observation that has two bumps: verdict, places and reason. Others stay as
/// they are.
void report_second_bump(const PressedNodes& nodes, Estimate& estimate);

}  // namespace palpate::lump
