// Skin stage: following points of the pattern on the pad's skin, read by GLSL and C++.
#ifndef PALPATE_SHARED_SKIN_H
#define PALPATE_SHARED_SKIN_H

#ifdef __cplusplus
#include <cstdint>
namespace palpate::shared {
using uint = uint32_t;
#endif

const uint kSkinIterations = 7;
const float kSkinStepPart =
    0.85f;  // that is gone of a step: the smoothed gradient makes it 10 to 30 % too long
const float kSkinSmallStep = 0.003f;  // of an iteration, samples: a next one would change nothing
const float kSkinSure = 0.7f;     // a point whose fit from where it was correlates less is looked for around
const uint kSkinReach = 2;        // steps of the search to each side
const float kSkinPrefer = 0.04f;  // by so much another start must correlate better than where the point was
const float kSkinLargestStep = 2.5f;       // of one iteration, in samples
const float kSkinSettled = 0.25f;          // a last step above this has not converged, samples
const float kSkinLeastCorrelation = 0.5f;  // a point that correlates less is lost
const uint kSkinPointTexels =
    2;  // of 4 floats: rest x, y in whole px, sum of the window squared, 0; neighbours, -1: none

struct SkinPush {
  uint points;
  uint width;        // px
  uint height;       // px
  uint pitch;        // words from one padded row of the frame to the next
  float search_px;   // step of the search
  float spacing_px;  // between neighbouring points
};

#ifdef __cplusplus
}  // namespace palpate::shared
#endif
#endif
