// Slope stage: push constants, read by GLSL and C++.
#ifndef PALPATE_SHARED_SLOPE_H
#define PALPATE_SHARED_SLOPE_H

#ifdef __cplusplus
#include <cstdint>
namespace palpate::shared {
using uint = uint32_t;
#endif

// Common to the three readings; each uses what it needs.
struct SlopePush {
  uint width;      // px
  uint height;     // px
  uint pitch;      // texels of four floats from one output row to the next
  uint coarse_pitch;  // pairs of floats from one row of the next coarser level to the next
  uint in_pitch;   // texels from one input row to the next
  float scale;     // mm per px: turns differences of height in px into mm
  float max_slope;
  float threshold; // shading: stored units; photometric: 1 / full scale of the camera
  float facing;    // shading: stored units of a facet that faces the light
  float gain;      // shading: scale on the slopes
  float wx[9];     // photometric: [channel][1, X, Y]
  float wy[9];
};

#ifdef __cplusplus
static_assert(sizeof(SlopePush) == 112);
}  // namespace palpate::shared
#endif
#endif
