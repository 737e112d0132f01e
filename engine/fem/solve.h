// The forward model: what a block of tissue with a lump in it answers to a press. Elasticity on
// a regular grid, linear or at large strain; frictionless contact.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "engine/fem/scene.h"

namespace palpate::fem {

/// How far off an answer may be for the size of the cells, estimated by two grids (solve_extrapolated()).
struct GridError {
  double force_N = 0;               ///< where a press was asked for
  double press_mm = 0;              ///< where a force was
  double stress_Pa = 0;             ///< of the map, root of the mean square
  std::optional<double> rim_order;  ///< of the force at the rim of a bonded floor (rim_error.h), if measured
};

/// Solves the scene. Throws Error(Failure::Usage) naming the field that is out of range or does not fit (an
/// inclusion that leaves the block, a grid that is too coarse or cannot be halved).
Result solve(const Scene& scene, const Options& options = {});

/// At large strain the same on the scene's cells and on half as many, extrapolated to cells of no size, where
/// the cells' numbers are multiples of eight (four along z); `error` says how far off that may be. None where
/// one grid answers.
Result solve(const Scene& scene, const Options& options, std::optional<GridError>& error);

/// Many scenes at once, each on one thread of the processor unless the options insist on the device,
/// `options.threads` of them at a time; answers in the scenes' order. `done` (may be empty) hears how many
/// are ready, from any thread.
std::vector<Result> solve(const std::vector<Scene>& scenes, const Options& options,
                          const std::function<void(size_t)>& done = {});

}  // namespace palpate::fem
