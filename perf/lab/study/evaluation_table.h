// Effect of a sensor's noise, number of loads and exposure on estimates of lumps: one score for each.
#pragma once

#include <string>
#include <vector>

#include "engine/base/json.h"
#include "perf/lab/study/evaluation.h"

namespace palpate::lump {

/// Which of a sensor's numbers is changed from row to row.
enum class ScoreOver : uint8_t {
  Noise,     ///< of a node, 0.1 to 10 % of the highest load's peak, each at 1, 2 and 4 loads
  Exposure,  ///< the peak at 90 to 300 % of full scale, each at 1 and 4 loads
  Loads,     ///< 1, 2 and 4, with the job's own noise
};

struct ScoreRow {
  double noise_fraction = 0, exposure = 0;
  uint32_t loads = 0;
  double saturated_fraction =
      0;  ///< of a window's nodes at the highest load, median of the blocks with a lump
  Score score;
};

/// Judges the job's examples once a row; its own numbers hold for what is not changed. Throws Stopped where
/// progress() said stop.
std::vector<ScoreRow> scores_over(ScoreOver what, const std::vector<Example>& examples,
                                  const EvaluationJob& job);
/// How many times `job.progress` will be told of one.
size_t rows_of(ScoreOver what);

/// Tables for people and for programs; shares in percent in the first alone.
std::string rows_text(const std::vector<ScoreRow>& rows);
std::string rows_csv(const std::vector<ScoreRow>& rows);
json::Value rows_json(const std::vector<ScoreRow>& rows);

}  // namespace palpate::lump
