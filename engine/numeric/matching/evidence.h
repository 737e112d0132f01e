// Evidence of a fit: its likelihood less the cost of its free parameters.
#pragma once

#include "engine/numeric/matching/flow.h"

namespace palpate {

/// Nats that the warp's freedom costs (Laplace's approximation): how much narrower the data make each
/// coefficient than it was beforehand. An affine map's coefficients are 1 beforehand, in the template's RMS
/// distance from its centre.
double freedom_cost(const FlowProblem& problem, const FlowState& state, double amplitude);

/// Nats per target point by which the warp explains points that were left out of its fit, a fifth at a time,
/// better than `energy_without` does (of all target points, without any template).
double held_out_gain(const FlowProblem& problem, const FlowState& state, double amplitude,
                     double energy_without);

}  // namespace palpate
