// Points that fill a cube evenly: Sobol's sequence, scrambled by a seed.
#pragma once

#include <array>
#include <cstdint>

namespace palpate {

/// Coordinates that sobol() has.
inline constexpr uint32_t kSobolDimensions = 12;

/// Point `number` of the sequence of this seed, each coordinate in (0, 1): of any 2^k points that begin at a
/// multiple of 2^k, each of the 2^k equal intervals of a coordinate holds one. A pure function. Direction
/// numbers of Joe and Kuo, "Constructing Sobol sequences with better two-dimensional projections", SIAM J.
/// Sci. Comput. 30 (2008); nested uniform scrambling by a hash as Burley, "Practical hash-based Owen
/// scrambling", J. Comput. Graph. Techn. 9 (2020).
std::array<double, kSobolDimensions> sobol(uint64_t seed, uint32_t number);

}  // namespace palpate
