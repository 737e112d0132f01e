// Limits of detection: lumps above them are seen, lumps well below are not, and "no lump" states them.
#include <gtest/gtest.h>

#include <cmath>

#include "capture/files/estimate_report.h"
#include "engine/lump/network/detection_limit.h"
#include "engine/lump/network/limit_search.h"
#include "tests/lump/emulated_ball.h"
#include "tests/support/calculix.h"

namespace palpate {
namespace {

const std::vector<double> kForces_N = {0.4, 0.8, 1.2, 1.6};
constexpr int kNoises = 20;  // readings each
constexpr double kTissue_Pa = 4000, kThick_mm = 20;

lump::PalpationSensor sensor_of(double noise_fraction) {
  lump::PalpationSensor sensor;
  sensor.noise_fraction = noise_fraction;
  sensor.gauge_fraction = 0;
  return sensor;
}

lump::Observation tissue_alone(double noise_fraction, uint64_t seed) {
  return plain_observation(lump::Network::built_in().model(), kThick_mm, kTissue_Pa, kForces_N,
                           sensor_of(noise_fraction), seed);
}

double limit_mm(double noise_fraction, double depth_mm, double ratio, uint64_t seed = 1) {
  const lump::Model& model = lump::Network::built_in().model();
  lump::Estimate trouble;
  const auto nodes = pressed_nodes(model, tissue_alone(noise_fraction, seed), trouble);
  return lump::DetectionLimits(model, *nodes, lump::Method::Refined, {0, 0})
      .size_mm(InclusionShape::Sphere, depth_mm, ratio);
}

double seen_share(double noise_fraction, double size_mm, double depth_mm, double ratio) {
  int seen = 0;
  for (uint64_t seed = 100; seed < uint64_t{100} + kNoises; ++seed) {
    lump::Observation observation = tissue_alone(noise_fraction, seed);
    add_emulated_ball(size_mm, depth_mm, ratio, {0, 0}, observation);
    seen += lump::Network::built_in().estimate(observation, lump::Method::Refined).detection_statistic >= 1;
  }
  return static_cast<double>(seen) / kNoises;
}

TEST(DetectionLimit, ABallAboveItIsSeenAndOneWellBelowIsNot) {
  struct Place {
    double noise, depth_mm, ratio;
  };
  for (const auto& [noise, depth_mm, ratio] : {Place{0.15, 4, 3}, {0.15, 7, 10}, {0.06, 8, 4}}) {
    const double size_mm = limit_mm(noise, depth_mm, ratio);
    ASSERT_GT(size_mm, 4) << "the emulator knows no smaller ones";
    ASSERT_LT(size_mm, 12);
    std::printf("noise %g, %g mm deep, ratio %g: from %.3g mm on\n", noise, depth_mm, ratio, size_mm);
    EXPECT_GE(seen_share(noise, 1.1 * size_mm, depth_mm, ratio), 0.85);
    EXPECT_LE(seen_share(noise, 0.7 * size_mm, depth_mm, ratio), 0.5);
  }
}

// A ball that another program's finite elements pressed, under noise that puts it above and below the limit.
TEST(DetectionLimit, HoldsForABallOfAnotherProgram) {
  const CalculixCase block = calculix_case("small_ball");
  const fem::Inclusion& ball = *block.scene.inclusion;
  const auto seen = [&](double noise_fraction) {
    std::vector<PressureMap> maps;
    std::vector<double> forces_N;
    for (const CalculixCase::Load& load : block.loads) {
      maps.push_back(load.pressure_Pa);
      forces_N.push_back(load.force_N);
    }
    int count = 0;
    for (uint64_t seed = 0; seed < kNoises; ++seed)
      count += lump::Network::built_in()
                   .estimate(sensor_observation(maps, forces_N, block.scene.block_mm, block.scene.young_Pa,
                                                sensor_of(noise_fraction), seed),
                             lump::Method::Refined)
                   .detection_statistic >= 1;
    return static_cast<double>(count) / kNoises;
  };
  const auto noise_at = [&](double size_mm) {
    double low = 0.001, high = 0.5;
    for (int i = 0; i < 12; ++i) {
      const double middle = std::sqrt(low * high);
      const double limit = limit_mm(middle, ball.depth_mm, ball.stiffness_ratio);
      (limit < size_mm ? low : high) = middle;
    }
    return low;
  };
  const double above = noise_at(ball.size_mm[0] / 1.3), below = noise_at(ball.size_mm[0] / 0.6);
  std::printf("%g mm: three tenths above the limit at noise of %.3g of the peak, far below at %.3g\n",
              ball.size_mm[0], above, below);
  const double share = seen(above);
  std::printf("seen in %.0f %% of readings\n", 100 * share);
  EXPECT_GE(share, 0.8);
  EXPECT_LE(seen(below), 0.5);
}

TEST(DetectionLimit, GrowsWithDepthAndNoiseAndFallsWithStiffness) {
  EXPECT_GT(limit_mm(0.1, 6, 4), 1.2 * limit_mm(0.1, 4, 4));
  EXPECT_GT(limit_mm(0.1, 6, 4), 1.1 * limit_mm(0.05, 6, 4));
  EXPECT_GT(limit_mm(0.1, 6, 2), 1.1 * limit_mm(0.1, 6, 10));
  EXPECT_TRUE(std::isnan(limit_mm(0.5, 9, 1.5)));
  EXPECT_EQ(limit_mm(0.0003, 1.5, 20), lump::kLeastSeen_mm);
}

TEST(DetectionLimit, IsQuotedWhereNoLumpIsSeen) {
  const lump::Estimate none =
      lump::Network::built_in().estimate(tissue_alone(0.01, 3), lump::Method::Refined);
  ASSERT_EQ(none.verdict, lump::Status::NoLump);
  ASSERT_FALSE(none.detection_limits.empty());
  EXPECT_NE(none.reasons.back().find("a ball 4 times as stiff as the tissue would be seen from"),
            std::string::npos)
      << none.reasons.back();
  const json::Value limits = facts_of(none).json["detection_limits"];
  ASSERT_EQ(limits.size(), none.detection_limits.size());
  EXPECT_EQ(limits[0]["depth_mm"], none.detection_limits[0].depth_mm);
  lump::Observation with = tissue_alone(0.01, 3);
  add_emulated_ball(9, 3, 6, {0, 0}, with);
  EXPECT_TRUE(lump::Network::built_in().estimate(with, lump::Method::Refined).detection_limits.empty());
  EXPECT_EQ(sentence_of(std::vector<lump::DetectionLimit>{{2, 4, std::nan("")}}),
            "a ball 4 times as stiff as the tissue would not be seen here, of whatever size");
}

}  // namespace
}  // namespace palpate
