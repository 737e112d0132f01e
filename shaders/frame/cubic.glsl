// Heights of a coarser level at the cells of a finer one. A fine cell lies a quarter of a coarse cell off the middle of its own, so
// the cubic through the four coarse cells around it gives them the weights (-5, 35, 105, -7) / 128, from the far side to the near
// one. Beyond an edge heights go on linearly, so that a tilt stays a tilt.

// Weights of: two cells off on the far side, the far neighbour, the cell itself, the near neighbour. Beside an edge whose last coarse
// cell is narrower than the others four cells are not evenly spaced: there the two nearest interpolate linearly.
vec4 cubic(int i, int n, float edge) {
  float far = far_weight(i, n, edge);
  bool uneven = i >= n - 5 && ((n & 1) == 1 || edge != 1.0);
  return choose(uneven, vec4(0.0, far, 1.0 - far, 0.0), vec4(-5.0, 35.0, 105.0, -7.0) / 128.0);
}

// For four columns, two apart.
struct Cubics {
  vec4 far2, far, here, near;
};

Cubics cubics(int first, int n, float edge) {
  mat4 w = transpose(mat4(cubic(first, n, edge), cubic(first + 2, n, edge), cubic(first + 4, n, edge), cubic(first + 6, n, edge)));
  return Cubics(w[0], w[1], w[2], w[3]);
}

vec4 blend(Cubics w, vec4 far2, vec4 far, vec4 here, vec4 near) {
  return w.far2 * far2 + w.far * far + w.here * here + w.near * near;
}

Eight blend(vec4 w, Eight far2, Eight far, Eight here, Eight near) {
  return Eight(w.x * far2.a + w.y * far.a + w.z * here.a + w.w * near.a, w.x * far2.b + w.y * far.b + w.z * here.b + w.w * near.b);
}

// The row after `here`, `before` being the one before it.
Eight onward(Eight here, Eight before) { return Eight(2.0 * here.a - before.a, 2.0 * here.b - before.b); }
Eight choose(bool first, Eight a, Eight b) { return Eight(choose(first, a.a, b.a), choose(first, a.b, b.b)); }
