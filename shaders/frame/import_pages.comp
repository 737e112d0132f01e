// A frame in memory of the host to rows padded with copies of their edge pixels, texels of 16 bytes; see PaddedLayout. Pixels may
// begin at any byte. An invocation owns one texel.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/import_pages.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
TEXELS(0, uvec4, texels);  // RGBA32UI
TEXELS(1, uint, words);    // R32UI
layout(binding = 2) writeonly buffer Padded { uvec4 padded[]; };
layout(push_constant) uniform Push { PadPush push; };

// Texels past the buffer's end are not asked for: what they hold is not used.
uvec4 texel(uint at) { return texelFetch(texels, int(min(at, texel_count(texels) - 1u))); }
uint word(uint at) { return texelFetch(words, int(min(at, texel_count(words) - 1u))).x; }

// `low` and `high` follow each other in memory; the four bytes from byte `shift` / 8 of `low` on.
uvec4 joined(uvec4 low, uvec4 high, uint shift) { return shift == 0u ? low : (low >> shift) | (high << (32u - shift)); }

// The 16 bytes from any address on.
uvec4 bytes_at(uint address) {
  uint at = address >> 4, skipped = address >> 2 & 3u, shift = (address & 3u) << 3;
  uvec4 a = texel(at), b = texel(at + 1u);
  uvec4 from0 = skipped == 0u ? a : skipped == 1u ? uvec4(a.yzw, b.x) : skipped == 2u ? uvec4(a.zw, b.xy) : uvec4(a.w, b.xyz);
  uint last = skipped == 0u ? b.x : skipped == 1u ? b.y : skipped == 2u ? b.z : b.w;
  return joined(from0, uvec4(from0.yzw, last), shift);
}

// The pixel at any address, in every place of a word.
uint pixel_at(uint address) {
  uint at = address >> 2, shift = (address & 3u) << 3;
  uint four = joined(uvec4(word(at)), uvec4(word(at + 1u)), shift).x;
  return push.pixel_bytes == 1u ? (four & 0xffu) * 0x01010101u : (four & 0xffffu) * 0x00010001u;
}

void main() {
  uint texel_x = gl_GlobalInvocationID.x, row = gl_GlobalInvocationID.y;
  if (texel_x >= push.pitch || row >= push.rows) return;
  uint begin = push.offset + row * push.row_bytes;
  uint first = max(texel_x, 1u) * 16u - 16u;  // byte of the row
  uint known = texel_x == 0u ? 0u : push.row_bytes - min(first, push.row_bytes);
  uvec4 value = uvec4(0);
  if (known > 0u) value = bytes_at(begin + first);
  if (known < 16u) {
    uint edge = pixel_at(texel_x == 0u ? begin : begin + push.row_bytes - push.pixel_bytes);
    uvec4 bits = min(max(ivec4(known) - ivec4(0, 4, 8, 12), ivec4(0)), ivec4(4)) * 8;
    uvec4 mask = mix((uvec4(1) << bits) - 1u, uvec4(0xffffffffu), equal(bits, uvec4(32)));
    value = (value & mask) | (edge & ~mask);
  }
  padded[row * push.pitch + texel_x] = value;
}
