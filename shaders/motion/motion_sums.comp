// Sums of a Gauss-Newton step over kMotionPixels pixels a workgroup, by Tukey's weights about the scale. JUDGED: weighed by the slope of
// the score, with the products of the differences of both frames' rows, and each pixel's terms kept. The host adds the workgroups'.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/motion/pixel.glsl"

layout(constant_id = 3) const uint JUDGED = 0;
layout(binding = 3) readonly buffer Scale { MotionScale scale; };
layout(binding = 4) writeonly buffer Sums { float sums[]; };
layout(binding = 5) writeonly buffer Terms { float terms[]; };

const uint SUMS = JUDGED != 0 ? kJudgedSums : kStepSums;
shared float lanes[kJudgedSums * kMotionLanes];

void set_row(out float row[6], vec3 place, vec3 normal, float scaled) {
  vec3 turn = cross(place, normal);
  row[0] = -normal.x * scaled;
  row[1] = -normal.y * scaled;
  row[2] = -normal.z * scaled;
  row[3] = -turn.x * scaled;
  row[4] = -turn.y * scaled;
  row[5] = -turn.z * scaled;
}

void main() {
  uint lane = gl_LocalInvocationID.x, first = gl_WorkGroupID.x * kMotionPixels;
  float bound = kTukeyBound * (push.scale > 0.0 ? push.scale : scale.scale);
  float mine[kJudgedSums];
  for (uint k = 0; k < kJudgedSums; ++k) mine[k] = 0.0;
  for (uint k = 0; k < kMotionPixels; k += kMotionLanes) {
    uint i = first + k + lane;
    if (i >= push.count) break;
    Pixel p = compared(i);
    float scaled = sqrt(p.inverse_variance), r = p.residual / bound, rest = max(1.0 - r * r, 0.0), weight = rest * rest;
    float used = JUDGED != 0 ? rest * (1.0 - 5.0 * r * r) : weight;
    float row[6], difference[6];
    set_row(row, p.place, vec3(0.5 * (p.key_slope + p.slope), -1.0), scaled);
    if (JUDGED != 0) {
      set_row(difference, p.place, vec3(p.key_slope - p.slope, 0.0), scaled);
      for (uint a = 0; a < 6; ++a) terms[i * kMotionTerms + a] = row[a];
      terms[i * kMotionTerms + 6] = p.residual;
      terms[i * kMotionTerms + 7] = p.inverse_variance;
    }
    uint product = 0;
    for (uint a = 0; a < 6; ++a) {
      for (uint b = 0; b <= a; ++b, ++product) {
        mine[product] += used * row[a] * row[b];
        if (JUDGED != 0) mine[kMotionDifferences + product] += used * difference[a] * difference[b];
      }
      mine[kMotionGradient + a] += weight * row[a] * p.residual;
    }
    mine[kMotionWeight] += used * p.inverse_variance;
    if (p.inverse_variance > 0.0) mine[kMotionLoss] += min(p.residual * p.residual, bound * bound);
  }
  for (uint k = 0; k < SUMS; ++k) lanes[k * kMotionLanes + lane] = mine[k];
  memoryBarrierShared();
  barrier();
  if (lane >= SUMS) return;
  float sum = 0.0;
  for (uint other = 0; other < kMotionLanes; ++other) sum += lanes[lane * kMotionLanes + other];
  sums[gl_WorkGroupID.x * SUMS + lane] = sum;
}
