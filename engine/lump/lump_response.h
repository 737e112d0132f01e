// What a block with a lump answers to known forces, as a sensor reads it, and how the answer changes with the
// lump: the finite elements behind the direct inversion (theory S12).
#pragma once

#include <array>
#include <vector>

#include <Eigen/Dense>

#include "engine/lump/large_strain.h"
#include "engine/lump/lump_reading.h"
#include "engine/lump/lump_sweep.h"

namespace palpate {

/// What is sought. Logarithms, so that no step leaves what makes sense, and places from the block's middle.
enum LumpUnknown : uint8_t { kLnSize, kLnDepth, kLnRatio, kPlaceX, kPlaceY, kLumpUnknowns };

struct LumpResponseOptions {
  std::array<uint32_t, 3> cells = {32, 32, 16};
  std::array<uint32_t, 3> coarser = {24, 24, 12};  ///< extrapolated with; {0, 0, 0}: one grid
  double poisson = 0.495;
  double residual = 1e-5, step_mm = 2;
  uint32_t threads = 0;
  /// The lump lies under the block's middle: its place is not sought, and a quarter is solved. The lump's
  /// offset is (0, 0).
  bool centred = false;
  double rim_mm = 4;  ///< of the block's surface that is left out: there grids differ most
};

/// Values that a reading has within the block less its rim, load after load.
struct LumpPrediction {
  bool converged = false;
  Eigen::VectorXd pressure_Pa;
  /// Changes per unit of each unknown at the same forces. Empty where they were not asked for.
  Eigen::MatrixXd by_unknown;
  /// The same per unit of the logarithm of each load's force (values x loads), and of the tissue's modulus.
  Eigen::MatrixXd by_force;
  Eigen::VectorXd by_modulus;
  /// What the pressures would be more if errors shrank with the cells' square instead of kGridOrder: the
  /// measure of what two grids leave open. Zero for one grid.
  Eigen::VectorXd by_order_Pa;
  double wall_s = 0;
};

/// Nodes of a reading that are compared: seen, finite at every load, within the block less its rim.
class ComparedNodes {
 public:
  ComparedNodes(const LumpReading& reading, double rim_mm);

  size_t count() const { return nodes_.size(); }  ///< of each load
  Eigen::VectorXd values() const;                 ///< of the reading, load after load
  double x_mm(size_t node) const;                 ///< from the block's middle
  double y_mm(size_t node) const;
  const LumpReading& reading() const { return reading_; }

 private:
  const LumpReading& reading_;
  std::vector<size_t> nodes_;
};

/// Presses the lump's block (`lump` empty: tissue alone) to the reading's forces. `derivatives`: all of the
/// prediction, on the coarser grid. Throws as solve_large_strain().
LumpPrediction predict(const ComparedNodes& nodes, const std::optional<LumpCase::Lump>& lump,
                       const LumpResponseOptions& options, bool derivatives);

}  // namespace palpate
