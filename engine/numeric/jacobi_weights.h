// Weights of two Jacobi sweeps: the roots of the Chebyshev polynomial of degree 2 on the upper four fifths of
// the spectrum [0, 2] of a Laplacian that is divided by its diagonal.
#pragma once

#include <numbers>

namespace palpate {

namespace jacobi {
inline constexpr double kMiddle = 1.2, kHalf = 0.8;  // of the band [0.4, 2]
inline constexpr double kRoot = kHalf * std::numbers::sqrt2 / 2;
/// Where the sweeps' factors are 0, the lower first: a sweep's weight is one over it.
inline constexpr double kLowerRoot = kMiddle - kRoot, kUpperRoot = kMiddle + kRoot;
}  // namespace jacobi

}  // namespace palpate
