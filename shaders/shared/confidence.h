// Confidence stage: what is known of each pixel, read by GLSL and C++.
#ifndef PALPATE_SHARED_CONFIDENCE_H
#define PALPATE_SHARED_CONFIDENCE_H

#ifdef __cplusplus
#include <cstdint>
namespace palpate::shared {
using uint = uint32_t;
#endif

// A pixel takes 16 bits: its confidence, 0 to kFullConfidence, and from kReasonShift on why it is not full.
const uint kFullConfidence = 255;
const uint kReasonShift = 8;
const uint kSaturated = 1;  // a raw value at or above the saturation level, in the frame or the background
const uint kShadowed = 2;   // too dark to carry a slope, in the frame or the background
const uint kOutside = 4;    // beyond the pad's outline
const uint kCovered =
    8;  // by printed markers, with nothing seen around them to continue from, or by a flaw of the pad

struct ConfidencePush {
  uint width;       // px
  uint height;      // px
  uint pitch;       // texels from one padded row of the frame to the next
  uint groups;      // of 16 px in a row of the map
  uint saturation;  // gray levels
  uint shadow;      // gray levels; 0: nothing is shadowed
};

// Pixels of one invocation's rows.
struct ConfidenceRecord {
  uint unknown;  // of confidence 0
  uint partial;  // between unknown and kFullConfidence
  uint saturated;
  uint shadowed;
  uint outside;
};

#ifdef __cplusplus
}  // namespace palpate::shared
#endif
#endif
