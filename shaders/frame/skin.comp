// Where the points of the skin's pattern are in this frame. An invocation follows one point: it fits, from where the point was,
//   image(p + shift) = gain * (rest(p) + gradient(p) . step) + offset + tilt . p
// over a window of SIDE x SIDE samples, each the sum of STRIDE x STRIDE pixels, until the step is small. Where that does not end in the window's pattern it
// looks around the places where the point may be (where it was, where its neighbours went, where it rests) and fits again. The
// untouched window and its gradient come with offset and tilt projected out, so that the normal matrix does not change and is
// inverted on the host (inverse compositional). Variants: WIDE (16-bit pixels), PLANES (1 or 3, summed).
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_vote : require
#include "shaders/shared/skin.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint SIDE = 17;
layout(constant_id = 4) const uint STRIDE = 1;
TEXELS(0, uint, words);    // R32UI, the frame
TEXELS(1, vec4, points);   // RGBA32F
TEXELS(2, vec4, windows);  // RGBA32F: a row's samples in fours, of each four rest, gain, step x, y; all points' first
TEXELS(3, vec4, before);   // RGBA32F, the last frame's motions
layout(binding = 4) writeonly buffer Motions { vec4 motions[]; };  // shift x, y, correlation, noise in rest's gray levels
layout(push_constant) uniform Push { SkinPush push; };

const int kSide = int(SIDE), kStride = int(STRIDE), kHalf = kSide / 2, kFours = (kSide + 3) / 4;
const int kPixels = kStride * kStride;  // of a sample

// A row of a window's samples, four by four; those beyond SIDE are of no account.
struct Row {
  vec4 a, b, c, d, e, f;
};

uint word(int row, int at) { return texelFetch(words, row + clamp(at, 0, int(push.pitch) - 1)).x; }

// Four pixels from x on, summed over the planes. A row is padded with copies of its first and last pixel.
vec4 four_pixels(int x, int y) {
  const int row = clamp(y, 0, int(push.height) - 1) * int(push.pitch), plane = int(push.height * push.pitch);
#ifdef WIDE
  const int at = 4 + (x >> 1);
  const uint shift = uint(x & 1) << 4, first = word(row, at), second = word(row, at + 1), third = word(row, at + 2);
  const uint low = first >> shift | second << 1 << (31 - shift), high = second >> shift | third << 1 << (31 - shift);
  return vec4(low & 0xffffu, low >> 16, high & 0xffffu, high >> 16);
#else
  const int at = 4 + (x >> 2);
  const uint shift = uint(x & 3) << 3;
  uint even = 0, odd = 0;
  for (int p = 0; p < PLANES; ++p) {
    const uint pixels = word(row + p * plane, at) >> shift | word(row + p * plane, at + 1) << 1 << (31 - shift);
    even += pixels & 0x00ff00ffu;
    odd += pixels >> 8 & 0x00ff00ffu;
  }
  return vec4(even & 0xffffu, odd & 0xffffu, even >> 16, odd >> 16);
#endif
}

// The first pixels of four samples that follow each other, and the sums of their others.
struct Four {
  vec4 first, others;
};

vec4 every(int x, int y) {
  return vec4(four_pixels(x, y).x, four_pixels(x + kStride, y).x, four_pixels(x + 2 * kStride, y).x, four_pixels(x + 3 * kStride, y).x);
}

Four four_at(int x, int y) {
  if (kStride == 1) return Four(four_pixels(x, y), vec4(0));
  if (kStride == 2) {
    const vec4 p = four_pixels(x, y), q = four_pixels(x + 4, y);
    return Four(vec4(p.xz, q.xz), vec4(p.yw, q.yw));
  }
  Four four = Four(every(x, y), vec4(0));
  for (int i = 1; i < kStride; ++i) four.others += every(x + i, y);
  return four;
}

vec4 between(Four here, Four next, float part) {
  return mix(here.first, vec4(here.first.yzw, next.first.x), part) + here.others;
}

// One row of pixels summed into samples that begin `part` of a pixel beyond x. The last four have a sample to spare.
Row row_samples(int x, int y, float part) {
  const int step = 4 * kStride;
  const Four none = Four(vec4(0), vec4(0)), a = four_at(x, y), b = four_at(x + step, y);
  Four c = none, d = none, e = none, f = none;
  if (kFours > 2) c = four_at(x + 2 * step, y);
  if (kFours > 3) d = four_at(x + 3 * step, y);
  if (kFours > 4) e = four_at(x + 4 * step, y);
  if (kFours > 5) f = four_at(x + 5 * step, y);
  return Row(between(a, b, part), between(b, c, part), between(c, d, part), between(d, e, part), between(e, f, part),
             between(f, none, part));
}

