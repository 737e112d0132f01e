// An observation's block on one of several grids, and what a sensor reads of its surface.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "engine/base/stop.h"
#include "engine/fem/large_strain/press.h"
#include "engine/fem/large_strain/pressed_surface.h"
#include "engine/lump/fem_inverse/response.h"

namespace palpate::lump {

/// One block with its lump, or without one.
struct Pressing {
  std::array<double, 2> block_mm;
  double poisson;
  std::array<uint32_t, 3> cells;
  Case block;
  bool turned = false;  ///< the scene's x is the observation's y

  /// On `times` the options' cells along each side.
  Pressing(const Observation& observation, const std::optional<Case::Lump>& lump,
           const ResponseOptions& options, uint32_t times = 1);
  fem::Scene scene() const { return scene_of(block, block_mm, poisson, cells); }
};

/// `stop`: see Effort::watch().
fem::LargeStrainOptions solver_options(const ResponseOptions& options, StopAsked stop);

/// Cells that a press solves: of a quarter where that represents the whole.
size_t count_cells(const fem::Scene& scene, bool quarter);

/// Pressure, Pa, of each node that is compared: the mean over a square of the pitch around it.
Eigen::VectorXd read(const fem::PressedSurface& surface, const ComparedNodes& nodes, bool turned);

/// The lump moved into the block's middle where it is that near that grids differ as they do there and the
/// cells are a quarter's; else as it is.
std::optional<FittedLump> for_comparison(const ComparedNodes& nodes, std::optional<FittedLump> lump,
                                         const ResponseOptions& options);

/// Fractions of grids of so many times the same cells in what cells of no size would give: the polynomial in
/// the square of the cells' size through all of them.
std::vector<double> at_no_size(const std::vector<uint32_t>& times);
/// The same in what is uncertain of it: see GridCorrection::open_Pa.
std::vector<double> open_fractions(const std::vector<uint32_t>& times);

}  // namespace palpate::lump
