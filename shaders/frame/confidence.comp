// Confidence of each pixel: the frame's raw values combined with what background and outline determine once and for all. All
// integer. An invocation owns 16 columns and TILE_ROWS rows. Variants: WIDE (16-bit pixels), PLANES (1 or
// 3), MARKERS (the frame is one whose printed markers were filled).
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/confidence.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint TILE_ROWS = 16;
layout(constant_id = 4) const uint REACH = 0;  // px around a saturated pixel that rest on it: 2 behind the 5x5 filter
layout(push_constant) uniform Push { ConfidencePush push; };
TEXELS(0, uvec4, frame_texels);
TEXELS(1, uint, frame_words);
TEXELS(2, uvec4, still_texels);  // confidence of background and outline
layout(binding = 3) writeonly buffer Map { uvec4 map[]; };
layout(binding = 4) writeonly buffer Records { ConfidenceRecord records[]; };
#ifdef MARKERS
TEXELS(5, uint, unknown_words);  // cells that could not be filled, a bit each
layout(constant_id = 5) const uint CELL = 2;               // px, their side
#endif

// Raw values of 16 pixels and of two on each side, the brightest plane's: v[i] is column i - 2. Few enough to stay in registers.
struct Row {
  uvec4 a, b, c, d;
  uvec2 l, r;
};

Row fetch_row(int group, int y) {
  int row = clamp(y, 0, int(push.height) - 1);
  Row v = Row(uvec4(0), uvec4(0), uvec4(0), uvec4(0), uvec2(0), uvec2(0));
  for (int plane = 0; plane < PLANES; ++plane) {
    int start = (plane * int(push.height) + row) * int(push.pitch) + 1;
#ifdef WIDE
    int at = start + 2 * group;
    uvec4 t = texelFetch(frame_texels, at), u = texelFetch(frame_texels, at + 1);
    uint l = texelFetch(frame_words, 4 * at - 1).x, r = texelFetch(frame_words, 4 * at + 8).x;
    v.a = max(v.a, uvec4(t.x & 0xffffu, t.x >> 16, t.y & 0xffffu, t.y >> 16));
    v.b = max(v.b, uvec4(t.z & 0xffffu, t.z >> 16, t.w & 0xffffu, t.w >> 16));
    v.c = max(v.c, uvec4(u.x & 0xffffu, u.x >> 16, u.y & 0xffffu, u.y >> 16));
    v.d = max(v.d, uvec4(u.z & 0xffffu, u.z >> 16, u.w & 0xffffu, u.w >> 16));
    v.l = max(v.l, uvec2(l & 0xffffu, l >> 16));
    v.r = max(v.r, uvec2(r & 0xffffu, r >> 16));
#else
    int at = start + group;
    uvec4 t = texelFetch(frame_texels, at);
    uint l = texelFetch(frame_words, 4 * at - 1).x, r = texelFetch(frame_words, 4 * at + 4).x;
    const uvec4 shift = uvec4(0, 8, 16, 24);
    v.a = max(v.a, (uvec4(t.x) >> shift) & 255u);
    v.b = max(v.b, (uvec4(t.y) >> shift) & 255u);
    v.c = max(v.c, (uvec4(t.z) >> shift) & 255u);
    v.d = max(v.d, (uvec4(t.w) >> shift) & 255u);
    v.l = max(v.l, (uvec2(l) >> shift.zw) & 255u);
    v.r = max(v.r, (uvec2(r) >> shift.xy) & 255u);
#endif
  }
  return v;
}

uint bits(uvec4 v, uint first) {
  uvec4 full = uvec4(greaterThanEqual(v, uvec4(push.saturation))) << (uvec4(0, 1, 2, 3) + first);
  return full.x | full.y | full.z | full.w;
}

// Saturated pixels of a row, bit i for column i - 2, spread along the row by REACH.
uint saturated_bits(Row v) {
  uvec2 r = uvec2(greaterThanEqual(v.r, uvec2(push.saturation)));
  uvec2 l = uvec2(greaterThanEqual(v.l, uvec2(push.saturation)));
  uint m = bits(v.a, 2) | bits(v.b, 6) | bits(v.c, 10) | bits(v.d, 14) | l.x | (l.y << 1) | (r.x << 18) | (r.y << 19);
  return REACH == 0 ? m : m | (m << 1) | (m << 2) | (m >> 1) | (m >> 2);
}

uvec4 brightness(uvec4 v) {
  if (push.shadow == 0) return uvec4(kFullConfidence);
  uvec4 above = v - min(v, uvec4(push.shadow));
  return min(above * kFullConfidence / push.shadow, uvec4(kFullConfidence));
}

