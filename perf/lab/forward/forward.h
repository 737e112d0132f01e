// Output of `palpate-lab forward` for a solved scene: numbers, files, plots, and the picture that a sensor
// would take.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/json.h"
#include "engine/fem/scene_json.h"
#include "engine/fem/solve.h"
#include "engine/lump/observation/gaussian_profile.h"
#include "palpate/sensor.h"
#include "viz/report/plot.h"

namespace palpate {

/// A solved scene with the line through its bump. The fit leaves out the outer tenth of the block at each
/// end, where its rim shapes the stress.
struct ForwardOutcome {
  fem::Scene scene;
  fem::Result result;
  lump::Profile profile;  ///< stress, Pa, along x through the bump
  lump::GaussianFit fit;
  std::optional<fem::GridError> grid_error = {};  ///< none: one grid, which does not show its own
};
/// Throws nothing of its own: a result that did not converge has no profile and no fit.
ForwardOutcome describe(const fem::Scene& scene, fem::Result result);

json::Value to_json(const ForwardOutcome& outcome);
std::string to_text(const ForwardOutcome& outcome);

inline double megabytes(const fem::Result& result) {
  return static_cast<double>(result.bytes) / 1048576;
}

/// Gray levels, width x height.
struct TactileImage {
  uint32_t width = 0, height = 0;
  double pitch_mm_per_px = 0;
  std::vector<float> gray;      ///< not clipped, without noise
  std::string source;           ///< whose optics, in words
  double brightest_change = 0;  ///< by the press, gray levels
  uint64_t clipped_px = 0;      ///< above what 8 bits hold
};
/// Image by the camera of the built-in sensor (the synthetic pad's light, 27.84 mm across) of the middle of
/// the surface; or, of a sensor with a straight force calibration of the gray sum, the light that gives the
/// same force: pressure times a pixel's area over c1. Throws Error(Failure::Sensor) where its calibration is
/// of another kind or has no scale.
TactileImage tactile_image(const PressureMap& stress_Pa, const Sensor* sensor);

/// Writes stress_Pa.npy, deflection_mm.npy, profile.csv, tactile.npy, tactile.png, forward.json and the plots
/// maps and profile (PNG and SVG) into `folder`. Returns their names in words.
std::string write_files(const ForwardOutcome& outcome, const TactileImage& image,
                        const std::filesystem::path& folder);

/// Change of the solution with each of the six inputs: one row per scene.
struct SweepRow {
  const char* input;  ///< "d", "h", "E_r", "s", "t", "l"
  double value;       ///< mm, or a ratio; of shapes their number
  ForwardOutcome outcome;
};
/// Scenes around `scene` (which has an inclusion), each input by itself through a range that fits the block;
/// solved many at once. `progress` hears how many are ready.
std::vector<SweepRow> sweep(const fem::Scene& scene, const fem::Options& options,
                            const std::function<void(uint64_t done, uint64_t total)>& progress);
std::string sweep_text(const std::vector<SweepRow>& rows);
json::Value sweep_json(const std::vector<SweepRow>& rows);
/// sweep.csv, and plots: sweep (amplitude and width of the Gaussian by each input), sweep_profiles.
std::string write_sweep(const std::vector<SweepRow>& rows, const std::filesystem::path& folder);

/// One scene on finer and finer grids, and over the range of Poisson's ratio, stiffness ratio, depth and
/// shape.
struct ConvergenceTables {
  std::vector<ForwardOutcome> grids;   ///< 16 cells along x to four times the scene's over two
  std::vector<ForwardOutcome> ranges;  ///< on half the scene's cells
};
ConvergenceTables converge(const fem::Scene& scene, const fem::Options& options);
std::string convergence_text(const ConvergenceTables& tables);
json::Value convergence_json(const ConvergenceTables& tables);
/// convergence.csv, stability.csv, and plots: convergence (error by grid and by time), stability
/// (iterations).
std::string write_convergence(const ConvergenceTables& tables, const std::filesystem::path& folder);

/// A map of the surface, times `factor`.
PlotMap plot_map(const PressureMap& map, double factor = 1);
/// The fit from -half_mm to half_mm, times `factor`.
PlotCurve gaussian_curve(const lump::GaussianFit& fit, double half_mm, double factor = 1);

/// Result of the press, in one sentence.
std::string headline(const ForwardOutcome& outcome);

}  // namespace palpate
