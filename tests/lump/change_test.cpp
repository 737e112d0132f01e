// Change of a lump between two days: what two presses of one block say, and of one whose lump has grown.
#include "engine/lump/change/change.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/fem/large_strain/extrapolation.h"
#include "engine/lump/observation/sensor_model.h"
#include "palpate/error.h"

namespace palpate {
namespace {

using lump::ChangeVerdict;
using lump::LumpChange;

/// A block pressed by a plate, on cells other than those that the network was taught on.
struct PressedBall {
  std::vector<PressureMap> maps;
  std::vector<double> forces;
  fem::Scene scene;

  PressedBall(double diameter_mm, double depth_mm, double ratio, double deepest_mm) {
    scene.inclusion.emplace();
    scene.inclusion->size_mm = {diameter_mm, diameter_mm, diameter_mm};
    scene.inclusion->depth_mm = depth_mm;
    scene.inclusion->stiffness_ratio = ratio;
    if (diameter_mm == 0) scene.inclusion.reset();
    scene.cells = {32, 32, 16};
    fem::LargeStrainOptions options;
    options.map_nodes = {33, 33};
    options.step_mm = 2;
    std::vector<fem::PressLoad> loads;
    for (int k = 1; k <= 4; ++k) loads.push_back({deepest_mm * k / 4, std::nullopt});
    for (const fem::PressedBlock& state : solve_extrapolated(scene, {16, 16, 8}, loads, options).loads) {
      maps.push_back(state.pressure_Pa);
      forces.push_back(state.force_N);
    }
  }

