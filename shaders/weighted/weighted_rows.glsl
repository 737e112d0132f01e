// Rows of eight cells and their neighbours, and the operator on them. The weight of a cell's right face is in `wx`, of its lower
// face in `wy`; faces on the border weigh 0, so that values beyond it count for nothing and no ghosts are needed.
// Included after `push` (WeightedPush) and the bindings wx_texels, wx_words, wy_texels are declared.

// Columns -1 .. 8 around two texels.
struct Ten {
  float l;
  vec4 a, b;
  float r;
};

// Two texels.
struct Pair {
  vec4 a, b;
};

// Faces of one row: right faces of columns -1 .. 7, lower faces of columns 0 .. 7.
struct Faces {
  float l;
  vec4 xa, xb, ya, yb;
};

int row_start(int y) { return clamp(y, 0, int(push.height) - 1) * int(push.pitch); }

int second_texel(int tx, int y) { return row_start(y) + min(2 * tx + 1, int(push.pitch) - 1); }
int left_word(int tx, int y) { return 4 * row_start(y) + max(8 * tx - 1, 0); }
int right_word(int tx, int y) { return 4 * row_start(y) + min(8 * tx + 8, 4 * int(push.pitch) - 1); }

#define pair_at(texels, tx, y) Pair(texelFetch(texels, row_start(y) + 2 * (tx)), texelFetch(texels, second_texel(tx, y)))
#define ten_at(texels, words, tx, y)                                                      \
  Ten(texelFetch(words, left_word(tx, y)).x, texelFetch(texels, row_start(y) + 2 * (tx)), \
      texelFetch(texels, second_texel(tx, y)), texelFetch(words, right_word(tx, y)).x)

// KNOWN_ONLY: faces that say nothing weigh 0. UNKNOWN_ONLY: all others do.
#if defined(KNOWN_ONLY)
vec4 weight(vec4 w) { return max(w, vec4(0.0)); }
#elif defined(UNKNOWN_ONLY)
vec4 weight(vec4 w) { return max(-w, vec4(0.0)); }
#else
vec4 weight(vec4 w) { return abs(w); }
#endif

// Rows beyond the frame have no faces.
Faces faces_at(int tx, int y) {
  int row = row_start(y), last = int(push.pitch) - 1;
  float inside = y >= 0 && y < int(push.height) ? 1.0 : 0.0;
  Faces f;
  f.l = tx == 0 ? 0.0 : inside * weight(texelFetch(wx_words, 4 * row + 8 * tx - 1)).x;
  f.xa = inside * weight(texelFetch(wx_texels, row + 2 * tx));
  f.xb = inside * weight(texelFetch(wx_texels, row + min(2 * tx + 1, last)));
  f.ya = inside * weight(texelFetch(wy_texels, row + 2 * tx));
  f.yb = inside * weight(texelFetch(wy_texels, row + min(2 * tx + 1, last)));
  return f;
}

// A x of a row: weights times differences to the four neighbours.
Pair apply(Faces above, Faces here, Ten up, Ten c, Ten down) {
  vec4 la = vec4(here.l, here.xa.xyz), lb = vec4(here.xa.w, here.xb.xyz);
  return Pair(la * (c.a - vec4(c.l, c.a.xyz)) + here.xa * (c.a - vec4(c.a.yzw, c.b.x)) + above.ya * (c.a - up.a) +
                  here.ya * (c.a - down.a),
              lb * (c.b - vec4(c.a.w, c.b.xyz)) + here.xb * (c.b - vec4(c.b.yzw, c.r)) + above.yb * (c.b - up.b) +
                  here.yb * (c.b - down.b));
}

// Its diagonal.
Pair diagonal(Faces above, Faces here) {
  return Pair(vec4(here.l, here.xa.xyz) + here.xa + above.ya + here.ya,
              vec4(here.xa.w, here.xb.xyz) + here.xb + above.yb + here.yb);
}

// A cell without neighbours stays where it is.
vec4 over(vec4 value, vec4 diagonal) { return mix(vec4(0.0), value / max(diagonal, vec4(1e-30)), greaterThan(diagonal, vec4(0.0))); }
float over(float value, float diagonal) { return diagonal > 0.0 ? value / diagonal : 0.0; }

float sum(vec4 v) { return v.x + v.y + v.z + v.w; }
