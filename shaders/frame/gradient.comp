// How steeply the change from the untouched image varies from pixel to pixel, summed over the frame: 5 x 5 derivatives across and
// down of every channel, the root of the sum of their squares, and of that what exceeds a limit. Rows stream through registers; one
// invocation owns a tile one texel (16 pixels of 8 bits) wide. Everything that counts is integer, so the sum is exact and the same on
// every device.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/gradient.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint SUBTRACT = 1;  // 0: the frame is the change already, the rest image is not read

TEXELS(0, uvec4, frame_texels);
TEXELS(1, uint, frame_words);
TEXELS(2, uvec4, rest_texels);
TEXELS(3, uint, rest_words);
layout(binding = 4) writeonly buffer Sums { uint sums[]; };
layout(push_constant) uniform Push { GradientPush push; };

// Two pixels to a word in lanes of 16 bits: p0 p2 and p1 p3, so `even` and `odd` are 16 neighbouring pixels. Lanes are kept from
// falling below 0 by what is added to each: 255 to a change, kRaise to a difference across.
struct Half {
  uvec4 even, odd;
};
const uint kRaise = 3 * 510;
const uint kRaised = kRaise * 16;  // after the binomial filter

uint lanes(uint image, uint rest) { return (image & 0x00ff00ffu) + 0x00ff00ffu - (SUBTRACT == 0 ? 0 : rest & 0x00ff00ffu); }
uvec4 lanes(uvec4 image, uvec4 rest) {
  return (image & 0x00ff00ffu) + 0x00ff00ffu - (SUBTRACT == 0 ? uvec4(0) : rest & 0x00ff00ffu);
}
uvec4 from_left(uvec4 x, uint left) { return (x << 16) | (uvec4(left, x.xyz) >> 16); }
uvec4 from_right(uvec4 x, uint right) { return (x >> 16) | (uvec4(x.yzw, right) << 16); }

struct Row {
  Half smooth_across, slope_across;
};

Row fetch_row(int plane, uint tile_x, int y) {
  int at = (plane * int(push.height) + clamp(y, 0, int(push.height) - 1)) * int(push.pitch) + int(tile_x) + 1;
  uvec4 image = texelFetch(frame_texels, at), rest = texelFetch(rest_texels, at);
  uint image_l = texelFetch(frame_words, at * 4 - 1).x, rest_l = texelFetch(rest_words, at * 4 - 1).x;
  uint image_r = texelFetch(frame_words, at * 4 + 4).x, rest_r = texelFetch(rest_words, at * 4 + 4).x;
  uvec4 even = lanes(image, rest), odd = lanes(image >> 8, rest >> 8);
  uint even_l = lanes(image_l, rest_l), odd_l = lanes(image_l >> 8, rest_l >> 8);
  uint even_r = lanes(image_r, rest_r), odd_r = lanes(image_r >> 8, rest_r >> 8);
  uvec4 even_2l = from_left(even, even_l), even_2r = from_right(even, even_r);
  uvec4 odd_1l = from_left(odd, odd_l), odd_2r = from_right(odd, odd_r);
  const uint raise = kRaise * 0x00010001u;
  return Row(Half(even_2l + even_2r + ((odd_1l + even + odd) << 2) + (even << 1),
                  odd_1l + odd_2r + ((even + odd + even_2r) << 2) + (odd << 1)),
             Half(even_2r + (odd << 1) + raise - even_2l - (odd_1l << 1), odd_2r + (even_2r << 1) + raise - odd_1l - (even << 1)));
}

// Running pair sums: (1 + z)^4 is the binomial filter, (1 + z)^3 (1 - z) the derivative.
struct Column {
  uvec4 s0, s1, s2, s3;  // of slopes across
  uvec4 d0, d1, d2, d3;  // of what is smooth across
};
struct Columns {
  Column even, odd;
};

// Squared steepness of a row's low and high lanes, two rows above the one that is fed.
void feed(inout Column c, uvec4 slope, uvec4 smoothed, inout uvec4 low, inout uvec4 high) {
  uvec4 a = slope + c.s0, b = a + c.s1, d = b + c.s2, across = d + c.s3;
  c.s0 = slope;
  c.s1 = a;
  c.s2 = b;
  c.s3 = d;
  uvec4 e = smoothed + c.d0, f = e + c.d1, g = f + c.d2;
  ivec4 down_low = ivec4(g & 0xffffu) - ivec4(c.d3 & 0xffffu), down_high = ivec4(g >> 16) - ivec4(c.d3 >> 16);
  c.d0 = smoothed;
  c.d1 = e;
  c.d2 = f;
  c.d3 = g;
  ivec4 across_low = ivec4(across & 0xffffu) - int(kRaised), across_high = ivec4(across >> 16) - int(kRaised);
  low += uvec4(across_low * across_low) + uvec4(down_low * down_low);
  high += uvec4(across_high * across_high) + uvec4(down_high * down_high);
}

// Whole part of the root, exact whatever the device's own root rounds to.
uvec4 whole_root(uvec4 n) {
  uvec4 r = uvec4(sqrt(vec4(n)));
  r -= uvec4(greaterThan(r * r, n));
  r += uvec4(lessThanEqual((r + 1) * (r + 1), n));
  return r;
}

uint excess(uvec4 squares, uint column) {
  uvec4 columns = uvec4(0, 4, 8, 12) + column;
  uvec4 steep = max(whole_root(squares), uvec4(push.limit)) - push.limit;
  steep *= uvec4(lessThan(columns, uvec4(push.width)));
  return steep.x + steep.y + steep.z + steep.w;
}

void main() {
  uint tile = gl_GlobalInvocationID.x;
  if (tile >= push.tiles_x * push.tiles_y) return;
  uint tile_x = tile % push.tiles_x;
  int y0 = int(tile / push.tiles_x * kGradientRows);
  const Column none = Column(uvec4(0), uvec4(0), uvec4(0), uvec4(0), uvec4(0), uvec4(0), uvec4(0), uvec4(0));
  Columns columns[PLANES];
  for (int plane = 0; plane < PLANES; ++plane) columns[plane] = Columns(none, none);
  uint sum = 0;
  for (int i = -4; i < int(kGradientRows); ++i) {
    uvec4 low_even = uvec4(0), high_even = uvec4(0), low_odd = uvec4(0), high_odd = uvec4(0);
    for (int plane = 0; plane < PLANES; ++plane) {
      Row row = fetch_row(plane, tile_x, y0 + i + 2);
      feed(columns[plane].even, row.slope_across.even, row.smooth_across.even, low_even, high_even);
      feed(columns[plane].odd, row.slope_across.odd, row.smooth_across.odd, low_odd, high_odd);
    }
    uint column = tile_x * 16;
    uint counts = uint(i >= 0 && y0 + i < int(push.height));
    sum += counts * (excess(low_even, column) + excess(low_odd, column + 1) + excess(high_even, column + 2) +
                     excess(high_odd, column + 3));
  }
  sums[tile] = sum;
}
