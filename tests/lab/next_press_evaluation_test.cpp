#include "perf/lab/study/presses/next_press_evaluation.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/base/numbers.h"

namespace palpate {
namespace {

using lump::NextPressCase, lump::ScanStep;

ScanStep step(double length, bool numbers = true) {
  return {numbers, numbers ? length : kNaN, {0.01, 0.02, 0.05}, {true, true, length > 1}};
}

TEST(NextPressScore, PressesAreCountedUntilIntervalsAreAsShort) {
  const NextPressCase quick{.number = 0,
                            .lump = true,
                            .raster = {step(3), step(2), step(1)},
                            .proposed = {step(1.5), step(0.9)},
                            .harder_told = 0.6,
                            .harder_found = 0.7,
                            .stopped = 2};
  const NextPressCase never{.number = 1,
                            .lump = true,
                            .raster = {step(0, false), step(2), step(1)},
                            .proposed = {step(2), step(1.2), step(1.1)},
                            .harder_told = kNaN,
                            .harder_found = kNaN};
  const NextPressCase plain{.number = 2,
                            .lump = false,
                            .raster = {step(0, false), step(0, false), step(0, false)},
                            .proposed = {step(0, false), step(1)}};
  const lump::NextPressScore score = lump::score_next_press({quick, never, plain});
  EXPECT_EQ(score.lumps, 2u);
  EXPECT_EQ(score.plain, 1u);
  EXPECT_EQ(score.false_lumps, 1u);
  EXPECT_EQ(score.reached, 1u);
  EXPECT_DOUBLE_EQ(score.presses_to_reach, 2.5);
  EXPECT_DOUBLE_EQ(score.mean_stopped, 2.5);
  EXPECT_EQ(score.harder, 1u);
  EXPECT_DOUBLE_EQ(score.harder_found, 0.7);
  ASSERT_EQ(score.rows.size(), 3u);
  EXPECT_EQ(score.rows[0].raster_numbers, 1u);
  EXPECT_EQ(score.rows[2].proposed_numbers, 2u) << "a scan that ended stays as it is";
  EXPECT_NEAR(score.rows[2].proposed_length, 1.1, 1e-12) << "the upper of two";
  EXPECT_DOUBLE_EQ(score.rows[2].proposed_holds[2], 0.5);
  EXPECT_NE(next_press_text(score).find("3 presses, proposed: numbers 2"), std::string::npos);
}

}  // namespace
}  // namespace palpate
