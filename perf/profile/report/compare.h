// Profiles of any number of machines side by side: ratios with their spread, and the differences that limit
// the comparison.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "engine/base/json.h"
#include "perf/profile/profile.h"
#include "perf/profile/report/tables.h"

namespace palpate::perf {

/// A figure of one machine beside the same of machine A.
struct ComparedValue {
  std::optional<double> value;  ///< nullopt: this machine does not have it
  double ratio = 0;             ///< to machine A's
  /// Where the quartiles of both sides would put it; the ratio itself for figures without a distribution.
  double ratio_low = 0;
  double ratio_high = 0;
};

/// One figure of all machines.
struct ComparedFigure {
  std::string what;     ///< "frame", "stage contact", "solver live", ...
  std::string reading;  ///< or truth
  std::string size;
  std::string unit;
  std::vector<ComparedValue> values;  ///< in the order of the machines; machine A has all
};

/// The whole frames' ratios of time to machine A: geometric mean, and its standard error as a factor (1:
/// none).
struct FrameRatio {
  std::optional<double> ratio;  ///< nullopt: no size and reading in common
  double spread = 1;
};

struct MachineComparison {
  std::vector<Profile> profiles;
  /// Letter, device and kind; with CPU and date where devices have one name.
  std::vector<std::string> names;
  std::vector<ComparedFigure> figures;
  std::vector<std::string> notes;  ///< differing versions, sizes of some only, unfinished profiles
  std::vector<FrameRatio> frames;  ///< in the order of the machines
};

/// "A", "B", ..., "Z", "AA", ...
std::string letter_of(size_t machine);

/// At least two profiles. The first is machine A, which the others are set against.
MachineComparison compare_profiles(const std::vector<Profile>& profiles);

std::vector<Table> tables_of(const MachineComparison& comparison);
std::string to_csv(const MachineComparison& comparison);
json::Value to_json(const MachineComparison& comparison);
/// "a frame takes 1.9 times as long on B: ... as on A (...)"; only where frames[machine].ratio is there.
std::string frame_sentence(const MachineComparison& comparison, size_t machine);
/// For the terminal.
std::string describe(const MachineComparison& comparison);

}  // namespace palpate::perf
