// One row of the coarser level, interpolated along the row to the columns around fine texel tx. Included after `push` (GridPush) and
// `coarse_pairs` (the coarser level's solution, two cells to a texel) are declared.
Eight coarse_row(int tx, int k, Eight far) {
  int row = clamp(k, 0, int(push.coarse_height) - 1) * int(push.coarse_pitch) * 2;
  int last = int(push.coarse_pitch) * 2 - 1;
  Six s;
  s.l = texelFetch(coarse_pairs, row + max(tx - 1, 0)).xy;
  s.c = texelFetch(coarse_pairs, row + tx).xy;
  s.r = texelFetch(coarse_pairs, row + min(tx + 1, last)).xy;
  return widen(with_ghosts(s, 2 * tx, int(push.coarse_width)), far);
}
