// The finest level of a live solve, as interpolate.comp, for GPUs: a workgroup owns a tile. CORRECTED: as in
// ascend_tile.comp.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/texels.glsl"
#include "shaders/surface/grid.glsl"
#include "shaders/frame/cubic.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { GridPush push; };
TEXELS(0, float, coarse_words);
layout(binding = 1) writeonly buffer Out { float result[]; };
#ifdef CORRECTED
TEXELS(2, float, coarser_words);
#endif

#include "shaders/surface/tile.glsl"
#define HALO 0
#include "shaders/surface/tile_cubic.glsl"

void main() {
  const ivec2 origin = tile_origin();
  interpolate_across(origin);
  FOR_TILE(0) {
    ivec2 place = origin + inner_of(n, 0), cell = framed(place);
    float height = interpolated(origin, cell);
    if (in_texels(place)) result[word_of(place)] = height;
  }
}
