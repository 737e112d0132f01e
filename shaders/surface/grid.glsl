// Cell-centred grids with natural boundary: the ghost beyond an edge equals the cell at the edge, so the operator
//   A x = across (2 x - left - right) + down (2 x - above - below)
// needs no border code once ghosts are filled in. Halving an odd level leaves a last column or row of narrower cells.
#include "shaders/shared/grid.h"

// One of two, without a branch: there are dozens in a loop, and SwiftShader's compiler follows every path through it, for minutes.
float choose(bool first, float a, float b) { return mix(b, a, first); }
vec2 choose(bool first, vec2 a, vec2 b) { return mix(b, a, bvec2(first)); }
vec4 choose(bool first, vec4 a, vec4 b) { return mix(b, a, bvec4(first)); }

// Columns -2 .. 5 around a texel of four cells.
struct Eight {
  vec4 a, b;
};

vec4 mid(Eight e) { return vec4(e.a.zw, e.b.xy); }

// Copies edge cells into ghosts: `first` is the column of cell 0, `width` the number of columns.
Eight with_ghosts(Eight e, int first, int width) {
  e.a.y = choose(first == 0, e.a.z, e.a.y);
  e.a.w = choose(first + 1 < width, e.a.w, e.a.z);
  e.b.x = choose(first + 2 < width, e.b.x, e.a.w);
  e.b.y = choose(first + 3 < width, e.b.y, e.b.x);
  e.b.z = choose(first + 4 < width, e.b.z, e.b.y);
  e.b.w = choose(first + 5 < width, e.b.w, e.b.z);
  return e;
}

// Couplings of a texel's four cells to their neighbours. Only the last column and row can have cells of another size: a narrower
// cell is nearer to its neighbour and has shorter faces above and below.
struct Couplings {
  vec4 left, right, column;
};

vec4 at_column(ivec4 columns, int which, float value) { return mix(vec4(1.0), vec4(value), equal(columns, ivec4(which))); }

Couplings couplings(GridPush g, int first) {
  ivec4 columns = ivec4(0, 1, 2, 3) + first;
  int last = int(g.width) - 1;
  float nearer = 2.0 / (1.0 + g.edge_width);
  return Couplings(g.across * at_column(columns, last, nearer), g.across * at_column(columns, last - 1, nearer),
                   g.down * at_column(columns, last, g.edge_width));
}

// Couplings of row y: to the row above, to the row below, and the height of the row's cells.
vec3 row_couplings(GridPush g, int y) {
  int last = int(g.height) - 1;
  float nearer = 2.0 / (1.0 + g.edge_height);
  return vec3(y == last ? nearer : 1.0, y == last - 1 ? nearer : 1.0, y == last ? g.edge_height : 1.0);
}

// A x for four cells c with their neighbours.
vec4 apply(Couplings k, vec3 row, vec4 c, vec4 l, vec4 r, vec4 u, vec4 d) {
  return row.z * (k.left * (c - l) + k.right * (c - r)) + k.column * (row.x * (c - u) + row.y * (c - d));
}

// Linear interpolation between the two nearest coarse cells: the weight of the farther one is 1/4 but at the far edge.
float far_weight(int i, int n, float edge) {
  bool odd = (n & 1) == 1;
  float inside = choose(i == n - 2, choose(odd, 1.0 / (2.0 + edge), edge / (3.0 + edge)), 0.25);
  return choose(odd && i == n - 1, 0.0, inside);
}

// Weights for columns -2 .. 5.
Eight far_weights(GridPush g, int first) {
  int n = int(g.width);
  float e = g.edge_width;
  return Eight(vec4(far_weight(first - 2, n, e), far_weight(first - 1, n, e), far_weight(first, n, e), far_weight(first + 1, n, e)),
               vec4(far_weight(first + 2, n, e), far_weight(first + 3, n, e), far_weight(first + 4, n, e),
                    far_weight(first + 5, n, e)));
}

// Six coarse columns around the two beneath a fine texel: l = (-2, -1), c = (0, 1), r = (2, 3).
struct Six {
  vec2 l, c, r;
};

Six with_ghosts(Six s, int first, int width) {
  s.l.y = choose(first == 0, s.c.x, s.l.y);
  s.l.x = choose(first == 0, s.c.x, s.l.x);
  s.c.y = choose(first + 1 < width, s.c.y, s.c.x);
  s.r.x = choose(first + 2 < width, s.r.x, s.c.y);
  s.r.y = choose(first + 3 < width, s.r.y, s.r.x);
  return s;
}

// Interpolates along the row.
Eight widen(Six s, Eight far) {
  return Eight(mix(vec4(s.l.yy, s.c.xx), vec4(s.l.x, s.c.x, s.l.y, s.c.y), far.a),
               mix(vec4(s.c.yy, s.r.xx), vec4(s.c.x, s.r.x, s.c.y, s.r.y), far.b));
}

// Interpolates between rows.
Eight blend(Eight near, Eight far, float weight) { return Eight(mix(near.a, far.a, weight), mix(near.b, far.b, weight)); }
