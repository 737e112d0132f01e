// Vectors in double precision, two texels each.
dvec3 wide_vector(uvec4 a, uvec4 b) {
  return dvec3(packDouble2x32(a.xy), packDouble2x32(a.zw), packDouble2x32(b.xy));
}
#define wide_at(from, n) wide_vector(texelFetch(from, 2 * (n)), texelFetch(from, 2 * (n) + 1))
