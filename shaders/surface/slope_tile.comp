// Pixels to the right side of the least-squares surface problem, as slope.comp and, with CELLS_ONLY, slope_coarse.comp, for GPUs: a
// workgroup owns a tile, whose slopes lie in shared memory.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/slope.h"
#include "shaders/shared/tile.h"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint TILE_ROWS = 16;
layout(push_constant) uniform Push { SlopePush push; };
#include "shaders/surface/slope_methods.glsl"

#ifdef CELLS_ONLY
layout(binding = FIRST_OUTPUT) writeonly buffer Coarse { float coarse[]; };
#else
layout(binding = FIRST_OUTPUT) writeonly buffer Right { float right_side[]; };
layout(binding = FIRST_OUTPUT + 1) writeonly buffer Coarse { float coarse[]; };
#endif

// Two pixels around the tile, in whole groups of four columns.
const int kGroups = kTileWidth / 4 + 2, kStride = 4 * kGroups, kSlopeRows = kTileHeight + 4;
shared float slope_x[kStride * kSlopeRows], slope_y[kStride * kSlopeRows];
shared uint tile_clipped;

// Slopes of the four pixels from column x of row y, and which of them are clipped.
#if defined(READING_GIVEN)
uvec4 four_slopes(int x, int y, out vec4 p, out vec4 q) {
  int at = y * int(push.in_pitch) + x / 4;
  p = texelFetch(p_texels, at);
  q = texelFetch(q_texels, at);
  return uvec4(0);
}
#elif defined(READING_SHADING)
uvec4 four_slopes(int x, int y, out vec4 p, out vec4 q) {
  int bx = x / 8, by = y / 8;
  Quadric fit = quadric(column_at(bx - 1, by), column_at(bx, by), column_at(bx + 1, by));
  vec2 middle = fit.middle + fit.along_v * ((float(y & 7) - 3.5) / 8.0);
  vec4 u = (vec4(0, 1, 2, 3) + (float(x & 7) - 3.5)) / 8.0;
  vec4 gray = unpack(texelFetch(filtered_pairs, 2 * y * int(push.in_pitch) + x / 4).xy);
  shade(gray, middle.x + fit.along_u.x * u, middle.y + fit.along_u.y * u, p, q);
  // Pixels in contact that are too dark.
  return uvec4(lessThan(gray, vec4(float(LEAST_GRAY)))) & uvec4(greaterThanEqual(gray, vec4(max(push.threshold, 1e-6))));
}
#else
// One plane's change from the background.
vec4 four_at(int plane, int x, int y) {
  int at = (plane * int(push.height) + y) * int(push.in_pitch) * 4 + 4 + x / 4;
  return unpack(texelFetch(frame_words, at).x) - unpack(texelFetch(rest_words, at).x);
}

uvec4 four_slopes(int x, int y, out vec4 p, out vec4 q) {
  vec4 across2;
  ColourWeights colours = weights_from(window_from(x), place_y(y));
  lean(normal_of(colours, four_at(0, x, y), four_at(1, x, y), four_at(2, x, y)), across2, p, q);
  float steepest = push.max_slope * push.max_slope;
  return uvec4(greaterThan(across2, vec4(steepest / (1.0 + steepest))));
}
#endif

ivec2 origin() { return ivec2(gl_WorkGroupID.xy) * ivec2(kTileWidth, kTileHeight); }
int index_of(ivec2 pixel) {
  ivec2 inner = pixel - origin();
  return (inner.y + 2) * kStride + inner.x + 4;
}
// The integral of the slope across the pair of a pixel and the one before it along a line of n pixels (fourth order); `step` leads to
// the next one's slope. Beyond the ends slopes go on linearly, which makes the pair beside an end exact for parabolas.
#define PAIR_ACROSS(slope, at, step, i, n)                                                                            \
  pair_across(slope[(at) - 2 * (step)], slope[(at) - (step)], slope[at], slope[(at) + (step)], i, n)
