// Face weights of the next coarser level: the sum over the two fine faces that a coarse face is made of, halved for twice the
// distance. An invocation owns four coarse cells.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/weighted.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { WeightedPush push; };
TEXELS(0, vec4, wx_texels);
TEXELS(1, vec4, wy_texels);
layout(binding = 2) writeonly buffer Across { vec4 wx[]; };
layout(binding = 3) writeonly buffer Down { vec4 wy[]; };

void main() {
  uint cell = gl_GlobalInvocationID.x;
  if (cell >= push.coarse_pitch * push.coarse_height) return;
  uint tx = cell % push.coarse_pitch, y = cell / push.coarse_pitch;
  int last = int(push.pitch) - 1, upper = int(2 * y * push.pitch), lower = upper + int(push.pitch);
  int left = int(2 * tx), right = min(left + 1, last);
  bool wide = left + 1 <= last, high = 2 * y + 1 < push.height;
  lower = high ? lower : upper;
  vec4 xa = abs(texelFetch(wx_texels, upper + left)), xb = abs(texelFetch(wx_texels, upper + right));
  vec4 xc = abs(texelFetch(wx_texels, lower + left)), xd = abs(texelFetch(wx_texels, lower + right));
  vec4 ya = abs(texelFetch(wy_texels, lower + left)), yb = abs(texelFetch(wy_texels, lower + right));
  vec4 upper_x = vec4(xa.yw, xb.yw), lower_x = vec4(xc.yw, xd.yw), down = vec4(ya.xz + ya.yw, yb.xz + yb.yw);
  vec4 across = 0.5 * (upper_x + (high ? lower_x : vec4(0.0)));
  down = high ? 0.5 * down : vec4(0.0);
  wx[cell] = wide ? across : vec4(across.xy, 0.0, 0.0);
  wy[cell] = wide ? down : vec4(down.xy, 0.0, 0.0);
}
