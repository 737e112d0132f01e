// The frame's depth, contact and known cells as padded maps. A depth that is no number, or beyond all measure,
// is not known.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/traction.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { TractionPush push; };
TEXELS(0, float, given);  // height x width words
SMALL_TEXELS(1, flags);   // height x width bytes
layout(binding = 2) writeonly buffer Depth { vec4 depth[]; };
layout(binding = 3) writeonly buffer Known { vec4 known[]; };
layout(binding = 4) writeonly buffer Contact { vec4 contact[]; };
layout(binding = 5) writeonly buffer State { TractionState state; };

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= push.pitch * push.rows) return;
  uint x = 4 * (i % push.pitch), y = i / push.pitch;
  vec4 d = vec4(0.0), k = d, c = d;
  for (int j = 0; j < 4; ++j) {
    bool inside = x + j < push.width && y < push.height;
    int at = inside ? int(y * push.width + x) + j : 0;
    uint flag = inside ? small_texel(flags, at, 1) : 0;
    uint bits = floatBitsToUint(texelFetch(given, at).x);
    bool sees = (flag & kTractionKnown) != 0 && (bits & 0x7fffffffu) <= floatBitsToUint(kTractionDeepest_mm);
    d[j] = uintBitsToFloat(sees ? bits : 0u);
    k[j] = sees ? 1.0 : 0.0;
    c[j] = (flag & kTractionContact) != 0 ? 1.0 : 0.0;
  }
  depth[i] = d;
  known[i] = k;
  contact[i] = c;
  if (i > 0) return;
  state.first_row = state.first_pair = 0;
  state.end_row = push.rows;
}
