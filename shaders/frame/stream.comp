// The least that a kernel can do: read each float once, write each once. Its speed is what a stage that streams is measured against.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { uint texels; uint each; };
TEXELS(0, vec4, values);
layout(binding = 1) writeonly buffer Out { vec4 result[]; };

void main() {
  // A workgroup's stretch is contiguous, and so are its invocations in every turn.
  uint first = gl_WorkGroupID.x * gl_WorkGroupSize.x * each + gl_LocalInvocationID.x;
  for (uint i = 0; i < each; ++i) {
    uint texel = first + i * gl_WorkGroupSize.x;
    if (texel < texels) result[texel] = texelFetch(values, int(texel)) + 1.0;
  }
}
