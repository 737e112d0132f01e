// Lens distortion and scale from pictures of a printed grid that lies in the plane of the pad.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "palpate/sensor.h"

namespace palpate {

/// One picture of the grid: where each point is seen (px, subpixel) and where it is on the grid (mm).
struct GridView {
  std::vector<std::array<double, 2>> seen_px;
  std::vector<std::array<double, 2>> grid_mm;
};

struct GridFit {
  Lens lens;      ///< residual_px: RMS distance of the points from the model
  int terms = 0;  ///< of the distortion that held-out points asked for: 0, 1 (k1), 2 (k2), 4 (p1, p2)
  /// How far the points reach towards the image's corners, 0 to 1. Distortion that they do not determine
  /// there, to 2 px, is left out.
  double reach = 0;
  double held_out_px = 0;                    ///< RMS distance of every other point when the rest make the fit
  double plain_px = 0;                       ///< the same without any distortion
  std::vector<std::array<double, 9>> to_px;  ///< each view: grid mm to px without distortion, rows of a
                                             ///< homography
};

/// Every view has a homography of its own, the lens is common; focal length and centre are those of the image
/// (`width`, `height`), since views of one plane do not determine them. Levenberg-Marquardt. Throws
/// Error(Failure::Input) with fewer than 12 points in a view, or where the fit does not settle.
GridFit fit_grid(const std::vector<GridView>& views, uint32_t width, uint32_t height);

/// The largest rectangle of the first view's grid plane, with sides along the image's, that the image shows
/// whole. The grid may lie at any turn in it.
struct PadFrame {
  double pitch_mm_per_px = 0;                      ///< that of the image's middle
  double pitch_sd_mm_per_px = 0;                   ///< from the points' residuals and the grid's own error
  std::array<std::array<double, 2>, 4> quad_px{};  ///< its corners in the image without distortion
  std::array<uint32_t, 2> size_px{};
};
/// `spacing_relative_sd`: standard error of the grid's spacing. Throws Error(Failure::Input) where nothing is
/// left.
PadFrame pad_frame(const GridFit& fit, const GridView& first, uint32_t width, uint32_t height,
                   double spacing_relative_sd);

}  // namespace palpate
