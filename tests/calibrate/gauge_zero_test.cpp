// Zero of a gauge with its error, and the cases in which there is none to rely on.
#include "engine/calibrate/gauge_zero.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace palpate {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Three presses of 5 N; each is seen `late` frames after it began and lost as long before it ends.
struct GaugeRecord {
  std::vector<double> force_N;
  std::vector<bool> touched;

  explicit GaugeRecord(size_t late = 5) {
    for (size_t i = 0; i < 400; ++i) {
      const size_t in = i % 120;
      const bool pressing = i >= 30 && i < 360 && in >= 30 && in < 90;
      force_N.push_back(pressing ? 5 * std::sin(3.14159 * static_cast<double>(in - 30) / 60) : 0);
      touched.push_back(pressing && in >= 30 + late && in < 90 - late);
    }
  }
  GaugeRecord& with(double offset_N, double noise_N, uint64_t seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal(0, noise_N);
    for (double& f : force_N) f += offset_N + (noise_N > 0 ? normal(random) : 0);
    return *this;
  }
};

TEST(GaugeZero, IsTheUntouchedReadingWithinItsError) {
  int within = 0;
  for (uint64_t seed = 1; seed <= 200; ++seed) {
    const GaugeRecord r = GaugeRecord().with(0.8, 0.05, seed);
    const auto zero = find_gauge_zero(r.force_N, r.touched, Pressed::Above);
    ASSERT_TRUE(zero);
    EXPECT_TRUE(zero->differs());
    EXPECT_TRUE(zero->steady());
    EXPECT_NEAR(zero->offset, 0.8, 0.05);
    EXPECT_LT(zero->sd, 0.02);
    within += std::abs(zero->offset - 0.8) <= 1.96 * zero->sd;
  }
  EXPECT_GE(within, 176) << "of 200, 95 % are promised";
}

TEST(GaugeZero, ATouchThatIsSeenLateDoesNotMoveIt) {
  const GaugeRecord r(12);  // seen at half of its force
  const auto zero = find_gauge_zero(r.force_N, r.touched, Pressed::Above);
  ASSERT_TRUE(zero);
  EXPECT_FALSE(zero->differs()) << zero->offset;
}

TEST(GaugeZero, ATouchThatIsNotSeenDoesNotMoveIt) {
  // The recording begins in a press that the image shows later.
  GaugeRecord r(12);
  for (size_t i = 0; i < 30; ++i) r.force_N[i] = 0.05 * static_cast<double>(i + 10);
  const auto zero = find_gauge_zero(r.force_N, r.touched, Pressed::Above);
  ASSERT_TRUE(zero);
  EXPECT_FALSE(zero->differs()) << zero->offset;
  EXPECT_TRUE(zero->steady()) << zero->spread;
}

/// A recording that begins as the press does: its first readings are small forces that nothing sees.
TEST(GaugeZero, AnUnseenRiseIsNoOffset) {
  std::vector<double> force_N;
  std::vector<bool> touched;
  for (size_t i = 0; i < 60; ++i) {
    force_N.push_back(0.14 + 0.12 * static_cast<double>(i));
    touched.push_back(i >= 5);
  }
  const auto zero = find_gauge_zero(force_N, touched, Pressed::Above);
  ASSERT_TRUE(zero);
  EXPECT_GT(zero->offset, 0.1);
  EXPECT_FALSE(zero->differs());
}

TEST(GaugeZero, NoiseAloneIsNoOffset) {
  int differs = 0;
  for (uint64_t seed = 1; seed <= 100; ++seed)
    differs +=
        find_gauge_zero(GaugeRecord().with(0, 0.05, seed).force_N, GaugeRecord().touched, Pressed::Above)
            ->differs();
  EXPECT_LE(differs, 4);
}

TEST(GaugeZero, OneThatMovesIsNotSteady) {
  GaugeRecord r;
  for (size_t i = 200; i < 400; ++i) r.force_N[i] += 1.5;
  EXPECT_FALSE(find_gauge_zero(r.force_N, r.touched, Pressed::Above)->steady());
  // A direction that reads next to nothing is judged by the range of the others.
  const std::vector<bool> touched = r.touched;
  std::vector<double> small(400, 0.01);
  for (size_t i = 200; i < 400; ++i) small[i] = 0.02;
  EXPECT_FALSE(find_gauge_zero(small, touched, Pressed::Either)->steady());
  EXPECT_TRUE(find_gauge_zero(small, touched, Pressed::Either, 5)->steady());
}

TEST(GaugeZero, WithoutUntouchedReadingsThereIsNone) {
  const GaugeRecord r;
  EXPECT_FALSE(find_gauge_zero(r.force_N, std::vector<bool>(400, true), Pressed::Above));
  EXPECT_FALSE(find_gauge_zero(std::vector<double>(400, kNaN), r.touched, Pressed::Above));
  std::vector<double> some = r.force_N;
  for (size_t i = 0; i < 30; ++i) some[i] = kNaN;  // frames before the gauge began
  const auto zero = find_gauge_zero(some, r.touched, Pressed::Above);
  ASSERT_TRUE(zero);
  EXPECT_NEAR(zero->offset, 0, 1e-9);
  EXPECT_NEAR(zero->range, 5, 0.01);
}

}  // namespace
}  // namespace palpate
