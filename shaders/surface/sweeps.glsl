// Rows in and out of the kernels that sweep. Included after `right_texels`, `right_pairs` (the right side) and `result` (the solution)
// are declared; needs columns.glsl.

// Rows beyond the frame repeat its edge.
Twelve right_row(int tx, int y) {
  int pitch = int(push.pitch), row = clamp(y, 0, int(push.height) - 1) * pitch, last = pitch - 1;
  int first = 8 * tx;
  Twelve f;
  f.l = texelFetch(right_pairs, 2 * row + max(4 * tx - 1, 0)).xy;
  f.a = texelFetch(right_texels, row + 2 * tx);
  f.b = texelFetch(right_texels, row + min(2 * tx + 1, last));
  f.r = texelFetch(right_pairs, 2 * row + min(4 * tx + 4, 2 * last + 1)).xy;
  return with_ghosts(f, first);
}

void put(Ten z, int tx, int y) {
  uint texel = uint(y) * push.pitch + 2 * uint(tx);
  if (y < int(push.height)) {
    result[texel] = z.a;
    if (2 * uint(tx) + 1 < push.pitch) result[texel + 1] = z.b;
  }
}
