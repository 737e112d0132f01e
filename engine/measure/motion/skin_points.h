// Followed points of the skin's pattern, found in the untouched image.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "palpate/frame.h"
#include "palpate/sensor.h"

namespace palpate {

/// The untouched image summed over its channels, height x width.
std::vector<float> skin_image(const Frame& frame);

/// Markers: centres of the dots that are darker (or brighter, whichever the image has) than their
/// surroundings, to a fraction of a pixel; dots that touch the frame's border are left out. Texture: a grid.
/// In rows from top to bottom.
std::vector<std::array<float, 2>> find_skin_points(const std::vector<float>& image, uint32_t width,
                                                   uint32_t height, const SkinPattern& pattern);

/// Window that is compared: `side` x `side` samples, each the sum of `stride` x `stride` px from its place
/// on.
struct SkinWindow {
  explicit SkinWindow(const SkinPattern& pattern);
  uint32_t side = 0;    ///< odd, 7 to 21
  uint32_t stride = 1;  ///< px
  uint32_t samples() const { return side * side; }
  uint32_t reach_px() const { return side / 2 * stride; }
};

/// One followed point as the kernel takes it.
struct SkinTemplate {
  int32_t x_px = 0, y_px = 0;     ///< whole pixel nearest to `centre`, middle of the window
  std::array<float, 2> centre{};  ///< as found
  /// Per sample: the untouched image less offset and tilt; what the image must be multiplied with and added
  /// up to give gain and gain * step along x and y.
  std::vector<std::array<float, 4>> window;
  float contrast = 0;  ///< sum of the squares of the first
  double step_sd = 0;  ///< standard error of the step along one axis, px for noise of 1 gray level
  std::array<int32_t, 4> neighbours{};  ///< nearest followed points; -1: none
};

/// Templates of the points whose window lies in the frame and has contrast along both axes; may be empty.
std::vector<SkinTemplate> skin_templates(const std::vector<float>& image, uint32_t width, uint32_t height,
                                         const SkinPattern& pattern);

}  // namespace palpate
