// How good estimates of lumps are: known blocks through a synthetic sensor, judged against the truth.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/json.h"
#include "engine/lump/estimator.h"
#include "engine/lump/observation/sensor_model.h"
#include "perf/lab/training/training.h"

namespace palpate::lump {

struct EvaluationJob {
  Estimator estimator;
  PalpationSensor sensor;
  uint32_t loads = 0;        ///< the highest so many of each example, evenly; 0: all
  double modulus_error = 0;  ///< share by which the tissue's modulus is told wrong
  /// The plate's way is told, with errors of this standard deviation (mm), and the modulus is not, unless it
  /// is told wrong. 0: no way is told.
  double press_sd_mm = 0;
  double press_sd_alike = 0.5;  ///< share of that variance that is alike at all loads
  double thickness_sd = 0;  ///< of the thickness as stated, share; the estimator's sources have to cover it
  bool skin_told = false;   ///< of blocks that have one
  double skin_sd = 0;       ///< of its thickness and its ratio as told, of each one's logarithm
  bool plate_told = false;  ///< of blocks under one that rubs or sticks
  double plate_sd = 0;      ///< of its friction as told
  /// Of all tissue, which the plate is held on as it says; told with shares that are wrong alike by its
  /// error, or not.
  std::optional<Relaxation> relaxation = {};
  bool relaxation_told = false;
  size_t first = 0, every = 1;  ///< of the examples: that one, and each so many after it
  uint32_t repeats = 1;         ///< of each, with other noise, patterns and errors of the gauge
  uint64_t seed = 1;
  uint32_t threads = 1;
  std::function<bool(size_t done)> progress = {};  ///< from one thread at a time; false: stop
};

struct Judged {
  size_t number = 0;  ///< of the example among all
  Example truth;      ///< without its maps
  Estimate estimate;
  double saturated_fraction = 0;  ///< of the observation
};

struct ErrorRange {
  double low = 0, high = 0;  ///< of the true stiffness ratio
  size_t count = 0;
  std::array<double, 3> median{};  ///< relative errors of size, depth, ratio; NaN where there are none
};

struct Score {
  size_t lumps = 0, plain = 0;
  std::array<size_t, kStatuses> verdicts{},
      plain_verdicts{};  ///< by Status, of blocks with and without a lump
  size_t judged = 0;     ///< lumps that were found (evidence of 1 and more): errors are theirs
  std::array<double, 3> median{}, ninetieth{};  ///< relative errors of size, depth, ratio (2 <= ratio <= 20)
  std::array<double, 3> coverage{};             ///< of the intervals
  std::array<double, 3> determined_median{};    ///< of those with verdict Found alone
  /// Of the centre, along x and y alike: errors, and coverage of lumps with numbers off the middle.
  double place_median_mm = 0, place_ninetieth_mm = 0, place_coverage = 0;
  size_t places = 0;  ///< of those, two a lump
  std::vector<ErrorRange> by_ratio;
  std::array<std::array<size_t, 4>, 4> shapes{};  ///< truth x answer, by InclusionShape
  double shape_rate = 0;
  double sensitivity = 0;  ///< of all lumps
  size_t goal_lumps = 0;   ///< of 6 mm and more at 8 mm and less
  double goal_sensitivity = 0, specificity = 0;
  std::vector<std::array<double, 2>>
      roc;  ///< false alarms, detections of the goal's lumps; by falling evidence
  double wall_ms = 0, wall_p95_ms = 0;
  size_t tissues = 0;  ///< estimates that found the tissue's modulus; its errors (share) and coverage
  double young_median = 0, young_ninetieth = 0, young_coverage = 0;
};

/// Size, depth, ratio.
std::array<double, 3> truth_of(const Example& example);
std::array<Value, 3> values_of(const Estimate& estimate);

size_t count_judged(size_t examples, const EvaluationJob& job);
/// Estimates each of the job's examples as the sensor reads it; in their order. Deterministic by seed, and
/// the same for an example whatever others are judged. Fewer than count_judged() where progress() said stop,
/// or the estimator was stopped: those that were done.
std::vector<Judged> judge_lumps(const std::vector<Example>& examples, const EvaluationJob& job);
Score score_of(const std::vector<Judged>& judged);

std::string score_text(const Score& score);
json::Value score_json(const Score& score, const std::string& method, const EvaluationJob& job);

}  // namespace palpate::lump
