// The coarser level's correction at one cell, interpolated linearly. Included after `coarse_words` is declared; needs grid.glsl.
float linear_correction(ivec2 cell) {
  ivec2 last = ivec2(push.coarse_width, push.coarse_height) - 1, near = cell >> 1, far = near + 2 * (cell & 1) - 1;
  near = clamp(near, ivec2(0), last);
  far = clamp(far, ivec2(0), last);
  float wx = far_weight(cell.x, int(push.width), push.edge_width), wy = far_weight(cell.y, int(push.height), push.edge_height);
  int pitch = 4 * int(push.coarse_pitch);
  float here = mix(texelFetch(coarse_words, near.y * pitch + near.x).x, texelFetch(coarse_words, near.y * pitch + far.x).x, wx);
  float beyond = mix(texelFetch(coarse_words, far.y * pitch + near.x).x, texelFetch(coarse_words, far.y * pitch + far.x).x, wx);
  return mix(here, beyond, wy);
}
