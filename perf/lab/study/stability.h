// Estimates of lumps in extreme cases: stiff and soft lumps, at the surface, on the floor, too wide, two of
// them, none, thin tissue, other tissue than stated, noise, a saturated sensor, another plate.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "engine/fem/scene.h"
#include "engine/lump/estimator.h"
#include "engine/lump/observation/sensor_model.h"
#include "perf/lab/training/training.h"

namespace palpate::lump {

/// One block, what is measured of it, and what is told wrong about it.
struct StabilityCase {
  std::string group, name;  ///< "stiffness ratio", "E_r 0.1"
  fem::Scene scene;         ///< pressed in four steps to a fifth of its thickness
  PalpationSensor sensor;
  double reported_modulus = 1;  ///< modulus that the estimator is told, over the true one
  /// Length and width that the estimator is told the block has, mm; none: its own.
  std::optional<std::array<double, 2>> reported_block_mm;
  bool plate_told = false;  ///< the estimator is told how the plate rubs or sticks
  uint32_t loads = 4;       ///< of the four, the last so many
};

struct StabilityRow {
  StabilityCase what;
  bool pressed = false;  ///< the forward model reached all loads
  Estimate estimate;

  /// What of a reported estimate is not true: of size, depth and ratio those whose intervals do not hold the
  /// truth, or "false alarm". A ratio beyond the training's is held where the interval reaches its end.
  /// Empty: nothing, or no numbers were reported.
  std::string misses() const { return pressed ? misses_of(estimate) : ""; }
  /// The same of another estimate of the case's lumps, which are all alike: of one of two.
  std::string misses_of(const Estimate& of) const;
};

/// All of them, around a sphere of 8 mm, 5 mm deep, six times as stiff, in 40 x 40 x 20 mm of 4 kPa. `noise`:
/// fraction of the peak.
std::vector<StabilityCase> stability_cases(double noise);

/// Solves, reads and estimates each. Blocks that only sensors tell apart are solved once. `progress` hears
/// how many are done.
std::vector<StabilityRow> judge_stability(const std::vector<StabilityCase>& cases, const Estimator& estimator,
                                          uint64_t seed, uint32_t threads,
                                          const std::function<void(uint64_t done)>& progress);

/// Run time and error of one way to compute a press.
struct CostRow {
  std::string choice, name;  ///< "grid", "32 x 32 x 16"
  double wall_s = 0;
  double map_error =
      0;  ///< largest difference from the finest, fraction of the peak, inner half of the block
  double force_error = 0;  ///< relative, at the same way
};
/// Balls of 6, 8 and 12 mm, 3 and 6 mm deep, three and ten times as stiff, pressed as stability_cases() are:
/// what an estimator's errors and times are measured on where no data set is there.
std::vector<Example> pressed_balls(uint32_t threads, const std::function<void(uint64_t done)>& progress);

/// Grids, alone and extrapolated, and the strain model, for the middle block at a fifth of its thickness.
std::vector<CostRow> press_costs(uint32_t threads);

}  // namespace palpate::lump
