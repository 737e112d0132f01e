// Slope stage: push constants and weights, read by GLSL and C++.
#ifndef PALPATE_SHARED_SLOPE_H
#define PALPATE_SHARED_SLOPE_H

#ifdef __cplusplus
#include <cstdint>
namespace palpate::shared {
using uint = uint32_t;
#endif

// Common to the three readings; each uses what it needs.
struct SlopePush {
  uint width;         // px
  uint height;        // px
  uint pitch;         // texels of four floats from one output row to the next
  uint coarse_pitch;  // the same of the next coarser level
  uint in_pitch;      // texels of the first binding's kind of row: four floats, eight 16-bit or sixteen 8-bit
                      // pixels
  float scale;        // mm per px: turns differences of height in px into mm
  float max_slope;
  float threshold;  // shading: stored units
  float facing;     // shading: stored units of a facet that faces the light
  float gain;       // shading: scale on the slopes
};

// Photometric: weights of colours for changes of one gray level, each a polynomial of place. A colour's terms
// are 1, X, Y, XX, XY, YY, ..., and kPlaceTerms apart, however many there are.
const int kColours = 9, kPlaceTerms = 10;

#ifdef __cplusplus
static_assert(sizeof(SlopePush) == 40);
}  // namespace palpate::shared
#endif
#endif
