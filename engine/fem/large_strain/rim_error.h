// The part of a grid's error that the rim of a bonded floor makes. There, under the block's free side, nearly
// incompressible tissue has an edge at which displacements go with the 0.595th power of the distance (a wedge
// of 90 degrees, held on one side; Williams 1952), so that a small press's force errs with the 1.19th power
// of the cells' size, whatever the cells; and under a deep press the side swells out over the floor, which
// makes the edge sharper: 1.0 at 5 % of the thickness, 0.88 at 10, 0.77 at 15, 0.65 at 20.
#pragma once

#include <optional>
#include <vector>

#include "engine/fem/large_strain/press.h"

namespace palpate::fem {

/// Convergence of a block without its inclusions on three coarse grids: F(h) = F(0) + c h^order, for each
/// load. It is the same rim whatever lies in the block's middle.
class RimError {
 public:
  struct Load {
    double order = 1;
    double scale_N = 0;              ///< F(h) - F(0) = scale_N * cells^-order, cells along x
    double force_N = 0;              ///< on the finest of the three
    double slope_N_per_mm = 0;       ///< of the force with the press
    double pressure_per_N = 0;       ///< Pa of the whole map for each N of the error
    std::vector<double> even_per_N;  ///< pressure over force: what a change of the press alone does
  };
  /// How much of the error may be wrong: most that was found on blocks 16 to 24 mm thick, to 20 % of press.
  static constexpr double kDoubt = 1.0 / 3;

  /// Three grids, 8 to 24 cells along x, of the scene's proportions and no finer than half of it. Under a
  /// skin those of 6, 12 and 18 layers, which have one share of their layers in it (see skin_layers()). None
  /// where there are no such.
  static std::optional<std::array<std::array<uint32_t, 3>, 3>> grids(const std::array<uint32_t, 3>& cells,
                                                                     bool skin = false);

  /// Presses the block to `press_mm`, which rise. None where grids() are none or a press does not converge.
  static std::optional<RimError> measure(const Scene& scene, const std::vector<double>& press_mm,
                                         const LargeStrainOptions& options);

  const Load& at(size_t load) const { return loads_.at(load); }
  /// By how much a grid's force is too high where the press is given, N.
  double force_N(size_t load, uint32_t cells) const;

 private:
  std::vector<Load> loads_;
};

}  // namespace palpate::fem
