// Photometric stereo with any number of lights, one gray image each: slopes that are linear in the images, by
// least squares against a surface that is known.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace palpate {

/// One image for each light, width x height values each, rows tightly packed, any unit.
struct LightImages {
  uint32_t width = 0;
  uint32_t height = 0;
  std::vector<std::vector<float>> images;
};

/// Slope d(height)/dx = sum_k w_k(X, Y) r_k + w_0(X, Y), likewise down; r_k is light k's fraction of the
/// brightness of all, which the surface's own colour leaves alone, and w are polynomials of degree `order` in
/// the place across the frame.
struct LightStack {
  uint32_t lights = 0;
  int order = 1;
  std::vector<double> wx, wy;  ///< (lights + 1) x terms of the polynomial
  double explained_x = 0;      ///< fraction of the slopes' variance explained where it was fitted
  double explained_y = 0;
  double condition = 0;  ///< of the normal equations; past 1e12 they are regularised
};

struct SlopeField {
  std::vector<float> across, down;  ///< width x height
};

/// Fits where `use` is not 0 to the slopes (central differences) of `height_mm`; both width x height. Throws
/// Error(Failure::Input) with fewer than three images, sizes that differ, or too few pixels.
LightStack fit_light_stack(const LightImages& images, std::span<const float> height_mm,
                           std::span<const uint8_t> use, double pitch_mm_per_px, int order = 1);

/// Throws Error(Failure::Input) where the number of images is another.
SlopeField slopes_of(const LightStack& stack, const LightImages& images);

/// Heights of mean 0 whose differences fit the slopes best (natural boundary), by cosine transform.
std::vector<float> integrate_slopes(const SlopeField& slopes, uint32_t width, uint32_t height,
                                    double pitch_mm_per_px);

}  // namespace palpate
