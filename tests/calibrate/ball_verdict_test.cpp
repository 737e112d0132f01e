// Verdict on presses of a ball: a radius is told from a diameter by the pad's shading, and what was left out
// is judged before an error of the rest is stated.
#include "capture/calibrate/photometric/ball_verdict.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <map>
#include <string>

#include "capture/calibrate/photometric/ball_stretch.h"
#include "capture/synthetic/synthetic.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr double kRadius_mm = 5;

/// Presses of a ball of 5 mm into the simulator's matt gel, found as if it had another radius.
struct Presses {
  Sensor sensor;
  BallPresses found;

  /// Each radius is searched for once.
  static const Presses& of(double stated_mm) {
    static std::map<double, Presses> known;
    return known.try_emplace(stated_mm, stated_mm).first->second;
  }
  explicit Presses(double stated_mm) {
    const std::string input = "synthetic:palpation?mode=gel&size=320x240&rate=2&radius=5&seed=3";
    sensor = synthetic_sensor(parse_synthetic(input));
    PressSearch search;
    search.shape = PressedShape::ball(stated_mm);
    found = find_presses(input, sensor, search, 4);
  }
};

TEST(BallVerdict, ShadingGivesTheRadiusWhateverWasStated) {
  for (const double stated_mm : {kRadius_mm, 2 * kRadius_mm, 31.0}) {
    const Presses& presses = Presses::of(stated_mm);
    const BallEvidence e = evidence_of(presses.found, presses.sensor);
    std::printf("stated %.3g mm: %s\n", stated_mm, describe(e).c_str());
    EXPECT_GE(e.judged, 4u);
    EXPECT_NEAR(e.shaded_radius_mm(), kRadius_mm, 0.15 * kRadius_mm);
    EXPECT_NEAR(e.shading, std::pow(stated_mm / kRadius_mm, 2), 0.25 * e.shading);
    EXPECT_LT(e.widest_share, 0.98 * kRadius_mm / stated_mm);
  }
}

/// Three rows of four, each between two of the frame's.
Frame squashed(const Frame& frame) {
  FrameFormat f = frame.format;
  f.height = f.height * 3 / 4;
  Frame out;
  out.reshape(f);
  for (uint32_t c = 0; c < f.channels; ++c)
    for (uint32_t y = 0; y < f.height; ++y) {
      const double at = (y + 0.5) * 4 / 3 - 0.5;
      const auto row = static_cast<uint32_t>(at);
      const double next = at - row;
      for (uint32_t x = 0; x < f.width; ++x)
        out.set(c, x, y,
                static_cast<uint32_t>(
                    std::lround((1 - next) * frame.at(c, x, row) + next * frame.at(c, x, row + 1))));
    }
  return out;
}

TEST(BallVerdict, ContactsOfPicturesThatWereScaledUnevenlyAreNoCircles) {
  Presses presses = Presses::of(kRadius_mm);
  presses.found.presses.resize(2);
  const BallStretch round = stretch_of(presses.found, presses.sensor);
  std::printf("as they are: %.2f is left of what no ball explains\n", round.left);
  EXPECT_FALSE(round.evident());
  BallPresses flat = presses.found;
  for (BallPress& press : flat.presses) press.frame = squashed(press.frame);
  for (Frame& background : flat.backgrounds) background = squashed(background);
  const BallStretch tall = stretch_of(flat, presses.sensor);
  std::printf("squashed: %.2f\n", tall.left);
  EXPECT_TRUE(tall.evident());
  EXPECT_GT(tall.factor, 1.2);
}

TEST(BallVerdict, ADiameterIsRefusedUnlessItIsSaidToBeARadius) {
  const auto doubt = [](double stated_mm, const BallSize& size) {
    const Presses& presses = Presses::of(stated_mm);
    return doubt_of(evidence_of(presses.found, presses.sensor), size);
  };
  const auto radius = [](double mm) { return BallSize{.radius_mm = mm}; };
  const auto unsaid = [](double mm) { return BallSize{.unsaid_mm = mm}; };
  for (const BallSize& right : {radius(5), unsaid(5), BallSize{.diameter_mm = 10}}) {
    const BallDoubt none = doubt(right.radius(), right);
    EXPECT_EQ(none.kind, BallDoubt::Kind::None) << none.line;
    EXPECT_FALSE(none.refused);
    EXPECT_EQ(none.line, "");
  }
  const BallDoubt diameter = doubt(10, unsaid(10));
  EXPECT_EQ(diameter.kind, BallDoubt::Kind::Diameter);
  EXPECT_TRUE(diameter.refused);
  EXPECT_NE(diameter.line.find("diameter"), std::string::npos) << diameter.line;
  const BallDoubt insisted = doubt(10, radius(10));
  EXPECT_EQ(insisted.kind, BallDoubt::Kind::Diameter);
  EXPECT_FALSE(insisted.refused);
  EXPECT_NE(insisted.line, "");
  const BallDoubt nonsense = doubt(31, radius(31));
  EXPECT_EQ(nonsense.kind, BallDoubt::Kind::TooLarge);
  EXPECT_TRUE(nonsense.refused);
  try {
    const Presses& presses = Presses::of(10);
    refuse_doubtful(diameter, evidence_of(presses.found, presses.sensor), unsaid(10), "presses");
    ADD_FAILURE() << "not refused";
  } catch (const Error& error) {
    EXPECT_EQ(error.failure(), Failure::Input);
    for (const char* word : {"--ball-diameter-mm 10", "--ball-radius-mm 10", "presses"})
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
  }
}

