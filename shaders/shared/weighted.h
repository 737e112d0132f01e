// Weighted surface: what its kernels share, read by GLSL and C++.
#ifndef PALPATE_SHARED_WEIGHTED_H
#define PALPATE_SHARED_WEIGHTED_H

#ifdef __cplusplus
#include <cstdint>
namespace palpate::shared {
using uint = uint32_t;
#endif

// Faces that say nothing are stored with this weight, negative: the equations take them as 0, the
// preconditioner by their size, so that it reaches across what is unknown.
const float kUnknownFace = 1e-2f;

// One level and the next coarser one. Cells are stored in rows of `pitch` texels of four floats.
struct WeightedPush {
  uint width;  // cells
  uint height;
  uint pitch;         // texels
  uint coarse_width;  // cells
  uint coarse_height;
  uint coarse_pitch;  // texels
  float step0;        // relaxation of the first sweep on the way down, of the second on the way up
  float step1;        // of the other two
  float scale;        // mm per px: turns differences of height in px into mm
};

// Steps of the scalar kernel, on the sums that the others leave.
const uint kScalarStart = 0;      // a new solve: squares are those of the right side
const uint kScalarDirection = 1;  // after the preconditioner: how much of the last direction goes on
const uint kScalarLength = 2;     // after the operator: how far along the direction
const uint kScalarFinish = 3;     // the last residual

struct WeightedScalarPush {
  uint stage;
  uint products;  // partial sums of each kind
  uint squares;
  float tolerance;
};

// The solve's scalars; they stay on the GPU until it is over.
struct WeightedScalars {
  float rho;  // residual times preconditioned residual
  float first_rho;
  float beta;       // share of the last direction in the next
  float alpha;      // length of the step
  float residual2;  // sum of squares of what the normal equations leave
  float right2;     // sum of squares of their right side
  float field2;     // sum over faces of weight times squared gradient
  float explained;  // what the heights take off field2
  uint iterations;  // that changed something
  uint converged;
};

#ifdef __cplusplus
static_assert(sizeof(WeightedScalars) == 40);
}  // namespace palpate::shared
#endif
#endif
