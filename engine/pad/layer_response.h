// How an elastic layer on a rigid base answers a wave of traction on its surface: its transfer functions in
// wave numbers (see engine/elasticity/layer.h for K).
#pragma once

#include "engine/pad/pad.h"

namespace palpate {

/// 1 - K(s) at the wave number s / H, s >= 0: 0 for short waves, which feel a half space, 1 (bonded,
/// incompressible) for long ones. Poisson's ratio in [0, 0.5].
double missing_response(double s, double poisson, Base base);
/// Beyond this s it is below 1e-12.
inline constexpr double kMissingResponseEnd = 18;

/// A layer bonded to a rigid base under a wave exp(i k x) of pressure P (into the layer) and shear traction
/// with the components T along k and S across it. Displacements of its surface, w into the layer, u along k,
/// v across k, times the shear modulus and k:
///   G k w = normal P - i coupling T,   G k u = along T + i coupling P,   G k v = across S.
/// Of short waves 1 - nu, 1 - nu, 1 and (1 - 2 nu) / 2, the half space's. By the plane-strain solutions of
/// Navier's equations that vanish at the base (compare J. R. Barber, Elasticity, ch. 9).
struct LayerResponse {
  double normal = 0;
  double along = 0;
  double across = 0;
  double coupling = 0;
};
/// At the wave number s / H, s >= 0. Poisson's ratio in [0, 0.5].
LayerResponse layer_response(double s, double poisson);

}  // namespace palpate
