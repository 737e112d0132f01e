// Pixels to slopes p = d(depth)/dx, q = d(depth)/dy at pixel centres, one row of eight pixels at a time. Variants: READING_GIVEN
// (slopes from a buffer), READING_SHADING, READING_PHOTOMETRIC. Included after `push` (SlopePush) and TILE_ROWS are declared;
// bindings below FIRST_OUTPUT are taken. What is read from pixels leaves in clipped_px, one word for each invocation, how many of
// its own pixels are steeper than max_slope.

#include "shaders/shared/texels.glsl"

#if defined(READING_GIVEN)
TEXELS(0, vec4, p_texels);
TEXELS(1, vec4, q_texels);
#define FIRST_OUTPUT 2
#elif defined(READING_SHADING)
TEXELS(0, uvec4, filtered_texels);  // eight 16-bit pixels to a texel
TEXELS(1, uvec2, filtered_pairs);   // four to a pair of words
TEXELS(2, float, block_words);      // means of eight by eight pixels
layout(binding = 3) writeonly buffer ClippedPixels { uint clipped_px[]; };
layout(constant_id = 4) const uint LEAST_GRAY = 0;  // stored units: contact pixels below are steeper than max_slope
#define FIRST_OUTPUT 4
#else
TEXELS(0, uvec2, frame_pairs);  // eight 8-bit pixels to a pair of words, planes red, green, blue
TEXELS(1, uint, frame_words);
TEXELS(2, uvec2, rest_pairs);
TEXELS(3, uint, rest_words);
layout(std140, binding = 4) uniform Weights { vec2 weights[kColours * kPlaceTerms]; };  // for the normal's x and y
layout(constant_id = 4) const uint PRODUCTS = 0;  // 1: the colours' products have weights too
layout(constant_id = 5) const uint PLACE_DEGREE = 1;  // of the weights' polynomials, 0 to 3
layout(binding = 5) writeonly buffer ClippedPixels { uint clipped_px[]; };
#define FIRST_OUTPUT 6
#endif

// Counts of clipped pixels in the columns of a tile, over its own rows.
struct Clipped {
  int first, end;
  uvec4 a, b;
};

Clipped none_clipped(int first) { return Clipped(first, min(first + int(TILE_ROWS), int(push.height)), uvec4(0), uvec4(0)); }

void store_clipped(Clipped clipped, uint tile, int tx) {
#if !defined(READING_GIVEN)
  ivec4 column = ivec4(0, 1, 2, 3) + 8 * tx;
  uvec4 sum = clipped.a * uvec4(lessThan(column, ivec4(push.width))) + clipped.b * uvec4(lessThan(column + 4, ivec4(push.width)));
  clipped_px[tile] = sum.x + sum.y + sum.z + sum.w;
#endif
}

// Slopes of one row around tile tx: p in columns -2 .. 9 (three groups of four), q in columns 0 .. 7.
struct Slopes {
  vec4 p_a, p_b, p_c, q_a, q_b;
};

#if defined(READING_GIVEN)

struct Window {
  uint unused;
};
Window window_at(int tx, int y) { return Window(0); }

Slopes slopes_at(Window window, int tx, int y, inout Clipped clipped) {
  int row = clamp(y, 0, int(push.height) - 1) * int(push.in_pitch), last = int(push.in_pitch) - 1;
  int texel = 2 * tx, next = min(texel + 1, last);
  vec4 l = texelFetch(p_texels, row + max(texel - 1, 0)), c = texelFetch(p_texels, row + texel);
  vec4 d = texelFetch(p_texels, row + next), r = texelFetch(p_texels, row + min(texel + 2, last));
  return Slopes(vec4(l.zw, c.xy), vec4(c.zw, d.xy), vec4(d.zw, r.xy), texelFetch(q_texels, row + texel),
                texelFetch(q_texels, row + next));
}

#elif defined(READING_SHADING)

vec4 unpack(uvec2 w) { return vec4(w.x & 0xffffu, w.x >> 16, w.y & 0xffffu, w.y >> 16); }

// The gray's gradient near a block of eight by eight pixels, from the quadric through the means of three by three blocks: in the
// block's middle, and how it changes along the row (u) and down the column (v). A pixel's own neighbours determine its brightness well
// but not the direction in which it falls: there noise would turn the slope every way.
struct Quadric {
  vec2 middle, along_u, along_v;
};

// The blocks to the left, here and to the right, in one row of blocks.
struct Window {
  Quadric l, c, r;
};

float block_at(int bx, int by) {
  int across = (int(push.width) + 7) / 8, down = (int(push.height) + 7) / 8;
  return texelFetch(block_words, clamp(by, 0, down - 1) * across + clamp(bx, 0, across - 1)).x;
}

