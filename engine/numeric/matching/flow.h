// From a rough placement of the template to a fitted warp: soft partners and warp in turn, annealed by the
// noise that they leave.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "engine/numeric/matching/contexts.h"
#include "engine/numeric/matching/warp.h"

namespace palpate {

/// Two sets in common coordinates, in which the template's RMS distance from its centre is 1.
struct FlowProblem {
  Eigen::MatrixXd from;   ///< n x axes
  Eigen::MatrixXd basis;  ///< n x coefficients of the warp
  Eigen::Index affine = 0;
  Eigen::MatrixXf to;  ///< m x axes
  float context_scale = 1;
  std::optional<ContextCells> to_cells;
  double log_volume = 0;  ///< of the box that the target's outliers are spread over

  FlowProblem(const Eigen::MatrixXd& from, const WarpModes& modes, const Eigen::MatrixXd& to,
              double log_volume, bool contexts);
  Eigen::VectorXd cost() const;                 ///< of each coefficient's square, over the amplitude
  FlowProblem stiff(Eigen::Index modes) const;  ///< with the strongest modes alone
};

struct FlowState {
  Eigen::MatrixXd warped;         ///< n x axes
  Eigen::MatrixXd coefficients;   ///< of the basis; empty before the first fit
  double variance = 0;            ///< of the noise, per axis
  double outlier_fraction = 0.1;  ///< of the target's points
  Eigen::MatrixXf partners;       ///< n x m: probability that i is j
  double energy = 0, bending = 0;
  uint32_t iterations = 0;
  bool converged = false;
};

struct FlowStage {
  double sd = 0.7;            ///< to begin with
  double context_weight = 0;  ///< of unlike neighbourhoods, nats; 0: distance alone
  double amplitude = 0.1;     ///< variance of a unit mode
  /// Count the warp's own freedom when noise is estimated. It keeps the anneal from sharpening too early, and
  /// at the end makes warps too stiff.
  bool count_freedom = false;
  double cooling = 0.85;  ///< least fraction of the variance that an iteration leaves
  uint32_t most_iterations = 60;
  /// Likeness of neighbourhoods as the template is placed, 0 to 1, n x m; none: computed here.
  const Eigen::MatrixXf* likeness = nullptr;
  uint32_t context_every = 5;  ///< iterations: neighbourhoods are seen anew
};

/// Noise below this is not told apart.
inline constexpr double kLeastSd = 0.002;

/// Closeness becomes partners: strangers and missing points take their part.
void share_out(const FlowProblem& problem, FlowState& state, double unlike, Eigen::VectorXf& row_factor);
/// Partners by distance alone, of a state that did not flow.
void set_partners(const FlowProblem& problem, FlowState& state);
double outlier_fraction(const FlowProblem& problem, double found);

/// The warp, under the noise of `state`, to partners of total `weight` (n) whose weighted sums are `pull`
/// (n x axes). Returns its own variance at each template point, per axis.
Eigen::VectorXd fit_warp(const FlowProblem& problem, const Eigen::VectorXd& weight,
                         const Eigen::MatrixXd& pull, double amplitude, FlowState& state);

void flow(const FlowProblem& problem, const FlowStage& stage, FlowState& state);
/// -log posterior of a state that flowed, its warp's part under the given amplitude.
void weigh(const FlowProblem& problem, double amplitude, FlowState& state);

}  // namespace palpate
