#version 460
// The height map as a grid of vertices: no vertex buffer, the depth is read where it was computed.
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/surface_view.h"

layout(push_constant) uniform Push { SurfacePush push; };
#include "shaders/view/surface_depth.glsl"

const float kSkyRings[2] = {0.02, 0.055};  // of the map's longer side
const vec2 kSkyDirections[8] = {{1, 0},  {0.7071, 0.7071},   {0, 1},  {-0.7071, 0.7071},
                                {-1, 0}, {-0.7071, -0.7071}, {0, -1}, {0.7071, -0.7071}};

TEXELS(2, float, mesh_places);  // of the columns, then of the rows, texels of the map

layout(location = 0) out vec2 texel;     // place in the map, texels
layout(location = 1) out vec3 world_mm;
layout(location = 2) out float open_sky;

// Share of the sky's light that reaches a place of the drawn surface: by the horizon in eight directions, from
// two places in each. At the vertices, which are densest in a dent: a fraction of what it costs by pixels.
float open_sky_at(ivec2 at, float depth) {
  const float longest = float(max(push.width, push.height));
  float sum = 0.0;
  for (int i = 0; i < 8; ++i) {
    const vec2 direction = kSkyDirections[i];
    float steepest = 0.0;
    for (int ring = 0; ring < 2; ++ring) {
      const float away = max(kSkyRings[ring] * longest, 1.0);
      const float rise_mm = (depth - depth_at(at + ivec2(round(direction * away)))) * push.exaggeration;
      steepest = max(steepest, rise_mm / (away * push.pitch_mm));
    }
    sum += inversesqrt(1.0 + steepest * steepest);
  }
  return sum / 8.0;
}

void main() {
  const uint columns = push.mesh_size & 0xffffu;
  const uint row = uint(gl_VertexIndex) / columns;
  const uint column = uint(gl_VertexIndex) - row * columns;
  const vec2 last = vec2(push.width - 1, push.height - 1);
  texel = vec2(texelFetch(mesh_places, int(column)).x, texelFetch(mesh_places, int(columns + row)).x);

  const ivec2 a = ivec2(texel);
  const ivec2 b = min(a + 1, ivec2(last));
  const vec2 f = texel - vec2(a);
  const float depth = mix(mix(depth_at(a), depth_at(ivec2(b.x, a.y)), f.x),
                          mix(depth_at(ivec2(a.x, b.y)), depth_at(b), f.x), f.y);

  const vec2 from_centre_mm = (texel - 0.5 * last) * push.pitch_mm;
  world_mm = vec3(from_centre_mm.x, -from_centre_mm.y, -depth * push.exaggeration);
  open_sky = (push.lit_spread & 1u) != 0u ? open_sky_at(ivec2(texel + 0.5), depth) : 1.0;
  gl_Position = push.clip_from_world * vec4(world_mm, 1);
}
