// Cell-centred grids with natural boundary: the ghost beyond an edge equals the cell at the edge, so the operator
//   A x = across (2 x - left - right) + down (2 x - above - below)
// needs no border code once ghosts are filled in.
#include "shaders/shared/grid.h"

// Columns -2 .. 5 around a texel of four cells.
struct Eight {
  vec4 a, b;
};

vec4 mid(Eight e) { return vec4(e.a.zw, e.b.xy); }

// Copies edge cells into ghosts: `first` is the column of cell 0, `width` the number of columns.
Eight with_ghosts(Eight e, int first, int width) {
  e.a.y = first == 0 ? e.a.z : e.a.y;
  e.a.w = first + 1 < width ? e.a.w : e.a.z;
  e.b.x = first + 2 < width ? e.b.x : e.a.w;
  e.b.y = first + 3 < width ? e.b.y : e.b.x;
  e.b.z = first + 4 < width ? e.b.z : e.b.y;
  e.b.w = first + 5 < width ? e.b.w : e.b.z;
  return e;
}

// Six coarse columns around the two beneath a fine texel: l = (-2, -1), c = (0, 1), r = (2, 3).
struct Six {
  vec2 l, c, r;
};

Six with_ghosts(Six s, int first, int width) {
  s.l.y = first == 0 ? s.c.x : s.l.y;
  s.l.x = first == 0 ? s.c.x : s.l.x;
  s.c.y = first + 1 < width ? s.c.y : s.c.x;
  s.r.x = first + 2 < width ? s.r.x : s.c.y;
  s.r.y = first + 3 < width ? s.r.y : s.r.x;
  return s;
}

// Bilinear interpolation, 3/4 to 1/4 in each direction: here first along the row.
Eight widen(Six s) {
  Eight e;
  e.a = 0.75 * vec4(s.l.yy, s.c.xx) + 0.25 * vec4(s.l.x, s.c.x, s.l.y, s.c.y);
  e.b = 0.75 * vec4(s.c.yy, s.r.xx) + 0.25 * vec4(s.c.x, s.r.x, s.c.y, s.r.y);
  return e;
}

Eight blend(Eight near, Eight far) { return Eight(0.75 * near.a + 0.25 * far.a, 0.75 * near.b + 0.25 * far.b); }
