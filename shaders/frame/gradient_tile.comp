// The steepness of the change, summed, as gradient.comp, for GPUs: a workgroup owns a tile eight words (32 pixels) wide and eight rows
// high, an invocation one word of a row. The sums are the same to the last bit.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/gradient.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint SUBTRACT = 1;  // 0: the frame is the change already, the rest image is not read

TEXELS(0, uint, frame_words);
TEXELS(1, uint, rest_words);
layout(binding = 2) writeonly buffer Sums { uint sums[]; };
layout(push_constant) uniform Push { GradientPush push; };

#include "shaders/frame/tile_words.glsl"
// What keeps lanes from falling below 0: see gradient.comp.
const uint kRaise = 3 * 510, kRaised = kRaise * 16;

// A word's even and odd pixels in lanes of 16 bits.
shared uint change_even[kWordsRead * kRowsRead], change_odd[kWordsRead * kRowsRead];
shared uint smooth_even[kWords * kRowsRead], smooth_odd[kWords * kRowsRead], slope_even[kWords * kRowsRead], slope_odd[kWords * kRowsRead];
shared uint tile_sum;

uint lane(uint w, int i) { return w >> (16 * i) & 0xffffu; }

void fetch_changes(int plane, ivec2 tile) {
  for (int n = int(gl_LocalInvocationIndex); n < kWordsRead * kRowsRead; n += int(gl_WorkGroupSize.x)) {
    int row = plane * int(push.height) + clamp(tile.y * kRows + n / kWordsRead - 2, 0, int(push.height) - 1);
    int at = (row * int(push.pitch) + 1) * 4 + tile.x * kWords + n % kWordsRead - 1;
    uint image = texelFetch(frame_words, at).x, rest = SUBTRACT == 0 ? 0 : texelFetch(rest_words, at).x;
    change_even[n] = (image & 0x00ff00ffu) + 0x00ff00ffu - (rest & 0x00ff00ffu);
    change_odd[n] = (image >> 8 & 0x00ff00ffu) + 0x00ff00ffu - (rest >> 8 & 0x00ff00ffu);
  }
}

// Binomial 1 4 6 4 1 and derivative 1 2 0 -2 -1 along the row.
void filter_across() {
  const uint raise = kRaise * 0x00010001u;
  for (int n = int(gl_LocalInvocationIndex); n < kWords * kRowsRead; n += int(gl_WorkGroupSize.x)) {
    int at = n / kWords * kWordsRead + n % kWords + 1;
    Along a = along(change_even[at], change_odd[at], change_even[at - 1], change_even[at + 1], change_odd[at - 1], change_odd[at + 1]);
    uvec2 smoothed = binomial(a);
    smooth_even[n] = smoothed.x;
    smooth_odd[n] = smoothed.y;
    slope_even[n] = a.even_2r + (a.odd << 1) + raise - a.even_2l - (a.odd_1l << 1);
    slope_odd[n] = a.odd_2r + (a.even_2r << 1) + raise - a.odd_1l - (a.even << 1);
  }
}

// One pixel's squared steepness in the plane, from five rows of its lane.
#define SQUARES(smoothed, slope, at, i)                                                                                        \
  squares(lane(slope[at], i) + lane(slope[(at) + 4 * kWords], i) +                                                              \
              4 * (lane(slope[(at) + kWords], i) + lane(slope[(at) + 3 * kWords], i)) + 6 * lane(slope[(at) + 2 * kWords], i),   \
          lane(smoothed[at], i) + 2 * lane(smoothed[(at) + kWords], i),                                                          \
          lane(smoothed[(at) + 4 * kWords], i) + 2 * lane(smoothed[(at) + 3 * kWords], i))
uint squares(uint slope, uint above, uint below) {
  int across = int(slope) - int(kRaised), down = int(above) - int(below);
  return uint(across * across) + uint(down * down);
}

// Whole part of the root, exact whatever the device's own root rounds to.
uint whole_root(uint n) {
  uint r = uint(sqrt(float(n)));
  r -= r * r > n ? 1 : 0;
  return r + ((r + 1) * (r + 1) <= n ? 1 : 0);
}

void main() {
  ivec2 tile = ivec2(gl_WorkGroupID.xy);
  int me = int(gl_LocalInvocationIndex), word = me % kWords, row = me / kWords;
  if (me == 0) tile_sum = 0;
  uvec4 steepness = uvec4(0);
  for (int plane = 0; plane < PLANES; ++plane) {
    fetch_changes(plane, tile);
    barrier();
    filter_across();
    barrier();
    int at = row * kWords + word;
    steepness += uvec4(SQUARES(smooth_even, slope_even, at, 0), SQUARES(smooth_odd, slope_odd, at, 0),
                       SQUARES(smooth_even, slope_even, at, 1), SQUARES(smooth_odd, slope_odd, at, 1));
  }
  uint sum = 0;
  for (int i = 0; i < 4; ++i) {
    bool inside = (tile.x * kWords + word) * 4 + i < int(push.width) && tile.y * kRows + row < int(push.height);
    sum += inside ? max(whole_root(steepness[i]), push.limit) - push.limit : 0;
  }
  if (sum > 0) atomicAdd(tile_sum, sum);
  barrier();
  if (me == 0) sums[gl_WorkGroupID.y * push.tiles_x + gl_WorkGroupID.x] = tile_sum;
}
