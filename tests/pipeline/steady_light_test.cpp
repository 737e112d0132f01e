// Exposure, white balance and drifting lamps are taken out of frames, a touch never.
#include "engine/pipeline/steady_light.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "tests/scenes/synthetic_run.h"

namespace palpate {
namespace {

constexpr FrameFormat kFormat{160, 128, 3, 8};
constexpr uint32_t kSaturation = 255;

class SteadyLightTest : public testing::Test {
 protected:
  using Light = std::function<double(uint32_t colour, uint32_t x, uint32_t y, double gray)>;

  SteadyLightTest() : untouched_(picture(as_it_was(), 0)) { light_.set_background(untouched_); }

  static Light as_it_was() {
    return [](uint32_t, uint32_t, uint32_t, double gray) { return gray; };
  }
  /// Lamps at two sides, seen in `light`, with noise of 1 gray level (0: none); touched from `touched_from_x`
  /// on by +-20 gray levels.
  Frame picture(const Light& light, uint32_t touched_to_x, double noise_gray = 1) {
    Frame frame;
    frame.reshape(kFormat);
    std::normal_distribution<double> noise(0, 1);
    for (uint32_t c = 0; c < 3; ++c)
      for (uint32_t y = 0; y < kFormat.height; ++y)
        for (uint32_t x = 0; x < kFormat.width; ++x) {
          double gray = 70 + 15 * c + 0.4 * x - 0.2 * y;
          if (x < touched_to_x) gray += 20 * std::sin(0.1 * x + 0.16 * y + c);
          gray = light(c, x, y, gray) + (noise_gray > 0 ? noise_gray * noise(random_) : 0);
          frame.set(c, x, y, static_cast<uint32_t>(std::lround(std::clamp(gray, 0.0, 255.0))));
        }
    return frame;
  }
  /// A light that adds 3 gray levels, under a press that bends the pad around it over so many px, each colour
  /// by another side, and darkens it.
  static Light pressed(double reach_px) {
    return [reach_px](uint32_t c, uint32_t x, uint32_t y, double gray) {
      const double u = (x - 100.0) / reach_px, v = (y - 60.0) / reach_px;
      const double side = c == 0 ? u : c == 1 ? v : -u;
      return gray + 3 + (30 * side - 6 * std::hypot(u, v)) * std::exp(-u * u - v * v);
    };
  }
  /// Mean over the frame, and largest mean of a block of 16 x 16, of frame less `truth`, gray levels.
  static std::pair<double, double> off(const Frame& frame, const Frame& truth) {
    double sum = 0, worst = 0;
    for (uint32_t c = 0; c < 3; ++c)
      for (uint32_t y = 0; y < kFormat.height; y += 16)
        for (uint32_t x = 0; x < kFormat.width; x += 16) {
          double block = 0;
          for (uint32_t v = y; v < y + 16; ++v)
            for (uint32_t u = x; u < x + 16; ++u)
              block += static_cast<double>(frame.at(c, u, v)) - truth.at(c, u, v);
          sum += block;
          worst = std::max(worst, std::abs(block) / 256);
        }
    return {sum / (3.0 * kFormat.width * kFormat.height), worst};
  }

