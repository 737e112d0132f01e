// Error against run time of each surface solver, on surfaces that are known exactly.
#pragma once

#include <span>
#include <vector>

#include "perf/profile/profile.h"
#include "perf/profile/sampling.h"
#include "perf/profile/sizes.h"

namespace palpate::perf {

/// Every solver of the engine and the paper's line integral on every truth (truths.h): all get the same
/// gradients and are timed in turn. Into `profile.solvers`, the fronts marked.
void measure_solvers(const gpu::ContextOptions& device, const std::vector<FrameSize>& sizes, double seconds,
                     const Watch& watch, Profile& profile);

/// Which of the points (time, error) no other beats: none is at least as good in both and better in one.
std::vector<bool> pareto_front(std::span<const double> time, std::span<const double> error);

}  // namespace palpate::perf
