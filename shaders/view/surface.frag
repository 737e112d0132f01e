#version 460
// Colour by depth, strain, pressure or shear over pressure, light by slope, all from the full map: a coarse mesh still
// shows every texel.
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/colormap.h"
#include "shaders/shared/surface_view.h"

layout(push_constant) uniform Push { SurfacePush push; };
#include "shaders/view/surface_depth.glsl"

TEXELS(1, float, load_map);  // pressure (MPa) or shear over it, over the same frame, of another size
layout(constant_id = 0) const int kMap = PALPATE_MAP_VIRIDIS;
layout(constant_id = 1) const int kShown = PALPATE_SHOWN_DEPTH;
layout(constant_id = 2) const int kFine = 1;  // 0: a pixel covers several texels

layout(location = 0) in vec2 texel;
layout(location = 1) in vec3 world_mm;
layout(location = 2) in float open_sky;
layout(location = 0) out vec4 color;

const vec3 kLight = normalize(vec3(-0.50, 0.55, 0.80));
const float kAmbient = 0.55;

// Between the four texels around the same place of the frame.
float load_at(vec2 place) {
  const ivec2 size = ivec2(push.load_size & 0xffffu, push.load_size >> 16);
  const vec2 at = (place + 0.5) * vec2(size) / vec2(push.width, push.height) - 0.5;
  const ivec2 a = clamp(ivec2(floor(at)), ivec2(0), size - 1), b = min(a + 1, size - 1);
  const vec2 f = clamp(at - vec2(a), 0.0, 1.0);
  return mix(mix(texelFetch(load_map, a.y * size.x + a.x).x, texelFetch(load_map, a.y * size.x + b.x).x, f.x),
             mix(texelFetch(load_map, b.y * size.x + a.x).x, texelFetch(load_map, b.y * size.x + b.x).x, f.x), f.y);
}

// Depth and slope where a pixel is smaller than a texel or as large: central differences at the four texels
// around, blended, for a slope without facets.
void look_closely(out float depth, out vec2 slope) {
  const ivec2 p = ivec2(floor(texel));
  const vec2 f = texel - vec2(p);
  const float d00 = depth_at(p), d10 = depth_at(p + ivec2(1, 0));
  const float d01 = depth_at(p + ivec2(0, 1)), d11 = depth_at(p + ivec2(1, 1));
  const vec2 gx0 = vec2(d10 - depth_at(p + ivec2(-1, 0)), depth_at(p + ivec2(2, 0)) - d00);
  const vec2 gx1 = vec2(d11 - depth_at(p + ivec2(-1, 1)), depth_at(p + ivec2(2, 1)) - d01);
  const vec2 gy0 = vec2(d01 - depth_at(p + ivec2(0, -1)), d11 - depth_at(p + ivec2(1, -1)));
  const vec2 gy1 = vec2(depth_at(p + ivec2(0, 2)) - d00, depth_at(p + ivec2(1, 2)) - d10);
  const vec2 gx = mix(gx0, gx1, f.y);
  const vec2 gy = mix(gy0, gy1, f.y);
  depth = mix(mix(d00, d10, f.x), mix(d01, d11, f.x), f.y);
  slope = 0.5 * vec2(mix(gx.x, gx.y, f.x), mix(gy.x, gy.y, f.x)) / push.pitch_mm;
}

// The same over the texels that the pixel covers, from five of them.
void look_from_afar(out float depth, out vec2 slope) {
  const int spread = int(push.lit_spread >> 1);
  const ivec2 p = ivec2(texel + 0.5);
  const float left = depth_at(p - ivec2(spread, 0)), right = depth_at(p + ivec2(spread, 0));
  const float above = depth_at(p - ivec2(0, spread)), below = depth_at(p + ivec2(0, spread));
  depth = 0.2 * (depth_at(p) + left + right + above + below);
  slope = vec2(right - left, below - above) / (2.0 * float(spread) * push.pitch_mm);
}

void main() {
  float depth;
  vec2 slope;
  if (kFine != 0) look_closely(depth, slope);
  else look_from_afar(depth, slope);

  float value = depth;
  if (kShown == PALPATE_SHOWN_PRESSURE || kShown == PALPATE_SHOWN_FRICTION) value = load_at(texel);
  if (kShown == PALPATE_SHOWN_STRAIN) value = sqrt(1.0 + dot(slope, slope)) - 1.0;
  const float t = clamp(value / push.colour_range, 0.0, 1.0);
  vec3 shade = clamp(vec3(map_red(kMap, t), map_green(kMap, t), map_blue(kMap, t)), 0.0, 1.0);

  if (push.grid_mm > 0) {
    const vec2 lines = world_mm.xy / push.grid_mm;
    const vec2 away = abs(fract(lines - 0.5) - 0.5) / max(fwidth(lines), vec2(1e-6));
    const float line = 1.0 - min(min(away.x, away.y), 1.0);
    shade = mix(shade, vec3(1.0), 0.16 * line);
  }
  if ((push.lit_spread & 1u) != 0u) {
    // Scaled so that a level facet keeps the colour of the colour bar.
    vec3 normal = normalize(vec3(slope.x * push.exaggeration, -slope.y * push.exaggeration, 1.0));
    const vec3 eye = normalize(vec3(push.eye_x_mm, push.eye_y_mm, push.eye_z_mm) - world_mm);
    const float side = gl_FrontFacing ? 1.0 : -1.0;
    normal *= side;
    const vec3 light = vec3(kLight.xy, side * kLight.z);
    const float diffuse = max(dot(normal, light), 0.0) / kLight.z;
    float gloss = max(dot(normal, normalize(light + eye)), 0.0);
    for (int i = 0; i < 5; ++i) gloss *= gloss;  // to the power 32, cheaper than pow
    const float ambient = kAmbient * (gl_FrontFacing ? open_sky : 1.0);
    shade = shade * (ambient + (1.0 - kAmbient) * min(diffuse, 1.35)) + 0.14 * gloss;
  }
  // The edge of the pad, smooth with one sample a pixel.
  const vec2 to_edge = min(texel, vec2(push.width, push.height) - 1.0 - texel) / max(fwidth(texel), vec2(1e-6));
  color = vec4(shade, clamp(min(to_edge.x, to_edge.y), 0.0, 1.0));
}
