// Edges between known cells, of a texel of four.

// A map's texel with the cells around it; beyond the map nothing is known.
struct Around {
  vec4 here, left, right, up, down;
};
Around around(samplerBuffer map, uint x, uint y) {
  int at = int(y * push.pitch + x), pitch = int(push.pitch), last = pitch * int(push.rows) - 1;
  Around a;
  a.here = texelFetch(map, at);
  float before = texelFetch(map, max(at - 1, 0)).w, after = texelFetch(map, min(at + 1, last)).x;
  a.left = vec4(x > 0 ? before : 0.0, a.here.xyz);
  a.right = vec4(a.here.yzw, x + 1 < push.pitch ? after : 0.0);
  vec4 above = texelFetch(map, max(at - pitch, 0)), below = texelFetch(map, min(at + pitch, last));
  a.up = y > 0 ? above : vec4(0.0);
  a.down = y + 1 < push.rows ? below : vec4(0.0);
  return a;
}
