// Double precision products where displacements are free. BALANCE: load - K u, and the sums of the squares of all forces (loads,
// and supports' where fixed) and of those out of balance. Else: K p, and the sums of p times it.
#version 460
#extension GL_GOOGLE_include_directive : require
#define WIDE
#include "shaders/shared/forward.h"
#include "shaders/shared/texels.glsl"
#include "shaders/fem/forward_product.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
TEXELS(3, vec4, inverse);
layout(binding = 4) writeonly buffer Product { uvec4 product[]; };
layout(binding = 5) writeonly buffer Sums { uvec4 sums[]; };
#ifdef BALANCE
TEXELS(6, uvec4, load);
#endif
dvec2 sum = dvec2(0.0);

void finish(int n, dvec3 x, dvec3 f) {
  uint free = uint(texelFetch(inverse, 2 * (n - int(push.lead))).w);
  bool free_x = (free & 1) != 0, free_y = (free & 2) != 0, free_z = (free & 4) != 0;
#ifdef BALANCE
  dvec3 given = wide_at(load, n), r = given - f;
  dvec3 all = dvec3(free_x ? given.x : f.x, free_y ? given.y : f.y, free_z ? given.z : f.z);
  r = dvec3(free_x ? r.x : 0.0lf, free_y ? r.y : 0.0lf, free_z ? r.z : 0.0lf);
  sum += dvec2(dot(all, all), dot(r, r));
#else
  dvec3 r = dvec3(free_x ? f.x : 0.0lf, free_y ? f.y : 0.0lf, free_z ? f.z : 0.0lf);
  sum.x += dot(x, r);
#endif
  product[2 * n] = uvec4(unpackDouble2x32(r.x), unpackDouble2x32(r.y));
  product[2 * n + 1] = uvec4(unpackDouble2x32(r.z), 0, 0);
}

void main() {
  march();
  if (owns_column())
    sums[sums_place()] = uvec4(unpackDouble2x32(sum.x), unpackDouble2x32(sum.y));
}
