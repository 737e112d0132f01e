// Edges between known cells, of a texel of four.

// A map's texel with the cells around it; beyond the map nothing is known.
struct Around {
  vec4 here, left, right, up, down;
};
Around around(uint x, uint y, vec4 here, float before, float after, vec4 above, vec4 below) {
  Around a;
  a.here = here;
  a.left = vec4(x > 0 ? before : 0.0, here.xyz);
  a.right = vec4(here.yzw, x + 1 < push.pitch ? after : 0.0);
  a.up = y > 0 ? above : vec4(0.0);
  a.down = y + 1 < push.rows ? below : vec4(0.0);
  return a;
}

// Texels of the map as places in its buffer; beyond either end the last one there.
int held(int at) { return clamp(at, 0, int(push.pitch * push.rows) - 1); }
#define around_at(map, column, row) around_of(map, column, row, int((row) * push.pitch + (column)))
#define around_of(map, column, row, at)                                                    \
  around(column, row, texelFetch(map, at), texelFetch(map, held((at) - 1)).w,              \
         texelFetch(map, held((at) + 1)).x, texelFetch(map, held((at) - int(push.pitch))), \
         texelFetch(map, held((at) + int(push.pitch))))
