// From a grid to its half and back.
#pragma once

#include "engine/base/work_team.h"
#include "engine/fem/linear/grid.h"

namespace palpate::fem {

/// coarse = P^T fine, fine += P coarse, each 3 x nodes, P trilinear in the nodes' places. Where a
/// displacement is fixed the result is zero, or stays as it is.
void restrict_to(const CellGrid& fine, const CellGrid& coarse, const FixedNodes& coarse_fixed,
                 const float* fine_values, float* coarse_values, WorkTeam& team);
void prolong_add(const CellGrid& fine, const CellGrid& coarse, const FixedNodes& fine_fixed,
                 const float* coarse_values, float* fine_values, WorkTeam& team);

}  // namespace palpate::fem
