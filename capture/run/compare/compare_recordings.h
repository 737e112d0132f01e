// Two recordings on one time: how they are aligned, and by how much they differ.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "capture/run/compare/recording_curve.h"
#include "engine/base/facts.h"

namespace palpate {

/// The moment of both recordings that is put at time 0.
enum class Alignment { Start, Touch, Largest, Mark };
inline constexpr int kAlignments = 4;
inline const std::map<std::string, Alignment> kAlignmentNames = {{"start", Alignment::Start},
                                                                 {"touch", Alignment::Touch},
                                                                 {"largest", Alignment::Largest},
                                                                 {"mark", Alignment::Mark}};
/// "first touch", "largest force".
const char* to_string(Alignment alignment);

/// That moment, s on the recording's own clock; none: nothing touches, or nothing is marked so. `mark`: text
/// of the mark; empty: the first one.
std::optional<double> moment_of(const RecordingCurve& curve, Alignment alignment, const std::string& mark);

/// Frame of the largest force that is valid, else of the largest that is known; without a force of the
/// largest depth; none: nothing touches.
std::optional<size_t> largest_frame(const RecordingCurve& curve);

/// Times of both on one axis: the moment of alignment is 0, and B is moved by `offset_s` to later times.
struct SharedTime {
  double a_s = 0, b_s = 0;  ///< on their own clocks, at time 0 of the axis

  /// Throws Error(Failure::Usage) where a recording has no such moment.
  SharedTime(const RecordingCurve& a, const RecordingCurve& b, Alignment alignment, const std::string& mark,
             double offset_s = 0);
};

/// One line of the table.
struct ComparedValue {
  std::string name, unit;     ///< "largest force", "N"
  Estimate a, b, difference;  ///< B minus A; its standard error is that of both, which are independent
  std::optional<double> a_time_s, b_time_s;  ///< of the moment, on their own clocks
  bool has_error = true;                     ///< false: counted from pixels
  std::string doubt = {};                    ///< larger values that are not valid; empty: there are none
};

/// Largest force, depth and area, as far as both have them.
std::vector<ComparedValue> compare_largest(const RecordingCurve& a, const RecordingCurve& b);
/// Force, depth and area at one moment of the shared axis; a recording that has no frame there: no values.
std::vector<ComparedValue> compare_at(const RecordingCurve& a, const RecordingCurve& b,
                                      const SharedTime& time, double at_s);
/// RMS of the difference of valid forces where both are measured; none: they have none at one time.
std::optional<double> force_rms_N(const RecordingCurve& a, const RecordingCurve& b, const SharedTime& time);

/// The answer in a sentence: "B presses 0.312 ± 0.021 N harder (+25 %)".
std::string headline_of(const std::vector<ComparedValue>& values);
/// Decimals that a value with this standard error deserves: two figures of the error, `most` at most.
int deserved_places(double standard_error, int most);
/// "1.488 ± 0.021 N", and its state where it is not valid; "-" where it is not known.
std::string value_words(const Estimate& value, const std::string& unit, bool has_error, bool sign = false);
/// The table, for people and programs.
Facts facts_of(const RecordingCurve& a, const RecordingCurve& b, const std::vector<ComparedValue>& values,
               Alignment alignment, const SharedTime& time);
/// comparison.csv: a row for each value.
std::string comparison_csv(const std::vector<ComparedValue>& values);

}  // namespace palpate
