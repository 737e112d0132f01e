// Which lump explains an observation best, and which others explain it nearly as well: the search behind the
// direct inversion.
#pragma once

#include <cmath>
#include <memory>
#include <optional>

#include <Eigen/Core>

#include "engine/lump/fem_inverse/emulated_slopes.h"
#include "engine/lump/fem_inverse/options.h"

namespace palpate::lump {

/// Changes of what is sought: see Unknown.
using LumpStep = Eigen::Matrix<double, kLumpUnknowns, 1>;

/// From one lump to another.
LumpStep difference(const Case::Lump& to, const Case::Lump& from);

/// chi2 below is over all values of the observation, with the forces, the modulus and the elements' errors
/// that suit a lump best within what the options allow them.
class DirectSearch {
 public:
  /// Keeps both.
  DirectSearch(const Observation& observation, const DirectInversionOptions& options);

  size_t values() const { return nodes_.count(); }  ///< of each load

  /// States that come of each other share cells, so that they compare, and what the grids said of the first.
  struct State {
    Case::Lump lump;
    fem::InclusionCells cells;
    std::shared_ptr<const GridCorrection> grids;
    Case::Lump corrected;   ///< lump that the grids were asked for
    Prediction prediction;  ///< with the correction
    double chi2 = HUGE_VAL;
  };
  /// In cells of its own, all grids asked. None where there is no equilibrium.
  std::optional<State> state_at(const Case::Lump& lump) const;
  /// Asks all grids again. Whether that gave the state new numbers.
  bool correct(State& state) const;
  /// A lump that the block can hold.
  Case::Lump moved(const Case::Lump& from, const LumpStep& by) const;

  enum class Sought : uint8_t { Nothing, LumpOfThisRatio, Lump };
  struct Step {
    LumpStep change = LumpStep::Zero();
    double chi2 = 0;  ///< of the linear model after the step
    // Of Sought::Lump alone:
    LumpStep sd = LumpStep::Zero();        ///< standard deviations
    LumpStep by_ratio = LumpStep::Zero();  ///< of the best lump, per unit of the ratio's logarithm
  };
  Step solve(const State& from, double damping, Sought sought) const;

  /// Moves the state to the best lump near it, all grids asked again as often as they change it. False where
  /// that did not end within the options' rounds.
  bool settle(State& best) const;

  struct RatioEnd {
    Case::Lump lump;             ///< whose chi2 is higher than the best's by what was allowed
    std::optional<State> lower;  ///< a better lump than the best, found on the way
  };
  /// From the best lump along lumps that are the best of their ratios (the likelihood's profile), to higher
  /// ratios (`direction` 1) or lower ones (-1), until chi2 has risen by `allowed`. A lump of 0.02 or 1000 is
  /// none. `step`: of the ratio's logarithm, the first one.
  RatioEnd ratio_end(const State& best, double direction, double allowed, double step) const;

  /// chi2 of tissue alone, on which forces and modulus act as they do with a lump, nearly.
  std::optional<double> without_lump(const State& with_lump);

 private:
  /// Moves the state to the best one that shares its correction, or its last one where other cells became
  /// needed; false where `rounds` ran out before.
  bool descend(State& best, uint32_t& rounds) const;
  std::optional<State> moved_to(const Case::Lump& lump, const State& from) const;
  void judge(State& state) const;
  bool cells_match(const State& state) const;
  Eigen::MatrixXd doubted(const State& state) const;

  const Observation& observation_;
  const DirectInversionOptions& options_;
  ComparedNodes nodes_;
  EmulatedSlopes slopes_;
  Eigen::VectorXd wanted_;
  Eigen::MatrixXd doubt_;      // nodes x fields
  Eigen::VectorXd tissue_Pa_;  // of tissue alone, once it was asked for
  double sigma_Pa_ = 1;
};

}  // namespace palpate::lump
