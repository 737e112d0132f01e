// Saturated loads: reported, left out, and no number where none remain.
#include "engine/lump/observation/saturated_loads.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/lump/network/network.h"
#include "engine/lump/observation/sensor_model.h"

namespace palpate {
namespace {

/// A dome with a bump on it at four loads.
std::vector<PressureMap> presses() {
  std::vector<PressureMap> maps;
  for (int k = 1; k <= 4; ++k) {
    PressureMap map{33, 33, {1.25, 1.25}, {}};
    for (int j = 0; j < 33; ++j)
      for (int i = 0; i < 33; ++i) {
        const double x = (i - 16) * 1.25, y = (j - 16) * 1.25;
        map.values.push_back(static_cast<float>(
            250 * k * (1 - 2e-4 * (x * x + y * y) + 0.8 * std::exp(-(x * x + y * y) / 32))));
      }
    maps.push_back(std::move(map));
  }
  return maps;
}

lump::Observation read(double exposure, size_t loads = 4) {
  lump::PalpationSensor sensor;
  sensor.size_px = {160, 120};
  sensor.exposure = exposure;
  std::vector<PressureMap> maps = presses();
  std::vector<double> forces = {0.5, 1, 1.5, 2};
  maps.erase(maps.begin(), maps.end() - static_cast<std::ptrdiff_t>(loads));
  forces.erase(forces.begin(), forces.end() - static_cast<std::ptrdiff_t>(loads));
  return sensor_observation(maps, forces, {40, 40, 20}, 4000, sensor, 1);
}

bool says(const lump::Estimate& estimate, const std::string& words) {
  for (const std::string& reason : estimate.reasons)
    if (reason.find(words) != std::string::npos) return true;
  return false;
}

TEST(SaturatedLoads, SharesAreThoseOfEachLoad) {
  const lump::Observation observation = read(1.6);
  const std::vector<double> fractions = saturated_fractions(observation);
  ASSERT_EQ(fractions.size(), 4u);
  EXPECT_EQ(fractions[0], 0);
  EXPECT_EQ(fractions[1], 0);
  EXPECT_GT(fractions[2], 0);
  EXPECT_NEAR(fractions[3], observation.saturated_fraction, 1e-9);
  EXPECT_NEAR(lump::saturated_fraction(observation.pressure_Pa), observation.saturated_fraction, 1e-9);
  // A part of the window that no load sees is not saturated.
  lump::Observation cut = observation;
  for (PressureMap& map : cut.pressure_Pa)
    for (uint32_t j = 0; j < map.height; ++j)
      for (uint32_t i = 0; i < 4; ++i) map.values[size_t{j} * map.width + i] = std::nanf("");
  const double part = 27.0 / 31;  // of the window's columns is left
  cut.saturated_fraction = observation.saturated_fraction / part;
  EXPECT_EQ(saturated_fractions(cut)[0], 0);
  EXPECT_NEAR(saturated_fractions(cut)[3], observation.saturated_fraction / part, 1e-6);
  EXPECT_NEAR(lump::saturated_fraction(cut.pressure_Pa), observation.saturated_fraction / part, 1e-6);
}

TEST(SaturatedLoads, OneMapAloneHasAHole) {
  const lump::Observation observation = read(1.2, 1);
  EXPECT_GT(observation.saturated_fraction, 0.03);
  EXPECT_NEAR(lump::saturated_fraction(observation.pressure_Pa), observation.saturated_fraction, 1e-9);
  EXPECT_EQ(lump::saturated_fraction(read(0.9, 1).pressure_Pa), 0);
}

TEST(SaturatedLoads, LittleIsToldMuchLeavesTheLoadOut) {
  lump::Estimate clean;
  ASSERT_EQ(without_saturated_loads(read(0.9), clean)->force_N.size(), 4u);
  EXPECT_TRUE(clean.reasons.empty());

  lump::Estimate little;
  const lump::Observation told = read(1.05);
  ASSERT_GE(told.saturated_fraction, lump::kReportedSaturation);
  ASSERT_LE(told.saturated_fraction, lump::kMostSaturation);
  EXPECT_EQ(without_saturated_loads(told, little)->force_N.size(), 4u);
  EXPECT_TRUE(says(little, "the sensor is saturated in"));

  lump::Estimate much;
  const auto rest = without_saturated_loads(read(1.6), much);
  ASSERT_TRUE(rest);
  EXPECT_EQ(rest->force_N.size(), 2u);
  EXPECT_EQ(rest->saturated_fraction, 0);
  EXPECT_TRUE(says(much, "is left out: the sensor is saturated"));
}

TEST(SaturatedLoads, NothingLeftIsNoNumber) {
  const lump::Estimate estimate = lump::Network::built_in().estimate(read(1.3, 1));
  EXPECT_EQ(estimate.verdict, lump::Status::Saturated);
  EXPECT_FALSE(reports_numbers(estimate.verdict));
  EXPECT_EQ(estimate.detection_statistic, 0);
  EXPECT_TRUE(says(estimate, "no load is left"));
}

}  // namespace
}  // namespace palpate
