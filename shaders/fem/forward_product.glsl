// The stiffness product in gather form. An invocation owns a column of nodes over a few planes and marches down: nine nodes a
// plane, summed and subtracted with those of the plane above; from these the moments of the four cells around and between, what
// they push back with (as engine/fem/linear/stiffness_row.cpp), and of that the node's shares above and below.
// The kernel defines `void finish(int n, Vector x, Vector f)`, called for node n with its displacement and the force on it.

#include "shaders/shared/texels.glsl"

layout(constant_id = 3) const bool LAYERED = false;  // layers of unequal height
TEXELS(1, vec4, moduli);

#ifdef WIDE
#define Real double
#define Vector dvec3
TEXELS(0, uvec4, nodes);
TEXELS(2, uvec4, layers);  // height over that of the stiffness numbers, and one over it
layout(push_constant) uniform Push { ForwardWidePush push; };
#include "shaders/fem/wide_vector.glsl"
#define NODE(n) wide_at(nodes, n)
dvec2 layer_at(int k) {
  uvec4 h = texelFetch(layers, k);
  return dvec2(packDouble2x32(h.xy), packDouble2x32(h.zw));
}
#else
#define Real float
#define Vector vec3
TEXELS(0, vec4, nodes);
TEXELS(2, vec4, layers);
layout(push_constant) uniform Push { ForwardStepPush push; };
#define NODE(n) texelFetch(nodes, n).xyz
vec2 layer_at(int k) { return texelFetch(layers, k).xy; }
#endif

void finish(int n, Vector x, Vector f);

// Made once before the march: nothing takes them out of the loop by itself.
struct Stiffness {
  Real bulk, twice_mu, gx, gy, gz, xx, yy, zz, xy, xz, yz;
  Vector of_xy, of_xz, of_yz, of_xyz;          // on a component's own mixed moment
  Real cross_xy, cross_xz, cross_yz;           // on another's of the same kind
  Real turned_xy, turned_xz, turned_yz;        // on another's of another kind
};
// `thin`: one over the layer's relative height; the height itself goes into the modulus.
Stiffness stiffness(Real thin) {
  const Real third = Real(1) / Real(3), f43 = Real(4) / Real(3), f23 = Real(2) / Real(3);
  Stiffness s;
  s.bulk = push.stiffness.bulk;
  s.twice_mu = push.stiffness.twice_mu;
  s.gx = push.stiffness.gx;
  s.gy = push.stiffness.gy;
  s.gz = push.stiffness.gz * thin;
  s.xx = push.stiffness.xx;
  s.yy = push.stiffness.yy;
  s.zz = push.stiffness.zz * (thin * thin);
  s.xy = push.stiffness.xy;
  s.xz = push.stiffness.xz * thin;
  s.yz = push.stiffness.yz * thin;
  s.of_xy = third * Vector(f43 * s.xx + s.yy, f43 * s.yy + s.xx, s.xx + s.yy);
  s.of_xz = third * Vector(f43 * s.xx + s.zz, s.xx + s.zz, f43 * s.zz + s.xx);
  s.of_yz = third * Vector(s.yy + s.zz, f43 * s.yy + s.zz, f43 * s.zz + s.yy);
  s.of_xyz = third * third * Vector(f43 * s.xx + s.yy + s.zz, f43 * s.yy + s.xx + s.zz, f43 * s.zz + s.xx + s.yy);
  s.cross_xy = third * s.xy;
  s.cross_xz = third * s.xz;
  s.cross_yz = third * s.yz;
  s.turned_xy = f23 * s.cross_xy;
  s.turned_xz = f23 * s.cross_xz;
  s.turned_yz = f23 * s.cross_yz;
  return s;
}

// Moments x, y, z, ... of the displacement in a cell whose corner on the side (sx, sy) the node is. `middle`: the force on that
// corner as the mean of upper and lower, `tilt`: half their difference.
void push_back(Stiffness s, Real e, Real sx, Real sy, Vector x, Vector y, Vector z, Vector xy, Vector xz, Vector yz, Vector xyz,
               inout Vector middle, inout Vector tilt) {
  Real dx = s.gx * x.x, dy = s.gy * y.y, dz = s.gz * z.z;
  Real pressure = s.bulk * ((dx + dy) + dz);
  Vector fx = Vector(s.gx * (pressure + s.twice_mu * dx), s.xy * y.x + s.xx * x.y, s.xz * z.x + s.xx * x.z);
  Vector fy = Vector(s.yy * y.x + s.xy * x.y, s.gy * (pressure + s.twice_mu * dy), s.yz * z.y + s.yy * y.z);
  Vector fz = Vector(s.zz * z.x + s.xz * x.z, s.zz * z.y + s.yz * y.z, s.gz * (pressure + s.twice_mu * dz));
  Vector fxy = s.of_xy * xy + Vector(-s.turned_xz * yz.z, -s.turned_yz * xz.z, s.cross_xz * yz.x + s.cross_yz * xz.y);
  Vector fxz = s.of_xz * xz + Vector(-s.turned_xy * yz.y, s.cross_xy * yz.x + s.cross_yz * xy.z, -s.turned_yz * xy.y);
  Vector fyz = s.of_yz * yz + Vector(s.cross_xy * xz.y + s.cross_xz * xy.z, -s.turned_xy * xz.x, -s.turned_xz * xy.x);
  Vector fxyz = s.of_xyz * xyz;
  middle += e * ((sx * fx + sy * fy) + (sx * sy) * fxy);
  tilt += e * ((fz + sx * fxz) + (sy * fyz + (sx * sy) * fxyz));
}