// Three means above each other.
vec3 column_at(int bx, int by) { return vec3(block_at(bx, by - 1), block_at(bx, by), block_at(bx, by + 1)); }

Quadric quadric(vec3 w, vec3 c, vec3 e) {
  const vec3 mean = vec3(0.25, 0.5, 0.25);
  float uv = (e.z - e.x - w.z + w.x) / 4.0;
  vec3 bend = vec3(w.x - 2.0 * w.y + w.z, c.x - 2.0 * c.y + c.z, e.x - 2.0 * e.y + e.z);
  return Quadric(vec2(dot(mean, e - w), dot(mean, vec3(w.z - w.x, c.z - c.x, e.z - e.x))) / 2.0,
                 vec2(dot(mean, w - 2.0 * c + e), uv), vec2(uv, dot(mean, bend)));
}

Window window_at(int tx, int y) {
  int by = clamp(y, 0, int(push.height) - 1) / 8;
  vec3 ww = column_at(tx - 2, by), w = column_at(tx - 1, by), c = column_at(tx, by), e = column_at(tx + 1, by),
       ee = column_at(tx + 2, by);
  return Window(quadric(ww, w, c), quadric(w, c, e), quadric(c, e, ee));
}

// Lambert with the light along the viewing axis: gray / facing = cos(slope angle), so |slope| = tan of it (Eq. 62-63); the
// surface falls away from the light in the direction in which the gray falls. Without contact there is no reading: slope 0.
void shade(vec4 gray, vec4 dx, vec4 dy, out vec4 p, out vec4 q) {
  // tan^2 = facing^2 / gray^2 - 1, over the gradient's squared size: one division and one root for each pixel.
  vec4 gray2 = max(gray * gray, vec4(1e-12)), steepest2 = gray2 * (push.max_slope * push.max_slope);
  vec4 tangent2 = min(max(push.facing * push.facing - gray2, vec4(0.0)), steepest2);
  vec4 scale = push.gain * sqrt(tangent2 / (gray2 * max(dx * dx + dy * dy, vec4(1e-12))));
  scale = mix(scale, vec4(0.0), lessThan(gray, vec4(max(push.threshold, 1e-6))));
  p = scale * dx;
  q = scale * dy;
}

Slopes slopes_at(Window window, int tx, int y, inout Clipped clipped) {
  int row = clamp(y, 0, int(push.height) - 1), last = 2 * int(push.in_pitch) - 1, at = row * int(push.in_pitch);
  uvec4 here = texelFetch(filtered_texels, at + tx);
  vec4 c = unpack(here.xy), d = unpack(here.zw);
  vec4 l = unpack(texelFetch(filtered_pairs, 2 * at + max(2 * tx - 1, 0)).xy);
  vec4 r = unpack(texelFetch(filtered_pairs, 2 * at + min(2 * tx + 2, last)).xy);
  float v = (float(row & 7) - 3.5) / 8.0;
  vec2 at_l = window.l.middle + window.l.along_v * v, at_c = window.c.middle + window.c.along_v * v,
       at_r = window.r.middle + window.r.along_v * v;
  vec4 u = (vec4(0, 1, 2, 3) - 3.5) / 8.0;
  // Columns -2 and -1 lie in the block to the left, 8 and 9 in the one to the right.
  vec2 u_l = vec2(2.5, 3.5) / 8.0, u_r = vec2(-3.5, -2.5) / 8.0;
  vec4 dx_a = vec4(at_l.x + window.l.along_u.x * u_l, at_c.x + window.c.along_u.x * u.xy);
  vec4 dy_a = vec4(at_l.y + window.l.along_u.y * u_l, at_c.y + window.c.along_u.y * u.xy);
  vec4 u_b = vec4(u.zw, -u.wz);
  vec4 dx_c = vec4(at_c.x - window.c.along_u.x * u.yx, at_r.x + window.r.along_u.x * u_r);
  vec4 dy_c = vec4(at_c.y - window.c.along_u.y * u.yx, at_r.y + window.r.along_u.y * u_r);
  Slopes result;
  vec4 q_a, q_b, q_c;
  // Own pixels in contact that are too dark; no gray lies below 0.
  float least = y >= clipped.first && y < clipped.end ? float(LEAST_GRAY) : 0.0, reach = max(push.threshold, 1e-6);
  clipped.a += uvec4(lessThan(c, vec4(least))) & uvec4(greaterThanEqual(c, vec4(reach)));
  clipped.b += uvec4(lessThan(d, vec4(least))) & uvec4(greaterThanEqual(d, vec4(reach)));
  shade(vec4(l.zw, c.xy), dx_a, dy_a, result.p_a, q_a);
  shade(vec4(c.zw, d.xy), at_c.x + window.c.along_u.x * u_b, at_c.y + window.c.along_u.y * u_b, result.p_b, q_b);
  shade(vec4(d.zw, r.xy), dx_c, dy_c, result.p_c, q_c);
  result.q_a = vec4(q_a.zw, q_b.xy);
  result.q_b = vec4(q_b.zw, q_c.xy);
  return result;
}

