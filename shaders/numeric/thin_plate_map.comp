// From the lattice's nodes to a map of one component of strain (or of the displacement itself): Hermite pieces of degree 3 by 3 and
// their own slopes. An invocation owns one row of a cell: kPlateStep pixels. NaN where no point is near.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/thin_plate.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint SHOWN = kPlateFirst;
layout(push_constant) uniform Push { PlatePush push; };
TEXELS(0, vec4, nodes);
layout(binding = 1) writeonly buffer Map { vec4 map[]; };

// Weights of a piece's value at its ends and of its slopes there; and of its slope.
vec4 hermite(float t) { return vec4((2.0 * t - 3.0) * t * t + 1.0, (3.0 - 2.0 * t) * t * t, ((t - 2.0) * t + 1.0) * t, (t - 1.0) * t * t); }
vec4 hermite_slope(float t) {
  return vec4(6.0 * t * (t - 1.0), 6.0 * t * (1.0 - t), (3.0 * t - 4.0) * t + 1.0, (3.0 * t - 2.0) * t);
}

// A field along the row: value and slope along x at both ends, and how they change across the row.
struct Line {
  vec4 value, across;  // left, right, slope left, slope right
};

Line line(int field, int upper, int lower, vec4 w, vec4 d) {
  vec4 a = texelFetch(nodes, upper + field), b = texelFetch(nodes, upper + int(kPlateNodeTexels) + field);
  vec4 c = texelFetch(nodes, lower + field), e = texelFetch(nodes, lower + int(kPlateNodeTexels) + field);
  vec4 top = vec4(a.x, b.x, a.y, b.y), top_slope = vec4(a.z, b.z, a.w, b.w);
  vec4 foot = vec4(c.x, e.x, c.y, e.y), foot_slope = vec4(c.z, e.z, c.w, e.w);
  return Line(w.x * top + w.y * foot + w.z * top_slope + w.w * foot_slope,
              d.x * top + d.y * foot + d.z * top_slope + d.w * foot_slope);
}

float component(vec2 value, vec4 g) {  // g: ux, uy, vx, vy
  if (SHOWN == kPlateU) return value.x;
  if (SHOWN == kPlateV) return value.y;
  if (SHOWN == kPlateArea) return g.x + g.w + g.x * g.w - g.y * g.z;
  float xx = g.x + 0.5 * (g.x * g.x + g.z * g.z), yy = g.w + 0.5 * (g.y * g.y + g.w * g.w);
  float xy = 0.5 * (g.y + g.z + g.x * g.y + g.z * g.w);
  if (SHOWN == kPlateXx) return xx;
  if (SHOWN == kPlateYy) return yy;
  if (SHOWN == kPlateXy) return xy;
  float middle = 0.5 * (xx + yy), half_ = 0.5 * (xx - yy), shear = sqrt(half_ * half_ + xy * xy);
  if (SHOWN == kPlateFirst) return middle + shear;
  if (SHOWN == kPlateSecond) return middle - shear;
  return shear;
}

void main() {
  uint cells_x = push.nodes_x - 1;
  uint cell = gl_GlobalInvocationID.x;
  if (cell >= cells_x * push.height) return;
  uint column = cell % cells_x, row = cell / cells_x;
  const float step_ = float(kPlateStep);
  float across = float(row % kPlateStep) / step_;
  int upper = int((row / kPlateStep * push.nodes_x + column) * kPlateNodeTexels);
  int lower = upper + int(push.nodes_x * kPlateNodeTexels);
  vec4 w = hermite(across), d = hermite_slope(across);
  Line u = line(0, upper, lower, w, d), v = line(1, upper, lower, w, d);
  float near_left = mix(texelFetch(nodes, upper + 2).x, texelFetch(nodes, lower + 2).x, across);
  float near_right = mix(texelFetch(nodes, upper + int(kPlateNodeTexels) + 2).x, texelFetch(nodes, lower + int(kPlateNodeTexels) + 2).x, across);
  float reach = sqrt(push.reach2);
  const float nan = uintBitsToFloat(0x7fc00000u);
  vec4 result[2];
  for (int k = 0; k < int(kPlateStep); ++k) {
    float t = float(k) / step_;
    vec4 wx = hermite(t), dx = hermite_slope(t);
    vec2 value = vec2(dot(wx, u.value), dot(wx, v.value));
    vec4 g = vec4(dot(dx, u.value), dot(wx, u.across), dot(dx, v.value), dot(wx, v.across)) / step_;
    float shown = component(value, g);
    result[k / 4][k % 4] = mix(near_left, near_right, t) <= reach ? shown : nan;
  }
  uint to = row * push.pitch + column * (kPlateStep / 4);
  map[to] = result[0];
  map[to + 1] = result[1];
}
