// Judged cases: what was true, what was said of it with which interval, and under which conditions.
#pragma once

#include <string>
#include <vector>

namespace palpate::judge {

/// A condition that varies from case to case; numbers, or names that numbers from 0 stand for.
struct Condition {
  std::string name;                 ///< with its unit at the end ("depth_mm")
  std::vector<std::string> labels;  ///< of the numbers 0, 1, ...; empty: numbers are meant as such
};

/// A quantity that is estimated with an interval.
struct Quantity {
  std::string name;      ///< with its unit at the end
  double promise = 0.9;  ///< share of intervals that hold the truth, 0 to 1, as the estimator says
};

/// One estimate; NaN: not stated, and not judged.
struct JudgedValue {
  double truth = 0, value = 0, low = 0, high = 0;
};

struct JudgedCase {
  std::vector<double> conditions;   ///< one of each; NaN: the case does not have it
  std::vector<JudgedValue> values;  ///< one of each quantity
  bool reported = true;             ///< false: the verdict refused, and its numbers do not count
  bool wrong = false;               ///< of a reported verdict: it is not true
  /// Cases of one number above 0 may err together (they share a calibration, say): where a cell is accused,
  /// they count as one draw.
  size_t group = 0;
};

struct Cases {
  std::vector<Condition> conditions;
  std::vector<Quantity> quantities;
  std::vector<JudgedCase> cases;
  /// Definition of a wrong verdict, for people: "farther than 0.05 of the scale". Empty: verdicts are
  /// not judged, only counted.
  std::string wrong_means;
};

}  // namespace palpate::judge