#else

vec4 unpack(uint w) { return vec4(w & 255u, (w >> 8) & 255u, (w >> 16) & 255u, w >> 24); }

// Twelve pixels of one plane, columns -2 .. 9, as three words.
uvec3 twelve(uint l, uvec2 c, uint r) {
  return uvec3((l >> 16) | (c.x << 16), (c.x >> 16) | (c.y << 16), (c.y >> 16) | (r << 16));
}
int word_at(int row, int tx) { return row * int(push.in_pitch) * 4 + 4 + 2 * tx; }
#define twelve_at(pairs, words, at) twelve(texelFetch(words, (at) - 1).x, texelFetch(pairs, (at) / 2).xy, texelFetch(words, (at) + 2).x)

// One plane's change from the background in twelve pixels.
struct Twelve {
  vec4 a, b, c;
};
Twelve change_at(int plane, int row, int tx) {
  int at = word_at(plane * int(push.height) + row, tx);
  uvec3 image = twelve_at(frame_pairs, frame_words, at), rest = twelve_at(rest_pairs, rest_words, at);
  return Twelve(unpack(image.x) - unpack(rest.x), unpack(image.y) - unpack(rest.y), unpack(image.z) - unpack(rest.z));
}

// A row's and a column's place, in -1 to 1.
float place_y(int row) { return (2.0 * float(row) + 1.0) / float(push.height) - 1.0; }
float place_x(int column) { return (2.0 * float(column) + 1.0) / float(push.width) - 1.0; }

// The weights of a row's columns from some column on, fetched once for many rows: instead of powers of x they go with Newton's
// 1, i, i (i - 1) / 2, ... of the i-th column, whose values follow from column to column by sums alone.
struct Window {
  vec2 weights[kColours * kPlaceTerms];
};

// Written out: with loops a frame took twice as long on lavapipe.
void take_differences(inout Window window, int colour, float x, float step) {
  int at = colour * kPlaceTerms;
  vec2 x3 = weights[at + 6], x2 = fma(vec2(3.0 * x), x3, weights[at + 3]);
  vec2 x1 = fma(vec2(x), 2.0 * weights[at + 3] + 3.0 * x * x3, weights[at + 1]);
  vec2 y_x2 = weights[at + 7], y_x1 = fma(vec2(2.0 * x), y_x2, weights[at + 4]);
  window.weights[at] = fma(vec2(x), fma(vec2(x), fma(vec2(x), x3, weights[at + 3]), weights[at + 1]), weights[at]);
  window.weights[at + 1] = step * (x1 + step * (x2 + step * x3));
  window.weights[at + 2] = fma(vec2(x), fma(vec2(x), y_x2, weights[at + 4]), weights[at + 2]);
  window.weights[at + 3] = step * step * (2.0 * x2 + 6.0 * step * x3);
  window.weights[at + 4] = step * (y_x1 + step * y_x2);
  window.weights[at + 5] = fma(vec2(x), weights[at + 8], weights[at + 5]);
  window.weights[at + 6] = 6.0 * step * step * step * x3;
  window.weights[at + 7] = 2.0 * step * step * y_x2;
  window.weights[at + 8] = step * weights[at + 8];
  window.weights[at + 9] = weights[at + 9];
}

Window window_from(int column) {
  Window window;
  float x = place_x(column), step = 2.0 / float(push.width);
  take_differences(window, 0, x, step);
  take_differences(window, 1, x, step);
  take_differences(window, 2, x, step);
  take_differences(window, 3, x, step);
  take_differences(window, 4, x, step);
  take_differences(window, 5, x, step);
  take_differences(window, 6, x, step);
  take_differences(window, 7, x, step);
  take_differences(window, 8, x, step);
  return window;
}
Window window_at(int tx, int y) { return window_from(8 * tx - 2); }

// A difference of a colour's weights in row y, of an order.
vec2 weight_at(Window window, int colour, int order, float y) {
  int at = colour * kPlaceTerms + order * (order + 1) / 2;
  vec2 sum = vec2(0.0);
  if (PLACE_DEGREE > order + 2) sum = window.weights[at + 3 * order + 9];
  if (PLACE_DEGREE > order + 1) sum = fma(sum, vec2(y), window.weights[at + 2 * order + 5]);
  if (PLACE_DEGREE > order) sum = fma(sum, vec2(y), window.weights[at + order + 2]);
  return fma(sum, vec2(y), window.weights[at]);
}

