#version 460
// The height map as a grid of vertices: no vertex buffer, the depth is read where it was computed.
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/surface_view.h"

layout(push_constant) uniform Push { SurfacePush push; };
#include "shaders/view/surface_depth.glsl"

TEXELS(2, float, mesh_places);  // of the columns, then of the rows, texels of the map

layout(location = 0) out vec2 texel;     // place in the map, texels
layout(location = 1) out vec3 world_mm;

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
  gl_Position = push.clip_from_world * vec4(world_mm, 1);
}
