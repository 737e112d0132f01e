#include "engine/numeric/sobol.h"

namespace palpate {
namespace {

/// A primitive polynomial and the first direction numbers of a coordinate; the first coordinate needs none.
struct Direction {
  uint32_t degree, coefficients;
  std::array<uint32_t, 5> first;
};
constexpr Direction kDirections[kSobolDimensions - 1] = {{1, 0, {1}},
                                                         {2, 1, {1, 3}},
                                                         {3, 1, {1, 3, 1}},
                                                         {3, 2, {1, 1, 1}},
                                                         {4, 1, {1, 1, 3, 3}},
                                                         {4, 4, {1, 3, 5, 13}},
                                                         {5, 2, {1, 1, 5, 5, 17}},
                                                         {5, 4, {1, 1, 5, 5, 5}},
                                                         {5, 7, {1, 1, 7, 11, 19}},
                                                         {5, 11, {1, 1, 5, 1, 1}},
                                                         {5, 13, {1, 1, 1, 3, 11}}};

using Matrix = std::array<std::array<uint32_t, 32>, kSobolDimensions>;

constexpr Matrix directions() {
  Matrix v{};
  for (uint32_t bit = 0; bit < 32; ++bit) v[0][bit] = 1u << (31 - bit);
  for (uint32_t d = 1; d < kSobolDimensions; ++d) {
    const Direction& from = kDirections[d - 1];
    const uint32_t s = from.degree;
    for (uint32_t bit = 0; bit < 32; ++bit) {
      if (bit < s) {
        v[d][bit] = from.first[bit] << (31 - bit);
        continue;
      }
      v[d][bit] = v[d][bit - s] ^ (v[d][bit - s] >> s);
      for (uint32_t k = 1; k < s; ++k)
        if ((from.coefficients >> (s - 1 - k) & 1) != 0) v[d][bit] ^= v[d][bit - k];
    }
  }
  return v;
}
constexpr Matrix kMatrix = directions();

constexpr uint32_t reversed(uint32_t x) {
  x = (x << 16) | (x >> 16);
  x = ((x & 0x00ff00ffu) << 8) | ((x & 0xff00ff00u) >> 8);
  x = ((x & 0x0f0f0f0fu) << 4) | ((x & 0xf0f0f0f0u) >> 4);
  x = ((x & 0x33333333u) << 2) | ((x & 0xccccccccu) >> 2);
  return ((x & 0x55555555u) << 1) | ((x & 0xaaaaaaaau) >> 1);
}

/// A permutation in which each bit depends on itself and the lower ones only.
constexpr uint32_t permuted(uint32_t x, uint32_t seed) {
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1u;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return x;
}

constexpr uint64_t mixed(uint64_t x) {
  x += 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

}  // namespace

std::array<double, kSobolDimensions> sobol(uint64_t seed, uint32_t number) {
  std::array<double, kSobolDimensions> point{};
  for (uint32_t d = 0; d < kSobolDimensions; ++d) {
    uint32_t x = 0;
    for (uint32_t bit = 0; bit < 32; ++bit)
      if ((number >> bit & 1) != 0) x ^= kMatrix[d][bit];
    x = reversed(permuted(reversed(x), static_cast<uint32_t>(mixed(mixed(seed) + d))));
    point[d] = (x + 0.5) / 4294967296.0;
  }
  return point;
}

}  // namespace palpate
