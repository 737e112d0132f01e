// Depth in mm at a texel of the map, or at the nearest one beyond it. Included after `push` (SurfacePush) is declared.
#include "shaders/shared/texels.glsl"

TEXELS(0, float, depth_map);

float depth_at(ivec2 p) {
  ivec2 at = clamp(p, ivec2(0), max(ivec2(push.width, push.height) - 1, 0));
  return texelFetch(depth_map, at.y * int(push.row_pitch) + at.x).x + push.offset_mm;
}