// Pixels of a row that markers cover, bit i for column i, each cell's bit for its two pixels.
uint covered_bits(int group, int y) {
#ifdef MARKERS
  int cells_x = (int(push.width) + int(CELL) - 1) / int(CELL), words = (cells_x + 31) / 32, row = min(y, int(push.height) - 1);
  if (CELL == 1) return texelFetch(unknown_words, row * words + group / 2).x >> (16 * (group % 2)) & 0xffffu;
  uint cells = texelFetch(unknown_words, row / 2 * words + group / 4).x >> (8 * (group % 4)) & 255u;
  cells = (cells | (cells << 4)) & 0x0f0fu;
  cells = (cells | (cells << 2)) & 0x3333u;
  cells = (cells | (cells << 1)) & 0x5555u;
  return cells | (cells << 1);
#else
  return 0;
#endif
}

// Four pixels: `still` holds what is known of them without the frame.
uvec4 judge(uvec4 v, uint saturated, uint covered, uint first, uvec2 still, inout uvec4 unknown, inout uvec4 partial, inout uvec4 full,
            inout uvec4 dark, inout uvec4 outside, uint column) {
  uvec4 s = uvec4(still.x & 0xffffu, still.x >> 16, still.y & 0xffffu, still.y >> 16);
  uvec4 hit = (uvec4(saturated) >> (uvec4(0, 1, 2, 3) + first + 2)) & 1u;
  uvec4 hidden = (uvec4(covered) >> (uvec4(0, 1, 2, 3) + first)) & 1u;
  uvec4 light = brightness(v);
  uvec4 reason = (s >> kReasonShift) | (hit * kSaturated) | (hidden * kCovered) | (uvec4(lessThan(light, uvec4(kFullConfidence))) * kShadowed);
  uvec4 confidence = min(s & 255u, light) * (1 - hit) * (1 - hidden);
  uvec4 inside = uvec4(lessThan(uvec4(0, 1, 2, 3) + column + first, uvec4(push.width)));
  unknown += inside * uvec4(equal(confidence, uvec4(0)));
  partial += inside * uvec4(greaterThan(confidence, uvec4(0))) * uvec4(lessThan(confidence, uvec4(kFullConfidence)));
  full += inside * (reason & kSaturated);
  dark += inside * ((reason & kShadowed) / kShadowed);
  outside += inside * ((reason & kOutside) / kOutside);
  return inside * (confidence | (reason << kReasonShift));
}

uint total(uvec4 v) { return v.x + v.y + v.z + v.w; }

void main() {
  uint tiles = (push.height + TILE_ROWS - 1) / TILE_ROWS;
  uint tile = gl_GlobalInvocationID.x;
  if (tile >= push.groups * tiles) return;
  int group = int(tile % push.groups), y0 = int(tile / push.groups * TILE_ROWS), height = int(push.height);
  uvec4 unknown = uvec4(0), partial = uvec4(0), full = uvec4(0), dark = uvec4(0), outside = uvec4(0);
  Row here = fetch_row(group, y0), next = fetch_row(group, y0 + 1);
  uint s0 = 0, s1 = 0, s2 = saturated_bits(here), s3 = saturated_bits(next);
  if (REACH > 0) {
    s0 = saturated_bits(fetch_row(group, y0 - 2));
    s1 = saturated_bits(fetch_row(group, y0 - 1));
  }
  for (int y = y0; y < y0 + int(TILE_ROWS); ++y) {
    Row after = fetch_row(group, y + 2);
    uint s4 = saturated_bits(after);
    uint saturated = REACH > 0 ? s0 | s1 | s2 | s3 | s4 : s2;
    int at = (min(y, height - 1) * int(push.groups) + group) * 2;
    uint covered = covered_bits(group, y);
    uvec4 still_a = texelFetch(still_texels, at), still_b = texelFetch(still_texels, at + 1);
    uint column = y < height ? uint(group) * 16 : push.width;  // beyond the last row nothing counts
    uvec4 a = judge(here.a, saturated, covered, 0, still_a.xy, unknown, partial, full, dark, outside, column);
    uvec4 b = judge(here.b, saturated, covered, 4, still_a.zw, unknown, partial, full, dark, outside, column);
    uvec4 c = judge(here.c, saturated, covered, 8, still_b.xy, unknown, partial, full, dark, outside, column);
    uvec4 d = judge(here.d, saturated, covered, 12, still_b.zw, unknown, partial, full, dark, outside, column);
    if (y < height) {
      map[at] = uvec4(a.x | (a.y << 16), a.z | (a.w << 16), b.x | (b.y << 16), b.z | (b.w << 16));
      map[at + 1] = uvec4(c.x | (c.y << 16), c.z | (c.w << 16), d.x | (d.y << 16), d.z | (d.w << 16));
    }
    s0 = s1;
    s1 = s2;
    s2 = s3;
    s3 = s4;
    here = next;
    next = after;
  }
  records[tile] = ConfidenceRecord(total(unknown), total(partial), total(full), total(dark), total(outside));
}
