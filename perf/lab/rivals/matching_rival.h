// Matching against a plain Coherent Point Drift, on bent characters with known partners.
#pragma once

#include <string>

#include "engine/numeric/matching/matching.h"

namespace palpate::perf {

/// Coherent Point Drift as published (Myronenko and Song 2010): Gaussian motion of width 2 and weight 3 after
/// both sets are brought to zero mean and unit variance, 10 % outliers, dense matrices, at most 150
/// iterations. Returns the template on the target.
PointSet drift_points(const PointSet& from, const PointSet& to);

/// One row per level: mean distance to the truth, fraction of trials above 0.05 and median time of both, in
/// turns. Prints the rows as they come.
std::string compare_matching(int trials);

}  // namespace palpate::perf
