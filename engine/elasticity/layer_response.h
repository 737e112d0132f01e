// How an elastic layer on a rigid base answers a wave of pressure on its surface (see layer.h for K).
#pragma once

namespace palpate {

enum class Base {
  Bonded,        ///< the pad is glued to its rigid base
  Frictionless,  ///< the pad slides on it
};

/// 1 - K(s) at the wave number s / H, s >= 0: 0 for short waves, which feel a half space, 1 (bonded,
/// incompressible) for long ones. Poisson's ratio in [0, 0.5].
double missing_response(double s, double poisson, Base base);
/// Beyond this s it is below 1e-12.
inline constexpr double kMissingResponseEnd = 18;

}  // namespace palpate
