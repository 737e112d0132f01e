// Response of a block with a lump to known forces, as a sensor reads it, and its derivatives with respect to
// the lump: the finite elements behind the direct inversion.
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "engine/fem/large_strain/fitted_grid.h"
#include "engine/fem/large_strain/large_strain.h"
#include "engine/lump/lump_case.h"
#include "engine/lump/observation/observation.h"

namespace palpate::lump {

/// Unknowns. Logarithms, so that no step makes them negative, and places from the block's middle.
enum Unknown : uint8_t { kLnSize, kLnDepth, kLnRatio, kPlaceX, kPlaceY, kLumpUnknowns };

/// A lump with one unknown changed.
Case::Lump changed(Case::Lump lump, size_t unknown, double by);

struct ResponseOptions {
  /// Which follow the lump is chosen on these.
  std::array<uint32_t, 3> cells = {16, 16, 8};
  /// Grids of so many times these cells along each side, rising. What cells of no size would give is taken
  /// from all of them, errors as sums of even powers of the cells' size; `searched` is one of them.
  std::vector<uint32_t> grids = {1, 2, 3};
  uint32_t searched = 2;
  double poisson = 0.495;
  double residual = 1e-5, step_mm = 2;
  uint32_t threads = 0;
  /// The lump lies under the block's middle: its place is not sought, and a quarter is solved. The lump's
  /// offset is (0, 0).
  bool centred = false;
  double rim_mm = 4;  ///< of the block's surface that is left out: there grids differ most
};

/// Values that an observation has within the block less its rim, load after load.
struct Prediction {
  bool converged = false;
  Eigen::VectorXd pressure_Pa;
  /// Changes per unit of each unknown at the same forces. Empty where they were not asked for.
  Eigen::MatrixXd by_unknown;
  /// The same per unit of the logarithm of each load's force (values x loads), and of the tissue's modulus.
  Eigen::MatrixXd by_force;
  Eigen::VectorXd by_modulus;
};

/// Difference between a prediction and cells of no size, by finer grids (GridSeries). It changes so slowly
/// with the lump that predictions of others nearby share it. Zeros where there is but one grid.
struct GridCorrection {
  Eigen::VectorXd add_Pa;
  /// The part of it that the grids finer than the one that is searched say. It changes slowest, and they cost
  /// most: further lumps share it. Empty: they were not asked.
  Eigen::VectorXd finer_Pa;
  /// Uncertainty of the correction: how much less would be added without the coarsest of three or more; of
  /// two, if errors shrank with the cells' power of 1.8 instead of their square.
  Eigen::VectorXd open_Pa;
};

/// Nodes of an observation that are compared: seen, finite at every load, within the block less its rim.
class ComparedNodes {
 public:
  ComparedNodes(const Observation& observation, double rim_mm);

  size_t count() const { return nodes_.size(); }  ///< of each load
  Eigen::VectorXd values() const;                 ///< of the observation, load after load
  double x_mm(size_t node) const;                 ///< from the block's middle
  double y_mm(size_t node) const;
  const Observation& observation() const { return observation_; }

 private:
  const Observation& observation_;
  std::vector<size_t> nodes_;
};

/// A lump and which of the options' cells follow it. Predictions from the same cells change smoothly
/// with the lump.
struct FittedLump {
  Case::Lump lump;
  fem::InclusionCells cells;
};

}  // namespace palpate::lump
