// Eight columns of a level and what lies beside them, for the kernels that restrict a residual. Included after `push` (GridPush) is
// declared; needs grid.glsl.

// Two texels of a row, and as many cells beside them: columns -2 .. 9.
struct Twelve {
  vec2 l;
  vec4 a, b;
  vec2 r;
};

// Copies edge cells into ghosts.
Twelve with_ghosts(Twelve f, int first) {
  int width = int(push.width);
  f.l.y = choose(first == 0, f.a.x, f.l.y);
  f.a.y = choose(first + 1 < width, f.a.y, f.a.x);
  f.a.z = choose(first + 2 < width, f.a.z, f.a.y);
  f.a.w = choose(first + 3 < width, f.a.w, f.a.z);
  f.b.x = choose(first + 4 < width, f.b.x, f.a.w);
  f.b.y = choose(first + 5 < width, f.b.y, f.b.x);
  f.b.z = choose(first + 6 < width, f.b.z, f.b.y);
  f.b.w = choose(first + 7 < width, f.b.w, f.b.z);
  f.r.x = choose(first + 8 < width, f.r.x, f.b.w);
  f.r.y = choose(first + 9 < width, f.r.y, f.r.x);
  return f;
}

// The solution in columns -1 .. 8.
struct Ten {
  float l;
  vec4 a, b;
  float r;
};

Ten with_ghosts(Ten z, int first) {
  int width = int(push.width);
  z.l = choose(first == 0, z.a.x, z.l);
  z.a.y = choose(first + 1 < width, z.a.y, z.a.x);
  z.a.z = choose(first + 2 < width, z.a.z, z.a.y);
  z.a.w = choose(first + 3 < width, z.a.w, z.a.z);
  z.b.x = choose(first + 4 < width, z.b.x, z.a.w);
  z.b.y = choose(first + 5 < width, z.b.y, z.b.x);
  z.b.z = choose(first + 6 < width, z.b.z, z.b.y);
  z.b.w = choose(first + 7 < width, z.b.w, z.b.z);
  z.r = choose(first + 8 < width, z.r, z.b.w);
  return z;
}

// Couplings of the two cells beside.
struct Beside {
  vec2 left, right, column;
};

struct Columns {
  Couplings a, b;
  Beside l, r;
};

Columns columns_at(int first) {
  Couplings left = couplings(push, first - 4), right = couplings(push, first + 8);
  return Columns(couplings(push, first), couplings(push, first + 4), Beside(left.left.zw, left.right.zw, left.column.zw),
                 Beside(right.left.xy, right.right.xy, right.column.xy));
}

vec2 apply(Beside k, vec3 row, vec2 c, vec2 l, vec2 r, vec2 u, vec2 d) {
  return row.z * (k.left * (c - l) + k.right * (c - r)) + k.column * (row.x * (c - u) + row.y * (c - d));
}

vec4 inside(vec4 v, int first) { return mix(vec4(0.0), v, lessThan(ivec4(0, 1, 2, 3) + first, ivec4(push.width))); }

// Row y's residual of the right side f, summed in pairs along the row. Rows beyond the last have none.
vec4 residual_sums(vec4 f_a, vec4 f_b, Ten above, Ten here, Ten below, Columns k, int tx, int y) {
  int height = int(push.height);
  vec3 row = row_couplings(push, y);
  vec4 up_a = y <= 0 ? here.a : above.a, up_b = y <= 0 ? here.b : above.b;
  vec4 down_a = y >= height - 1 ? here.a : below.a, down_b = y >= height - 1 ? here.b : below.b;
  vec4 a = f_a - apply(k.a, row, here.a, vec4(here.l, here.a.xyz), vec4(here.a.yzw, here.b.x), up_a, down_a);
  vec4 b = f_b - apply(k.b, row, here.b, vec4(here.a.w, here.b.xyz), vec4(here.b.yzw, here.r), up_b, down_b);
  a = inside(a, 8 * tx);
  b = inside(b, 8 * tx + 4);
  return y < height ? vec4(a.xz + a.yw, b.xz + b.yw) : vec4(0.0);
}
