// How far linear elasticity is off where a sphere goes deep into a rubber layer: finite elements at large
// strain beside the exact linear layer.
#pragma once

#include <span>
#include <string>
#include <vector>

namespace palpate::perf {

/// One sphere at one depth. Lengths over the layer's thickness H, moduli over its Young's modulus E.
struct BeyondLinear {
  double poisson = 0;
  double radius = 0, depth = 0;
  double force = 0;         ///< neo-Hookean, over E H^2
  double force_error = 0;   ///< of it, relative, estimated with elements of twice the size
  double linear_force = 0;  ///< of the exact layer (engine/elasticity/layer.h) at the same depth
  double contact_radius = 0, linear_contact_radius = 0;
  double peak_ratio = 0;   ///< of the largest pressures, neo-Hookean over linear
  double found_force = 0;  ///< by TractionSolver from the neo-Hookean surface as a camera sees it
};

/// A sphere at rising depths; those that equilibrium was found at. `cells`: elements of the finer mesh along
/// a thickness, under the contact; even.
std::vector<BeyondLinear> beyond_linear(double poisson, double radius, std::span<const double> depths,
                                        int cells);
/// A line of names and one for each.
std::string beyond_linear_csv(std::span<const BeyondLinear> rows);

/// Radii of 0.5, 1, 2 and 4 H, depths of 0.02 to 0.66 H at nu = 0.48.
std::vector<BeyondLinear> beyond_linear_study();

}  // namespace palpate::perf
