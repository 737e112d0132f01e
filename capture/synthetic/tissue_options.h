// Options of the synthetic block, and as text.
#pragma once

#include <cstdint>
#include <string>

#include "engine/fem/scene.h"
#include "engine/palpation/hand/held_pad.h"

namespace palpate {

struct TissueOptions {
  uint32_t width = 640, height = 480;  ///< px, at least 32; the field of view is always 27.84 mm wide
  uint64_t seed = 1;                   ///< of the noise
  double rate_Hz = 30;
  bool noise = true;
  double falloff =
      0.015;            ///< fraction of the light lost in the corners, as a flat field correction leaves it
  uint32_t repeat = 1;  ///< 0: without end

  double force_N = 2;         ///< highest, on the whole block; 3 by hand where it is not said
  uint32_t loads = 4;         ///< even steps up to it, each held, 1 to 8
  double x_mm = 0, y_mm = 0;  ///< of the window's middle from the block's
  uint32_t hand = 0;          ///< presses by hand, of a third to all of force_N, up to 64; 0: a stage's
  HandSkill skill;            ///< of the hand: tilts to 15, turns to 45 degrees, tremor to 1 mm
  double slide_mm = 0;        ///< way that the pad slides at the highest force of each press, 0 to 20
  double texture = 0.15;      ///< of the skin under a hand, RMS share of the pressure, 0 to 0.3
  /// The block and its lump; press, presser and pad are not used. 40 x 40 x 20 cells, extrapolated with half
  /// as many along each side: one grid of so few makes lumps look soft.
  fem::Scene scene;

  TissueOptions() { scene.cells = {40, 40, 20}; }
};

/// Whether an input is a synthetic block: "synthetic:tissue", alone or followed by "?...".
bool is_tissue(const std::string& input);
/// Keys: size, seed, rate, noise, falloff, repeat, force, loads, x, y (of the window), lump (a shape, or
/// none), d (diameter), h (depth), ratio, lx, ly (of the lump), lx2, ly2 (of a second one like it),
/// thickness, young, cells (along the block's length: a multiple of 8), hand (presses), tilt, turn, tremor,
/// slide, texture. Throws Error(Failure::Input) that lists them.
TissueOptions parse_tissue(const std::string& input);
/// The inverse, with every key.
std::string to_string(const TissueOptions& options);

}  // namespace palpate
