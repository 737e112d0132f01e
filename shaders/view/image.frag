#version 460
// The raw image, planes of 8 or 16 bit, averaged over the screen pixel's footprint; over it, where it is known, a map of strain.
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/surface_view.h"
#include "shaders/shared/colormap.h"
#include "shaders/shared/texels.glsl"

layout(push_constant) uniform Push { ImagePush push; };
SMALL_TEXELS(0, pixels);
TEXELS(1, float, strain);
layout(location = 0) in vec2 image_px;
layout(location = 0) out vec4 color;

void main() {
  const int plane = int(push.width * push.height), bytes = int(push.pixel_bytes);
  vec3 sum = vec3(0);
  for (uint j = 0; j < push.taps; ++j) {
    for (uint i = 0; i < push.taps; ++i) {
      const vec2 offset = ((vec2(i, j) + 0.5) / float(push.taps) - 0.5) * push.step_px;
      const ivec2 p = clamp(ivec2(image_px + offset), ivec2(0), ivec2(push.width, push.height) - 1);
      const int at = p.y * int(push.width) + p.x;
      const float first = float(small_texel(pixels, at, bytes));
      sum += push.channels == 3 ? vec3(first, float(small_texel(pixels, at + plane, bytes)), float(small_texel(pixels, at + 2 * plane, bytes)))
                                : vec3(first);
    }
  }
  vec3 shade = sum * push.scale / float(push.taps * push.taps);
  if (push.strain_range > 0) {
    const ivec2 p = ivec2(clamp(image_px, vec2(0), vec2(push.width, push.height) - 0.5) * float(push.strain_step));
    const float value = texelFetch(strain, p.y * int(push.strain_pitch) + p.x).x;
    const float t = clamp(value / push.strain_range, 0.0, 1.0);
    const int map = int(push.strain_colours);
    const vec3 over = clamp(vec3(map_red(map, t), map_green(map, t), map_blue(map, t)), 0.0, 1.0);
    if (!isnan(value)) shade = mix(shade, over, 0.6);
  }
  color = vec4(shade, 1);
}
