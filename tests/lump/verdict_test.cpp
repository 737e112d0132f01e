// Verdicts: tissue alone under every noise and pattern is no lump, and an observation gives the
// same from whichever side it is looked at.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "engine/lump/network/model.h"
#include "engine/lump/network/network.h"
#include "engine/lump/observation/fixed_pattern.h"
#include "engine/tissue/map_sampling.h"
#include "tests/lump/emulated_ball.h"

namespace palpate {
namespace {

constexpr double kYoung_Pa = 4000;
constexpr std::array<double, 4> kLoads = {0.06, 0.12, 0.18, 0.25};  // over area and modulus

/// Nodes over a window in the block's middle.
PressureMap empty_map(double width_mm, double height_mm) {
  PressureMap map;
  map.pitch_mm = {1.25, 1.25};
  map.width = window_nodes(width_mm, 1.25);
  map.height = window_nodes(height_mm, 1.25);
  map.values.resize(size_t{map.width} * map.height);
  return map;
}

/// Tissue alone, as the network's own model of it has it, at the last so many loads.
lump::Observation tissue(double thickness_mm, size_t loads) {
  const lump::Model& model = lump::Network::built_in().model();
  lump::Observation observation;
  observation.block_mm = {40, 40, thickness_mm};
  observation.young_Pa = kYoung_Pa;
  for (size_t k = kLoads.size() - loads; k < kLoads.size(); ++k) {
    const Eigen::VectorXf quarter = model.base.quarter(thickness_mm, kLoads[k]);
    PressureMap map = empty_map(40, 30);
    for (size_t n = 0; n < map.values.size(); ++n) {
      const auto [x, y] = place_of(map, n);
      map.values[n] = static_cast<float>(kYoung_Pa * model.base.at(quarter, x, y));
    }
    observation.pressure_Pa.push_back(std::move(map));
    observation.force_N.push_back(kLoads[k] * kYoung_Pa * 1600e-6);
  }
  return observation;
}

double peak_of(const lump::Observation& observation) {
  const auto& values = observation.pressure_Pa.back().values;
  return static_cast<double>(*std::max_element(values.begin(), values.end()));
}

/// Noise of each value, and a pattern that all loads share; shares of the peak.
void disturb(lump::Observation& observation, double noise, double pattern, const lump::PatternKind& kind,
             std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const double peak = peak_of(observation);
  const PressureMap& first = observation.pressure_Pa.front();
  const Eigen::MatrixXd fixed = lump::fixed_pattern(first.width, first.height, 1.25, kind.length_mm, random);
  for (PressureMap& map : observation.pressure_Pa)
    for (size_t n = 0; n < map.values.size(); ++n) {
      const double value = static_cast<double>(map.values[n]);
      const double here =
          fixed(static_cast<Eigen::Index>(n / map.width), static_cast<Eigen::Index>(n % map.width));
      map.values[n] = static_cast<float>(value + pattern * here * (kind.gain ? value : peak) +
                                         noise * peak * normal(random));
    }
}

TEST(LumpVerdict, TissueAloneIsNoLumpUnderAnyNoiseAndPattern) {
  const lump::Network& network = lump::Network::built_in();
  int asked = 0, none = 0, found = 0;
  for (const double noise : {0., 0.001, 0.01, 0.1})
    for (const double pattern : {0., 0.001, 0.0025, 0.005})
      for (const size_t loads : {1, 2, 4})
        for (uint64_t seed = 0; seed < 6; ++seed) {
          std::mt19937_64 random(seed * 7919 + loads);
          lump::Observation observation = tissue(17 + static_cast<double>(seed), loads);
          const lump::PatternKind kind = lump::any_pattern(random);
          disturb(observation, noise, pattern, kind, random);
          const lump::Status verdict = network.estimate(observation).verdict;
          ++asked;
          none += verdict == lump::Status::NoLump;
          const bool alarm = verdict != lump::Status::NoLump && verdict != lump::Status::OutsideTraining;
          found += alarm;
          if (alarm)
            std::printf("%s: noise %.3g, pattern %.3g of %.3g mm, %zu loads, seed %d\n", to_string(verdict),
                        noise, pattern, kind.length_mm, loads, static_cast<int>(seed));
        }
  std::printf("tissue alone: %d of %d no lump, %d a lump\n", none, asked, found);
  EXPECT_LE(found, asked / 100 + 1);
  EXPECT_GE(none, 0.97 * asked);
}

/// A ball as the network's emulator has it, off the middle.
lump::Observation ball(double size_mm, double depth_mm, double ratio, std::array<double, 2> offset_mm) {
  lump::Observation observation = tissue(20, 4);
  add_emulated_ball(size_mm, depth_mm, ratio, offset_mm, observation);
  return observation;
}

/// x and y exchanged.
lump::Observation turned(const lump::Observation& from) {
  lump::Observation to = from;
  for (PressureMap& map : to.pressure_Pa) {
    const PressureMap old = map;
    std::swap(map.width, map.height);
    for (uint32_t y = 0; y < map.height; ++y)
      for (uint32_t x = 0; x < map.width; ++x) map.values[size_t{y} * map.width + x] = old.at(y, x);
  }
  return to;
}

/// x to the other side.
lump::Observation mirrored(const lump::Observation& from) {
  lump::Observation to = from;
  for (PressureMap& map : to.pressure_Pa) {
    const PressureMap old = map;
    for (uint32_t y = 0; y < map.height; ++y)
      for (uint32_t x = 0; x < map.width; ++x)
        map.values[size_t{y} * map.width + x] = old.at(map.width - 1 - x, y);
  }
  return to;
}

TEST(LumpVerdict, IsTheSameFromEverySide) {
  const lump::Network& network = lump::Network::built_in();
  for (uint64_t seed = 0; seed < 6; ++seed) {
    std::mt19937_64 random(seed);
    lump::Observation first = ball(7, 3, 6, {1.3, -3.1});
    disturb(first, 0.005, 0.001, lump::any_pattern(random), random);
    for (const lump::Method method : {lump::Method::Network, lump::Method::Refined}) {
      const lump::Estimate as_it_lies = network.estimate(first, method);
      ASSERT_TRUE(reports_numbers(as_it_lies.verdict)) << to_string(as_it_lies.verdict);
      lump::Observation other = first;
      for (int turn = 0; turn < 4; ++turn) {
        other = turned(mirrored(other));  // by a quarter
        for (const lump::Observation& one : {other, mirrored(other)}) {
          const lump::Estimate e = network.estimate(one, method);
          EXPECT_EQ(e.verdict, as_it_lies.verdict);
          const std::array<std::pair<lump::Value, lump::Value>, 3> pairs = {
              std::pair{e.size_mm, as_it_lies.size_mm},
              {e.depth_mm, as_it_lies.depth_mm},
              {e.stiffness_ratio, as_it_lies.stiffness_ratio}};
          for (const auto& [there, here] : pairs) {
            EXPECT_NEAR(there.value, here.value, 2e-3 * here.value) << turn;
            EXPECT_NEAR(there.low, here.low, 2e-3 * here.low) << turn;
            EXPECT_NEAR(there.high, here.high, 2e-3 * here.high) << turn;
          }
        }
      }
    }
  }
}

TEST(FixedPattern, HasTheVarianceAndTheLengthThatAreAskedFor) {
  std::mt19937_64 random(1);
  for (const double length : {0., 1.5, 4.}) {
    double variance = 0, next = 0;
    int count = 0;
    for (int i = 0; i < 60; ++i) {
      const Eigen::MatrixXd p = lump::fixed_pattern(20, 16, 1.25, length, random);
      ASSERT_EQ(p.rows(), 16);
      ASSERT_EQ(p.cols(), 20);
      variance += p.array().square().sum();
      next += (p.leftCols(18).array() * p.rightCols(18).array()).sum() * 20 / 18;
      count += 320;
    }
    const double expected = length > 0 ? std::exp(-0.5 * std::pow(2.5 / length, 2)) : 0;  // two nodes apart
    EXPECT_NEAR(variance / count, 1, 0.12) << length;
    EXPECT_NEAR(next / variance, expected, 0.05) << length;
  }
}

}  // namespace
}  // namespace palpate
