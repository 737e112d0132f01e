// Tables and plots of the errors of lump estimates.
#pragma once

#include <string>
#include <vector>

#include "perf/lab/study/evaluation.h"

namespace palpate {

/// Into `folder`: lump_evaluation.csv, estimates and quality as .png, .svg and .pdf; returns their names for
/// people.
std::string write_score(const lump::Score& score, const std::vector<lump::Judged>& judged,
                        const std::string& folder);

}  // namespace palpate
