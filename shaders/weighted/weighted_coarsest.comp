// The coarsest level of the preconditioner: a few cells, relaxed one after the other, there and back again, by one invocation.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/weighted.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const int SWEEPS = 3;
layout(push_constant) uniform Push { WeightedPush push; };
TEXELS(0, float, wx_words);
TEXELS(1, float, wy_words);
TEXELS(2, float, right_words);
layout(binding = 3) buffer Out { float x[]; };
layout(binding = 4) writeonly buffer Dots { float dots[4]; };  // right times result, where there is no finer level


// No solution has a mean, and no right side may: what rounding leaves of it would grow without bound.
float middle = 0.0;

void relax(int column, int row) {
  int pitch = 4 * int(push.pitch), at = row * pitch + column;
  float l = column > 0 ? abs(texelFetch(wx_words, at - 1).x) : 0.0, u = row > 0 ? abs(texelFetch(wy_words, at - pitch).x) : 0.0;
  float r = column + 1 < int(push.width) ? abs(texelFetch(wx_words, at).x) : 0.0;
  float d = row + 1 < int(push.height) ? abs(texelFetch(wy_words, at).x) : 0.0;
  float rest = texelFetch(right_words, at).x - middle;
  if (l > 0.0) rest += l * x[at - 1];
  if (r > 0.0) rest += r * x[at + 1];
  if (u > 0.0) rest += u * x[at - pitch];
  if (d > 0.0) rest += d * x[at + pitch];
  float diagonal = l + r + u + d;
  x[at] = diagonal > 0.0 ? rest / diagonal : 0.0;
}

void main() {
  if (gl_GlobalInvocationID.x > 0) return;
  int width = int(push.width), height = int(push.height), cells = width * height;
  for (int i = 0; i < 4 * int(push.pitch) * height; ++i) x[i] = 0.0;
  for (int i = 0; i < cells; ++i) middle += texelFetch(right_words, i / width * 4 * int(push.pitch) + i % width).x;
  middle /= float(cells);
  for (int sweep = 0; sweep < SWEEPS; ++sweep) {
    for (int i = 0; i < cells; ++i) relax(i % width, i / width);
    for (int i = cells - 1; i >= 0; --i) relax(i % width, i / width);
  }
  float mean = 0.0, dot = 0.0;
  for (int i = 0; i < cells; ++i) mean += x[i / width * 4 * int(push.pitch) + i % width] / float(cells);
  for (int i = 0; i < cells; ++i) {
    int at = i / width * 4 * int(push.pitch) + i % width;
    x[at] -= mean;
    dot += texelFetch(right_words, at).x * x[at];
  }
  dots = float[4](dot, 0.0, 0.0, 0.0);
}
