// Judged cases from a CSV table, of this program or of another.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "perf/lab/judge/cases.h"

namespace palpate {

struct JudgedTableOptions {
  std::vector<std::string> by = {};  ///< columns that are conditions; empty: all that mean nothing else
  double promise = 0.9;              ///< of every quantity's intervals
  std::vector<std::string> reported = {"reported", "valid", "found", "reliable", "yes", "true", "1"};
};

/// Columns: `truth,value,low,high`, or `NAME_truth,NAME,NAME_low,NAME_high` for each of several quantities
/// (low and high may both be missing); `verdict`, reported where it is one of options.reported (without the
/// column: everywhere); `wrong`, 0 or 1; `group`, a whole number that cases which may err together have in
/// common; all others are conditions, numbers, or words (at most 20 different
/// ones). An empty cell or "nan" is not known. Throws Error(Failure::Input), one line with file, line and
/// column, and Error(Failure::Usage) where options.by names what is no condition.
judge::Cases read_judged_table(const std::filesystem::path& file, const JudgedTableOptions& options);

}  // namespace palpate
