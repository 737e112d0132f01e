// Gradient stage: how the change's steepness is counted, read by GLSL and C++.
#ifndef PALPATE_SHARED_GRADIENT_H
#define PALPATE_SHARED_GRADIENT_H

#ifdef __cplusplus
#include <cstdint>
namespace palpate::shared {
using uint = uint32_t;
#endif

// Derivative 1 2 0 -2 -1 one way, binomial 1 4 6 4 1 the other: a change of one gray level per px is this
// much.
const uint kGradientUnits = 128;
// Rows of a tile, one texel (16 px) wide.
const uint kGradientRows = 32;

struct GradientPush {
  uint width;   // px
  uint height;  // px
  uint pitch;   // texels from one padded row to the next
  uint tiles_x;
  uint tiles_y;
  uint limit;  // what is not steeper than this does not count, in units
};

#ifdef __cplusplus
// Nothing on the way overflows: lanes of 16 bits hold changes raised by 255 or differences raised by theirs,
// a pixel's sum of squares over three channels and a tile's sum fit 32 bits.
namespace gradient_bounds {
constexpr uint64_t kRaised = 510, kSteepest = 6 * 16 * 255;
static_assert(16 * kRaised * 8 <= 0xffff && 2 * 3 * kRaised * 16 <= 0xffff);
static_assert(2 * 3 * kSteepest * kSteepest <= 0xffffffff);
static_assert(16 * kGradientRows * 60000 <= 0xffffffff && 2 * 3 * kSteepest * kSteepest <= 60000ull * 60000);
}  // namespace gradient_bounds
}  // namespace palpate::shared
#endif
#endif
