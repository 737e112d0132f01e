// Lookup stage: push constants, read by GLSL and C++.
#ifndef PALPATE_SHARED_LOOKUP_H
#define PALPATE_SHARED_LOOKUP_H

#ifdef __cplusplus
#include <cstdint>
namespace palpate::shared {
using uint = uint32_t;
#endif

struct LookupPush {
  uint width;     // px
  uint height;    // px
  uint in_pitch;  // texels of eight 16-bit pixels from one row of the filtered image to the next
  uint pitch;     // texels of four floats from one row of the depth map to the next
  uint rows;      // that one invocation goes through
};

#ifdef __cplusplus
}  // namespace palpate::shared
#endif
#endif
