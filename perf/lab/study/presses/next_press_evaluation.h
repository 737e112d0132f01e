// Scans whose next press is proposed, beside a raster of presses of the same blocks.
#pragma once

#include <string>
#include <vector>

#include "perf/lab/study/evaluation.h"

namespace palpate::lump {

/// One scan after so many presses.
struct ScanStep {
  bool numbers = false;
  double length = 0;  ///< of the intervals of size, depth and ratio: geometric mean of their logarithms'
  std::array<double, 3> error{};  ///< relative
  std::array<bool, 3> holds{};
};

struct NextPressCase {
  size_t number = 0;  ///< of the example among all
  bool lump = false;
  std::vector<ScanStep> raster, proposed;  ///< after 1, 2, ... presses
  /// Interval's length after a proposed press and all of it harder, over that after the first press: as told
  /// and as found; NaN: not told.
  double harder_told = 0, harder_found = 0;
  size_t stopped = 0;  ///< presses of the proposed scan when nothing more was worth pressing; 0: it went on
};

/// What scans of `presses` presses each come to, over the blocks with a lump.
struct NextPressRow {
  size_t presses = 0;
  size_t raster_numbers = 0, proposed_numbers = 0;
  double raster_length = 0,
         proposed_length = 0;  ///< over the whole raster's, median of those with numbers in both
  std::array<double, 3> raster_error{}, proposed_error{};  ///< medians (ratios of 2 to 20)
  std::array<double, 3> raster_holds{}, proposed_holds{};  ///< shares
};

struct NextPressScore {
  size_t lumps = 0, plain = 0, raster_presses = 0;
  size_t reached = 0;  ///< lumps whose proposed scan has intervals no longer than the whole raster's
  double presses_to_reach =
      0;                    ///< mean over the lumps with numbers by the raster; raster_presses where never
  double mean_stopped = 0;  ///< presses when nothing more was worth pressing, of the lumps
  size_t harder = 0;        ///< lumps that were to be pressed harder; medians of what that was to do and did
  double harder_told = 0, harder_found = 0;
  size_t false_lumps = 0;  ///< plain blocks with numbers by the proposed scan, at any step
  std::vector<NextPressRow> rows;
};

/// Each of the job's examples, its modulus such that its hardest press is one of 1.6 N, on a stage of 0.1 mm
/// and up to `top_N`; the proposed scan begins in the middle. Deterministic by seed.
std::vector<NextPressCase> judge_next_press(const std::vector<Example>& examples, const EvaluationJob& job,
                                            const std::string& method, double top_N = 1.5);
NextPressScore score_next_press(const std::vector<NextPressCase>& cases);

std::string next_press_text(const NextPressScore& score);
std::string next_press_csv(const NextPressScore& score);
json::Value next_press_json(const NextPressScore& score);

}  // namespace palpate::lump
