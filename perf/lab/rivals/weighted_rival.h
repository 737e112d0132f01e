// Weighted surfaces with Eigen's sparse factorisation on the CPU.
#pragma once

#include <vector>

#include "engine/numeric/weighted_poisson.h"

namespace palpate::perf {

/// Assembles the normal equations of the faces, factorises them (LDLT, approximate minimum degree) and
/// solves. Pixels of weight 0 are held at 0. Returns height x width.
std::vector<double> solve_with_eigen(const WeightedFaces& faces);

}  // namespace palpate::perf
