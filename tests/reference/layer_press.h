// An indenter, rigid or a ball of rubber, pressed without friction into a layer on a rigid base, axisymmetric
// or plane, at large strain or linear: how far linear elasticity of layers goes.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

namespace palpate::fem {

enum class Indenter {
  Sphere,
  Cylinder,  ///< lying, in plane strain: forces are those of 1 mm of its length
  Flat,      ///< a round flat face, its rim rounded by rim_mm
};

/// The layer is bonded to its base and ends, free, eight thicknesses beyond `reach_mm`.
struct IndenterOnLayer {
  double thickness_mm = 1;
  double young_MPa = 1;
  double poisson = 0.48;                 ///< 0 to 0.4999
  double radius_mm = 1;                  ///< of the indenter
  Indenter indenter = Indenter::Sphere;  ///< others at large strain alone
  double rim_mm = 0.2;                   ///< less than the radius
  /// Neo-Hookean (the energy of neo_hookean.h) under the indenter; false: small strain under the paraboloid
  /// of the sphere's radius, contact seen from the surface at rest.
  bool large_strain = true;
  /// Finite: the lower half of a ball of neo-Hookean rubber, cut 70 degrees from its axis; what is pressed on
  /// is its upper face, which stays flat and as wide.
  double indenter_young_MPa = std::numeric_limits<double>::infinity();
  double indenter_poisson = 0.48;  ///< 0 to 0.4999
  double cell_mm = 0.04;           ///< of the elements under the contact, at most a quarter of the thickness
  double reach_mm = 0.5;           ///< from the axis: to where they are that small
};

struct PressedLayer {
  double press_mm = 0;
  double force_N = 0;
  double contact_radius_mm = 0;
  double pressure_max_MPa = 0;  ///< true pressure
  /// Nodes of the surface from the axis outwards: {radius, depth below rest}, where they lie at large strain
  /// and where they lay at small strain, which knows no difference.
  std::vector<std::array<double, 2>> surface_mm;
};

/// Presses to each of `press_mm`, rising. Fewer answers than were asked for: equilibrium was not found
/// further on. Quadratic elements of nine nodes, volume changes projected on linear ones (Q2-P1), Newton's
/// search on the energy, contact by a penalty that lets 1/500 of a cell through at a pressure of the
/// modulus. Throws Error(Failure::Usage) on numbers out of range.
std::vector<PressedLayer> press_layer(const IndenterOnLayer& what, const std::vector<double>& press_mm);

/// The pressed surface on a square grid of `along` x `along` cells about the axis; a cylinder lies along y.
struct SeenPress {
  std::vector<float> depth_mm;   ///< the mean over each cell
  std::vector<uint8_t> contact;  ///< 1 where the cell's centre lies within the contact and `margin` cells
};
SeenPress seen_by_camera(const PressedLayer& pressed, uint32_t along, double cell_mm, double margin = 0.7,
                         bool plane = false);

}  // namespace palpate::fem
