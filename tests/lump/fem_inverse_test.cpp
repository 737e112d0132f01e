// Direct inversion: estimate of a lump by finite elements, on other cells than those that made the
// observation.
#include "engine/lump/fem_inverse/inversion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "engine/base/stop.h"
#include "engine/fem/large_strain/extrapolation.h"
#include "engine/lump/network/model.h"
#include "engine/lump/network/network.h"
#include "engine/lump/observation/sensor_model.h"
#include "palpate/error.h"

namespace palpate {
namespace {

struct Block {
  std::vector<PressureMap> maps;
  std::vector<double> forces;
  fem::Scene scene;
};

Block press(const std::optional<fem::Inclusion>& lump, std::initializer_list<double> ways_mm,
            uint32_t cells = 32, uint32_t coarser = 24) {
  Block block;
  block.scene.inclusion = lump;
  block.scene.cells = {cells, cells, cells / 2};
  fem::LargeStrainOptions options;
  options.map_nodes = {33, 33};
  options.residual = 1e-5;
  options.step_mm = 2;
  std::vector<fem::PressLoad> loads;
  for (const double way : ways_mm) loads.push_back({way, std::nullopt});
  for (const fem::PressedBlock& state :
       solve_extrapolated(block.scene, {coarser, coarser, coarser / 2}, loads, options).loads) {
    block.maps.push_back(state.pressure_Pa);
    block.forces.push_back(state.force_N);
  }
  return block;
}

lump::Observation read(const Block& block, double noise) {
  lump::PalpationSensor sensor;
  sensor.noise_fraction = noise;
  sensor.gauge_fraction = 0.001;
  return sensor_observation(block.maps, block.forces, block.scene.block_mm, block.scene.young_Pa, sensor, 3);
}

fem::Inclusion lump() {
  fem::Inclusion lump;
  lump.size_mm = {10, 10, 10};
  lump.depth_mm = 4;
  lump.stiffness_ratio = 5;
  return lump;
}

lump::DirectInversionOptions quick() {
  lump::DirectInversionOptions options;
  options.model.cells = {12, 12, 6};
  options.model.grids = {1, 2};
  options.model.searched = 1;
  options.model.centred = true;
  return options;
}

lump::Case::Lump ball(double diameter_mm, double depth_mm, double ratio) {
  lump::Case::Lump lump;
  lump.diameter_mm = diameter_mm;
  lump.depth_mm = depth_mm;
  lump.stiffness_ratio = ratio;
  return lump;
}

bool holds(const lump::Value& interval, double truth) {
  return interval.low <= truth && truth <= interval.high;
}

/// Reading of a ball of 8 mm, 5 mm deep, ten times as stiff, in the middle.
lump::Observation hard_ball() {
  fem::Inclusion hard;
  hard.stiffness_ratio = 10;
  return read(press(hard, {2, 4}, 48, 24), 0.002);
}

lump::DirectInversionOptions from_near_it() {
  lump::DirectInversionOptions options;
  options.model.centred = true;
  options.starts = {{ball(9, 4.4, 7), 1}};
  return options;
}

TEST(DirectInversion, FindsTheLumpThatMadeTheReading) {
  const lump::Observation observation = hard_ball();
  lump::DirectInversionOptions options = from_near_it();
  const lump::Estimate estimate = invert_directly(observation, options);
  // Such grids may leave the ratio open by more than a factor of four, and the result then reports it.
  EXPECT_EQ(estimate.verdict, estimate.stiffness_ratio.high > 4 * estimate.stiffness_ratio.low
                                  ? lump::Status::StiffnessOpen
                                  : lump::Status::Found)
      << (estimate.reasons.empty() ? "" : estimate.reasons[0]);
  EXPECT_GT(estimate.detection_statistic, 10);
  // The observation has errors of its own: 48 and 24 cells made it.
  EXPECT_NEAR(estimate.size_mm.value, 8, 0.1);
  EXPECT_NEAR(estimate.depth_mm.value, 5, 0.1);
  EXPECT_NEAR(std::log(estimate.stiffness_ratio.value / 10), 0, 0.15);
  EXPECT_TRUE(holds(estimate.stiffness_ratio, 10))
      << estimate.stiffness_ratio.low << " to " << estimate.stiffness_ratio.high;
  EXPECT_LT(estimate.size_mm.low, estimate.size_mm.value);
  EXPECT_GT(estimate.size_mm.high, estimate.size_mm.value);
}

TEST(DirectInversion, StartsDoNotDisturbEachOther) {
  const lump::Observation observation = read(press(lump(), {1.5, 3}), 0.002);
  lump::DirectInversionOptions once = quick();
  once.starts = {{ball(9, 4.4, 7), 1}};
  lump::DirectInversionOptions twice = once;
  twice.starts.push_back(once.starts[0]);
  const lump::Estimate alone = invert_directly(observation, once), both = invert_directly(observation, twice);
  EXPECT_EQ(alone.verdict, both.verdict);
  EXPECT_DOUBLE_EQ(alone.size_mm.value, both.size_mm.value);
  EXPECT_DOUBLE_EQ(alone.stiffness_ratio.high, both.stiffness_ratio.high);
  EXPECT_DOUBLE_EQ(alone.detection_statistic, both.detection_statistic);
  EXPECT_DOUBLE_EQ(both.shape_probability[0], 1);
}

TEST(DirectInversion, OneLoadAndNoiseLeaveTheStiffnessOpen) {
  const lump::Estimate estimate = invert_directly(read(press(lump(), {1}), 0.01), quick());
  EXPECT_EQ(estimate.verdict, lump::Status::StiffnessOpen);
  EXPECT_GT(estimate.stiffness_ratio.high, 4 * estimate.stiffness_ratio.low);
  ASSERT_FALSE(estimate.reasons.empty());
}

// Above a ratio of ten hardly anything changes, below three much does: the curvature at the best lump, the
// same to either side, does not determine the side.
TEST(DirectInversion, AnOpenRatioIsMoreOpenUpwards) {
  fem::Inclusion small;
  small.size_mm = {6, 6, 6};
  small.depth_mm = 6;
  small.stiffness_ratio = 12;
  const lump::Observation observation = read(press(small, {2, 4}, 48, 24), 0.005);
  lump::DirectInversionOptions options = quick();
  options.model.cells = {16, 16, 8};
  options.starts = {{ball(6.8, 5.6, 3), 1}};
  const lump::Estimate estimate = invert_directly(observation, options);
  EXPECT_EQ(estimate.verdict, lump::Status::StiffnessOpen);
  EXPECT_TRUE(holds(estimate.stiffness_ratio, 12));
  EXPECT_TRUE(holds(estimate.size_mm, 6)) << estimate.size_mm.low << " to " << estimate.size_mm.high;
  EXPECT_TRUE(holds(estimate.depth_mm, 6)) << estimate.depth_mm.low << " to " << estimate.depth_mm.high;
  const auto& [value, low, high] = estimate.stiffness_ratio;
  EXPECT_GT(low, 2);
  EXPECT_GT(std::log(high / value), 2 * std::log(value / low)) << low << ", " << value << ", " << high;
}

TEST(DirectInversion, TissueAloneIsNoLump) {
  const lump::Estimate estimate = invert_directly(read(press(std::nullopt, {1.5, 3}), 0.01), quick());
  EXPECT_EQ(estimate.verdict, lump::Status::NoLump) << estimate.detection_statistic;
}

/// The built-in emulator with bumps so many times as high.
std::shared_ptr<const lump::Model> emulator(float times = 1) {
  auto model = std::make_shared<lump::Model>(lump::Network::built_in().model());
  model->out_mean *= times;
  model->out_scale *= times;
  return model;
}

// Elements say what the emulator is off by: one whose bumps are a fifth too high leads to the same lump.
TEST(DirectInversion, AWrongEmulatorLeadsToTheSameLump) {
  const lump::Observation observation = hard_ball();
  lump::DirectInversionOptions options = from_near_it();
  std::array<lump::Estimate, 2> led;
  for (size_t wrong = 0; wrong < 2; ++wrong) {
    options.emulator = emulator(wrong == 0 ? 1 : 1.2F);
    led[wrong] = invert_directly(observation, options);
    EXPECT_TRUE(reports_numbers(led[wrong].verdict));
    EXPECT_NEAR(led[wrong].size_mm.value, 8, 0.1);
    EXPECT_NEAR(led[wrong].depth_mm.value, 5, 0.1);
    EXPECT_NEAR(std::log(led[wrong].stiffness_ratio.value / 10), 0, 0.15);
    EXPECT_TRUE(holds(led[wrong].stiffness_ratio, 10));
  }
  EXPECT_NEAR(std::log(led[1].size_mm.value / led[0].size_mm.value), 0, 0.004);
  EXPECT_NEAR(std::log(led[1].depth_mm.value / led[0].depth_mm.value), 0, 0.008);
  EXPECT_NEAR(std::log(led[1].stiffness_ratio.value / led[0].stiffness_ratio.value), 0, 0.04);
}

TEST(DirectInversion, TheEmulatorSeesNothingInTissueAloneButSmallLumps) {
  lump::DirectInversionOptions options = quick();
  options.emulator = emulator();
  const lump::Estimate nothing = invert_directly(read(press(std::nullopt, {1.5, 3}), 0.01), options);
  EXPECT_EQ(nothing.verdict, lump::Status::NoLump) << nothing.detection_statistic;
  fem::Inclusion small;
  small.size_mm = {5, 5, 5};
  small.depth_mm = 4;
  small.stiffness_ratio = 4;
  const lump::Estimate found = invert_directly(read(press(small, {1.5, 3}), 0.01), options);
  EXPECT_TRUE(reports_numbers(found.verdict)) << found.detection_statistic;
  EXPECT_TRUE(holds(found.size_mm, 5)) << found.size_mm.low << " to " << found.size_mm.high;
}

TEST(DirectInversion, EndsSoonAfterItIsStopped) {
  const lump::Observation observation = read(press(lump(), {1.5, 3}), 0.002);
  lump::DirectInversionOptions options = quick();
  options.emulator = emulator();
  options.starts = {{ball(9, 4.4, 7), 0.6}, {ball(9, 4.4, 7), 0.4}};
  options.starts[1].lump.shape = InclusionShape::Cylinder;
  size_t asked = 0, until = 100000000;
  options.stop = [&] { return ++asked > until; };
  EXPECT_TRUE(reports_numbers(invert_directly(observation, options).verdict));
  const size_t all = asked;
  EXPECT_GT(all, 300u) << "at each iteration of the elements";
  for (const size_t part : {0, 1, 4, 7, 9}) {
    until = all * part / 10;
    asked = 0;
    EXPECT_THROW(invert_directly(observation, options), Stopped);
    EXPECT_EQ(asked, until + 1) << "nothing is begun after it";
  }
}

TEST(DirectInversion, ALimitOfWorkEndsItAndIsReported) {
  const lump::Observation observation = read(press(lump(), {1.5, 3}), 0.002);
  lump::DirectInversionOptions options = quick();
  options.emulator = emulator();
  options.starts = {{ball(9, 4.4, 7), 1}};
  const auto told = [](const lump::Estimate& estimate) {
    return std::any_of(estimate.reasons.begin(), estimate.reasons.end(), [](const std::string& reason) {
      return reason.find("limit of work") != std::string::npos;
    });
  };
  const lump::Estimate whole = invert_directly(observation, options);
  ASSERT_TRUE(reports_numbers(whole.verdict));
  EXPECT_FALSE(told(whole));
  // Less than one press takes: no lump is reported, nor that there is none.
  options.most_work = 1000;
  const lump::Estimate nothing = invert_directly(observation, options);
  EXPECT_EQ(nothing.verdict, lump::Status::Unusable);
  EXPECT_TRUE(told(nothing));
  // The other method's answer stands.
  lump::Estimate other = whole;
  other.method = "network";
  other.size_mm = {10.2, 9, 12};
  options.otherwise = other;
  const lump::Estimate stands = invert_directly(observation, options);
  EXPECT_EQ(stands.method, "network");
  EXPECT_EQ(stands.verdict, whole.verdict);
  EXPECT_EQ(stands.size_mm.value, 10.2);
  EXPECT_TRUE(told(stands));
  // Enough for the first shape and not for the second: intervals hold the other method's.
  const lump::Estimate again = invert_directly(observation, options);
  EXPECT_EQ(again.size_mm.value, stands.size_mm.value) << "the same work each time";
  options.starts.push_back(options.starts[0]);
  options.starts[0].odds = 0.6;
  options.starts[1].odds = 0.4;
  options.starts[1].lump.shape = InclusionShape::Cylinder;
  for (options.most_work = 2e5; options.most_work < 1e9; options.most_work *= 1.3) {
    const lump::Estimate part = invert_directly(observation, options);
    if (part.method == "network") continue;
    EXPECT_TRUE(told(part)) << options.most_work;
    EXPECT_LE(part.size_mm.low, 9);
    EXPECT_GE(part.size_mm.high, 12);
    EXPECT_NEAR(part.size_mm.value, whole.size_mm.value, 0.3);
    break;
  }
}

TEST(DirectInversion, WhatCannotBeReadIsUnusable) {
  const Block block = press(lump(), {1.5, 3});
  lump::Observation observation = read(block, 0.002);
  observation.saturated_fraction = 0.1;
  EXPECT_EQ(invert_directly(observation, quick()).verdict, lump::Status::Unusable);
  observation.saturated_fraction = 0;
  for (PressureMap& map : observation.pressure_Pa)
    std::fill(map.values.begin(), map.values.end(), std::nanf(""));
  EXPECT_EQ(invert_directly(observation, quick()).verdict, lump::Status::Unusable);

  lump::Observation broken = read(block, 0.002);
  broken.force_N.pop_back();
  EXPECT_THROW(invert_directly(broken, quick()), Error);
  broken = read(block, 0.002);
  std::swap(broken.force_N[0], broken.force_N[1]);
  EXPECT_THROW(invert_directly(broken, quick()), Error);
  lump::DirectInversionOptions apart = quick();
  apart.model.grids = {2, 1};
  EXPECT_THROW(invert_directly(read(block, 0.002), apart), Error);
}

}  // namespace
}  // namespace palpate
