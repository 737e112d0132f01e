// Cases at the limits of the range: the quantity that each measures, and that it reaches the estimator.
#include "perf/lab/study/stability.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

namespace palpate {
namespace {

TEST(LumpStability, CasesCoverTheEdges) {
  const std::vector<lump::StabilityCase> cases = lump::stability_cases(0.002);
  std::set<std::string> names, groups;
  for (const lump::StabilityCase& c : cases) {
    EXPECT_TRUE(names.insert(c.group + c.name).second) << c.name;
    groups.insert(c.group);
    fem::Scene scene = c.scene;
    EXPECT_NO_THROW(check(scene)) << c.name;
  }
  for (const char* group : {"stiffness ratio", "Poisson's ratio", "depth", "size", "number", "noise",
                            "sensor", "tissue modulus", "loads", "floor", "thin tissue", "plate"})
    EXPECT_TRUE(groups.count(group)) << group;
}

TEST(LumpStability, MissesAreNamed) {
  lump::StabilityRow row;
  row.pressed = true;
  row.what.scene.inclusion->stiffness_ratio = 1e4;
  row.estimate.verdict = lump::Status::Found;
  row.estimate.size_mm = {8.2, 7.9, 8.5};
  row.estimate.depth_mm = {4.6, 4.4, 4.8};
  row.estimate.stiffness_ratio = {30, 10, 39.99};
  EXPECT_EQ(row.misses(), "depth") << "an interval that ends where the network's ratios do is open";
  row.estimate.stiffness_ratio.high = 35;
  EXPECT_EQ(row.misses(), "depth, ratio");
  row.what.scene.inclusion.reset();
  EXPECT_EQ(row.misses(), "false alarm");
  row.estimate.verdict = lump::Status::OutsideTraining;
  EXPECT_EQ(row.misses(), "");
}

TEST(LumpStability, EstimatorSeesWhatTheCaseSays) {
  const std::vector<lump::StabilityCase> all = lump::stability_cases(0.002);
  std::vector<lump::StabilityCase> few;
  for (const char* name :
       {"sphere 8 mm, 5 mm deep, E_r 6", "saturated at 80 % of the peak", "told -30 %", "1 of 4"})
    few.push_back(
        *std::find_if(all.begin(), all.end(), [&](const lump::StabilityCase& c) { return c.name == name; }));
  std::vector<lump::Observation> observations;
  uint64_t last = 0;
  const std::vector<lump::StabilityRow> rows = judge_stability(
      few,
      [&](const lump::Observation& observation) {
        observations.push_back(observation);
        return lump::Estimate{};
      },
      1, 0, [&](uint64_t done) { last = done; });
  ASSERT_EQ(rows.size(), 4u);
  ASSERT_EQ(observations.size(), 4u);
  EXPECT_EQ(last, 4u);
  EXPECT_EQ(observations[0].saturated_fraction, 0);
  EXPECT_GT(observations[1].saturated_fraction, 0);
  EXPECT_DOUBLE_EQ(observations[0].young_Pa, 4000);
  EXPECT_NEAR(observations[2].young_Pa, 2800, 1e-9);
  EXPECT_EQ(observations[0].force_N.size(), 4u);
  EXPECT_EQ(observations[3].force_N.size(), 1u);
  EXPECT_NEAR(observations[3].force_N[0], observations[0].force_N[3], 0.01 * observations[0].force_N[3]);
}

}  // namespace
}  // namespace palpate
