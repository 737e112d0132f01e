// Rows from their cosines and sines: four cells and their mirror images of several rows an invocation. Variants: DEPTH, as it is;
// UNEXPLAINED, what it leaves of the depth that was seen; GRADIENT, less the prior, with the sums of its squares; RIGHT, only the
// sums.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/traction.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint ROWS = 4;
layout(push_constant) uniform Push { TractionPush push; };
TEXELS(0, vec4, answered);
TEXELS(1, vec4, waves);
layout(binding = 2) readonly buffer State { TractionState state; };
#ifndef RIGHT
layout(binding = 3) writeonly buffer Out { vec4 cells[]; };
#endif
#ifdef UNEXPLAINED
TEXELS(4, vec4, depth);
#endif
#ifdef RIGHT
layout(binding = 3) writeonly buffer Sums { vec4 sums[]; };
TEXELS(4, vec4, contact);
#endif
#ifdef GRADIENT
TEXELS(4, vec4, pressure);
TEXELS(5, vec4, contact);
layout(binding = 6) writeonly buffer Sums { vec4 sums[]; };
#endif

// Inputs that only cells with contact need.
#if defined(GRADIENT) || defined(RIGHT)
#define CONTACT
#endif

vec2 found = vec2(0.0);

void store(vec4 value, int at) {
#if defined(DEPTH)
  cells[at] = value;
#elif defined(UNEXPLAINED)
  cells[at] = texelFetch(depth, at) - value;
#elif defined(GRADIENT)
  vec4 p = texelFetch(pressure, at), may = texelFetch(contact, at);
  vec4 gradient = mix(vec4(0.0), value - push.prior * p, greaterThan(may, vec4(0.0)));
  cells[at] = gradient;
  // Where something presses any gradient is left to do, where nothing does only one that wants pressure.
  vec4 carries = vec4(greaterThan(p, vec4(0.0))), wanted = max(gradient, vec4(0.0)) * (1.0 - carries);
  found += vec2(dot(gradient * gradient, carries), dot(wanted, wanted));
#else
  vec4 right = mix(vec4(0.0), value, greaterThan(texelFetch(contact, at), vec4(0.0)));
  found = vec2(found.x + dot(right, right), max(found.y, max(max(right.x, right.y), max(right.z, right.w))));
#endif
}

void main() {
  uint i = gl_GlobalInvocationID.x;
  uint half_pitch = push.pitch / 2;
#ifdef CONTACT
  // Packed, so that no group of invocations is half idle.
  uint pairs = max(half_pitch - state.first_pair, 1);
  uint x0 = state.first_pair + i % pairs, row = (i / pairs + state.first_row / ROWS) * ROWS, end = state.end_row;
#else
  uint x0 = i % half_pitch, row = i / half_pitch * ROWS, end = push.rows;
#endif
  int pitch = int(push.pitch), x = int(x0), y0 = int(row);
  if (row >= end) return;
  vec4 even[ROWS], odd[ROWS];
  for (int r = 0; r < int(ROWS); ++r) even[r] = odd[r] = vec4(0.0);
  for (int wave = 0; wave < pitch; ++wave) {
    int at = 8 * x * pitch + wave;
    vec4 c0 = texelFetch(waves, at), s0 = texelFetch(waves, at + pitch);
    vec4 c1 = texelFetch(waves, at + 2 * pitch), s1 = texelFetch(waves, at + 3 * pitch);
    vec4 c2 = texelFetch(waves, at + 4 * pitch), s2 = texelFetch(waves, at + 5 * pitch);
    vec4 c3 = texelFetch(waves, at + 6 * pitch), s3 = texelFetch(waves, at + 7 * pitch);
    for (int r = 0; r < int(ROWS); ++r) {
      vec4 c = texelFetch(answered, 2 * (y0 + r) * pitch + wave), s = texelFetch(answered, (2 * (y0 + r) + 1) * pitch + wave);
      even[r] += vec4(dot(c, c0), dot(c, c1), dot(c, c2), dot(c, c3));
      odd[r] += vec4(dot(s, s0), dot(s, s1), dot(s, s2), dot(s, s3));
    }
  }
  for (int r = 0; r < int(ROWS); ++r) {
    store(even[r] + odd[r], (y0 + r) * pitch + x);
    store((even[r] - odd[r]).wzyx, (y0 + r + 1) * pitch - 1 - x);
  }
#if defined(GRADIENT) || defined(RIGHT)
  sums[i] = vec4(found, 0.0, 0.0);
#endif
}
