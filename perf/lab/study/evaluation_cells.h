// Judged lumps as cases for cells of size, depth, stiffness ratio and what else varies.
#pragma once

#include <vector>

#include "perf/lab/judge/cases.h"
#include "perf/lab/study/evaluation.h"

namespace palpate::lump {

/// Conditions size_mm, depth_mm, ratio, thickness_mm, offset_mm (of the centre from the block's middle) and
/// shape, all of the truth; intervals of size_mm, depth_mm and ratio, nine of ten. Reported are the verdicts
/// Found and StiffnessOpen. Wrong is one whose size, depth or ratio (where it is stated) is off by more than
/// a factor of two and outside its interval, and every lump reported of a block without one: such blocks have
/// no conditions.
judge::Cases cases_of(const std::vector<Judged>& judged);

}  // namespace palpate::lump
