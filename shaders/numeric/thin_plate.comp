// A thin-plate spline of two fields at the nodes of a lattice over the frame: value, both slopes and the mixed derivative. An
// invocation owns four nodes of a row, so that a point is read once for the four.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/thin_plate.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { PlatePush push; };
TEXELS(0, vec4, points);  // place in own coordinates, weights of u and v
layout(binding = 1) writeonly buffer Nodes { vec4 nodes[]; };

// Drivers' own logarithms are good to 1e-4 or so. Exponent, and 2 atanh of the rest by its series: good to 2e-7.
vec4 log_of(vec4 x) {
  uvec4 bits = floatBitsToUint(x), steps = (bits - 0x3f3504f3u + 0x40000000u) >> 23;
  vec4 exponent = vec4(steps) - 128.0;
  vec4 m = uintBitsToFloat(bits - (steps << 23) + 0x40000000u);
  vec4 t = (m - 1.0) / (m + 1.0), s = t * t;
  vec4 series = ((s * (2.0 / 9.0) + 2.0 / 7.0) * s + 2.0 / 5.0) * s + 2.0 / 3.0;
  return exponent * 0.69314718 + (2.0 * t + t * s * series);
}

struct Sum {
  vec4 value, x, y, xy;
};

void main() {
  uint across = (push.nodes_x + 3) / 4;
  uint group = gl_GlobalInvocationID.x;
  if (group >= across * push.nodes_y) return;
  uint column = group % across * 4, row = group / across;
  float step_own = push.px * float(kPlateStep);
  vec4 x = push.first_x + step_own * (float(column) + vec4(0, 1, 2, 3));
  float y = push.first_y + step_own * float(row);
  Sum u = Sum(push.u + push.u_x * x + push.u_y * y, vec4(push.u_x), vec4(push.u_y), vec4(0));
  Sum v = Sum(push.v + push.v_x * x + push.v_y * y, vec4(push.v_x), vec4(push.v_y), vec4(0));
  vec4 nearest = vec4(1e30);
  for (int i = 0; i < int(push.count); ++i) {
    vec4 point = texelFetch(points, i);
    vec4 dx = x - point.x;
    float dy = y - point.y;
    vec4 s = max(dx * dx + dy * dy, 1e-30);
    vec4 log = log_of(s), slope = 2.0 * log + 2.0;
    vec4 value = s * log, slope_x = slope * dx, slope_y = slope * dy, mixed = 4.0 * dy * dx / s;
    nearest = min(nearest, s);
    u.value += point.z * value;
    u.x += point.z * slope_x;
    u.y += point.z * slope_y;
    u.xy += point.z * mixed;
    v.value += point.w * value;
    v.x += point.w * slope_x;
    v.y += point.w * slope_y;
    v.xy += point.w * mixed;
  }
  nearest = sqrt(nearest);
  for (int k = 0; k < 4; ++k) {
    if (column + k >= push.nodes_x) continue;
    uint at = (row * push.nodes_x + column + k) * kPlateNodeTexels;
    // Per step, as the pieces between nodes want it.
    nodes[at] = vec4(u.value[k], vec2(u.x[k], u.y[k]) * step_own, u.xy[k] * step_own * step_own);
    nodes[at + 1] = vec4(v.value[k], vec2(v.x[k], v.y[k]) * step_own, v.xy[k] * step_own * step_own);
    nodes[at + 2] = vec4(nearest[k], 0, 0, 0);
  }
}