// Weights of a colour at a column, and their differences to the columns that follow.
struct Weight {
  vec2 here, first, second, third;
};
Weight weight_from(Window window, int colour, float y) {
  Weight w = Weight(weight_at(window, colour, 0, y), vec2(0.0), vec2(0.0), vec2(0.0));
  if (PLACE_DEGREE > 0) w.first = weight_at(window, colour, 1, y);
  if (PLACE_DEGREE > 1) w.second = weight_at(window, colour, 2, y);
  if (PLACE_DEGREE > 2) w.third = weight_at(window, colour, 3, y);
  return w;
}
// The weight here; the next one's is there afterwards.
vec2 take(inout Weight w) {
  vec2 here = w.here;
  if (PLACE_DEGREE > 0) w.here += w.first;
  if (PLACE_DEGREE > 1) w.first += w.second;
  if (PLACE_DEGREE > 2) w.second += w.third;
  return here;
}

struct ColourWeights {
  Weight r, g, b, rr, rg, rb, gg, gb, bb;
};
ColourWeights weights_from(Window window, float y) {
  return ColourWeights(weight_from(window, 0, y), weight_from(window, 1, y), weight_from(window, 2, y), weight_from(window, 3, y),
                       weight_from(window, 4, y), weight_from(window, 5, y), weight_from(window, 6, y), weight_from(window, 7, y),
                       weight_from(window, 8, y));
}

// The normal's x and y in the next pixel of a row, by its changes of red, green and blue; products of these are never formed.
vec2 normal_of(inout ColourWeights w, float r, float g, float b) {
  vec2 red = take(w.r), green = take(w.g), blue = take(w.b);
  if (PRODUCTS != 0) {
    red += take(w.rr) * r + take(w.rg) * g + take(w.rb) * b;
    green += take(w.gg) * g + take(w.gb) * b;
    blue += take(w.bb) * b;
  }
  return red * r + green * g + blue * b;
}

// The same in the next four.
struct Normal {
  vec4 x, y;
};
Normal normal_of(inout ColourWeights w, vec4 r, vec4 g, vec4 b) {
  vec2 i = normal_of(w, r.x, g.x, b.x), j = normal_of(w, r.y, g.y, b.y);
  vec2 k = normal_of(w, r.z, g.z, b.z), l = normal_of(w, r.w, g.w, b.w);
  return Normal(vec4(i.x, j.x, k.x, l.x), vec4(i.y, j.y, k.y, l.y));
}

// Slope = n_xy / n_z of the unit normal. A slope of max_slope has n_z = 1 / sqrt(1 + max_slope^2); beyond it the direction is kept
// and the size clipped.
void lean(Normal n, out vec4 across2, out vec4 p, out vec4 q) {
  across2 = n.x * n.x + n.y * n.y;
  float steepest = push.max_slope * push.max_slope, least_nz2 = 1.0 / (1.0 + steepest);
  vec4 scale = sqrt(min(vec4(1.0) / max(1.0 - across2, vec4(least_nz2)), steepest / max(across2, vec4(1e-20))));
  p = n.x * scale;
  q = n.y * scale;
}

Slopes slopes_at(Window window, int tx, int y, inout Clipped clipped) {
  int row = clamp(y, 0, int(push.height) - 1);
  Twelve r = change_at(0, row, tx), g = change_at(1, row, tx), b = change_at(2, row, tx);
  ColourWeights colours = weights_from(window, place_y(row));
  Slopes result;
  vec4 q_a, q_b, q_c, across_a, across_b, across_c;
  lean(normal_of(colours, r.a, g.a, b.a), across_a, result.p_a, q_a);
  lean(normal_of(colours, r.b, g.b, b.b), across_b, result.p_b, q_b);
  lean(normal_of(colours, r.c, g.c, b.c), across_c, result.p_c, q_c);
  float steepest = push.max_slope * push.max_slope;
  float limit = y >= clipped.first && y < clipped.end ? steepest / (1.0 + steepest) : 3.4e38;
  clipped.a += uvec4(greaterThan(vec4(across_a.zw, across_b.xy), vec4(limit)));
  clipped.b += uvec4(greaterThan(vec4(across_b.zw, across_c.xy), vec4(limit)));
  result.q_a = vec4(q_a.zw, q_b.xy);
  result.q_b = vec4(q_b.zw, q_c.xy);
  return result;
}

#endif
