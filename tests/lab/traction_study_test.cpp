// Errors in the tables of `palpate-lab bench --traction`; nothing is timed.
#include <gtest/gtest.h>

#include <cmath>

#include "perf/lab/rivals/traction_study.h"

namespace palpate {
namespace {

TEST(TractionStudy, TighterTolerancesAndFinerCellsErrLess) {
  const std::vector<perf::TractionCost> rows = perf::traction_costs(0, nullptr);
  ASSERT_EQ(rows.size(), 15u);
  for (const perf::TractionCost& row : rows) {
    SCOPED_TRACE(perf::traction_costs_csv({&row, 1}));
    EXPECT_EQ(row.ms, 0);
    // What a tolerance costs, and what cells of that size do.
    const double cells = 0.01 * row.cell_mm / 0.5;
    EXPECT_LE(std::abs(row.force_error), 0.5 * row.tolerance + cells);
    EXPECT_LE(std::abs(row.peak_error), 0.4 * row.tolerance + cells);
    EXPECT_LE(row.pressure_error, 0.3 * row.tolerance + cells);
    EXPECT_LE(row.iterations, 12u);
  }
  EXPECT_LT(rows[14].pressure_error, 0.5 * rows[4].pressure_error);
}

// From no Poisson's ratio to incompressible, from three cells thick to a half space, from no noise to three
// times what is stated.
TEST(TractionStudy, StableOverLayersAndNoise) {
  size_t outside = 0, trials = 0;
  double spread = 0, stated = 0;
  for (const perf::TractionStability& row : perf::traction_stability()) {
    SCOPED_TRACE(perf::traction_stability_csv({&row, 1}));
    EXPECT_EQ(row.converged, row.trials);
    // Slopes of a thin layer that keeps its volume say little of long waves: the prior pulls them down.
    const double own = row.thickness_cells < 10 ? 0.02 : 0.003;
    if (row.noise == 0) {
      EXPECT_LE(std::abs(row.force_error), own);
      EXPECT_LE(std::abs(row.peak_error), own);
      continue;
    }
    EXPECT_LE(std::abs(row.force_error), own + 3 * std::max(row.noise, 1.0) * row.stated_sd);
    EXPECT_GT(row.stated_sd, 0);
    if (row.noise == 1) {
      ++trials;
      spread += row.force_spread;
      stated += row.stated_sd;
      outside += std::abs(row.force_error) > own + 2 * row.stated_sd;
    }
  }
  EXPECT_EQ(outside, 0u) << "of " << trials;
  // The stated error is the trials' scatter, on its wide side.
  EXPECT_GT(stated, 0.9 * spread);
  EXPECT_LT(stated, 2 * spread);
}

}  // namespace
}  // namespace palpate
