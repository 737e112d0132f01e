// The scalars of conjugate gradients from the partial sums that the other kernels leave: one workgroup, nothing goes to the host.
// Once the residual is small enough nothing moves any more.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/weighted.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint LANES = 64;
layout(push_constant) uniform Push { WeightedScalarPush push; };
TEXELS(0, float, dots);     // products: residual times preconditioned, or direction times applied
TEXELS(1, float, squares);  // of the residual
layout(binding = 2) buffer Scalars { WeightedScalars s; };

const float kLongest = 1000.0;

shared vec2 lanes[LANES];

void main() {
  uint lane = gl_LocalInvocationID.x;
  vec2 sum = vec2(0.0);
  for (uint i = lane; i < push.products; i += LANES) sum.x += texelFetch(dots, int(i)).x;
  for (uint i = lane; i < push.squares; i += LANES) sum.y += texelFetch(squares, int(i)).x;
  lanes[lane] = sum;
  barrier();
  if (lane > 0) return;
  vec2 total = vec2(0.0);
  for (uint i = 0; i < LANES; ++i) total += lanes[i];
  if (push.stage == kScalarStart) {
    s.field2 = total.x;  // the caller binds the faces' sums for the products
    s.right2 = total.y;
    s.residual2 = total.y;
    s.rho = s.first_rho = s.beta = s.alpha = s.explained = 0.0;
    s.iterations = 0;
    s.converged = total.y > 0.0 ? 0 : 1;
  } else if (push.stage == kScalarDirection) {
    s.residual2 = total.y;
    if (s.iterations == 0) s.first_rho = total.x;
    float limit = push.tolerance * push.tolerance;
    bool done = s.converged != 0 || total.y <= limit * s.right2 || total.x <= limit * s.first_rho;
    s.converged = done ? 1 : 0;
    s.beta = !done && s.rho > 0.0 && total.x > 0.0 ? total.x / s.rho : 0.0;
    s.rho = done ? 0.0 : max(total.x, 0.0);
  } else if (push.stage == kScalarLength) {
    // The preconditioner makes a length of about 1. Lengths far beyond come from rounding, where parts hang free of each other.
    bool move = s.converged == 0 && s.rho > 0.0 && total.x * kLongest > s.rho;
    s.alpha = move ? s.rho / total.x : 0.0;
    s.explained += s.alpha * s.rho;
    s.iterations += move ? 1 : 0;
  } else {
    s.residual2 = total.y;
    s.converged = s.converged != 0 || total.y <= push.tolerance * push.tolerance * s.right2 ? 1 : 0;
  }
}
