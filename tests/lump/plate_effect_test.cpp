// A lump under a plate that rubs or sticks: the finite elements' press with that taken off, and estimates
// that know of it or do not.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>

#include "engine/lump/change/change.h"
#include "engine/lump/error_sources.h"
#include "engine/lump/network/network.h"
#include "engine/lump/press_effect/plate_check.h"
#include "engine/lump/press_effect/press_effect.h"
#include "tests/lump/pressed_block.h"

namespace palpate {
namespace {

const lump::PressConditions kRubs{{}, false, 0.1}, kSticks{{}, true, 0};

const lump::Observation& sliding_plate() {
  static const lump::Observation observation = pressed_block({}, kPressedBall);
  return observation;
}
const lump::Observation& rubbing_plate() {
  static const lump::Observation observation = pressed_block(kRubs, kPressedBall);
  return observation;
}
const lump::Observation& sticking_plate() {
  static const lump::Observation observation = pressed_block(kSticks, kPressedBall);
  return observation;
}

lump::Observation with_plate(lump::Observation o, const lump::Plate& plate) {
  o.plate = plate;
  return o;
}

bool holds(const lump::Value& value, double truth) {
  return value.low <= truth && truth <= value.high;
}

void expect_ball(const lump::Estimate& e, const char* name) {
  std::printf("%s: %s, %.2f mm (%.2f to %.2f), %.2f deep (%.2f to %.2f), ratio %.1f (%.1f to %.1f)\n", name,
              to_string(e.verdict), e.size_mm.value, e.size_mm.low, e.size_mm.high, e.depth_mm.value,
              e.depth_mm.low, e.depth_mm.high, e.stiffness_ratio.value, e.stiffness_ratio.low,
              e.stiffness_ratio.high);
  ASSERT_TRUE(reports_numbers(e.verdict)) << name;
  EXPECT_TRUE(holds(e.size_mm, 9)) << name;
  EXPECT_TRUE(holds(e.depth_mm, 4)) << name;
  EXPECT_TRUE(holds(e.stiffness_ratio, 6)) << name;
}

TEST(PlateEffect, MapsAndWaysAreThoseUnderASlidingPlate) {
  const lump::Observation& slides = sliding_plate();
  for (const auto& [conditions, there] :
       {std::pair{&kRubs, &rubbing_plate()}, std::pair{&kSticks, &sticking_plate()}}) {
    lump::PressEffect effect(*there, *conditions);
    ASSERT_TRUE(effect.converged());
    ASSERT_TRUE(effect.set_lumps({kPressedBall}));
    const lump::Observation off = effect.taken_off(*there);
    const double way_mm = at_force(slides, slides.press_mm, there->force_N[2]);
    EXPECT_NEAR(off.press_mm[2], way_mm, 0.015);
    EXPECT_GT(std::abs(there->press_mm[2] - way_mm), 0.1) << "the plate hardly matters";
    const double left = map_difference(off, 2, slides), before = map_difference(*there, 2, slides);
    std::printf("%s: changes the map by %.2f %% of its peak (RMS), taken off: %.2f %%\n",
                lump::conditions_text(*conditions).c_str(), 100 * before, 100 * left);
    EXPECT_GT(before, 0.005);
    EXPECT_LT(left, 0.15 * before);
  }
}

TEST(PlateEffect, OneThatSlidesTakesNothingOff) {
  const lump::Observation& slides = sliding_plate();
  lump::PressEffect effect(slides, {}, lump::PressEffect::Effort::Rough);
  ASSERT_TRUE(effect.converged() && effect.set_lumps({kPressedBall}));
  EXPECT_NEAR(effect.bump_factor(), 1, 1e-6);
  const lump::Observation off = effect.taken_off(slides);
  for (size_t n = 0; n < off.pressure_Pa[3].values.size(); ++n)
    EXPECT_NEAR(off.pressure_Pa[3].values[n], slides.pressure_Pa[3].values[n], 0.05);
}

TEST(PlateEffect, ALumpUnderAStatedPlateIsWhatItIs) {
  for (const lump::Observation* o : {&rubbing_plate(), &sticking_plate()}) {
    const lump::Estimate ignored = plain_estimator()(*o);
    EXPECT_FALSE(reports_numbers(ignored.verdict) && holds(ignored.depth_mm, 4) &&
                 holds(ignored.stiffness_ratio, 6))
        << "nothing to mend";
  }
  expect_ball(plain_estimator()(with_plate(rubbing_plate(), {false, 0.1, 0})), "friction 0.1, told");
  const lump::Estimate sticks = plain_estimator()(with_plate(sticking_plate(), {true, 0, 0}));
  // Nearer than ignored (25 % too deep), but what cells are off by is not small here: not judged.
  ASSERT_TRUE(reports_numbers(sticks.verdict));
  EXPECT_NEAR(sticks.size_mm.value, 9, 0.8);
  EXPECT_NEAR(sticks.depth_mm.value, 4, 0.8);
  ASSERT_FALSE(sticks.input_effects.empty());
  EXPECT_EQ(sticks.input_effects.back().input, "plate's effect");
  EXPECT_NE(sticks.reasons.back().find("a plate that holds the tissue"), std::string::npos);
  EXPECT_TRUE(std::any_of(sticks.reasons.begin(), sticks.reasons.end(), [](const std::string& reason) {
    return reason.find("not judged") != std::string::npos;
  }));
}

TEST(PlateEffect, AFrictionHardlyKnownWidensTheIntervals) {
  const lump::Estimate known = plain_estimator()(with_plate(rubbing_plate(), {false, 0.1, 0})),
                       unsure = plain_estimator()(with_plate(rubbing_plate(), {false, 0.1, 0.05}));
  ASSERT_TRUE(reports_numbers(unsure.verdict));
  EXPECT_EQ(unsure.size_mm.value, known.size_mm.value);
  EXPECT_GT(std::log(unsure.depth_mm.high / unsure.depth_mm.low),
            1.1 * std::log(known.depth_mm.high / known.depth_mm.low));
  const auto of_friction =
      std::find_if(unsure.input_effects.begin(), unsure.input_effects.end(),
                   [](const lump::InputEffect& e) { return e.input == "plate's friction"; });
  ASSERT_NE(of_friction, unsure.input_effects.end());
  EXPECT_NEAR(of_friction->error, 1.645 * 0.05, 1e-3);
  EXPECT_NE(effect_text(*of_friction).find("friction is 0.082 less than stated"), std::string::npos)
      << effect_text(*of_friction);
}

TEST(PlateEffect, TheWayFindsTheTissue) {
  lump::Observation under = rubbing_plate();
  under.young_Pa = 0;
  const lump::Estimate ignored = plain_estimator()(under),
                       known = plain_estimator()(with_plate(under, {false, 0.1, 0}));
  ASSERT_TRUE(ignored.tissue && known.tissue);
  std::printf("modulus %.0f Pa, the plate ignored %.0f\n", known.tissue->young_Pa.value,
              ignored.tissue->young_Pa.value);
  EXPECT_NEAR(known.tissue->young_Pa.value, 4000, 80);
  EXPECT_GT(std::abs(ignored.tissue->young_Pa.value - 4000), 120);
}

TEST(PlateEffect, ABlockWithoutALumpHasNone) {
  lump::Observation under = pressed_block(kSticks, std::nullopt);
  under.press_mm.clear();
  const lump::Estimate known = plain_estimator()(with_plate(under, {true, 0, 0}));
  EXPECT_EQ(known.verdict, lump::Status::NoLump) << known.reasons.front();
}

TEST(PlateEffect, MapsShowAPlateThatRubs) {
  const lump::Network& network = lump::Network::built_in();
  const auto slides = plate_grip(network, sliding_plate()), rubs = plate_grip(network, rubbing_plate());
  ASSERT_TRUE(slides && rubs);
  std::printf("grip of a plate that slides %.2f +- %.2f, with a friction of 0.1 %.2f +- %.2f\n", slides->grip,
              slides->sd, rubs->grip, rubs->sd);
  EXPECT_TRUE(slides->slides);
  EXPECT_FALSE(rubs->slides);
  EXPECT_NEAR(rubs->grip - slides->grip, 1, 0.5);

  lump::Estimate estimate = network.estimate(rubbing_plate());
  report_plate(network, rubbing_plate(), estimate);
  EXPECT_EQ(estimate.verdict, lump::Status::Inconsistent);
  EXPECT_NE(estimate.reasons.front().find("--plate-friction"), std::string::npos);
  lump::Estimate honest = network.estimate(sliding_plate());
  const lump::Status before = honest.verdict;
  report_plate(network, sliding_plate(), honest);
  EXPECT_EQ(honest.verdict, before);
  // Who is told looks for nothing.
  lump::Estimate told = network.estimate(sliding_plate());
  report_plate(network, with_plate(rubbing_plate(), {false, 0.1, 0}), told);
  EXPECT_EQ(told.verdict, before);
}

TEST(PlateEffect, DaysUnderSuchAPlateAreNotCompared) {
  const lump::Day day{with_plate(sticking_plate(), {true, 0, 0}), {}};
  const lump::LumpChange change = compare(lump::Network::built_in(), day, day, {});
  EXPECT_EQ(change.verdict, lump::ChangeVerdict::NotComparable);
  ASSERT_FALSE(change.reasons.empty());
  EXPECT_NE(change.reasons.front().find("plate"), std::string::npos);
}

}  // namespace
}  // namespace palpate
