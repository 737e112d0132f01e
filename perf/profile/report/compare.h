// Two profiles side by side: ratios with their spread, and the differences that limit the comparison.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "perf/profile/profile.h"
#include "perf/profile/report/tables.h"

namespace palpate::perf {

struct ComparedFigure {
  std::string what;     ///< "frame", "stage contact", "solver live", ...
  std::string reading;  ///< or truth
  std::string size;
  std::string unit;
  double a = 0;
  double b = 0;
  double ratio = 0;  ///< b / a
  /// Where the quartiles of both sides would put it; the ratio itself for figures without a distribution.
  double ratio_low = 0;
  double ratio_high = 0;
};

struct MachineComparison {
  Profile a;
  Profile b;
  std::string name_a;  ///< of the device; with the CPU where both devices have one name
  std::string name_b;
  std::vector<ComparedFigure> figures;
  std::vector<std::string> notes;  ///< differing versions, sizes of one side only, unfinished profiles
  /// Geometric mean of the whole frames' ratios of time, and its standard error as a factor (1: none);
  /// nullopt: no size in common.
  std::optional<double> frame_ratio;
  double frame_ratio_spread = 1;
};

MachineComparison compare_profiles(const Profile& a, const Profile& b);

std::vector<Table> tables_of(const MachineComparison& comparison);
std::string to_csv(const MachineComparison& comparison);
std::string to_json(const MachineComparison& comparison);
/// For the terminal.
std::string describe(const MachineComparison& comparison);

}  // namespace palpate::perf
