// The scalars of conjugate gradients from the sums that the other kernels leave: one workgroup. Once the residual is small enough, or
// a product shows that rounding leads, nothing moves any more until the next round.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/forward.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint LANES = 64;
layout(push_constant) uniform Push { ForwardScalarPush push; };
TEXELS(0, uvec4, sums);
layout(binding = 1) buffer Scalars { ForwardScalars s; };

// A round ends a little below what is wanted, so that the true residual is there too.
const double kBelow = 0.9lf;

shared dvec2 lanes[LANES];

void main() {
  uint lane = gl_LocalInvocationID.x;
  dvec2 sum = dvec2(0.0);
  for (uint i = lane; i < push.sums; i += LANES) {
    uvec4 words = texelFetch(sums, int(i));
    sum += dvec2(packDouble2x32(words.xy), packDouble2x32(words.zw));
  }
  lanes[lane] = sum;
  barrier();
  if (lane > 0) return;
  dvec2 total = dvec2(0.0);
  for (uint i = 0; i < LANES; ++i) total += lanes[i];
  double unknowns = double(push.unknowns);
  if (push.stage == kForwardBalance) {
    s.all_forces = sqrt(total.x);
    s.left = sqrt(total.y);
    s.scale = s.left / sqrt(unknowns);
    s.along = s.alpha = s.beta = 0.0;
    s.done = s.left <= kBelow * s.wanted * s.all_forces || s.iterations >= s.most ? 1 : 0;
  } else if (push.stage == kForwardDirection) {
    double along = s.scale * s.scale * total.x;
    bool moves = s.done == 0 && along > 0.0;
    s.beta = moves && s.along > 0.0 ? along / s.along : 0.0;
    s.along = moves ? along : 0.0;
    s.done = moves ? 0 : 1;
  } else if (push.stage == kForwardLength) {
    bool moves = s.done == 0 && total.x > 0.0;
    s.alpha = moves ? s.along / total.x : 0.0;
    s.scale = s.left / sqrt(unknowns);
    s.iterations += moves ? 1 : 0;
    s.done = moves ? 0 : 1;
  } else {
    s.left = sqrt(total.x);
    s.done = s.done != 0 || s.left <= kBelow * s.wanted * s.all_forces || s.iterations >= s.most ? 1 : 0;
  }
}
