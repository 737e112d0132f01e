// Scans by hand beside staged ones of the same blocks, judged against the truth.
#pragma once

#include <string>
#include <vector>

#include "perf/lab/study/evaluation.h"

namespace palpate::lump {

/// Shares are of the blocks with a lump, or of those without; errors and intervals of what reports numbers.
struct HandRow {
  std::string scan;  ///< "staged", "by hand"
  size_t lumps = 0, plain = 0;
  size_t found = 0;       ///< of the lumps: reported with numbers
  size_t also_found = 0;  ///< of those that the staged scan reports, this one too
  size_t staged_found = 0;
  size_t detected = 0;     ///< of the lumps: evidence of 1 and more, whatever the verdict
  size_t false_lumps = 0;  ///< of the plain ones: reported with numbers
  size_t refused = 0;      ///< scans that were not put together at all
  std::array<double, 3> median_error{}, hold{};  ///< size, depth, ratio
  double presses = 0, used = 0;                  ///< of a scan, mean
};

/// Each of the job's examples, its modulus such that its hardest press is one of 1.6 N: a staged scan of it
/// (0.1 mm) up to the force that was the weakest press's of the hand, and one by hand (HandPlan's own
/// numbers). Intervals cover the window's place. Deterministic by seed.
std::vector<HandRow> judge_by_hand(const std::vector<Example>& examples, const EvaluationJob& job,
                                   const std::string& method);

std::string hand_text(const std::vector<HandRow>& rows);
std::string hand_csv(const std::vector<HandRow>& rows);
json::Value hand_json(const std::vector<HandRow>& rows);

}  // namespace palpate::lump
