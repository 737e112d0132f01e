// Depth in mm at a texel of the map, from the part of it that is held. Included after `push` (SurfacePush) is declared.
#include "shaders/shared/texels.glsl"

TEXELS(0, float, depth_map);

float depth_at(ivec2 p) {
  ivec2 place = ivec2(push.window_place & 0xffffu, push.window_place >> 16);
  ivec2 size = ivec2(push.window_size & 0xffffu, push.window_size >> 16);
  ivec2 q = clamp(p, ivec2(0), ivec2(push.width, push.height) - 1) - place;
  bool held = all(greaterThanEqual(q, ivec2(0))) && all(lessThan(q, size));
  ivec2 at = clamp(q, ivec2(0), max(size - 1, 0));
  return held ? texelFetch(depth_map, at.y * int(push.row_pitch) + at.x).x + push.offset_mm : 0.0;
}
