// Which lump explains an observation best, and which others explain it nearly as well: the search behind the
// direct inversion.
#pragma once

#include <cmath>
#include <memory>
#include <optional>

#include <Eigen/Core>

#include "engine/lump/fem_inverse/effort.h"
#include "engine/lump/fem_inverse/emulated_slopes.h"
#include "engine/lump/fem_inverse/grid_series.h"
#include "engine/lump/fem_inverse/options.h"
#include "engine/lump/fem_inverse/search_limits.h"

namespace palpate::lump {

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
  /// Where the emulator reaches a lump it stands in for the elements: what these differed from it where they
  /// were asked last is added.
  struct State {
    Case::Lump lump;
    fem::InclusionCells cells;
    std::shared_ptr<const GridCorrection> grids;
    Case::Lump corrected;               ///< lump that the coarser grids were asked for too
    std::optional<Case::Lump> refined;  ///< lump of these cells that all grids were asked for
    std::optional<Case::Lump> pressed;  ///< lump that elements were asked for last; none: tissue alone
    Eigen::VectorXd beyond_Pa;          ///< elements less the emulator's bump there; empty: elements alone
    Eigen::MatrixXd beyond_by_unknown;  ///< slopes of that, where others were asked for nearby
    Prediction prediction;              ///< with the correction
    double chi2 = HUGE_VAL;

    bool emulated() const { return beyond_Pa.size() > 0; }
  };
  /// In cells of its own, all grids asked; with `like` the finer ones' part of the correction is that of
  /// another lump in the same place. None where there is no equilibrium, or no effort left.
  std::optional<State> state_at(const Case::Lump& lump, const State* like = nullptr);
  /// Asks the elements again, all grids where the state is a way off from where they were. Whether
  /// that gave the state new numbers.
  bool correct(State& state);
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

  /// Along which axis a long lump lies, by the emulator alone, which fits one of either near the guess; as
  /// the guess where it does not reach it.
  bool lies_along_y(const Case::Lump& guess);

  enum class Settled : uint8_t {
    Yes,
    No,      ///< not within the options' rounds
    Outdone  ///< nothing near it is expected to reach the chi2 that was allowed
  };
  /// Moves the state to the best lump near it, the elements asked again as often as they change it.
  Settled settle(State& best, double most_chi2 = HUGE_VAL);
  /// No effort is left: the elements answer no more.
  bool spent() const { return effort_.spent(); }

  struct RatioEnd {
    Case::Lump lump;             ///< whose chi2 is higher than the best's by what was allowed
    std::optional<State> lower;  ///< a better lump than the best, found on the way
  };
  /// From the best lump along lumps that are the best of their ratios (the likelihood's profile), to higher
  /// ratios (`direction` 1) or lower ones (-1), until chi2 has risen by `allowed`. A lump of 0.02 or 1000 is
  /// none. `step`: of the ratio's logarithm, the first one.
  RatioEnd ratio_end(const State& best, double direction, double allowed, double step);

  /// chi2 of tissue alone, on which forces and modulus act as they do with a lump, nearly.
  std::optional<double> without_lump(const State& with_lump);

  /// The best lump near one by elements of tissue alone and the emulator's bump, and chi2 of that tissue.
  /// None where the emulator does not know the block or there is no equilibrium.
  struct Glimpse {
    State best;
    double tissue_chi2;
  };
  std::optional<Glimpse> glimpse(const Case::Lump& from);

 private:
  /// Moves the state to the best one that shares its correction, or its last one where other cells became
  /// needed; false where `rounds` ran out before.
  bool descend(State& best, uint32_t& rounds);
  std::optional<State> moved_to(const Case::Lump& lump, const State& from) const;
  void emulate(State& state) const;
  void judge(State& state) const;
  bool press(State& state, AskedGrids grids);
  std::optional<State> fresh_at(const Case::Lump& lump, AskedGrids grids, const State* like);
  bool press_tissue();
  bool cells_match(const State& state) const;
  class RatioWalk;
  /// What elements that were asked differed from the emulator, but for what the finest grids say.
  struct Asked {
    Case::Lump lump;
    Eigen::VectorXd beyond_Pa;
  };
  static Asked asked_of(const State& state);
  /// Gives what elements answer beyond the emulator slopes, by other lumps that they were asked for.
  void lean_on(const std::vector<Asked>& others, State& state) const;
  /// Takes these slopes away: the state keeps its numbers.
  static void level(State& state);
  RatioEnd ratio_end_by_elements(const State& best, double direction, double allowed, double step);
  /// The best lump by the emulator's bump beyond the pressure of tissue.
  State best_beyond(const Case::Lump& from, Eigen::VectorXd tissue_Pa, GridCorrection correction);
  /// All grids were asked near the state.
  static bool refined(const State& state);
  Settled settle_emulated(State& best, double most_chi2);
  bool settle_by_elements(State& best);
  Eigen::MatrixXd doubted(const State& state) const;

  const Observation& observation_;
  const DirectInversionOptions& options_;
  ComparedNodes nodes_;
  EmulatedSlopes emulator_;
  mutable Effort effort_;  // counts what predictions cost
  GridSeries series_;
  Eigen::VectorXd wanted_;
  Eigen::MatrixXd doubt_;             // nodes x fields
  std::optional<GridAnswer> tissue_;  // alone, once it was asked for
  double sigma_Pa_ = 1;
};

}  // namespace palpate::lump
