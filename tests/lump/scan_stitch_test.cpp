// Presses at several places stitched to one map, against the map they were cut from.
#include "engine/lump/observation/scan_stitch.h"
#include "engine/fem/solve.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/lump/observation/sensor_model.h"
#include "engine/tissue/map_sampling.h"
#include "palpate/error.h"

namespace palpate {
namespace {

/// A solved block with a lump off its middle, and how it answers to force: not quite in proportion.
const fem::Result& solved() {
  static const fem::Result result = [] {
    fem::Scene scene;
    scene.inclusion->offset_mm = {3, -2};
    scene.press_mm.reset();
    scene.force_N = 1;
    scene.cells = {32, 32, 16};
    return fem::solve(scene);
  }();
  return result;
}
PressureMap truth_at(double force_N) {
  PressureMap map = solved().stress_Pa;
  const double mean = 1 / 1600e-6;
  for (float& value : map.values) {
    const double v = static_cast<double>(value);
    value = static_cast<float>(force_N * v * (1 + 0.05 * force_N * (v / mean - 1)));
  }
  return map;
}

struct Plan {
  std::vector<std::array<double, 2>> stage_mm;
  std::vector<std::array<double, 2>> error_mm;  // true place minus the stage's
  std::vector<double> gain;
  double noise = 0.01;
  double full_scale_Pa = 0;
};
/// A window of 27.84 x 20.88 mm at three by three places: overlaps of about half.
Plan nine() {
  Plan plan;
  for (const double y : {-10.0, 0.0, 10.0})
    for (const double x : {-7.0, 0.0, 7.0}) plan.stage_mm.push_back({x, y});
  plan.error_mm.resize(9);
  plan.gain.assign(9, 1);
  return plan;
}

std::vector<lump::ScanPress> press(const Plan& plan, uint64_t seed = 1) {
  std::vector<lump::ScanPress> presses;
  for (size_t p = 0; p < plan.stage_mm.size(); ++p) {
    const double off = 1 + 0.04 * std::sin(2.4 * static_cast<double>(p));  // forces never repeat
    std::vector<double> forces_N;
    std::vector<PressureMap> maps;
    for (const double force_N : {0.5, 1.0, 1.5, 2.0}) {
      forces_N.push_back(off * force_N);
      maps.push_back(truth_at(off * force_N));
    }
    lump::PalpationSensor sensor;
    sensor.size_px = {320, 240};
    sensor.window_mm = {27.84, 20.88};
    sensor.least_cell = 0;
    sensor.window_center_mm = {plan.stage_mm[p][0] + plan.error_mm[p][0],
                               plan.stage_mm[p][1] + plan.error_mm[p][1]};
    sensor.noise_fraction = plan.noise;
    sensor.gauge_fraction = 0.001;
    sensor.full_scale_Pa = plan.full_scale_Pa;
    lump::Observation r = sensor_observation(maps, forces_N, {40, 40, 20}, 4000, sensor, seed * 100 + p);
    r.window_mm = plan.stage_mm[p];
    for (PressureMap& map : r.pressure_Pa)
      for (float& value : map.values) value *= static_cast<float>(plan.gain[p]);
    presses.push_back({"press " + std::to_string(p + 1), std::move(r)});
  }
  return presses;
}

/// Root mean square of map minus truth where it was seen, at the highest load.
double error_Pa(const lump::ScanMap& map) {
  const PressureMap& found = map.observation.pressure_Pa.back();
  const PressureMap truth = truth_at(map.observation.force_N.back());
  double sum = 0;
  size_t count = 0;
  for (uint32_t j = 0; j < found.height; ++j)
    for (uint32_t i = 0; i < found.width; ++i) {
      const double v = static_cast<double>(found.at(i, j));
      if (!std::isfinite(v)) continue;
      const double x = (i - (found.width - 1) / 2.0) * found.pitch_mm[0],
                   y = (j - (found.height - 1) / 2.0) * found.pitch_mm[1];
      if (std::abs(x) > 18 || std::abs(y) > 18) continue;  // means over cells that end at the rim
      const double off = v - map_at(truth, x, y);
      sum += off * off;
      ++count;
    }
  return std::sqrt(sum / static_cast<double>(count));
}

/// Half of a node aside, where noise between nodes is least.
TEST(ScanStitch, NoiseDrawsNoPressAside) {
  Plan plan = nine();
  for (auto& [x, y] : plan.stage_mm) {
    x *= 6.875 / 7;
    y *= 9.375 / 10;
  }
  plan.noise = 0.05;
  lump::StitchOptions options;
  options.stage_sd_mm = 0.2;
  double squares = 0, stated = 0;
  int count = 0;
  for (uint64_t seed = 1; seed <= 4; ++seed)
    for (const lump::PressPlace& place : lump::stitch(press(plan, seed), options).places)
      for (size_t c = 0; c < 2; ++c, ++count) {
        squares += std::pow(place.shift_mm[c], 2);
        stated += std::pow(place.shift_sd_mm[c], 2);
      }
  std::printf("moved by %.3f mm, stated %.3f\n", std::sqrt(squares / count), std::sqrt(stated / count));
  EXPECT_LT(squares, 1.5 * 1.5 * stated);
}

TEST(ScanStitch, NineWindowsAreTheBlock) {
  const lump::ScanMap map = lump::stitch(press(nine()));
  EXPECT_TRUE(map.warnings.empty()) << map.warnings[0];
  EXPECT_GT(map.seen_fraction, 0.99);
  ASSERT_EQ(map.observation.pressure_Pa.size(), 4u);
  EXPECT_NEAR(map.observation.force_N.back(), 2, 0.1);
  EXPECT_EQ(map.observation.pressure_Pa[0].width, 33u);
  const double peak = 2200;
  EXPECT_LT(error_Pa(map), 0.012 * peak);
  // The noise that it states is the error that it has.
  EXPECT_GT(map.observation.noise_Pa, 0.6 * error_Pa(map));
  EXPECT_LT(map.observation.noise_Pa, 1.7 * error_Pa(map));
  EXPECT_NEAR(map.between_presses_Pa, 0.01 * peak, 0.006 * peak);
  for (const lump::PressPlace& place : map.places) {
    EXPECT_TRUE(place.used);
    EXPECT_NEAR(place.deviation, 1, 0.4) << place.name;
    EXPECT_LT(std::hypot(place.shift_mm[0], place.shift_mm[1]), 0.35) << place.name;
    EXPECT_NEAR(place.gain, 1, 0.02) << place.name;
  }
}

// One press 1 mm off its stated place is found, the others stay where they are.
TEST(ScanStitch, AMovedPressIsPutBack) {
  Plan plan = nine();
  plan.error_mm[4] = {0.8, -0.6};
  const lump::ScanMap map = lump::stitch(press(plan));
  const lump::PressPlace& moved = map.places[4];
  EXPECT_NEAR(moved.shift_mm[0], 0.8, 0.15);
  EXPECT_NEAR(moved.shift_mm[1], -0.6, 0.15);
  EXPECT_GT(moved.shift_sd_mm[0], 0.005);
  EXPECT_LT(moved.shift_sd_mm[0], 0.2);
  for (size_t p = 0; p < 9; ++p)
    EXPECT_LT(p == 4 ? 0 : std::hypot(map.places[p].shift_mm[0], map.places[p].shift_mm[1]), 0.35) << p;
  ASSERT_EQ(map.warnings.size(), 1u);
  EXPECT_NE(map.warnings[0].find("press 5"), std::string::npos) << map.warnings[0];
  lump::StitchOptions trusting;
  trusting.stage_sd_mm = 1e-4;
  EXPECT_LT(error_Pa(map), 0.9 * error_Pa(lump::stitch(press(plan), trusting)));
}

TEST(ScanStitch, AScaleErrorIsTakenOut) {
  Plan plan = nine();
  plan.gain[2] = 1.08;
  const lump::ScanMap map = lump::stitch(press(plan));
  EXPECT_NEAR(map.places[2].gain, 1.08, 0.015);
  ASSERT_EQ(map.warnings.size(), 1u);
  EXPECT_NE(map.warnings[0].find("press 3"), std::string::npos) << map.warnings[0];
  EXPECT_LT(error_Pa(map), 0.012 * 2200);
}

TEST(ScanStitch, WhatNobodySawIsNotANumber) {
  Plan plan = nine();
  plan.stage_mm.resize(6);  // without the lowest row
  const lump::ScanMap map = lump::stitch(press(plan));
  EXPECT_LT(map.seen_fraction, 0.85);
  EXPECT_TRUE(std::isnan(map.observation.pressure_Pa.back().at(16, 32)));
  EXPECT_EQ(map.presses.at(16, 32), 0);
  EXPECT_EQ(map.observation.saturated_fraction, 0);
  EXPECT_NE(map.warnings.back().find("not seen"), std::string::npos);
  EXPECT_LT(error_Pa(map), 0.015 * 2200);
}

// The peak is beyond the sensor: no press holds it, and the map says so instead of showing its limit.
TEST(ScanStitch, SaturatedPlacesStayOpen) {
  Plan plan = nine();
  plan.full_scale_Pa = 1600;
  const lump::ScanMap map = lump::stitch(press(plan));
  EXPECT_GT(map.observation.saturated_fraction, 0.01);
  EXPECT_TRUE(std::isnan(map.observation.pressure_Pa.back().at(18, 14)));
  for (const float value : map.observation.pressure_Pa.back().values) EXPECT_FALSE(value > 1750) << value;
  EXPECT_FALSE(map.warnings.empty());
}

TEST(ScanStitch, OneSaturatedPressIsFilledByTheOthers) {
  std::vector<lump::ScanPress> presses = press(nine());
  Plan dim = nine();
  dim.full_scale_Pa = 1600;
  presses[4] = press(dim)[4];
  const lump::ScanMap map = lump::stitch(presses);
  EXPECT_GT(map.seen_fraction, 0.99);
  EXPECT_EQ(map.observation.saturated_fraction, 0);
  EXPECT_LT(error_Pa(map), 0.012 * 2200);
}

TEST(ScanStitch, AnotherBlocksPressIsLeftOut) {
  std::vector<lump::ScanPress> presses = press(nine());
  for (PressureMap& map : presses[4].observation.pressure_Pa)
    for (uint32_t i = 0; i < map.width * map.height; ++i)
      map.values[i] *= static_cast<float>(1 + 0.4 * std::sin(0.9 * i));
  const lump::ScanMap map = lump::stitch(presses);
  EXPECT_FALSE(map.places[4].used);
  EXPECT_NE(map.places[4].reason.find("unlike"), std::string::npos);
  EXPECT_LT(error_Pa(map), 0.015 * 2200);
}

TEST(ScanStitch, APressThatEndedEarlyIsLeftOut) {
  std::vector<lump::ScanPress> presses = press(nine());
  for (double& force_N : presses[0].observation.force_N) force_N *= 0.6;
  const lump::ScanMap map = lump::stitch(presses);
  EXPECT_FALSE(map.places[0].used);
  EXPECT_NE(map.warnings[0].find("it reached"), std::string::npos) << map.warnings[0];
}

TEST(ScanStitch, OnePressIsAMapOfItsWindow) {
  std::vector<lump::ScanPress> presses = {press(nine())[4]};
  const lump::ScanMap map = lump::stitch(presses);
  EXPECT_EQ(map.places[0].shift_mm[0], 0);
  EXPECT_EQ(map.between_presses_Pa, 0);
  EXPECT_NEAR(map.observation.noise_Pa, presses[0].observation.noise_Pa,
              1e-6 * presses[0].observation.noise_Pa);
  EXPECT_NEAR(map.seen_fraction, 27.84 * 20.88 / 1600, 0.06);
}

TEST(ScanStitch, RefusesWhatMakesNoSense) {
  EXPECT_THROW(lump::stitch({}), Error);
  const std::vector<lump::ScanPress> good = press(nine());
  const auto refused = [&](auto change, const char* word) {
    std::vector<lump::ScanPress> presses = good;
    change(presses[1].observation);
    try {
      lump::stitch(presses);
      ADD_FAILURE() << word;
    } catch (const Error& error) {
      EXPECT_EQ(error.failure(), Failure::Input);
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find("press 2"), std::string::npos) << error.what();
    }
  };
  refused([](lump::Observation& r) { r.block_mm[2] = 30; }, "block");
  refused([](lump::Observation& r) { r.force_N.pop_back(); }, "forces");
  refused([](lump::Observation& r) { r.force_N[1] = 0.1; }, "rise");
  refused([](lump::Observation& r) { r.force_N[0] = NAN; }, "rise");
  refused([](lump::Observation& r) { r.pressure_Pa[2].values.pop_back(); }, "maps");
  refused([](lump::Observation& r) { r.noise_Pa = NAN; }, "noise");
}

}  // namespace
}  // namespace palpate
