// The largest pressure on the frame's border: what presses there presses outside too, and that load is not seen.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/elastic.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { ElasticPressurePush push; };
TEXELS(0, vec4, pressure_texels);
TEXELS(1, float, pressure_words);
layout(binding = 2) writeonly buffer Out { float largest[]; };

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= kElasticBorderRecords) return;
  const int margin = int(kElasticMargin);
  int width = int(push.width), height = int(push.height), pitch = int(push.pitch);
  int across = (width + 3) / 4;
  float most = 0.0;
  for (int t = int(i); t < across; t += int(kElasticBorderRecords)) {
    vec4 top = texelFetch(pressure_texels, margin * pitch + margin / 4 + t);
    vec4 bottom = texelFetch(pressure_texels, (margin + height - 1) * pitch + margin / 4 + t);
    vec4 both = max(top, bottom);
    most = max(most, max(max(both.x, both.y), max(both.z, both.w)));
  }
  for (int y = int(i); y < height; y += int(kElasticBorderRecords)) {
    int at = (margin + y) * pitch * 4 + margin;
    most = max(most, max(texelFetch(pressure_words, at).x, texelFetch(pressure_words, at + width - 1).x));
  }
  largest[i] = most;
}
