// The residuals' scale from what motion_residuals.comp left: one workgroup. Leaves the bins empty for the next guess.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/object_motion.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { MotionPush push; };
layout(binding = 0) buffer Bins { uint bins[]; };
layout(binding = 1) readonly buffer Parts { MotionResiduals parts[]; };
layout(binding = 2) writeonly buffer Scale { MotionScale scale; };

const uint kMine = kSizeBins / kMotionLanes;
shared uint counts[kMotionLanes];
shared vec2 lanes[kMotionLanes];

float edge(uint bin) { return uintBitsToFloat((kFirstSizeBin + bin) << kSizeShift); }

// The median: the bin in which it lies is `lane`'s.
float deviation(uint lane, uint before, uint wanted) {
  for (uint k = 0; k < kMine; ++k) {
    uint bin = lane * kMine + k, count = bins[bin];
    if (before + count <= wanted) {
      before += count;
      continue;
    }
    float part = (float(wanted - before) + 0.5) / float(count);
    return kDeviationOfMedian * mix(edge(bin), edge(bin + 1u), part);
  }
  return 0.0;
}

void main() {
  uint lane = gl_LocalInvocationID.x, groups = (push.count + kMotionPixels - 1u) / kMotionPixels;
  uint mine = 0u;
  for (uint k = 0; k < kMine; ++k) mine += bins[lane * kMine + k];
  vec2 sum = vec2(0.0);
  for (uint i = lane; i < groups; i += kMotionLanes) sum += vec2(parts[i].squares, parts[i].precisions);
  counts[lane] = mine;
  lanes[lane] = sum;
  memoryBarrierShared();
  barrier();
  if (lane == 0u) {
    uint all = 0u, before = 0u, owner = 0u;
    vec2 total = vec2(0.0);
    for (uint k = 0; k < kMotionLanes; ++k) {
      all += counts[k];
      total += lanes[k];
    }
    while (owner < kMotionLanes - 1u && before + counts[owner] <= all / 2u) before += counts[owner++];
    float mean_precision = all > 0u ? total.y / float(all) : 0.0;
    float of_residuals = push.by_squares != 0u ? sqrt(total.x / max(float(all), 1.0)) : deviation(owner, before, all / 2u);
    scale = MotionScale(all, max(of_residuals, push.least_mm * sqrt(mean_precision)), mean_precision);
  }
  memoryBarrierBuffer();
  barrier();
  for (uint k = 0; k < kMine; ++k) bins[lane * kMine + k] = 0u;
}