float pair_across(float a, float b, float c, float d, int i, int n) {
  a = i == 1 ? 2.0 * b - c : a;
  d = i == n - 1 ? 2.0 * c - b : d;
  return i >= 1 && i < n ? (13.0 * (b + c) - a - d) / 24.0 : 0.0;
}
float left_pair(ivec2 pixel) { return PAIR_ACROSS(slope_x, index_of(pixel), 1, pixel.x, int(push.width)); }
float upper_pair(ivec2 pixel) { return PAIR_ACROSS(slope_y, index_of(pixel), kStride, pixel.y, int(push.height)); }

float pixel_sum(ivec2 pixel) {
  return left_pair(pixel) - left_pair(pixel + ivec2(1, 0)) + upper_pair(pixel) - upper_pair(pixel + ivec2(0, 1));
}

void main() {
  const int width = int(push.width), height = int(push.height), first = int(gl_LocalInvocationIndex), stride = int(gl_WorkGroupSize.x);
  if (first == 0) tile_clipped = 0;
  barrier();
  uint clipped = 0;
  for (int n = first; n < kGroups * kSlopeRows; n += stride) {
    ivec2 place = origin() + ivec2(n % kGroups * 4 - 4, n / kGroups - 2);
    vec4 p, q;
    uvec4 steep = four_slopes(clamp(place.x, 0, 4 * ((width - 1) / 4)), clamp(place.y, 0, height - 1), p, q);
    int at = n * 4;
    for (int i = 0; i < 4; ++i) {
      slope_x[at + i] = p[i];
      slope_y[at + i] = q[i];
    }
    // Own pixels inside the frame.
    ivec2 inner = place - origin();
    bool own = inner.x >= 0 && inner.x < kTileWidth && inner.y >= 0 && inner.y < kTileHeight && place.y < height;
    uvec4 counted = steep * uvec4(lessThan(ivec4(0, 1, 2, 3) + place.x, ivec4(width)));
    clipped += own ? counted.x + counted.y + counted.z + counted.w : 0;
  }
  if (clipped > 0) atomicAdd(tile_clipped, clipped);
  barrier();
  for (int n = first; n < kTileWidth * kTileHeight / 4; n += stride) {
    ivec2 cell = origin() / 2 + ivec2(n % (kTileWidth / 2), n / (kTileWidth / 2));
    float sum = 0.0;
    for (int i = 0; i < 2; ++i) {
#ifdef CELLS_ONLY
      // Pairs inside the cell cancel.
      ivec2 row = 2 * cell + ivec2(0, i), column = 2 * cell + ivec2(i, 0);
      sum += row.y < height ? left_pair(row) - left_pair(row + ivec2(2, 0)) : 0.0;
      sum += column.x < width ? upper_pair(column) - upper_pair(column + ivec2(0, 2)) : 0.0;
#else
      for (int j = 0; j < 2; ++j) {
        ivec2 pixel = 2 * cell + ivec2(j, i);
        bool inside = pixel.x < width && pixel.y < height;
        float value = inside ? push.scale * pixel_sum(pixel) : 0.0;
        sum += value;
        if (pixel.x < 4 * int(push.pitch) && pixel.y < height) right_side[pixel.y * 4 * int(push.pitch) + pixel.x] = value;
      }
#endif
    }
#ifdef CELLS_ONLY
    sum *= push.scale;
#endif
    if (cell.x < 4 * int(push.coarse_pitch) && 2 * cell.y < height) coarse[cell.y * 4 * int(push.coarse_pitch) + cell.x] = 2 * cell.x < width ? sum : 0.0;
  }
#if !defined(READING_GIVEN)
  // There is a word for each strip of the other kernels: at least one for each tile, as TILE_ROWS are at most kTileHeight.
  uint tiles = gl_NumWorkGroups.x * gl_NumWorkGroups.y, tile = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
  uint strips = (push.pitch + 1) / 2 * ((push.height + TILE_ROWS - 1) / TILE_ROWS);
  for (uint i = tile + uint(first) * tiles; i < strips; i += uint(stride) * tiles) clipped_px[i] = i == tile ? tile_clipped : 0;
#endif
}
