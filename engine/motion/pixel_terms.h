// Pixel terms: what all that add up pixels (PixelSums) have in common.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "engine/motion/pixel_sums.h"

namespace palpate {

/// A guess as a level's pixels see it, in single precision.
struct PixelGuess {
  std::array<float, 9> back{};    ///< turns, rows
  std::array<float, 3> origin{};  ///< of the first pixel, from the guess's middle and shift, mm
  std::array<float, 3> middle{};  ///< of the guess, from the key frame's first pixel, mm; z is a depth

  PixelGuess(const MotionGuess& guess, const ContactSurface::Level& key, const ContactSurface::Level& now);
};

/// The least scale of residuals whose precision is 1, mm: what sampling leaves on a surface without noise.
double least_scale_mm(double pitch_mm);

/// Which bin a residual's size is counted in (shaders/shared/object_motion.h).
uint32_t size_bin(float residual);
/// The median of the sizes in those bins, good to a hundredth, times what makes a standard deviation of it.
double deviation_of(std::span<const uint32_t> bins);

/// Sums in the order of shaders/shared/object_motion.h.
MotionSums sums_of(std::span<const double> sums, bool judged);

/// Adds a pixel's term of the gradient, if it has any weight.
void add_term(ScoreField& field, uint32_t pixel, const std::array<float, 6>& row, float residual,
              double scale);

}  // namespace palpate
