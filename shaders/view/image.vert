#version 460
// A rectangle for the raw image, as a strip of four vertices.
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/surface_view.h"

layout(push_constant) uniform Push { ImagePush push; };
layout(location = 0) out vec2 image_px;

void main() {
  const vec2 corner = vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1);
  image_px = corner * vec2(push.width, push.height);
  gl_Position = vec4(mix(vec2(push.left, push.top), vec2(push.right, push.bottom), corner), 0, 1);
}
