// A lump under a skin: the finite elements' press with the skin taken off, and estimates that know of it or
// do not.
#include "engine/lump/press_effect/press_effect.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <utility>

#include "engine/lump/change/change.h"
#include "engine/lump/error_sources.h"
#include "engine/lump/network/network.h"
#include "tests/lump/pressed_block.h"

namespace palpate {
namespace {

constexpr auto& kBall = kPressedBall;

/// The ball, and the same under a skin of 2 mm, four times as stiff as the tissue.
const lump::Observation& ball_alone() {
  static const lump::Observation observation = pressed_block({}, kBall);
  return observation;
}
const lump::Observation& ball_under_skin() {
  static const lump::Observation observation = pressed_block({.skin = fem::Skin{2, 4}}, kBall);
  return observation;
}

lump::Observation told(lump::Observation o, const lump::Skin& skin) {
  o.skin = skin;
  return o;
}

TEST(SkinEffect, MapsAndWaysAreThoseOfTheBlockWithoutIt) {
  const lump::Observation &bare = ball_alone(), &under = ball_under_skin();
  lump::PressEffect effect(under, {.skin = fem::Skin{2, 4}});
  ASSERT_TRUE(effect.converged());
  ASSERT_TRUE(effect.set_lumps({kBall}));
  const lump::Observation off = effect.taken_off(under);
  EXPECT_FALSE(off.skin);
  // The third load's force lies between two of the bare block's.
  const double force_N = under.force_N[2];
  ASSERT_TRUE(force_N > bare.force_N[2] && force_N < bare.force_N[3]);
  const double way_mm = at_force(bare, bare.press_mm, force_N);
  EXPECT_NEAR(off.press_mm[2], way_mm, 0.01);
  EXPECT_GT(std::abs(under.press_mm[2] - way_mm), 0.2) << "the skin hardly matters";
  const double left = map_difference(off, 2, bare), there = map_difference(under, 2, bare);
  std::printf("a skin of 2 mm, ratio 4, changes the map by %.2f %% of its peak (RMS); taken off: %.2f %%\n",
              100 * there, 100 * left);
  EXPECT_GT(there, 0.01);
  EXPECT_LT(left, 0.15 * there);
}

TEST(SkinEffect, NoneTakesNothingOff) {
  const lump::Observation& bare = ball_alone();
  lump::PressEffect effect(bare, {.skin = fem::Skin{2, 1}}, lump::PressEffect::Effort::Rough);
  ASSERT_TRUE(effect.converged() && effect.set_lumps({kBall}));
  const lump::Observation off = effect.taken_off(bare);
  for (size_t k = 0; k < 4; ++k) {
    EXPECT_NEAR(off.press_mm[k], bare.press_mm[k], 1e-9);
    for (size_t n = 0; n < off.pressure_Pa[k].values.size(); ++n)
      EXPECT_NEAR(off.pressure_Pa[k].values[n], bare.pressure_Pa[k].values[n], 0.05);
  }
  const lump::Observation& under = ball_under_skin();
  const lump::Observation same =
      lump::PressEffect(under, {.skin = fem::Skin{2, 4}}, lump::PressEffect::Effort::Rough)
          .taken_off(under, 0);
  for (size_t n = 0; n < same.pressure_Pa[3].values.size(); ++n)
    EXPECT_NEAR(same.pressure_Pa[3].values[n], under.pressure_Pa[3].values[n], 0.05);
}

const lump::Estimate& told_estimate() {
  static const lump::Estimate estimate = plain_estimator()(told(ball_under_skin(), {2, 4}));
  return estimate;
}

TEST(SkinEffect, ALumpUnderAStatedSkinIsWhatItIs) {
  const lump::Observation& under = ball_under_skin();
  const lump::Estimate ignored = plain_estimator()(under);
  const lump::Estimate& known = told_estimate();
  for (const auto& [name, e] : {std::pair{"ignored", &ignored}, std::pair{"told", &known}})
    std::printf("%s: %s, %.2f mm (%.2f to %.2f), %.2f deep (%.2f to %.2f), ratio %.1f (%.1f to %.1f)\n", name,
                to_string(e->verdict), e->size_mm.value, e->size_mm.low, e->size_mm.high, e->depth_mm.value,
                e->depth_mm.low, e->depth_mm.high, e->stiffness_ratio.value, e->stiffness_ratio.low,
                e->stiffness_ratio.high);
  ASSERT_TRUE(reports_numbers(known.verdict)) << to_string(known.verdict);
  EXPECT_NEAR(known.size_mm.value, 9, 0.6);
  EXPECT_NEAR(known.depth_mm.value, 4, 0.5);
  EXPECT_TRUE(known.size_mm.low <= 9 && known.size_mm.high >= 9);
  EXPECT_TRUE(known.depth_mm.low <= 4 && known.depth_mm.high >= 4);
  EXPECT_TRUE(known.stiffness_ratio.low <= 6 && known.stiffness_ratio.high >= 6);
  ASSERT_FALSE(known.input_effects.empty());
  EXPECT_EQ(known.input_effects.back().input, "skin's effect");
}

TEST(SkinEffect, ASkinHardlyKnownWidensTheIntervals) {
  const lump::Estimate& known = told_estimate();
  const lump::Estimate unsure = plain_estimator()(told(ball_under_skin(), {2, 4, 0.15, 0.2}));
  ASSERT_TRUE(reports_numbers(unsure.verdict));
  EXPECT_EQ(unsure.size_mm.value, known.size_mm.value);
  EXPECT_GT(std::log(unsure.depth_mm.high / unsure.depth_mm.low),
            1.05 * std::log(known.depth_mm.high / known.depth_mm.low));
}

TEST(SkinEffect, TheWayFindsTheTissueBelow) {
  lump::Observation under = ball_under_skin();
  under.young_Pa = 0;
  const lump::Estimate ignored = plain_estimator()(under), known = plain_estimator()(told(under, {2, 4}));
  ASSERT_TRUE(ignored.tissue && known.tissue);
  std::printf("modulus %.0f Pa, the skin ignored %.0f\n", known.tissue->young_Pa.value,
              ignored.tissue->young_Pa.value);
  EXPECT_NEAR(known.tissue->young_Pa.value, 4000, 80);
  EXPECT_GT(std::abs(ignored.tissue->young_Pa.value - 4000), 160);
}

TEST(SkinEffect, ABlockWithoutALumpHasNone) {
  lump::Observation under = pressed_block({.skin = fem::Skin{2, 4}}, std::nullopt);
  under.press_mm.clear();
  const lump::Estimate known = plain_estimator()(told(under, {2, 4}));
  EXPECT_EQ(known.verdict, lump::Status::NoLump) << known.reasons.front() << known.reasons.back();
  EXPECT_EQ(plain_estimator()(pressed_block({}, std::nullopt)).verdict, lump::Status::NoLump);
}

TEST(SkinEffect, WhatFindsNoEquilibriumHasNoNumbers) {
  lump::Observation under = ball_under_skin();
  under.press_mm.clear();
  under.young_Pa = 4;  // kPa
  const lump::Estimate found = plain_estimator()(told(under, {2, 4}));
  EXPECT_EQ(found.verdict, lump::Status::Unusable);
  ASSERT_FALSE(found.reasons.empty());
  EXPECT_NE(found.reasons.front().find("no equilibrium"), std::string::npos) << found.reasons.front();
}

TEST(SkinEffect, DaysUnderASkinAreNotCompared) {
  const lump::Day day{told(ball_under_skin(), {2, 4}), {}};
  const lump::LumpChange change = compare(lump::Network::built_in(), day, day, {});
  EXPECT_EQ(change.verdict, lump::ChangeVerdict::NotComparable);
  ASSERT_FALSE(change.reasons.empty());
  EXPECT_NE(change.reasons.front().find("skin"), std::string::npos);
}

}  // namespace
}  // namespace palpate