  /// As a window sees it that lies elsewhere than is told.
  lump::Day day(uint64_t seed, std::array<double, 2> window_mm = {0, 0}, double noise = 0.002) const {
    lump::PalpationSensor sensor;
    sensor.window_mm = {36, 28};
    sensor.window_center_mm = window_mm;
    sensor.noise_fraction = noise;
    lump::Day day{sensor_observation(maps, forces, scene.block_mm, scene.young_Pa, sensor, seed), {}};
    day.observation.window_mm = {0, 0};
    day.observation.place_sd_mm = 1.2;
    day.estimate = lump::Network::built_in().estimate(day.observation);
    return day;
  }
};

LumpChange compared(const lump::Day& first, const lump::Day& second, const lump::ErrorSources& sources = {}) {
  return compare(lump::Network::built_in(), first, second, sources);
}

class ChangeOfLump : public testing::Test {
 protected:
  static const PressedBall& ball() {
    static const PressedBall it(9, 4, 5, 3.2);
    return it;
  }
  static const PressedBall& grown() {
    static const PressedBall it(9.9, 3.55, 5, 3.4);
    return it;
  }
  static const PressedBall& plain() {
    static const PressedBall it(0, 0, 1, 3.2);
    return it;
  }
};

// Placed anew by up to 2 mm, twelve times: no change is told, and nine of ten intervals hold none.
TEST_F(ChangeOfLump, AnotherPressOfTheSameBlockIsNoChange) {
  const lump::Day first = ball().day(1);
  int held = 0;
  for (uint64_t seed = 2; seed < 14; ++seed) {
    const double turn = 0.7 * static_cast<double>(seed);
    const LumpChange c = compared(first, ball().day(seed, {1.9 * std::cos(turn), 1.9 * std::sin(turn)}));
    EXPECT_EQ(c.verdict, ChangeVerdict::NoChange) << sentence_of(c);
    EXPECT_FALSE(c.ratio_changed) << sentence_of(c);
    EXPECT_NEAR(c.moved_mm[0], 1.9 * std::cos(turn), 0.25);
    EXPECT_NEAR(c.moved_mm[1], 1.9 * std::sin(turn), 0.25);
    held += c.size_mm.low <= 0 && c.size_mm.high >= 0;
  }
  EXPECT_GE(held, 9);
}

TEST_F(ChangeOfLump, GrowthIsToldWithAnIntervalThatHolds) {
  const lump::Day first = ball().day(1);
  int held = 0;
  for (uint64_t seed = 20; seed < 26; ++seed) {
    const LumpChange c = compared(first, grown().day(seed, {1.5, -1}));
    EXPECT_EQ(c.verdict, ChangeVerdict::Grown) << sentence_of(c);
    EXPECT_LT(c.size_mm.high - c.size_mm.low, 0.8) << "narrower than two estimates";
    held += c.size_mm.low <= 0.9 && c.size_mm.high >= 0.9;
    EXPECT_EQ(sentence_of(c).find("has grown by"), 0u);
  }
  EXPECT_GE(held, 4);
  const LumpChange back = compared(grown().day(30), first);
  EXPECT_EQ(back.verdict, ChangeVerdict::Shrunk) << sentence_of(back);
}

// Noise of 20 % of the peak hides it, and the sentence says how much more would have been seen.
TEST_F(ChangeOfLump, NoiseIsInTheInterval) {
  const LumpChange clear = compared(ball().day(1), grown().day(2)),
                   noisy = compared(ball().day(1, {0, 0}, 0.05), grown().day(2, {0, 0}, 0.05));
  ASSERT_TRUE(std::isfinite(noisy.least_mm)) << sentence_of(noisy);
  EXPECT_GT(noisy.least_mm, 2 * clear.least_mm);
}

TEST_F(ChangeOfLump, LumpsComeAndGo) {
  const lump::Day with = ball().day(1), without = plain().day(2);
  const LumpChange appeared = compared(without, with);
  EXPECT_EQ(appeared.verdict, ChangeVerdict::Appeared);
  ASSERT_FALSE(appeared.reasons.empty());
  EXPECT_NE(appeared.reasons.front().find("on the first day a ball 4 times as stiff"), std::string::npos)
      << appeared.reasons.front();
  EXPECT_EQ(compared(with, without).verdict, ChangeVerdict::Gone);
  EXPECT_EQ(compared(without, plain().day(3)).verdict, ChangeVerdict::NoLump);
}

TEST_F(ChangeOfLump, UnlikeDaysAreRefused) {
  const lump::Day first = ball().day(1);
  lump::Day harder = ball().day(2);
  for (double& force : harder.observation.force_N) force *= 1.8;
  for (PressureMap& map : harder.observation.pressure_Pa)
    for (float& value : map.values) value *= 1.8f;
  EXPECT_EQ(compared(first, harder).verdict, ChangeVerdict::NotComparable);
  EXPECT_NE(sentence_of(compared(first, harder)).find("press as hard"), std::string::npos);
  lump::Day elsewhere = ball().day(2);
  elsewhere.observation.window_mm = {6, 0};
  elsewhere.observation.place_sd_mm = 0.2;
  lump::Day sure = first;
  sure.observation.place_sd_mm = 0.2;
  EXPECT_NE(sentence_of(compared(sure, elsewhere)).find("another lump"), std::string::npos);
  lump::Day over = first, turned = ball().day(2);
  over.observation.window_mm = {3, 1};
  turned.observation.window_mm = {-3, -1};
  over.observation.place_sd_mm = turned.observation.place_sd_mm = 0.2;
  const LumpChange around = compared(over, turned);
  EXPECT_EQ(around.verdict, ChangeVerdict::NotComparable);
  EXPECT_NE(around.reasons.back().find("turned by 180 degrees"), std::string::npos) << around.reasons.back();
  lump::Day nothing = ball().day(3);
  nothing.estimate.verdict = lump::Status::Saturated;
  EXPECT_NE(sentence_of(compared(first, nothing)).find("second day"), std::string::npos);
}

// One block has one modulus: a small difference between the days is taken out, a large one contradicts.
TEST_F(ChangeOfLump, ModuliOfBothDaysAreOne) {
  const lump::Day first = ball().day(1);
  lump::Day second = ball().day(2);
  second.observation.young_Pa *= 1.08;
  const LumpChange near = compared(first, second);
  EXPECT_EQ(near.verdict, ChangeVerdict::NoChange) << sentence_of(near);
  EXPECT_FALSE(near.ratio_changed) << sentence_of(near);
  second.observation.young_Pa *= 1.2;
  const LumpChange far = compared(first, second);
  EXPECT_EQ(far.verdict, ChangeVerdict::NotComparable);
  EXPECT_NE(sentence_of(far).find("modulus"), std::string::npos) << sentence_of(far);
  EXPECT_TRUE(std::isfinite(compared(first, second, {.young = 0}).size_mm.value)) << "the tissue has changed";
}

// The tissue's modulus is wrong on both days alike: it moves both, and the change little.
TEST_F(ChangeOfLump, InputErrorsOfBothDaysMostlyCancel) {
  lump::Day first = ball().day(1), second = grown().day(2);
  const LumpChange right = compared(first, second);
  for (lump::Day* day : {&first, &second}) day->observation.young_Pa *= 1.1;
  const LumpChange wrong = compared(first, second);
  ASSERT_TRUE(std::isfinite(wrong.size_mm.value)) << sentence_of(wrong);
  EXPECT_GE(wrong.size_mm.value, right.size_mm.low);
  EXPECT_LE(wrong.size_mm.value, right.size_mm.high);
}

}  // namespace
}  // namespace palpate