Row times(Row r, float w) { return Row(w * r.a, w * r.b, w * r.c, w * r.d, w * r.e, w * r.f); }
Row plus(Row r, Row s, float w) {
  return Row(r.a + w * s.a, r.b + w * s.b, r.c + w * s.c, r.d + w * s.d, r.e + w * s.e, r.f + w * s.f);
}

// 1 for those of the four samples from 4 k on that lie within the window.
vec4 within(int k) { return vec4(lessThan(4 * k + ivec4(0, 1, 2, 3), ivec4(kSide))); }

vec4 window_at(int row, int k, int which, int point) { return texelFetch(windows, (((row * kFours + k) << 2) + which) * int(push.points) + point); }

// Sums of v, t and t^2; of v^2 and t v.
struct Products {
  vec3 ones;
  vec2 pairs;
};

void correlate(int row, int k, int point, vec4 v, inout Products sums) {
  if (k >= kFours) return;
  const vec4 t = window_at(row, k, 0, point);
  v *= within(k);
  sums.ones += vec3(dot(v, vec4(1)), dot(t, vec4(1)), dot(t, t));
  sums.pairs += vec2(dot(v, v), dot(t, v));
}

// Correlation of every other row of the window with the frame, shifted by whole pixels.
float correlation_at(int point, ivec2 rest, vec2 shift) {
  const ivec2 at = rest + ivec2(round(shift)), corner = at - kHalf * kStride;
  const float base = float(kPixels) * four_pixels(at.x, at.y).x;
  Products sums = Products(vec3(0), vec2(0));
  for (int j = 0; j < kSide; j += 2) {
    Row row = row_samples(corner.x, corner.y + j * kStride, 0.0);
    for (int i = 1; i < kStride; ++i) row = plus(row, row_samples(corner.x, corner.y + j * kStride + i, 0.0), 1.0);
    correlate(j, 0, point, row.a - base, sums);
    correlate(j, 1, point, row.b - base, sums);
    correlate(j, 2, point, row.c - base, sums);
    correlate(j, 3, point, row.d - base, sums);
    correlate(j, 4, point, row.e - base, sums);
    correlate(j, 5, point, row.f - base, sums);
  }
  const float n = float((kSide + 1) / 2 * kSide), b = sums.ones.x, a = sums.ones.y;
  return (sums.pairs.y - a * b / n) * inversesqrt(max((sums.ones.z - a * a / n) * (sums.pairs.x - b * b / n), 1e-12));
}

// Sums over the window of what the frame has there.
struct Fit {
  vec4 moments;  // of v, v x, v y, v^2
  vec4 motion;   // with rest; gain, gain * step x, y
};

void add_four(int row, int k, int point, vec4 v, inout Fit fit) {
  if (k >= kFours) return;
  if (4 * k + 4 > kSide) v *= within(k);
  const float sum = dot(v, vec4(1));
  fit.moments += vec4(sum, dot(v, vec4(4 * k - kHalf) + vec4(0, 1, 2, 3)), sum * float(row - kHalf), dot(v, v));
  fit.motion += vec4(dot(v, window_at(row, k, 0, point)), dot(v, window_at(row, k, 1, point)), dot(v, window_at(row, k, 2, point)),
                     dot(v, window_at(row, k, 3, point)));
}

Fit fit_at(int point, ivec2 rest, vec2 shift) {
  const vec2 whole = floor(shift), part = shift - whole;
  const ivec2 middle = rest + ivec2(whole), corner = middle - kHalf * kStride;
  const float base = float(kPixels) * four_pixels(middle.x, middle.y).x;
  Fit fit = Fit(vec4(0), vec4(0));
  Row last = row_samples(corner.x, corner.y, part.x);
  for (int j = 0; j < kSide; ++j) {
    Row row = times(last, 1.0 - part.y);
    for (int i = 1; i <= kStride; ++i) {
      last = row_samples(corner.x, corner.y + j * kStride + i, part.x);
      row = plus(row, last, i == kStride ? part.y : 1.0);
    }
    add_four(j, 0, point, row.a - base, fit);
    add_four(j, 1, point, row.b - base, fit);
    add_four(j, 2, point, row.c - base, fit);
    add_four(j, 3, point, row.d - base, fit);
    add_four(j, 4, point, row.e - base, fit);
    add_four(j, 5, point, row.f - base, fit);
  }
  return fit;
}

