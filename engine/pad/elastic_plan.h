// The reading `elastic` as a pyramid: pressure is halved level by level, each level answers what its cells
// resolve with one small stencil, and the answers are interpolated and added from coarse to fine. The work is
// that of a few passes over the frame.
//
// 1/r is a sum of Gaussians whose widths grow by sqrt 2 (trapezoid rule for 1/r = sqrt(2/pi) int exp(-r^2 /
// (2 s^2)) d(1/s), good to 2e-6), and what a layer's thickness takes away is one by least squares. A level
// takes the two widths of its octave; the frame's own level takes the pixel's integral (Love) less all
// coarser Gaussians, which is compact. Restriction and interpolation are quintic B-splines (1 6 15 20 15 6
// 1), whose spectrum the stencils divide out again. Compare A. Brandt and A. A. Lubrecht, J. Comput. Phys. 90
// (1990) 348.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "engine/pad/layer_kernel.h"
#include "shaders/shared/elastic.h"

namespace palpate {

/// One level's cells (i, j), at (i, j) 2^level pixels. Pressure and answer reach shared::kElasticReach cells
/// beyond each side.
struct ElasticLevel {
  uint32_t width = 0;
  uint32_t height = 0;
  /// Answer at (dx, dy) cells to 1 MPa on one cell, mm: entry of (max, min) of |dx| and |dy| at max (max + 1)
  /// / 2 + min. Not of the coarsest level.
  std::array<float, shared::kElasticOrbits> stencil{};
};

struct ElasticPlan {
  ElasticPlan(const LayerKernel& kernel, uint32_t width, uint32_t height);

  std::vector<ElasticLevel> levels;
  /// Answer of the coarsest level at (dx, dy) cells: row |dy|, column |dx|, table_width to a row.
  std::vector<float> table;
  uint32_t table_width = 0;
};

}  // namespace palpate