// A node and its eight neighbours in a plane: row by row.
struct Nine {
  Vector a, b, c, d, e, f, g, h, i;
};
Nine nine(int n) {
  int row = int(push.row);
  return Nine(NODE(n - row - 1), NODE(n - row), NODE(n - row + 1), NODE(n - 1), NODE(n), NODE(n + 1), NODE(n + row - 1),
              NODE(n + row), NODE(n + row + 1));
}
// Sums and differences of neighbours along x.
struct Pairs {
  Vector sum_a, sum_b, sum_d, sum_e, sum_g, sum_h;
  Vector step_a, step_b, step_d, step_e, step_g, step_h;
};
Pairs pairs(Nine v) {
  return Pairs(v.a + v.b, v.b + v.c, v.d + v.e, v.e + v.f, v.g + v.h, v.h + v.i, v.b - v.a, v.c - v.b, v.e - v.d, v.f - v.e, v.h - v.g,
               v.i - v.h);
}
Nine plus(Nine v, Nine w) {
  return Nine(v.a + w.a, v.b + w.b, v.c + w.c, v.d + w.d, v.e + w.e, v.f + w.f, v.g + w.g, v.h + w.h, v.i + w.i);
}
Nine minus(Nine v, Nine w) {
  return Nine(v.a - w.a, v.b - w.b, v.c - w.c, v.d - w.d, v.e - w.e, v.f - w.f, v.g - w.g, v.h - w.h, v.i - w.i);
}

void march() {
  int column = int(gl_GlobalInvocationID.x), plane = int(push.plane);
  int first = int(gl_GlobalInvocationID.y * push.segment), end = min(first + int(push.segment), int(push.planes));
  if (column >= plane) return;
  int n = int(push.lead) + (first - 1) * plane + column;
  Nine above = nine(n);
  Vector carry = Vector(0);
  Stiffness s = stiffness(Real(1));
  for (int k = first; k <= end; ++k) {
    Nine below = nine(n + plane);
    vec4 cells = texelFetch(moduli, n);
    Real ea = Real(cells.x), eb = Real(cells.y), ed = Real(cells.z), ee = Real(cells.w);
    if (LAYERED) {
      Real height = layer_at(k - 1 + int(kForwardSpareLayers)).x, thin = layer_at(k - 1 + int(kForwardSpareLayers)).y;
      ea *= height;
      eb *= height;
      ed *= height;
      ee *= height;
      s = stiffness(thin);
    }
    Pairs t = pairs(plus(above, below)), z = pairs(minus(below, above));
    Vector middle = Vector(0), tilt = Vector(0);
    const Real one = Real(1);
    push_back(s, ea, one, one, t.step_a + t.step_d, t.sum_d - t.sum_a, z.sum_a + z.sum_d, t.step_d - t.step_a, z.step_a + z.step_d,
              z.sum_d - z.sum_a, z.step_d - z.step_a, middle, tilt);
    push_back(s, eb, -one, one, t.step_b + t.step_e, t.sum_e - t.sum_b, z.sum_b + z.sum_e, t.step_e - t.step_b, z.step_b + z.step_e,
              z.sum_e - z.sum_b, z.step_e - z.step_b, middle, tilt);
    push_back(s, ed, one, -one, t.step_d + t.step_g, t.sum_g - t.sum_d, z.sum_d + z.sum_g, t.step_g - t.step_d, z.step_d + z.step_g,
              z.sum_g - z.sum_d, z.step_g - z.step_d, middle, tilt);
    push_back(s, ee, -one, -one, t.step_e + t.step_h, t.sum_h - t.sum_e, z.sum_e + z.sum_h, t.step_h - t.step_e, z.step_e + z.step_h,
              z.sum_h - z.sum_e, z.step_h - z.step_e, middle, tilt);
    if (k > first) finish(n, above.e, carry + (middle - tilt));
    carry = middle + tilt;
    above = below;
    n += plane;
  }
}
bool owns_column() { return gl_GlobalInvocationID.x < push.plane; }
// Where an invocation's partial sums go.
uint sums_place() { return gl_GlobalInvocationID.y * push.plane + gl_GlobalInvocationID.x; }
