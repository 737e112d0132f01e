// Detection of a ball's contact in the picture alone, against the synthetic gel's truth; and rejection of
// other presses.
#include "engine/calibrate/ball/finder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include "capture/calibrate/photometric/presses.h"
#include "capture/open_source.h"
#include "capture/synthetic/synthetic.h"
#include "engine/calibrate/ball/ramp.h"
#include "engine/calibrate/photometric/fit.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr const char* kGel = "synthetic:palpation?mode=gel&size=320x240&rate=2&radius=5&seed=3";

struct GelRecording {
  Sensor sensor = synthetic_sensor(parse_synthetic(kGel));
  std::unique_ptr<Source> source = open_source(kGel, sensor);
  Frame background = load_background(kGel, sensor, *source);
  BallSearch search{PressedShape::ball(5), sensor.pitch_mm_per_px, sensor.threshold_gray};

  /// The first press that is well seen.
  void find_press(Frame& press, FoundBall& found) {
    while (found.radius_px < 25 || !found.good()) {
      ASSERT_TRUE(source->next(press));
      found = find_ball(press, background, {}, search);
    }
  }
};

/// The change of `press`, moved by whole pixels and added to `to`.
Frame add_moved(const Frame& to, const Frame& press, const Frame& rest, int dx, int dy) {
  Frame out = to;
  const FrameFormat& f = to.format;
  for (uint32_t c = 0; c < f.channels; ++c)
    for (int y = 0; y < static_cast<int>(f.height); ++y)
      for (int x = 0; x < static_cast<int>(f.width); ++x) {
        const int u = x - dx, v = y - dy;
        if (u < 0 || v < 0 || u >= static_cast<int>(f.width) || v >= static_cast<int>(f.height)) continue;
        const auto at = [&](const Frame& frame, int i, int j) {
          return static_cast<int>(frame.at(c, static_cast<uint32_t>(i), static_cast<uint32_t>(j)));
        };
        const int value = at(to, x, y) + at(press, u, v) - at(rest, u, v);
        out.set(c, static_cast<uint32_t>(x), static_cast<uint32_t>(y),
                static_cast<uint32_t>(std::clamp(value, 0, static_cast<int>(f.max_gray()))));
      }
  return out;
}

TEST(BallFinder, FindsTheSyntheticBallToAFractionOfAPixel) {
  GelRecording r;
  double center2 = 0, radius2 = 0, worst = 0;
  int presses = 0, untouched = 0;
  for (Frame frame; r.source->next(frame);) {
    const Truth truth = *r.source->truth(frame.sequence);
    const FoundBall ball = find_ball(frame, r.background, {}, r.search);
    if (!truth.contact) {
      EXPECT_FALSE(ball.good()) << frame.sequence;
      EXPECT_EQ(ball.refusal.rfind("nothing is pressed", 0), 0u) << ball.refusal;
      ++untouched;
    } else if (truth.radius_px > 12) {
      EXPECT_TRUE(ball.good()) << frame.sequence << ": " << ball.refusal;
      const double center =
          std::hypot(ball.center_x_px - truth.center_x_px, ball.center_y_px - truth.center_y_px);
      center2 += center * center;
      radius2 += std::pow(ball.radius_px / truth.radius_px - 1, 2);
      worst = std::max(worst, center);
      EXPECT_GT(ball.center_sd_px, 0);
      ++presses;
    }
  }
  ASSERT_GE(presses, 15);
  EXPECT_GE(untouched, 2);
  std::printf("%d presses: centre %.3f px RMS, worst %.3f, radius %.2f %% RMS\n", presses,
              std::sqrt(center2 / presses), worst, 100 * std::sqrt(radius2 / presses));
  EXPECT_LT(std::sqrt(center2 / presses), 0.15);
  EXPECT_LT(std::sqrt(radius2 / presses), 0.03);
}

