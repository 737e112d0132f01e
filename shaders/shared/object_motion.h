// Object motion: push constants and records of the sums over two surfaces' pixels, read by GLSL and C++.
#ifndef PALPATE_SHARED_OBJECT_MOTION_H
#define PALPATE_SHARED_OBJECT_MOTION_H

#ifdef __cplusplus
#include <cstdint>
namespace palpate::shared {
using uint = uint32_t;
#endif

const float kTukeyBound = 4.685f;  // of a scale; loses a twentieth under normal noise

// Sizes of residuals are counted in bins, 32 to an octave from 2^-24 on; a median is taken within its bin.
const uint kSizeBins = 1024;
const uint kSizeShift = 18;                // a float's bits to its bin
const uint kFirstSizeBin = 103 * 32;       // of 2^-24
const float kDeviationOfMedian = 1.4826f;  // of sizes under normal noise

const uint kMotionLanes = 64;    // invocations of a workgroup
const uint kMotionPixels = 512;  // of a workgroup

// A workgroup's sums of a step: 21 products of two rows, 6 of row and residual, the weight, the loss.
const uint kMotionProducts = 21;
const uint kMotionGradient = 21;
const uint kMotionWeight = 27;
const uint kMotionLoss = 28;
const uint kStepSums = 29;
// Judged: those, then 21 products of the differences of rows.
const uint kMotionDifferences = 29;
const uint kJudgedSums = 50;

// A pixel's terms when it is judged: six of the row, the residual, its inverse variance.
const uint kMotionTerms = 8;

struct MotionResiduals {
  uint compared;  // pixels
  float squares;  // sum of their residuals'
  float precisions;
};

struct MotionScale {
  uint compared;
  float scale;  // standard deviation of the residual
  float mean_precision;
};

struct MotionPush {
  uint key_first;  // of the level's planes among the key frame's texels
  uint key_width;
  uint key_height;
  uint first;   // of the level's planes among the present frame's texels
  uint width;   // px
  uint pixels;  // of a plane
  uint first_inside;
  uint count;       // pixels inside
  float back[9];    // turns, rows
  float origin[3];  // of the first pixel, from the guess's middle and shift, mm
  float middle[3];  // of the guess, from the key frame's first pixel, mm; z is a depth
  float pitch;      // mm
  float per_pitch;  // of the key frame, 1/mm
  float least_mm;   // the least scale, of a residual of precision 1
  float scale;      // what weights are about; 0: what the residuals gave
  uint by_squares;  // 1: the scale is by squares, not by the median
};

#ifdef __cplusplus
}  // namespace palpate::shared
#endif
#endif
