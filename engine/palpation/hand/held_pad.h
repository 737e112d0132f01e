// A pad held by hand on pressed tissue: its pose, which trembles, the pressure under it and the skin's
// texture.
#pragma once

#include <array>
#include <cstdint>
#include <random>
#include <vector>

#include "engine/tissue/pressure_map.h"

namespace palpate {

/// A block as a level plate presses it: the forward model's answer at rising loads.
struct PressedTissue {
  std::array<double, 3> block_mm = {40, 40, 20};
  double young_Pa = 4000;
  std::vector<PressureMap> pressure_Pa;  ///< true pressure in the frame of the plate
  std::vector<double> force_N, press_mm;
};

/// Texture of a skin: waves in all directions, of lengths alike in their logarithm.
class SkinTexture {
 public:
  /// `rms`: of any unit, that of at().
  SkinTexture(double rms, const std::array<double, 2>& length_mm, std::mt19937_64& random);
  /// At a place of the skin at rest.
  double at(double x_mm, double y_mm) const;

 private:
  struct Wave {
    double x, y, phase, height;
  };
  std::vector<Wave> waves_;
};

struct HeldPose {
  std::array<double, 2> at_mm{};  ///< the window's middle in the block
  double turn_rad = 0;
  std::array<double, 2> tilt_rad{};  ///< > 0: the plate goes deeper at larger x, y

  /// The block's place under a place of the window, both from their middle.
  std::array<double, 2> block(double u_mm, double v_mm) const;
};

/// One press: where the pad is held, and how it trembles.
struct HeldPress {
  HeldPose pose;
  double tremor_mm = 0;  ///< amplitude along x and along y
  double rate_Hz = 10;
  std::array<double, 2> phase_rad{};

  HeldPose at(double time_s) const;
};

struct HandSkill {
  double turn_deg = 6, tilt_deg = 5;  ///< most, even
  double tremor_mm = 0.1;             ///< amplitude along x and along y, at 8 to 12 Hz
};
/// A press that is aimed at a place and misses it by `miss_sd_mm`.
HeldPress held_press(const HandSkill& skill, const std::array<double, 2>& aim_mm, double miss_sd_mm,
                     std::mt19937_64& random);

/// The block's middle, then windows to and fro over all of it, each over half of its neighbour.
std::vector<std::array<double, 2>> hand_aims(const std::array<double, 3>& block_mm,
                                             const std::array<double, 2>& window_mm);

/// Forces that a press by hand is read at, from 55 to 100 % of the highest: below, a tilted pad lifts off.
double hand_load(double top_N, uint32_t load, uint32_t loads);

/// Pressure under the window at nodes 0.6 mm apart and beside it for 1.5 mm, its frame the pad's; 0 beside
/// the block is not told. A tilted plate presses each place as a level one would that is as deep there.
PressureMap pressure_under(const PressedTissue& tissue, const HeldPose& pose, double force_N,
                           const std::array<double, 2>& window_mm);

/// The skin's own place under a place of the pressed block: incompressible, wider by its mean compression,
/// and drawn aside where a tilted plate presses deeper.
std::array<double, 2> skin_place(const PressedTissue& tissue, const HeldPose& pose, double force_N,
                                 double x_mm, double y_mm);

}  // namespace palpate
