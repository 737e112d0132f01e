// Two lumps in one block: each is estimated, three are not, and one is never two.
#include "engine/lump/pair/pair.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/fem/large_strain/extrapolation.h"
#include "engine/lump/estimator.h"
#include "engine/lump/observation/sensor_model.h"
#include "engine/lump/pair/merged.h"

namespace palpate {
namespace {

fem::Inclusion ball_at(double x_mm, double y_mm, double size_mm, double depth_mm, double ratio) {
  fem::Inclusion lump;
  lump.size_mm = {size_mm, size_mm, size_mm};
  lump.depth_mm = depth_mm;
  lump.stiffness_ratio = ratio;
  lump.offset_mm = {x_mm, y_mm};
  return lump;
}

/// Presses of straight cells, which misplace a lump's surface by up to 0.3 mm, through the sensor.
lump::Observation press(const std::vector<fem::Inclusion>& lumps) {
  fem::Scene scene;
  scene.cells = {32, 32, 16};
  scene.inclusion = lumps.front();
  scene.others.assign(lumps.begin() + 1, lumps.end());
  fem::LargeStrainOptions options;
  options.residual = 1e-4;
  options.step_mm = 2;
  options.map_nodes = {33, 33};
  const fem::LargeStrainResult pressed =
      solve_extrapolated(scene, {24, 24, 12}, {{1.8, std::nullopt}, {3.6, std::nullopt}}, options);
  EXPECT_TRUE(pressed.converged);
  lump::PalpationSensor sensor;
  sensor.size_px = {160, 120};
  return sensor_observation({pressed.loads.at(0).pressure_Pa, pressed.loads.at(1).pressure_Pa},
                            {pressed.loads[0].force_N, pressed.loads[1].force_N}, scene.block_mm,
                            scene.young_Pa, sensor, 1);
}

const lump::Model& model() {
  return lump::Network::built_in().model();
}

lump::Estimate estimate_of(const lump::Observation& observation, const lump::ErrorSources& sources) {
  return lump::named_estimator("refined", lump::load_network(""), sources)(observation);
}

void expect_near(const lump::Estimate& found, const fem::Inclusion& truth) {
  EXPECT_TRUE(reports_numbers(found.verdict)) << to_string(found.verdict);
  EXPECT_NEAR(found.x_mm.value, truth.offset_mm[0], 0.4);
  EXPECT_NEAR(found.y_mm.value, truth.offset_mm[1], 0.4);
  EXPECT_NEAR(found.size_mm.value / truth.size_mm[0], 1, 0.12);
  EXPECT_NEAR(found.depth_mm.value / truth.depth_mm, 1, 0.2);
  EXPECT_LT(found.stiffness_ratio.low, truth.stiffness_ratio * 1.25);
  EXPECT_GT(found.stiffness_ratio.high, truth.stiffness_ratio / 1.25);
}

TEST(Pair, EachOfTwoLumpsIsEstimatedAndWidened) {
  const fem::Inclusion soft = ball_at(-5.5, 1, 6, 3, 4), stiff = ball_at(5, -3, 7.5, 3, 10);
  const lump::Observation observation = press({soft, stiff});
  const lump::Estimate exact = estimate_of(observation, lump::ErrorSources::none());
  ASSERT_EQ(exact.verdict, lump::Status::SeveralLumps);
  ASSERT_EQ(exact.lumps.size(), 2u);
  EXPECT_TRUE(std::isnan(exact.size_mm.value)) << "no number of one lump alone";
  const bool stiff_first = exact.lumps[0].x_mm.value > 0;
  expect_near(exact.lumps[stiff_first ? 0 : 1], stiff);
  expect_near(exact.lumps[stiff_first ? 1 : 0], soft);
  for (size_t i = 0; i < 2; ++i)
    EXPECT_NEAR(exact.lumps[i].x_mm.value, exact.bumps_mm[i][0], 1.5) << "in the order of the bumps";

  lump::ErrorSources sources = lump::ErrorSources::none();
  sources.young = 0.1;
  const lump::Estimate wide = estimate_of(observation, sources);
  ASSERT_EQ(wide.lumps.size(), 2u);
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_LE(wide.lumps[i].stiffness_ratio.low, exact.lumps[i].stiffness_ratio.low * 1.0001);
    EXPECT_GE(wide.lumps[i].stiffness_ratio.high, exact.lumps[i].stiffness_ratio.high * 0.9999);
    EXPECT_EQ(wide.lumps[i].input_effects.size(), 1u);
    EXPECT_GT(wide.lumps[i].stiffness_ratio.high / wide.lumps[i].stiffness_ratio.low,
              exact.lumps[i].stiffness_ratio.high / exact.lumps[i].stiffness_ratio.low);
  }
}

TEST(Pair, ThreeLumpsHaveNoNumbers) {
  const lump::Estimate found =
      estimate_of(press({ball_at(-9, -5, 6, 2, 8), ball_at(9, -5, 6, 2, 8), ball_at(0, 8, 6, 2, 8)}),
                  lump::ErrorSources());
  EXPECT_EQ(found.verdict, lump::Status::SeveralLumps);
  EXPECT_TRUE(found.lumps.empty());
  EXPECT_EQ(found.bumps_mm.size(), 3u);
  EXPECT_NE(found.reasons.front().find("three bumps or more"), std::string::npos) << found.reasons.front();
}

TEST(Pair, MergedLumpsAreNamedWithTheDistanceFromWhichOnTheyAreTwo) {
  const auto pair = [](double apart) {
    return press({ball_at(-apart / 2, 0, 5.2, 4.2, 8), ball_at(apart / 2, 0, 7.2, 4.8, 9.6)});
  };
  const lump::Estimate merged = estimate_of(pair(7), lump::ErrorSources::none());
  EXPECT_EQ(merged.verdict, lump::Status::NotSeparable) << to_string(merged.verdict);
  EXPECT_FALSE(reports_numbers(merged.verdict));
  EXPECT_TRUE(merged.lumps.empty());
  EXPECT_TRUE(std::isnan(merged.size_mm.value));
  ASSERT_GT(merged.separable_from_mm, 7) << merged.reasons.front();
  // What it says of the distance is so.
  const lump::Estimate apart = estimate_of(pair(merged.separable_from_mm + 0.5), lump::ErrorSources::none());
  EXPECT_EQ(apart.verdict, lump::Status::SeveralLumps) << merged.separable_from_mm;
}

TEST(Pair, OneLongLumpIsNeverTwo) {
  for (const double ratio : {3.0, 30.0}) {
    fem::Inclusion lump = ball_at(0, 0, 8, 2.5, ratio);
    lump.shape = InclusionShape::LyingCylinder;
    lump.size_mm[0] = 20;
    const lump::Estimate found = estimate_of(press({lump}), lump::ErrorSources::none());
    EXPECT_NE(found.verdict, lump::Status::SeveralLumps) << ratio;
    EXPECT_NE(found.verdict, lump::Status::NotSeparable) << ratio;
    EXPECT_TRUE(found.lumps.empty());
  }
}

TEST(Pair, OtherVerdictsStayAsTheyAre) {
  const lump::Observation observation = press({ball_at(0, 0, 7, 3, 6)});
  lump::Estimate estimate = lump::Network::built_in().estimate(observation);
  const lump::Status before = estimate.verdict;
  const double size_mm = estimate.size_mm.value;
  estimate_pair(model(), observation, estimate);
  EXPECT_EQ(estimate.verdict, before);
  EXPECT_EQ(estimate.size_mm.value, size_mm);
  EXPECT_TRUE(estimate.lumps.empty());
}

}  // namespace
}  // namespace palpate
