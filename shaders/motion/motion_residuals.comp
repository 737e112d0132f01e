// Residuals of a guess: their sizes counted in bins, their number, squares and precisions summed. A workgroup owns kMotionPixels
// pixels; its sums go over its invocations in order, so that they are the same each time.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/motion/pixel.glsl"

layout(binding = 3) buffer Bins { uint bins[]; };
layout(binding = 4) writeonly buffer Parts { MotionResiduals parts[]; };

shared uint sizes[kSizeBins];
shared MotionResiduals lanes[kMotionLanes];

void main() {
  uint lane = gl_LocalInvocationID.x, first = gl_WorkGroupID.x * kMotionPixels;
  for (uint bin = lane; bin < kSizeBins; bin += kMotionLanes) sizes[bin] = 0u;
  memoryBarrierShared();
  barrier();
  MotionResiduals sum = MotionResiduals(0u, 0.0, 0.0);
  for (uint k = 0; k < kMotionPixels; k += kMotionLanes) {
    uint i = first + k + lane;
    if (i >= push.count) break;
    Pixel p = compared(i);
    if (p.inverse_variance <= 0.0) continue;
    uint bin = clamp(floatBitsToUint(abs(p.residual)) >> kSizeShift, kFirstSizeBin, kFirstSizeBin + kSizeBins - 1u);
    atomicAdd(sizes[bin - kFirstSizeBin], 1u);
    ++sum.compared;
    sum.squares += p.residual * p.residual;
    sum.precisions += p.inverse_variance;
  }
  lanes[lane] = sum;
  memoryBarrierShared();
  barrier();
  for (uint bin = lane; bin < kSizeBins; bin += kMotionLanes)
    if (sizes[bin] > 0u) atomicAdd(bins[bin], sizes[bin]);
  if (lane > 0) return;
  for (uint other = 1; other < kMotionLanes; ++other) {
    sum.compared += lanes[other].compared;
    sum.squares += lanes[other].squares;
    sum.precisions += lanes[other].precisions;
  }
  parts[gl_WorkGroupID.x] = sum;
}
