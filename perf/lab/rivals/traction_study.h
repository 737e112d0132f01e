// Errors of the traction solve on surfaces of exact contacts: by run time, and by what varies.
#pragma once

#include <cstdint>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "engine/pad/traction.h"

namespace palpate::gpu {
class Context;
}

namespace palpate::perf {

/// One solve of a sphere on a bonded layer (150 kPa, nu = 0.485, 5.5 mm), contact of 4 mm radius.
struct TractionCost {
  uint32_t width = 0, height = 0;
  double cell_mm = 0;
  double tolerance = 0;
  /// "double": the processor's solver; "single": the device's stage. The maps are single precision for both.
  const char* precision = "double";
  uint32_t iterations = 0;
  double ms = 0;              ///< wall time, median, cold start, without standard errors; 0: not timed
  double force_error = 0;     ///< relative
  double peak_error = 0;      ///< relative, of the largest pressure
  double pressure_error = 0;  ///< root of the mean square over the contact, over the peak
};
/// Medians of `repetitions` runs; 0: the errors alone. Grids of 40 x 30 to 160 x 120 cells over 20 x 15 mm.
/// `device`: also by its stage; null: by the processor's solver alone.
std::vector<TractionCost> traction_costs(int repetitions, gpu::Context* device);
std::string traction_costs_csv(std::span<const TractionCost> rows);

/// One sphere on one layer under slopes' errors, with the sensor's stated error of 0.02.
struct TractionStability {
  double poisson = 0;
  double thickness_cells = 0;
  double noise = 0;         ///< of the slopes, in times what is stated
  double force_error = 0;   ///< relative, signed; of noise the mean over trials
  double force_spread = 0;  ///< relative standard deviation of the trials
  double stated_sd = 0;     ///< relative, mean of the trials
  double peak_error = 0;    ///< relative, root of the mean square of the trials
  uint32_t converged = 0, trials = 0;
};
std::vector<TractionStability> traction_stability();
std::string traction_stability_csv(std::span<const TractionStability> rows);

}  // namespace palpate::perf
