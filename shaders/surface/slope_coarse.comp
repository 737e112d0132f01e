// Pixels to the right side of the least-squares surface problem on cells of two by two pixels: the integrals of the slopes across the
// cells' faces (fourth order, as in slope.comp, of which these are the sums over two by two pixels). Pairs inside a cell cancel, so
// half of them are never computed, and a solve that starts on the cells needs nothing finer.
// An invocation owns eight columns and TILE_ROWS rows.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/slope.h"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint TILE_ROWS = 16;
layout(push_constant) uniform Push { SlopePush push; };
#include "shaders/surface/slope_methods.glsl"

layout(binding = FIRST_OUTPUT) writeonly buffer Coarse { vec4 coarse[]; };

// 24 times the integral from sample b to c of the cubic through a, b, c, d.
vec4 pair(vec4 a, vec4 b, vec4 c, vec4 d) { return 13.0 * (b + c) - a - d; }

// Values that do not change from row to row.
struct Columns {
  vec4 faces;           // 1 where the face left of a cell has pixels on both sides
  float last_face;      // the same right of the fourth cell
  vec4 second;          // 1 where a cell's second column is in the frame
  bvec4 beyond;         // the second column is the first one beyond an odd frame
  bool beyond_last;     // the same for the cell to the right
  vec4 cells;           // the scale of a cell's right side, 0 beyond the frame
};

Columns columns_at(int first) {
  ivec4 column = ivec4(0, 2, 4, 6) + first, width = ivec4(push.width);
  Columns c;
  c.faces = vec4(lessThan(column, width));
  c.faces.x = first == 0 ? 0.0 : c.faces.x;
  c.last_face = first + 8 < width.x ? 1.0 : 0.0;
  c.second = vec4(lessThan(column + 1, width));
  c.beyond = equal(column + 1, width);
  c.beyond_last = first + 9 == width.x;
  c.cells = vec4(lessThan(column, width)) * (push.scale / 24.0);
  return c;
}

// What two rows leave for the next two: q of both summed over the columns of each cell, the cells' part along the row, and the
// integral across the face above them.
struct Stream {
  vec4 q0, q1, across, above;
};

vec4 cell_sums(vec4 a, vec4 b, Columns c) { return vec4(a.xz, b.xz) + c.second * vec4(a.yw, b.yw); }

// Takes in rows y and y + 1 and gives the right side of the cells above them.
vec4 take_rows(inout Stream t, inout Clipped clipped, Window window, Columns columns, int tx, int y) {
  int height = int(push.height);
  Slopes upper = slopes_at(window, tx, y, clipped), lower = slopes_at(window, tx, y + 1, clipped);
  bool both = y + 1 < height;
  float second_row = both ? 1.0 : 0.0;
  vec4 p_a = upper.p_a + second_row * lower.p_a, p_b = upper.p_b + second_row * lower.p_b, p_c = upper.p_c + second_row * lower.p_c;
  vec4 b = vec4(p_a.yw, p_b.yw), c = vec4(p_a.z, p_b.xz, p_c.x);
  // Beyond an odd frame's last pixel slopes go on linearly.
  vec4 d = mix(vec4(p_a.w, p_b.yw, p_c.y), 2.0 * c - b, columns.beyond);
  float last_d = columns.beyond_last ? 2.0 * p_c.z - p_c.y : p_c.w;
  vec4 faces = columns.faces * pair(vec4(p_a.xz, p_b.xz), b, c, d);
  float last_face = columns.last_face * (13.0 * (p_c.y + p_c.z) - p_c.x - last_d);

  vec4 q0 = cell_sums(upper.q_a, upper.q_b, columns), q1 = cell_sums(lower.q_a, lower.q_b, columns);
  q1 = both ? q1 : 2.0 * q0 - t.q1;
  vec4 below = (y > 0 && y < height ? 1.0 : 0.0) * pair(t.q0, t.q1, q0, q1);
  vec4 right = columns.cells * (t.across + t.above - below);
  t = Stream(q0, q1, faces - vec4(faces.yzw, last_face), below);
  return right;
}

void main() {
  uint tiles_x = push.coarse_pitch, tiles_y = (push.height + TILE_ROWS - 1) / TILE_ROWS;
  uint tile = gl_GlobalInvocationID.x;
  if (tile >= tiles_x * tiles_y) return;
  int tx = int(tile % tiles_x), y0 = int(tile / tiles_x * TILE_ROWS), end = y0 + int(TILE_ROWS) + 2;
  Columns columns = columns_at(8 * tx);
  const vec4 none = vec4(0.0);
  Stream stream = Stream(none, none, none, none);
  Clipped clipped = none_clipped(y0);
  // Rows are taken two ahead of the cells they finish; the window changes with every eight rows.
  int y = y0 - 2, next = y0;
  do {
    Window window = window_at(tx, y);
    do {
      vec4 right = take_rows(stream, clipped, window, columns, tx, y);
      if (y > y0 && y < int(push.height) + 2) coarse[uint(y - 2) / 2 * push.coarse_pitch + uint(tx)] = right;
      y += 2;
    } while (y < min(next, end));
    next += 8;
  } while (y < end);
  store_clipped(clipped, tile, tx);
}
