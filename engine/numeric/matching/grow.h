// From a fit that is right in part to the whole: what fits best holds, and the rest follows from it.
#pragma once

#include <vector>

#include "engine/numeric/matching/flow.h"

namespace palpate {

struct Core {
  Eigen::VectorXd weight;  ///< of each template point
  double variance = 0;     ///< that its own fit leaves, per axis
};

/// Neighbours that one smooth warp brings onto their partners best, at most so many, the best first.
std::vector<Core> cores(const FlowProblem& problem, const FlowState& state, double amplitude, size_t most);

/// Fits the warp to a core, and lets the others follow by the warp's own uncertainty there: points whose
/// partner is not certain yet weigh little.
void grow(const FlowProblem& problem, double amplitude, const Core& core, double spacing, FlowState& state);

}  // namespace palpate
