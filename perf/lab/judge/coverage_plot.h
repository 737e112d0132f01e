// Heat maps and files of a judgement by cells.
#pragma once

#include <filesystem>
#include <string>

#include "perf/lab/judge/cells.h"
#include "viz/report/plot.h"

namespace palpate {

/// A panel for each grid and quantity (share of intervals that hold), and each grid's verdicts (wrong and
/// refused ones). Numbers of cases stand in the cells, those with too few are gray, those below the promise
/// beyond chance have a star, the worst is framed.
Plot coverage_plot(const judge::Judgement& judgement);

/// Into `folder`: STEM.txt (tables), .csv, .json, .png, .svg, .pdf, and STEM_cases.csv, which
/// `palpate-lab evaluate table` reads. Returns their names for people. Throws Error(Failure::Output).
std::string write_judgement(const judge::Judgement& judgement, const judge::Cases& cases,
                            const std::filesystem::path& folder, const std::string& stem);

}  // namespace palpate
