// Where the points of the skin's pattern are in this frame. An invocation follows one point: it looks around the places where the
// point may be (where it was, where its neighbours went, where it rests) and then fits, a fixed number of times,
//   image(p + shift) = gain * (rest(p) + gradient(p) . step) + offset + tilt . p
// over a window of SIDE x SIDE samples, STRIDE px apart. The untouched window and its gradient come with offset and tilt projected
// out, so that the normal matrix does not change and is inverted on the host (inverse compositional). Variants: WIDE (16-bit
// pixels), PLANES (1 or 3, summed).
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/skin.h"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint SIDE = 17;
layout(constant_id = 4) const uint STRIDE = 1;
layout(binding = 0) uniform usamplerBuffer words;       // R32UI, the frame
layout(binding = 1) uniform samplerBuffer points;       // RGBA32F
layout(binding = 2) uniform samplerBuffer windows;      // RGBA32F: rest, and what gives gain, step x, y; all points' first sample first
layout(binding = 3) uniform samplerBuffer before;       // RGBA32F, the last frame's motions
layout(binding = 4) writeonly buffer Motions { vec4 motions[]; };  // shift x, y, correlation, noise in rest's gray levels
layout(push_constant) uniform Push { SkinPush push; };

const int kSide = int(SIDE), kStride = int(STRIDE), kHalf = kSide / 2;

#ifdef WIDE
const int kWordBits = 1;
#else
const int kWordBits = 2;
#endif

float pixel(int x, int y) {
  x = clamp(x, 0, int(push.width) - 1);
  y = clamp(y, 0, int(push.height) - 1);
  uint sum = 0;
  for (int plane = 0; plane < PLANES; ++plane) {
    uint word = texelFetch(words, (plane * int(push.height) + y) * int(push.pitch) + 4 + (x >> kWordBits)).x;
#ifdef WIDE
    sum += word >> ((x & 1) << 4) & 0xffffu;
#else
    sum += word >> ((x & 3) << 3) & 0xffu;
#endif
  }
  return float(sum);
}

vec4 window_at(int sample_index, int point) { return texelFetch(windows, sample_index * int(push.points) + point); }

// Correlation of every other sample of the window with the frame, shifted by whole pixels.
float correlation(int point, ivec2 rest, vec2 shift) {
  ivec2 at = rest + ivec2(round(shift));
  float base = pixel(at.x, at.y), n = 0.0, a = 0.0, b = 0.0, aa = 0.0, bb = 0.0, ab = 0.0;
  for (int j = 0; j < kSide; j += 2) {
    for (int i = 0; i < kSide; i += 2) {
      float t = window_at(j * kSide + i, point).x, v = pixel(at.x + (i - kHalf) * kStride, at.y + (j - kHalf) * kStride) - base;
      n += 1.0;
      a += t;
      b += v;
      aa += t * t;
      bb += v * v;
      ab += t * v;
    }
  }
  return (ab - a * b / n) * inversesqrt(max((aa - a * a / n) * (bb - b * b / n), 1e-12));
}

void main() {
  int point = int(gl_GlobalInvocationID.x);
  if (point >= int(push.points)) return;
  vec4 first = texelFetch(points, point * 2), beside = texelFetch(points, point * 2 + 1);
  ivec2 rest = ivec2(first.xy);
  vec4 was = texelFetch(before, point);

  // Where the neighbours went, those that were followed. A point far from that has jumped to another one's place.
  vec3 others = vec3(0.0);
  for (int k = 0; k < 4; ++k) {
    vec4 other = texelFetch(before, max(int(beside[k]), 0));
    others += beside[k] >= 0.0 && other.z > 0.0 ? vec3(other.xy, 1.0) : vec3(0.0);
  }
  vec2 around = others.z > 0.0 ? others.xy / others.z : was.xy;
  bool astray = was.z <= 0.0 || (others.z > 1.0 && distance(was.xy, around) > 0.45 * push.spacing_px);
  vec2 start = astray ? around : was.xy;

  float best = correlation(point, rest, start);
  vec2 shift = start;
  best += kSkinPrefer;
  const int kReach = int(kSkinReach), kAcross = 2 * kReach + 1;
  for (int k = 0; k <= kAcross * kAcross; ++k) {
    vec2 candidate = start + push.search_px * vec2(k % kAcross - kReach, k / kAcross - kReach);
    candidate = k == kAcross * kAcross ? vec2(0.0) : candidate;
    float score = correlation(point, rest, candidate);
    bool better = score > best;
    best = better ? score : best;
    shift = better ? candidate : shift;
  }

  const float kSamples = float(kSide * kSide), kSpread = kSamples * float(kSide * kSide - 1) / 12.0;  // sum of i^2
  float correlation = 0.0, noise = 0.0;
  for (uint iteration = 0; iteration < kSkinIterations; ++iteration) {
    vec2 whole = floor(shift), part = shift - whole;
    ivec2 corner = rest + ivec2(whole) - kHalf * kStride;
    float base = pixel(rest.x + int(whole.x), rest.y + int(whole.y));
    vec4 sums = vec4(0.0);  // of v, v x, v y, v^2
    vec4 fit = vec4(0.0);   // with rest; gain, step x, y
    for (int j = 0; j < kSide; ++j) {
      int y = corner.y + j * kStride;
      float above = pixel(corner.x, y), below = pixel(corner.x, y + 1);
      for (int i = 0; i < kSide; ++i) {
        int x = corner.x + i * kStride;
        if (STRIDE != 1 && i > 0) {
          above = pixel(x, y);
          below = pixel(x, y + 1);
        }
        float above_right = pixel(x + 1, y), below_right = pixel(x + 1, y + 1);
        float v = mix(mix(above, above_right, part.x), mix(below, below_right, part.x), part.y) - base;
        sums += v * vec4(1.0, float(i - kHalf), float(j - kHalf), v);
        fit += v * window_at(j * kSide + i, point);
        above = above_right;
        below = below_right;
      }
    }
    float total = sums.w - sums.x * sums.x / kSamples - (sums.y * sums.y + sums.z * sums.z) / kSpread;
    // A window without contrast in the frame has nothing to say, nor one whose contrast is turned round.
    bool seen = fit.y > 1e-3 && fit.x > 0.0 && total > 1e-3;
    vec2 motion = seen ? fit.zw / fit.y : vec2(0.0);
    float size = length(motion), most = kSkinLargestStep * float(kStride), correlated = min(fit.x * fit.x / (first.z * total), 1.0);
    shift -= motion * min(1.0, most / max(size, 1e-9));
    correlation = seen && size < kSkinSettled * float(kStride) ? sqrt(correlated) : 0.0;
    noise = seen ? sqrt(total * (1.0 - correlated) / kSamples) / fit.y : 0.0;
  }
  vec2 at = vec2(rest) + shift;
  bool inside = at.x >= 0.0 && at.y >= 0.0 && at.x <= float(push.width - 1) && at.y <= float(push.height - 1);
  // What is lost stays where it was last seen, until it is found.
  bool good = inside && correlation >= kSkinLeastCorrelation && shift.x == shift.x && shift.y == shift.y;
  motions[point] = good ? vec4(shift, correlation, noise) : vec4(start, 0.0, 0.0);
}
