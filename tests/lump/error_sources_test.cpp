// Intervals that cover the errors of an estimate's inputs, each source by what it moves.
#include "engine/lump/error_sources.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/base/normal.h"
#include "palpate/error.h"

namespace palpate {
namespace {

using lump::Observation;

/// A made-up inverse: the size goes with the modulus, the depth with the thickness, the ratio with the pitch;
/// the place with how far the map's first value is from its middle one.
lump::Estimate made_up(const Observation& o) {
  lump::Estimate e;
  e.verdict = lump::Status::Found;
  const auto value = [](double v) { return lump::Value{v, v * std::exp(-0.03), v * std::exp(0.03)}; };
  e.size_mm = value(8 * o.young_Pa / 4000);
  e.depth_mm = value(4 * std::pow(o.block_mm[2] / 20, 2));
  e.stiffness_ratio = value(6 * o.pressure_Pa[0].pitch_mm[0]);
  const PressureMap& map = o.pressure_Pa[0];
  const double tilt = static_cast<double>(map.at(1, 1)) - static_cast<double>(map.at(0, 0));
  e.x_mm = {tilt, tilt - 0.1, tilt + 0.1};
  e.y_mm = {0, -0.1, 0.1};
  e.wall_s = 1;
  return e;
}

Observation observation() {
  Observation o;
  o.pressure_Pa = {{3, 3, {1, 1}, std::vector<float>(9, 1.0f)}};
  o.force_N = {1};
  return o;
}

TEST(ErrorSources, NoneLeavesTheIntervalsAsTheyAre) {
  const lump::Estimator exact(made_up);
  const lump::Estimate e = exact(observation());
  EXPECT_TRUE(e.input_effects.empty());
  EXPECT_EQ(e.size_mm.low, made_up(observation()).size_mm.low);
  EXPECT_EQ(e.x_mm.low, -0.1);
  EXPECT_EQ(e.wall_s, 1);
  EXPECT_FALSE(lump::Estimator());
}

TEST(ErrorSources, EachWidensWhatItMovesBySquares) {
  const lump::Estimator estimator(made_up, lump::ErrorSources{});
  const Observation o = observation();
  const lump::Estimate e = estimator(o);
  ASSERT_EQ(e.input_effects.size(), 4u);
  // Modulus: ten per cent of the size, up and down.
  EXPECT_NEAR(std::log(e.size_mm.high / 8), std::hypot(0.03, std::log(1.1)), 1e-6);
  EXPECT_NEAR(std::log(e.size_mm.low / 8), -std::hypot(0.03, std::log(0.9)), 1e-6);
  EXPECT_NEAR(std::log(e.depth_mm.high / 4), std::hypot(0.03, 2 * std::log(1.05)), 1e-6);
  EXPECT_NEAR(std::log(e.stiffness_ratio.high / 6), std::hypot(0.03, std::log(1.01)), 1e-6);
  // Light: the middle against a corner, by the 90 % share of the window's unevenness; and the place.
  const double light = kNormal90 * o.uneven_sd;
  EXPECT_NEAR(e.x_mm.high, std::hypot(0.1, light, kNormal90 * o.place_sd_mm), 1e-6);
  EXPECT_NEAR(e.y_mm.high, std::hypot(0.1, kNormal90 * o.place_sd_mm), 1e-6);
  EXPECT_NEAR(e.y_mm.low, -e.y_mm.high, 1e-12);
  EXPECT_EQ(e.wall_s, 9);
  EXPECT_NE(effect_text(e.input_effects[0]).find("if the modulus is 10 % lower than stated: size -10 %"),
            std::string::npos)
      << effect_text(e.input_effects[0]);
  EXPECT_NE(effect_text(e.input_effects[3]).find("1.6 % darker than its corners: "), std::string::npos)
      << effect_text(e.input_effects[3]);
}

TEST(ErrorSources, AnotherInverseMovesFromItsOwnAnswer) {
  const lump::Estimator estimator(
      made_up, {.young = 0.1, .thickness = 0, .pitch = 0, .light = false, .place = false},
      [](const Observation& o) {
        lump::Estimate e = made_up(o);
        e.size_mm.value *= 1.5;  // another answer, which the same error moves alike
        return e;
      });
  const lump::Estimate e = estimator(observation());
  EXPECT_NEAR(std::log(e.size_mm.high / 8), std::hypot(0.03, std::log(1.1)), 1e-6);
}

TEST(ErrorSources, AnEndWithoutNumbersCountsAsTheOther) {
  const lump::Estimator estimator(
      [](const Observation& o) {
        lump::Estimate e = made_up(o);
        if (o.young_Pa < 4000) e.verdict = lump::Status::OutsideTraining;
        return e;
      },
      {.young = 0.1, .thickness = 0, .pitch = 0, .light = false, .place = false});
  const lump::Estimate e = estimator(observation());
  EXPECT_NEAR(std::log(e.size_mm.low / 8), -std::hypot(0.03, std::log(1.1)), 1e-6);
  EXPECT_NE(effect_text(e.input_effects[0]).find("lower than stated: no numbers"), std::string::npos);
}

TEST(ErrorSources, ALumpThatGoesAwayWithUnevenLightIsUnusable) {
  const lump::Estimator estimator(
      [](const Observation& o) {
        lump::Estimate e = made_up(o);
        if (e.x_mm.value < -0.01) e.verdict = lump::Status::NoLump;
        return e;
      },
      {.young = 0, .thickness = 0, .pitch = 0, .light = true, .place = true});
  Observation o = observation();
  const lump::Estimate gone = estimator(o);
  EXPECT_EQ(gone.verdict, lump::Status::Unusable);
  ASSERT_EQ(gone.reasons.size(), 1u);
  EXPECT_NE(gone.reasons[0].find("unevenness, which is known to 1 %"), std::string::npos) << gone.reasons[0];
  o.uneven_sd = 0.001;
  EXPECT_EQ(estimator(o).verdict, lump::Status::Found);
  // In a scan each window has its own light.
  int asked = 0;
  estimator(o, [&](double fraction) {
    ++asked;
    EXPECT_NEAR(std::abs(fraction), kNormal90 * 0.001, 1e-9);
    return o;
  });
  EXPECT_EQ(asked, 2);
}

TEST(ErrorSources, UnevenLightKeepsTheMean) {
  Observation o = observation();
  o.pressure_Pa[0] = {41, 31, {1, 1}, std::vector<float>(41 * 31, 1.0f)};
  const Observation lit = with_uneven_light(o, 0.1);
  double sum = 0;
  for (const float v : lit.pressure_Pa[0].values) sum += static_cast<double>(v);
  EXPECT_NEAR(sum / (41 * 31), 1, 0.005);
  EXPECT_NEAR(
      static_cast<double>(lit.pressure_Pa[0].at(20, 15)) - static_cast<double>(lit.pressure_Pa[0].at(0, 0)),
      0.1, 1e-6);
}

TEST(ErrorSources, SharesThatAreNoneAreRefused) {
  EXPECT_THROW(lump::Estimator(made_up, {.young = 0.6}), Error);
  EXPECT_THROW(lump::Estimator(made_up, {.pitch = -0.1}), Error);
}

}  // namespace
}  // namespace palpate
