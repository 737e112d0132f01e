// A pixel of the present frame seen at its place in the key frame by a guess: what is left over of its depth (Catmull-Rom), and
// both frames' slopes there (the key frame's bilinear). The same arithmetic as engine/motion/host_sums.cpp.
#include "shaders/shared/object_motion.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { MotionPush push; };
// Of a level: depth, slopes along x and y, variance (-1 outside the contact), one plane behind the other.
TEXELS(0, float, key_planes);
TEXELS(1, float, planes);
TEXELS(2, uint, inside);  // column, and row << 16, of each pixel inside the contact

struct Pixel {
  float residual;   // times the root of the inverse variance
  float inverse_variance;  // 0: cannot be compared
  vec3 place;       // in the key frame, from the guess's middle, mm
  vec2 key_slope, slope;
};

vec4 cubic(float t) {
  return vec4(t * (-0.5 + t * (1.0 - 0.5 * t)), 1.0 + t * t * (-2.5 + 1.5 * t), t * (0.5 + t * (2.0 - 1.5 * t)),
              t * t * (-0.5 + 0.5 * t));
}

float key_at(int at) { return texelFetch(key_planes, at).x; }
float bilinear(int here, vec2 part) {
  int below = here + int(push.key_width);
  return mix(mix(key_at(here), key_at(here + 1), part.x), mix(key_at(below), key_at(below + 1), part.x), part.y);
}

Pixel compared(uint i) {
  uint where = texelFetch(inside, int(push.first_inside + i)).x;
  uint column = where & 0xffffu, row = where >> 16;
  int at = int(push.first + row * push.width + column), plane = int(push.pixels);
  vec3 moved = vec3(push.origin[0] + float(column) * push.pitch, push.origin[1] + float(row) * push.pitch,
                    push.origin[2] + texelFetch(planes, at).x);
  mat3 turn = mat3(push.back[0], push.back[1], push.back[2], push.back[3], push.back[4], push.back[5], push.back[6],
                   push.back[7], push.back[8]);  // its transpose's columns are the rows
  Pixel p;
  p.place = moved * turn;
  vec2 px = (p.place.xy + vec2(push.middle[0], push.middle[1])) * push.per_pitch;
  // Places beyond the map are read within it, and left out.
  vec2 most = vec2(float(push.key_width), float(push.key_height)) - 3.0;
  vec2 held = min(max(px, 1.0), most);
  ivec2 left = ivec2(held);
  vec2 part = held - vec2(left);
  int width = int(push.key_width), key_plane = width * int(push.key_height);
  int here = int(push.key_first) + left.y * width + left.x;
  float there_variance =
      key_at(here + 3 * key_plane + (part.x >= 0.5 ? 1 : 0) + (part.y >= 0.5 ? width : 0));
  vec4 across = cubic(part.x), down = cubic(part.y);
  float there = 0.0;
  for (int k = 0; k < 4; ++k) {
    int d = here + (k - 1) * width - 1;
    there += down[k] * dot(across, vec4(key_at(d), key_at(d + 1), key_at(d + 2), key_at(d + 3)));
  }
  p.key_slope = vec2(bilinear(here + key_plane, part), bilinear(here + 2 * key_plane, part));
  vec3 normal = vec3(texelFetch(planes, at + plane).x, texelFetch(planes, at + 2 * plane).x, -1.0) * turn;
  float steep = -1.0 / min(normal.z, -0.05);  // what is seen from the side is left out
  p.slope = normal.xy * steep;
  bool good = all(greaterThanEqual(px, vec2(1.0))) && all(lessThan(px, most)) && there_variance > 0.0 && normal.z <= -0.05;
  p.inverse_variance = good ? 1.0 / (max(there_variance, 0.0) + texelFetch(planes, at + 3 * plane).x) : 0.0;
  p.residual = (there - push.middle[2] - p.place.z) * sqrt(p.inverse_variance);
  return p;
}
