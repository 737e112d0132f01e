#version 460
// The raw image, planes of 8 or 16 bit, averaged over the screen pixel's footprint.
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/surface_view.h"

layout(push_constant) uniform Push { ImagePush push; };
layout(binding = 0) uniform usamplerBuffer pixels;
layout(location = 0) in vec2 image_px;
layout(location = 0) out vec4 color;

void main() {
  const int plane = int(push.width * push.height);
  vec3 sum = vec3(0);
  for (uint j = 0; j < push.taps; ++j) {
    for (uint i = 0; i < push.taps; ++i) {
      const vec2 offset = ((vec2(i, j) + 0.5) / float(push.taps) - 0.5) * push.step_px;
      const ivec2 p = clamp(ivec2(image_px + offset), ivec2(0), ivec2(push.width, push.height) - 1);
      const int at = p.y * int(push.width) + p.x;
      const float first = float(texelFetch(pixels, at).x);
      sum += push.channels == 3 ? vec3(first, float(texelFetch(pixels, at + plane).x), float(texelFetch(pixels, at + 2 * plane).x))
                                : vec3(first);
    }
  }
  color = vec4(sum * push.scale / float(push.taps * push.taps), 1);
}