TEST(BallFinder, SaysWhyAPictureIsNoPressOfOneBall) {
  GelRecording r;
  Frame press;
  FoundBall found;
  ASSERT_NO_FATAL_FAILURE(r.find_press(press, found));
  const auto refusal = [&](const Frame& frame, BallSearch search) {
    return find_ball(frame, r.background, {}, search).refusal;
  };
  const auto says = [](const std::string& text, const char* what) {
    return text.find(what) != std::string::npos;
  };
  EXPECT_EQ(refusal(press, r.search), "");
  EXPECT_TRUE(says(refusal(r.background, r.search), "nothing is pressed"));
  // A second ball next to the first.
  const int away = found.center_x_px < 160 ? 110 : -110;
  const Frame two = add_moved(press, press, r.background, away, 0);
  EXPECT_NE(refusal(two, r.search), "") << "two balls";
  // Half outside the frame.
  const Frame border =
      add_moved(r.background, press, r.background, static_cast<int>(5 - found.center_x_px), 0);
  EXPECT_TRUE(says(refusal(border, r.search), "border")) << refusal(border, r.search);
  // Most of it in the frame: refused, unless parts are welcome, and then with its circle.
  const int cut_px = static_cast<int>(0.6 * found.radius_px - found.center_x_px);
  const Frame cut = add_moved(r.background, press, r.background, cut_px, 0);
  EXPECT_TRUE(says(refusal(cut, r.search), "border"));
  BallSearch parts = r.search;
  parts.least_in_frame = 0.7;
  EXPECT_TRUE(says(refusal(border, parts), "border"));
  const FoundBall part = find_ball(cut, r.background, {}, parts);
  EXPECT_TRUE(part.good()) << part.refusal;
  EXPECT_NEAR(part.center_x_px, found.center_x_px + cut_px, 0.05 * found.radius_px);
  EXPECT_NEAR(part.radius_px, found.radius_px, 0.05 * found.radius_px);
  // A contact wider than the ball it is said to be of.
  BallSearch small = r.search;
  small.shape = PressedShape::ball(0.9 * found.radius_px * r.search.pitch_mm_per_px);
  EXPECT_TRUE(says(refusal(press, small), "does not fit a ball")) << refusal(press, small);
  // Light that is too bright: what changes is at the camera's limit.
  Frame bright = press;
  for (uint32_t c = 0; c < 3; ++c)
    for (uint32_t y = 0; y < 240; ++y)
      for (uint32_t x = 0; x < 320; ++x)
        if (std::hypot(x - found.center_x_px, y - found.center_y_px) < 0.9 * found.radius_px)
          bright.set(c, x, y, 255);
  EXPECT_TRUE(says(refusal(bright, r.search), "saturated")) << refusal(bright, r.search);
  Frame gray;
  gray.reshape({320, 240, 1, 8});
  EXPECT_THROW(find_ball(gray, gray, {}, r.search), Error);
  EXPECT_THROW(find_ball(press, r.background, std::vector<uint8_t>(7), r.search), Error);
}

TEST(BallFinder, MaskedPixelsDoNotMatter) {
  GelRecording r;
  Frame press;
  FoundBall found;
  ASSERT_NO_FATAL_FAILURE(r.find_press(press, found));
  // Dots of black ink that moved with the press, masked.
  std::vector<uint8_t> mask(320 * 240);
  Frame inked = press;
  for (uint32_t y = 0; y < 240; ++y)
    for (uint32_t x = 0; x < 320; ++x)
      if (std::hypot(static_cast<double>(x % 20) - 10, static_cast<double>(y % 20) - 10) < 4) {
        mask[y * 320 + x] = 1;
        for (uint32_t c = 0; c < 3; ++c) inked.set(c, x, y, 10);
      }
  const FoundBall with = find_ball(inked, r.background, mask, r.search);
  EXPECT_TRUE(with.good()) << with.refusal;
  EXPECT_NEAR(with.center_x_px, found.center_x_px, 0.2);
  EXPECT_NEAR(with.center_y_px, found.center_y_px, 0.2);
  EXPECT_NEAR(with.radius_px, found.radius_px, 0.03 * found.radius_px);
}

// Under a lamp of less light both the untouched picture and what a press changes in it are darker.
TEST(BallFinder, DimLightIsNoOtherBall) {
  GelRecording r;
  Frame press;
  FoundBall bright;
  ASSERT_NO_FATAL_FAILURE(r.find_press(press, bright));
  const auto dimmed = [](Frame frame) {
    const FrameFormat& f = frame.format;
    for (uint32_t c = 0; c < f.channels; ++c)
      for (uint32_t y = 0; y < f.height; ++y)
        for (uint32_t x = 0; x < f.width; ++x) frame.set(c, x, y, (frame.at(c, x, y) + 1) / 2);
    return frame;
  };
  const FoundBall dim = find_ball(dimmed(press), dimmed(r.background), {}, r.search);
  ASSERT_TRUE(dim.good()) << dim.refusal;
  EXPECT_NEAR(dim.ramp_per_px, bright.ramp_per_px, 0.05 * bright.ramp_per_px);
}

TEST(BallFinder, LightThatFallsOffIsNoOtherBall) {
  const FrameFormat format{320, 240, 3, 8};
  std::vector<FoundBall> balls;
  for (int i = 0; i < 24; ++i) {
    FoundBall& ball = balls.emplace_back();
    ball.center_x_px = 30.0 + 52 * (i % 6);
    ball.center_y_px = 30.0 + 60 * static_cast<int>(i / 6);
    const double x = 2 * ball.center_x_px / format.width - 1;
    ball.ramp_per_px = 2 * std::exp(-0.9 * x * x);
  }
  std::vector<FoundBall> others = balls;
  for (const size_t i : {3u, 14u}) others[i].ramp_per_px *= 0.5;
  const std::vector<double> usual = usual_ramps(others, format);
  for (size_t i = 0; i < balls.size(); ++i)
    EXPECT_NEAR(usual[i], balls[i].ramp_per_px, 0.03 * balls[i].ramp_per_px) << i;
  others.resize(5);
  EXPECT_EQ(usual_ramps(others, format).front(), usual_ramps(others, format).back());  // too few for a place
}

