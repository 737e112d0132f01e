// A scan of a tissue block: several presses, one map, what is felt and what lies behind it.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/fem/large_strain/large_strain.h"
#include "engine/lump/estimator.h"
#include "engine/lump/observation/gaussian_profile.h"
#include "engine/lump/observation/observation.h"
#include "engine/lump/observation/outline.h"
#include "engine/lump/observation/scan_stitch.h"
#include "engine/lump/observation/sensor_model.h"
#include "engine/palpation/next_press.h"

namespace palpate {

/// A synthetic scan. The block is the scene's; the estimator does not get to see it.
struct ScanPlan {
  fem::Scene scene;
  double force_N = 2;  ///< highest, on the whole block
  uint32_t loads = 4;  ///< of each press, even shares of the highest force
  lump::PalpationSensor sensor = {.window_mm = {27.84, 20.88}};
  std::vector<std::array<double, 2>> places_mm;  ///< of the window's middle; empty: scan_places()
  double stage_sd_mm = 0.1;                      ///< by how far the window misses its stated place
  double force_sd = 0.02;  ///< share by which the presses' forces differ from each other
  uint64_t seed = 1;
};

/// Window places that cover the block, each window over at least `overlap` of its neighbour's width.
std::vector<std::array<double, 2>> scan_places(const std::array<double, 3>& block_mm,
                                               const std::array<double, 2>& window_mm, double overlap = 0.35);

/// Presses the block once and looks at it from every place. Throws Error(Failure::Usage) on a plan that makes
/// no sense, and where the press did not converge up to the highest force: with how far it came.
std::vector<lump::ScanPress> simulate_scan(const ScanPlan& plan, const fem::PressSolver& solver);

/// Estimate by one press alone, of a block with more than one lump.
struct ScannedPress {
  std::string name;
  std::array<double, 2> bump_mm{};  ///< the one that it sees, from the block's middle
  lump::Estimate estimate;
};

/// Result of a scan.
struct ScanAnswer {
  lump::ScanMap map;
  lump::Outline outline;  ///< of the higher bump where there are two
  std::optional<lump::Outline> second_outline;
  std::vector<ScannedPress> presses;       ///< of two bumps: who sees one of them alone, with an estimator
  std::optional<lump::Estimate> estimate;  ///< none without an estimator
  std::optional<NextPress> next;           ///< with an estimate, where a press is worth it
  lump::Profile profile;                   ///< pressure at the highest load along x through the bump
  lump::Profile block;                     ///< of the smooth block under it
  lump::GaussianFit fit;                   ///< of profile less block
  std::vector<std::string> warnings;       ///< of all of them, one line each
};
/// Estimate by a scan's map, which is put together again for light that is uneven in each window.
lump::Estimate estimate_map(const lump::ScanMap& map, const std::vector<lump::ScanPress>& presses,
                            const lump::StitchOptions& options, const lump::Estimator& estimator);
ScanAnswer evaluate_scan(const std::vector<lump::ScanPress>& presses, const lump::StitchOptions& options,
                         const lump::Estimator& estimator, uint64_t seed = 1);

/// A shape in words: "sphere", "upright cylinder", ...
const char* shape_text(InclusionShape shape);
/// "8.1 mm (90 %: 7.6 to 8.7)"; with `open`, what the interval says alone.
std::string interval_text(const lump::Value& value, const char* unit);
/// The rows of a table for people: what it is and what is known of it.
std::vector<std::pair<std::string, std::string>> estimate_rows(const lump::Estimate& estimate);

}  // namespace palpate
