// A coarser level's correction at one cell of a level of `size` cells, whose last ones have the size `edge`; interpolated linearly.
// Included after CORRECTION_WORDS, the coarser level's solution, is defined; needs grid.glsl.
float linear_correction(ivec2 cell, ivec2 size, vec2 edge) {
  ivec2 coarse = (size + 1) / 2, last = coarse - 1, near = cell >> 1, far = near + 2 * (cell & 1) - 1;
  near = clamp(near, ivec2(0), last);
  far = clamp(far, ivec2(0), last);
  float wx = far_weight(cell.x, size.x, edge.x), wy = far_weight(cell.y, size.y, edge.y);
  ivec2 row = ivec2(near.y, far.y) * ((coarse.x + 3) / 4 * 4);
  vec2 here = vec2(texelFetch(CORRECTION_WORDS, row.x + near.x).x, texelFetch(CORRECTION_WORDS, row.x + far.x).x);
  vec2 beyond = vec2(texelFetch(CORRECTION_WORDS, row.y + near.x).x, texelFetch(CORRECTION_WORDS, row.y + far.x).x);
  return mix(mix(here.x, here.y, wx), mix(beyond.x, beyond.y, wx), wy);
}
