// Lengths of the window and its pictures at scale 1 (96 dpi), px: one grid, two sizes of letters, one of
// figures.
#pragma once

namespace palpate::viz {

/// Edges of panels, and distances of what belongs apart, are multiples of it; within a group half of it.
inline constexpr float kGrid_px = 8;
/// Letters of what is read; of what explains it; figures of the headline.
inline constexpr float kBody_px = 15, kSmall_px = 13, kHeadline_px = 32;

}  // namespace palpate::viz
