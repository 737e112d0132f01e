// Sums over a kernel's only workgroup.
shared vec2 lanes[LANES];
shared vec2 whole;

// The sums of both; as `most`, the second one's largest. Every lane must come here.
vec2 over_lanes(vec2 part, bool most) {
  uint lane = gl_LocalInvocationID.x;
  lanes[lane] = part;
  barrier();
  if (lane == 0) {
    vec2 total = lanes[0];
    for (uint i = 1; i < LANES; ++i)
      total = vec2(total.x + lanes[i].x, most ? max(total.y, lanes[i].y) : total.y + lanes[i].y);
    whole = total;
  }
  barrier();
  return whole;
}