// Presses that differ much by their place leave a wide error of the median; where hardly one of them reads as
// little as under the right ball, it is the diameter all the same.
TEST(BallVerdict, PressesThatDifferMuchAndAllReadTooMuchTellADiameter) {
  BallEvidence presses{.radius_mm = 7.6,
                       .least_contact_mm = 2.1,
                       .widest_contact_mm = 3.1,
                       .widest_share = 0.41,
                       .shading = 2.6,
                       .shading_sd = 0.6,
                       .least_shading = 1.8,
                       .judged = 10};
  const BallSize unsaid{.unsaid_mm = 7.6};
  EXPECT_TRUE(doubt_of(presses, unsaid).refused);
  EXPECT_FALSE(doubt_of(presses, {.radius_mm = 7.6}).refused);
  EXPECT_NE(doubt_of(presses, {.radius_mm = 7.6}).line.find("is it the diameter?"), std::string::npos);
  presses.judged = 4;
  EXPECT_FALSE(doubt_of(presses, unsaid).refused) << "four presses may all lie where the gel darkens most";
  presses.judged = 10;
  presses.least_shading = 1.1;
  EXPECT_FALSE(doubt_of(presses, unsaid).refused) << "a tenth of them read as under the right ball";
  presses.least_shading = 1.8;
  presses.widest_share = 0.6;
  EXPECT_FALSE(doubt_of(presses, unsaid).refused) << "contacts wider than half of it would be";
}

TEST(BallVerdict, WithoutShadingHalfTheRadiusIsOnlyNamed) {
  BallEvidence gray{.radius_mm = 8, .least_contact_mm = 2, .widest_contact_mm = 3.24, .widest_share = 0.405};
  EXPECT_EQ(doubt_of(gray, {.unsaid_mm = 8}).kind, BallDoubt::Kind::Diameter);
  EXPECT_FALSE(doubt_of(gray, {.unsaid_mm = 8}).refused);
  EXPECT_EQ(doubt_of(gray, {.radius_mm = 8}).kind, BallDoubt::Kind::None);
  gray.widest_share = 0.81;
  EXPECT_EQ(doubt_of(gray, {.unsaid_mm = 4}).kind, BallDoubt::Kind::None);
}

/// `fitting` presses and others that were refused as wider than the ball, whose colour changes `ramp` times
/// as fast.
BallPresses some_presses(size_t fitting, size_t wider, double ramp) {
  BallPresses found;
  const auto ball = [](double radius_px, double ramp_per_px) {
    FoundBall one;
    one.radius_px = radius_px;
    one.ramp_per_px = ramp_per_px;
    return one;
  };
  for (size_t i = 0; i < fitting; ++i) {
    BallPress press;
    press.ball = ball(20, 3);
    press.shape = PressedShape::ball(3);
    found.presses.push_back(press);
    found.backgrounds.emplace_back();
    ++found.frames_with_ball;
  }
  for (size_t i = 0; i < wider; ++i)
    found.refused.push_back(
        {"p.png", "too wide", BallRefusal::TooWide, ball(35, 3 * ramp), PressedShape::ball(3)});
  return found;
}

std::string refusal(const BallPresses& found) {
  Sensor sensor;
  sensor.pitch_mm_per_px = 0.1;
  try {
    refuse_contradictions(found, sensor, "presses");
  } catch (const Error& error) {
    EXPECT_EQ(error.failure(), Failure::Input);
    return error.what();
  }
  return "";
}

TEST(BallVerdict, PressesWiderThanTheBallContradictItsRadiusOrTheScale) {
  const std::string most = refusal(some_presses(4, 13, 1));
  for (const char* word : {"13 of 17 presses", "3.5 mm radius", "radius or the scale", "0.0857 mm per px"})
    EXPECT_NE(most.find(word), std::string::npos) << word << " in: " << most;
  EXPECT_NE(refusal(some_presses(0, 1, 1)), "");
  EXPECT_NE(refusal(some_presses(8, 8, 5)), "") << "half of them, whatever they are";
  EXPECT_NE(refusal(some_presses(12, 5, 1.2)), "") << "a minority of the same ball";
  EXPECT_EQ(refusal(some_presses(12, 5, 3)), "") << "a minority of something else";
  EXPECT_EQ(refusal(some_presses(20, 1, 1)), "") << "one of many";
  EXPECT_EQ(refusal(some_presses(5, 0, 1)), "");
}

TEST(BallVerdict, MostPressesUnlikeTheOthersAreRefused) {
  BallPresses found = some_presses(8, 0, 1);
  for (int i = 0; i < 3; ++i) refuse_press(found, 0, "reads 1.6 times the depth");
  EXPECT_EQ(refusal(found), "");
  refuse_press(found, 0, "reads 1.6 times the depth");
  EXPECT_NE(refusal(found).find("4 of 8"), std::string::npos) << refusal(found);
}

TEST(BallVerdict, TheSelectionIsCounted) {
  BallPresses found = some_presses(4, 2, 1);
  found.refused.push_back({"q.png", "at the border", BallRefusal::AtBorder, {}, PressedShape::ball(3)});
  const PressSelection s = selection_of(found);
  EXPECT_EQ(
      describe(s),
      "4 presses; of 7 pictures of a press 3 left out (1 at the frame's border, 2 wider than the ball)");
  EXPECT_FALSE(s.minority());
  EXPECT_TRUE(selection_of(some_presses(4, 5, 3)).minority());
  EXPECT_EQ(describe(selection_of(some_presses(1, 0, 1))), "1 press, none left out");
}

}  // namespace
}  // namespace palpate