  std::mt19937 random_{11};
  SteadyLight light_{kFormat, kSaturation};
  Frame untouched_;
};

TEST_F(SteadyLightTest, WhatDoesNotChangeIsLeftAsItIs) {
  for (const uint32_t touched_to_x : {0u, 50u, 120u}) {
    const Frame frame = picture(as_it_was(), touched_to_x);
    EXPECT_EQ(&light_.steady(frame), &frame) << touched_to_x;
    EXPECT_EQ(light_.summary().state, LightState::Steady);
    EXPECT_EQ(light_.summary().change_gray, 0);
  }
}

TEST_F(SteadyLightTest, AFrameThatIsForgottenTeachesNothing) {
  const Light half_brighter = [](uint32_t, uint32_t x, uint32_t, double gray) {
    return gray + (x < kFormat.width / 2 ? 0.7 : 0.0);
  };
  const Frame untouched = picture(as_it_was(), 0, 0);
  SteadyLight forgetful(kFormat, kSaturation);
  for (SteadyLight* light : {&forgetful, &light_}) light->set_background(untouched);
  for (int i = 0; i < 60; ++i) {
    const Frame spoilt = picture(half_brighter, 0, 0.5);
    forgetful.steady(spoilt);
    forgetful.forget_last();
    light_.steady(spoilt);
  }
  const Frame frame = picture(as_it_was(), 0);
  EXPECT_EQ(&forgetful.steady(frame), &frame);
  EXPECT_NE(&light_.steady(frame), &frame) << "these frames teach nothing anyway";
}

TEST_F(SteadyLightTest, ExposureAndWhiteBalanceAreTakenOut) {
  for (const auto& [red, green, blue, offset] : {std::array{1.08, 1.08, 1.08, 0.0},
                                                 {0.9, 1.0, 1.1, 0.0},
                                                 {1.0, 1.0, 1.0, 6.0},
                                                 {1.15, 0.95, 1.02, -4.0}})
    for (const uint32_t touched_to_x : {0u, 60u}) {
      const std::array gains{red, green, blue};
      const Light changed = [&, more = offset](uint32_t c, uint32_t, uint32_t, double gray) {
        return gains[c] * gray + more;
      };
      const Frame truth = picture(as_it_was(), touched_to_x, 0);
      const Frame frame = picture(changed, touched_to_x);
      const auto before = off(frame, truth), after = off(light_.steady(frame), truth);
      EXPECT_EQ(light_.summary().state, LightState::Changed);
      EXPECT_GT(before.second, 3);
      EXPECT_LT(std::abs(after.first), 0.15) << red << " " << offset << " touched to " << touched_to_x;
      EXPECT_LT(after.second, 0.8) << red << " " << offset << " touched to " << touched_to_x;
      EXPECT_NEAR(light_.summary().change_gray, before.second, before.second);
    }
}

// A third of the picture that agrees by chance is no light: only once the untouched image has been found to
// be this pad's may a touch leave so little of it.
TEST_F(SteadyLightTest, ALightIsTrustedOnceMostOfAPictureHasAgreed) {
  constexpr uint32_t kCovers_px = 108;
  light_.steady(picture(as_it_was(), kCovers_px));
  EXPECT_EQ(light_.summary().state, LightState::Unknown) << "nothing was seen before";
  light_.steady(picture(as_it_was(), 0));
  EXPECT_EQ(light_.summary().state, LightState::Steady);
  light_.steady(picture(as_it_was(), kCovers_px));
  EXPECT_EQ(light_.summary().state, LightState::Steady) << "a touch that covers two thirds";
  light_.set_background(untouched_);
  light_.steady(picture(as_it_was(), kCovers_px));
  EXPECT_EQ(light_.summary().state, LightState::Unknown) << "after another untouched image";
  // Separate pictures are each followed alone.
  SteadyLight separate(kFormat, kSaturation, true);
  separate.set_background(untouched_);
  separate.steady(picture(as_it_was(), 0));
  EXPECT_EQ(separate.summary().state, LightState::Steady);
  separate.steady(picture(as_it_was(), kCovers_px));
  EXPECT_EQ(separate.summary().state, LightState::Unknown);
}

TEST_F(SteadyLightTest, LampsThatDriftAreFollowed) {
  // One lamp warms up: 8 gray levels at its side within 20 s, nothing at the other.
  double now = 0;
  const Light warm = [&](uint32_t c, uint32_t x, uint32_t, double gray) {
    return gray + (c == 0 ? now * (1 - x / 160.0) * (1 - x / 160.0) : 0);
  };
  for (int i = 0; i <= 600; ++i) {
    now = 8 * i / 600.0;
    light_.steady(picture(warm, 0));
  }
  const Frame truth = picture(as_it_was(), 60, 0), frame = picture(warm, 60);
  EXPECT_GT(off(frame, truth).second, 5);
  EXPECT_LT(off(light_.steady(frame), truth).second, 1.2);
  EXPECT_EQ(light_.summary().state, LightState::Changed);
  // A new untouched image begins anew.
  const Frame now_untouched = picture(warm, 0, 0);
  light_.set_background(now_untouched);
  const Frame next = picture(warm, 0);
  EXPECT_EQ(&light_.steady(next), &next);
}

TEST_F(SteadyLightTest, ATouchIsNeverFollowed) {
  // A faint one that is held for 20 s, on a twentieth of the frame.
  const Light faint = [](uint32_t, uint32_t x, uint32_t y, double gray) {
    return gray + (std::hypot(x - 50.0, y - 64.0) < 18 ? 2.0 : 0);
  };
  for (int i = 0; i < 600; ++i) light_.steady(picture(faint, 0));
  const Frame frame = picture(faint, 0);
  EXPECT_EQ(&light_.steady(frame), &frame);
  EXPECT_EQ(light_.summary().state, LightState::Steady);
}

TEST_F(SteadyLightTest, WhereTooLittleAgreesTheLastLightIsKept) {
  const Light brighter = [](uint32_t, uint32_t, uint32_t, double gray) { return 1.1 * gray; };
  light_.steady(picture(brighter, 0));
  ASSERT_EQ(light_.summary().state, LightState::Changed);
  const double change_gray = light_.summary().change_gray;
  // Touched all over, by some 60 gray levels.
  const Light covered = [](uint32_t c, uint32_t x, uint32_t y, double gray) {
    return 1.1 * gray + 60 * std::sin(0.22 * x + c) * std::cos(0.14 * y);
  };
  light_.steady(picture(covered, 0));
  EXPECT_EQ(light_.summary().state, LightState::Unknown);
  EXPECT_NEAR(light_.summary().change_gray, change_gray, 0.01);
}

TEST_F(SteadyLightTest, AWidePressDoesNotPullTheLightOfFramesBefore) {
  for (int i = 0; i < 3; ++i) light_.steady(picture(pressed(4), 0));
  EXPECT_NEAR(light_.summary().change_gray, 3, 0.3);
  SteadyLight alone(kFormat, kSaturation);
  alone.set_background(untouched_);
  for (int i = 0; i < 60; ++i) {
    const Frame wide = picture(pressed(50), 0);
    light_.steady(wide);
    EXPECT_NEAR(light_.summary().change_gray, 3, 0.8) << i;
    alone.steady(wide);
  }
  EXPECT_GT(std::abs(alone.summary().change_gray - 3), 1) << "this press pulls no light anyway";
  // Another exposure under the same press is followed at once.
  const Light brighter = [](uint32_t c, uint32_t x, uint32_t y, double gray) {
    return 1.2 * pressed(50)(c, x, y, gray);
  };
  light_.steady(picture(brighter, 0));
  EXPECT_GT(light_.summary().change_gray, 12);
}

TEST_F(SteadyLightTest, PicturesOfASeriesShareTheirLight) {
  SteadyLight series(kFormat, kSaturation, true), alone(kFormat, kSaturation, true);
  for (SteadyLight* light : {&series, &alone}) light->set_background(untouched_);
  const Frame wide = picture(pressed(50), 0);
  for (const double reach_px : {50.0, 6.0, 8.0, 10.0, 12.0, 40.0})
    series.look_ahead(picture(pressed(reach_px), 0));
  alone.steady(wide);
  series.steady(wide);
  EXPECT_EQ(series.summary().state, LightState::Changed);
  EXPECT_NEAR(series.summary().change_gray, 3, 0.6);
  EXPECT_EQ(alone.summary().state, LightState::Unknown) << "this press hides no light anyway";
  // One under another light is read in its own; one of another pad has none.
  const Light brighter = [](uint32_t, uint32_t, uint32_t, double gray) { return 1.15 * gray; };
  const Frame truth = picture(as_it_was(), 0, 0);
  EXPECT_LT(off(series.steady(picture(brighter, 0)), truth).second, 0.8);
  const Light foreign = [](uint32_t c, uint32_t x, uint32_t y, double) {
    return 60.0 + (c == 1 ? x : 160.0 - x) + 0.2 * y;
  };
  series.steady(picture(foreign, 0));
  EXPECT_EQ(series.summary().state, LightState::Unknown);
  // Of another untouched image the series says nothing.
  series.set_background(untouched_);
  series.forget_series();
  series.steady(wide);
  EXPECT_EQ(series.summary().state, LightState::Unknown);
}

TEST_F(SteadyLightTest, SaturatedStaysSaturatedAndNothingElseBecomesIt) {
  const Light darker = [](uint32_t, uint32_t x, uint32_t y, double gray) {
    if (x < 20 && y < 20) return 255.0;
    return x < 40 && y < 20 ? 245.0 : 0.8 * gray;
  };
  const Frame& steady = light_.steady(picture(darker, 0, 0));
  ASSERT_EQ(light_.summary().state, LightState::Changed);
  EXPECT_EQ(steady.at(1, 10, 10), 255u);
  EXPECT_EQ(steady.at(1, 30, 10), 254u);
}

// A ball of 25 mm, too smooth for an outline: in 13 of these frames it was taken for a light.
TEST(SteadyLight, AWideBallIsNoLight) {
  SyntheticRun run("press?mode=gel&size=320x240&radius=25&force=8");
  SteadyLight light(run.background.format, kSaturation);
  light.set_background(run.background);
  for (uint64_t k = 0; k < run.count(); ++k) {
    light.steady(run.frame(k));
    EXPECT_EQ(light.summary().state, LightState::Steady) << k;
  }
}

TEST(SteadyLight, FramesOfAnySize) {
  for (const auto& [width, height] : {std::pair{1u, 1u}, {3u, 2u}, {7u, 300u}, {64u, 48u}, {1921u, 1081u}}) {
    const FrameFormat format{width, height, 3, 8};
    SteadyLight light(format, 255);
    Frame frame;
    frame.reshape(format);
    std::fill(frame.bytes.begin(), frame.bytes.end(), uint8_t{80});
    light.set_background(frame);
    EXPECT_EQ(&light.steady(frame), &frame);
    Frame brighter = frame;
    std::fill(brighter.bytes.begin(), brighter.bytes.end(), uint8_t{90});
    const Frame& steady = light.steady(brighter);
    EXPECT_EQ(steady.at(2, width - 1, height - 1), 80u) << width << " x " << height;
  }
}

}  // namespace
}  // namespace palpate
