// A hand that presses a block of known truth: what its pad sees, press by press.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "engine/lump/observation/sensor_model.h"
#include "engine/palpation/hand/hand_press.h"
#include "engine/palpation/hand/held_pad.h"

namespace palpate {

struct HandPlan {
  std::vector<std::array<double, 2>> aims_mm;  ///< of the window's middle, in order; none: hand_aims()
  double aim_sd_mm = 1.5;  ///< by how far the hand misses them; the first one by first_sd_mm
  double first_sd_mm = 0.7;
  HandSkill skill;                         ///< the first press's turn: a third of it
  std::array<double, 2> force_N = {1, 3};  ///< highest of a press, even
  double press_s = 1.5;                    ///< until its highest force
  uint32_t loads = 4;
  double relief_mm = 0.012;        ///< RMS of the skin's texture, waves of 0.5 to 3 mm; 0: smooth
  double relief_noise_mm = 0.003;  ///< of each pixel of a surface, of it as much again over 3 px
  double relief_pitch_mm = 0.15;
  double pad_mm_per_MPa = 20;  ///< what pressure makes of the pad's surface
  lump::PalpationSensor sensor = {.window_mm = {27.84, 20.88}};
  uint64_t seed = 1;
};

/// What the hand did.
struct HandTruth {
  std::array<double, 2> at_mm{};  ///< the window's middle when the relief was seen
  double turn_rad = 0;
  std::array<double, 2> tilt_rad{};  ///< > 0: the plate goes deeper at larger x, y
  double highest_N = 0;
};

/// Presses of the block, as held_pad.h has them. All are read from 55 to 100 % of the force that the
/// weakest press has reached, each with an error of 2 % of how near a frame was. Throws Error(Failure::Usage)
/// where the tissue was not pressed as hard as the weakest press, or a number is out of range.
std::vector<HandPress> simulate_hand(const PressedTissue& tissue, const HandPlan& plan,
                                     std::vector<HandTruth>* truth = nullptr);

}  // namespace palpate