void main() {
  const int point = int(gl_GlobalInvocationID.x);
  if (point >= int(push.points)) return;
  const vec4 first = texelFetch(points, point * 2), beside = texelFetch(points, point * 2 + 1);
  const ivec2 rest = ivec2(first.xy);
  const vec4 was = texelFetch(before, point);

  // Where the neighbours went, those that were followed. A point far from that has jumped to another one's place.
  vec3 others = vec3(0.0);
  for (int k = 0; k < 4; ++k) {
    const vec4 other = texelFetch(before, max(int(beside[k]), 0));
    others += beside[k] >= 0.0 && other.z > 0.0 ? vec3(other.xy, 1.0) : vec3(0.0);
  }
  const vec2 around = others.z > 0.0 ? others.xy / others.z : was.xy;
  const bool astray = was.z <= 0.0 || (others.z > 1.0 && distance(was.xy, around) > 0.45 * push.spacing_px);
  const vec2 start = astray ? around : was.xy;

  const int kReach = int(kSkinReach), kAcross = 2 * kReach + 1;
  const float kSamples = float(kSide * kSide), kSpread = kSamples * float(kSide * kSide - 1) / 12.0;  // sum of i^2
  // All points of a subgroup go round as often as the slowest; selection keeps the values of those that are done. (Left to the driver,
  // lavapipe applies the last step of a point that leaves a loop before the others twice.)
  vec2 shift = start;
  float correlation = 0.0, noise = 0.0;
  bool searches = astray, done = false;
  do {
    // The start itself is the first candidate, and the only one where the point is fitted from there.
    vec2 from = start;
    float best = -2.0;
    int k = 0;
    do {
      vec2 candidate = start + push.search_px * vec2((k - 1) % kAcross - kReach, (k - 1) / kAcross - kReach);
      candidate = k == 0 ? start : k > kAcross * kAcross ? vec2(0.0) : candidate;
      const float score = correlation_at(point, rest, candidate) + (k == 0 ? kSkinPrefer : 0.0);
      const bool better = score > best && (searches || k == 0);
      best = better ? score : best;
      from = better ? candidate : from;
      ++k;
    } while (subgroupAny(searches && !done) && k < kAcross * kAcross + 2);

    shift = done ? shift : from;
    uint iterations = 0;
    bool settled = done;
    do {
      const Fit fit = fit_at(point, rest, shift);
      const vec4 m = fit.moments, f = fit.motion;
      const float total = m.w - m.x * m.x / kSamples - (m.y * m.y + m.z * m.z) / kSpread;
      // A window without contrast in the frame has nothing to say, nor one whose contrast is turned round.
      const bool seen = f.y > 1e-3 && f.x > 0.0 && total > 1e-3;
      const vec2 motion = seen ? f.zw / f.y : vec2(0.0);
      const float size = length(motion), most = kSkinLargestStep * float(kStride), correlated = min(f.x * f.x / (first.z * total), 1.0);
      shift -= settled ? vec2(0.0) : motion * min(kSkinStepPart, most / max(size, 1e-9));
      correlation = settled ? correlation : seen && size < kSkinSettled * float(kStride) ? sqrt(correlated) : 0.0;
      noise = settled ? noise : seen ? sqrt(total * (1.0 - correlated) / kSamples) / f.y : 0.0;
      settled = settled || size < kSkinSmallStep * float(kStride) || ++iterations == kSkinIterations;
    } while (subgroupAny(!settled));
    done = searches || correlation >= kSkinSure;
    searches = true;
  } while (subgroupAny(!done));

  const vec2 at = vec2(rest) + shift;
  const bool inside = at.x >= 0.0 && at.y >= 0.0 && at.x <= float(push.width - 1) && at.y <= float(push.height - 1);
  // A lost point stays where it was last seen, until it is found.
  const bool good = inside && correlation >= kSkinLeastCorrelation && shift.x == shift.x && shift.y == shift.y;
  motions[point] = good ? vec4(shift, correlation, noise) : vec4(start, 0.0, 0.0);
}