TEST(BallFinder, MarkersOfTheSyntheticGelAreMasked) {
  // The same presses with and without printed dots, and with dots that are not masked.
  const auto fitted = [](const std::string& skin, bool mask) {
    const std::string input = "synthetic:palpation?mode=gel&size=480x360&rate=1&radius=5&seed=3&skin=" + skin;
    const Sensor sensor = synthetic_sensor(parse_synthetic(input));
    PressSearch search;
    search.shape = PressedShape::ball(5);
    search.mask_markers = mask;
    const BallPresses found = find_presses(input, sensor, search, 4);
    PhotometricFit fit(found.format, sensor.pitch_mm_per_px);
    for (size_t i = 0; i < found.presses.size(); ++i) {
      const BallPress& p = found.presses[i];
      EXPECT_EQ(p.mask.empty(), skin == "none" || !mask);
      fit.add_ball(p.frame, found.backgrounds[i], p.ball.center_x_px, p.ball.center_y_px, p.ball.radius_px, 5,
                   p.label, p.mask);
    }
    PhotometricFitResult result = fit.solve(1, NormalModel::Best);
    std::printf("skin %s%s: %zu presses, held out %.4f mm, %.2f deg\n", skin.c_str(),
                mask ? "" : " (not masked)", found.presses.size(), result.depth_rmse_mm,
                result.normal_angle_deg);
    return result;
  };
  const PhotometricFitResult plain = fitted("none", true), masked = fitted("markers", true),
                             unmasked = fitted("markers", false);
  EXPECT_LT(masked.normal_angle_deg, 2.5 * plain.normal_angle_deg);
  EXPECT_LT(masked.normal_angle_deg, 0.5 * unmasked.normal_angle_deg);
  // Between the dots lie pieces of the contact; the ball goes on under them.
  EXPECT_LT(masked.depth_rmse_mm, 1.5 * plain.depth_rmse_mm);
}

/// A gray gel: change grows with the depth of a ball below the rim.
Frame gray_press(double cx, double cy, double contact_px, double ball_px, uint32_t rest_gray) {
  Frame frame;
  frame.reshape({160, 120, 1, 8});
  const double rim = std::sqrt(ball_px * ball_px - contact_px * contact_px);
  for (uint32_t y = 0; y < 120; ++y)
    for (uint32_t x = 0; x < 160; ++x) {
      const double r = std::hypot(x - cx, y - cy);
      const double depth = r < contact_px ? std::sqrt(ball_px * ball_px - r * r) - rim : 0;
      frame.set(0, x, y, static_cast<uint32_t>(std::lround(rest_gray - 6 * depth)));
    }
  return frame;
}

TEST(BallFinder, FindsABallInAGrayGel) {
  Frame rest;
  rest.reshape({160, 120, 1, 8});
  std::fill(rest.bytes.begin(), rest.bytes.end(), uint8_t{180});
  for (const auto& [x, y, radius] : {std::tuple{70.3, 55.8, 30.0}, {90.0, 60.0, 20.0}}) {
    const FoundBall ball = find_gray_ball(gray_press(x, y, radius, 45, 180), rest, {}, Signal::Darker,
                                          {PressedShape::ball(45 * 0.05), 0.05, 2});
    EXPECT_TRUE(ball.good()) << ball.refusal;
    EXPECT_NEAR(ball.center_x_px, x, 0.15);
    EXPECT_NEAR(ball.center_y_px, y, 0.15);
    EXPECT_NEAR(ball.radius_px, radius, 0.03 * radius + 0.5);
  }
  EXPECT_FALSE(find_gray_ball(rest, rest, {}, Signal::Darker, {PressedShape::ball(2.25), 0.05, 2}).good());
  // The wrong sign shows no touch.
  EXPECT_FALSE(find_gray_ball(gray_press(70, 60, 30, 45, 180), rest, {}, Signal::Brighter,
                              {PressedShape::ball(2.25), 0.05, 2})
                   .good());
  EXPECT_NE(find_gray_ball(gray_press(10, 60, 30, 45, 180), rest, {}, Signal::Darker,
                           {PressedShape::ball(2.25), 0.05, 2})
                .refusal.find("border"),
            std::string::npos);
}

}  // namespace
}  // namespace palpate
