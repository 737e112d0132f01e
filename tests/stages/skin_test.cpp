// The skin stage: the pattern is found, the kernel equals plain loops, and the followed motion is that of the
// synthetic pad's skin.
#include "engine/stages/frame/skin.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <random>

#include "capture/synthetic/synthetic.h"
#include "engine/gpu/commands.h"
#include "engine/pipeline/pipeline_access.h"
#include "palpate/error.h"
#include "palpate/pipeline.h"
#include "tests/reference/skin.h"
#include "tests/support/gpu_fixture.h"
#include "tests/support/thorough.h"

namespace palpate {
namespace {

/// `any_picture`: frames may be black, which damaged ones are taken for.
PipelineOptions following(bool any_picture = false) {
  PipelineOptions options;
  options.outputs = Output::Force | Output::Skin;
  options.any_picture = any_picture;
  return options;
}

struct MarkedPad {
  explicit MarkedPad(gpu::Context& context, const std::string& text, bool any_picture = false)
      : source(parse_synthetic("synthetic:" + text)),
        sensor(synthetic_sensor(parse_synthetic("synthetic:" + text))),
        pipeline(context, sensor, source.format(), following(any_picture)) {
    background = *source.own_background();
    pipeline.set_background(background);
  }
  Touch see(uint64_t sequence) {
    EXPECT_TRUE(source.render(sequence, frame));
    return pipeline.process(frame).touch;
  }
  SyntheticSensor source;
  Sensor sensor;
  Pipeline pipeline;
  Frame background, frame;
};

TEST(SkinPoints, MarkersAreFoundAndMissingOnesAreNotInvented) {
  for (const char* mode : {"gel", "waveguide"}) {
    const SyntheticOptions o =
        parse_synthetic(std::string("synthetic:still?skin=markers&size=640x480&mode=") + mode);
    const SyntheticSensor source(o);
    const Sensor sensor = synthetic_sensor(o);
    Frame image = *source.own_background();
    const double spacing = sensor.skin->spacing_px;
    // A worn place without print.
    const auto rubbed = [](double x, double y) { return std::hypot(x - 400, y - 150) < 60; };
    for (uint32_t c = 0; c < image.format.channels; ++c)
      for (uint32_t y = 80; y < 220; ++y)
        for (uint32_t x = 330; x < 470; ++x)
          if (rubbed(x, y)) image.set(c, x, y, mode[0] == 'g' ? 130 : 18);
    const auto found = find_skin_points(skin_image(image), 640, 480, *sensor.skin);
    size_t expected = 0, hit = 0;
    for (int j = -20; j <= 20; ++j)
      for (int i = -20; i <= 20; ++i) {
        const double x = 319.5 + i * spacing, y = 239.5 + j * spacing;
        if (x < 12 || y < 12 || x > 627 || y > 467 || std::hypot(x - 400, y - 150) < 75) continue;
        ++expected;
        hit += std::any_of(found.begin(), found.end(), [&](const auto& p) {
          return std::hypot(double{p[0]} - x, double{p[1]} - y) < 1.7;  // printed within 0.03 mm of the grid
        });
      }
    EXPECT_GT(expected, 400u);
    EXPECT_EQ(hit, expected) << mode;
    size_t invented = 0;
    for (const auto& p : found) invented += std::hypot(double{p[0]} - 400, double{p[1]} - 150) < 50;
    EXPECT_EQ(invented, 0u) << mode;
  }
}

TEST(SkinPoints, AnImageWithoutPatternHasNone) {
  SkinPattern markers;
  const std::vector<float> flat(200 * 100, 50.0f);
  EXPECT_TRUE(skin_templates(flat, 200, 100, markers).empty());
  SkinPattern texture;
  texture.kind = SkinKind::Texture;
  EXPECT_TRUE(skin_templates(flat, 200, 100, texture).empty());
}

using SkinStage = GpuTest;

TEST_F(SkinStage, EqualsPlainLoops) {
  for (const char* text : {"drag?size=320x240&skin=texture", "drag?size=320x240&skin=markers&mode=gel",
                           "twist?size=333x250&skin=texture&bits=12", "pull?size=480x360&skin=markers"}) {
    MarkedPad pad(context(), text);
    const Skin stage(context(), pad.sensor, pad.source.format());
    reference::Skin plain(pad.background, *pad.sensor.skin, double{stage.search_px()});
    const uint64_t first = 30, last = of_sweep(36, 32);
    for (uint64_t k = first; k < last; ++k) {
      const Touch touch = pad.see(k);
      const auto& motions = plain.follow(pad.frame);
      ASSERT_EQ(touch.skin_points.size(), motions.size());
      size_t compared = 0, differ = 0;
      for (size_t i = 0; i < motions.size(); ++i) {
        const SkinPoint& p = touch.skin_points[i];
        const bool same =
            (p.correlation > 0) == (motions[i].correlation > 0) &&
            std::hypot(double{p.shift_x_px} - motions[i].x, double{p.shift_y_px} - motions[i].y) < 2e-3 &&
            std::abs(double{p.correlation} - motions[i].correlation) < 2e-3;
        compared += p.correlation > 0;
        differ += !same;
      }
      EXPECT_GT(compared, motions.size() / 2) << text;
      // A point at the very edge of being lost may fall to either side.
      EXPECT_LE(differ, motions.size() / 200) << text << " frame " << k << " of " << motions.size();
    }
  }
}

TEST_F(SkinStage, FollowsTheSkinOfTheSyntheticPad) {
  for (const char* text :
       {"drag?size=640x480&rate=10&skin=texture", "drag?size=480x360&rate=10&skin=markers&mode=gel",
        "twist?size=640x480&rate=10&skin=texture", "drag?size=640x480&rate=10&skin=markers"}) {
    MarkedPad pad(context(), text);
    double squares = 0, inside_squares = 0, largest = 0;
    size_t count = 0, inside = 0, lost = 0, all = 0;
    for (uint64_t k = 10; k < 50; k += 4) {
      const Touch touch = pad.see(k);
      const Truth truth = *pad.source.truth(k);
      for (size_t i = k % 13; i < touch.skin_points.size(); i += 13) {
        const SkinPoint& p = touch.skin_points[i];
        ++all;
        if (p.correlation <= 0) {
          ++lost;
          continue;
        }
        const auto shift = pad.source.skin_shift_px(k, double{p.rest_x_px}, double{p.rest_y_px});
        const double error = std::hypot(double{p.shift_x_px} - shift[0], double{p.shift_y_px} - shift[1]);
        const double r = std::hypot(double{p.rest_x_px} + shift[0] - truth.center_x_px,
                                    double{p.rest_y_px} + shift[1] - truth.center_y_px);
        largest = std::max(largest, std::hypot(shift[0], shift[1]));
        squares += error * error / 2;  // of one component
        ++count;
        if (truth.contact && r < 0.75 * truth.radius_px) {
          inside_squares += error * error / 2;
          ++inside;
        }
      }
    }
    const double rms = std::sqrt(squares / static_cast<double>(count)),
                 rms_inside = std::sqrt(inside_squares / static_cast<double>(inside)),
                 lost_fraction = static_cast<double>(lost) / static_cast<double>(all);
    std::printf(
        "%s: %zu points, RMS error %.3f px, under the contact %.3f px, largest shift %.1f px, lost %.2f %%\n",
        text, pad.see(0).skin_points.size(), rms, rms_inside, largest, 100 * lost_fraction);
    EXPECT_GT(largest, 4) << text;
    // Untouched, a waveguide is dark: its pattern is known to half a gray level only.
    EXPECT_LT(rms_inside, std::string(text).find("gel") == std::string::npos ? 0.065 : 0.02) << text;
    EXPECT_LT(lost_fraction, 0.05) << text;
  }
}

TEST_F(SkinStage, WhatIsLostIsFoundAgain) {
  MarkedPad pad(context(), "still?size=320x240&skin=markers&mode=gel", true);
  const Touch before = pad.see(0);
  ASSERT_GT(before.skin->points, 30u);
  EXPECT_EQ(before.skin->lost, 0u);
  Frame black = pad.frame;
  std::fill(black.bytes.begin(), black.bytes.end(), uint8_t{0});
  const Touch dark = pad.pipeline.process(black).touch;
  EXPECT_EQ(dark.skin->points, 0u);
  EXPECT_EQ(dark.skin->lost, before.skin->points);
  const Touch after = pad.see(1);
  EXPECT_EQ(after.skin->points, before.skin->points);
  for (const SkinPoint& p : after.skin_points)
    EXPECT_LT(std::hypot(double{p.shift_x_px}, double{p.shift_y_px}), 0.3);
}

TEST_F(SkinStage, WhatDoesNotFitIsRefusedInOneLine) {
  const SyntheticOptions o = parse_synthetic("synthetic:still?size=320x240");
  const SyntheticSensor source(o);
  Sensor sensor = synthetic_sensor(o);
  const auto line = [&] {
    try {
      Pipeline pipeline(context(), sensor, source.format(), following());
      pipeline.set_background(*source.own_background());
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string("accepted");
  };
  EXPECT_NE(line().find("pattern on the skin"), std::string::npos) << line();
  sensor.skin = SkinPattern{};
  EXPECT_NE(line().find("points to follow"), std::string::npos) << line();
  EXPECT_EQ(line().find('\n'), std::string::npos);
}

TEST_F(SkinStage, NothingIsComputedThatIsNotAskedFor) {
  const SyntheticOptions o = parse_synthetic("synthetic:still?size=320x240&skin=markers&mode=gel");
  const SyntheticSensor source(o);
  Sensor sensor = synthetic_sensor(o);
  sensor.shear.reset();
  PipelineOptions options;
  options.outputs = Output::Force;
  Pipeline pipeline(context(), sensor, source.format(), options);
  pipeline.set_background(*source.own_background());
  Frame frame;
  source.render(0, frame);
  const Touch touch = pipeline.process(frame).touch;
  EXPECT_FALSE(touch.skin.has_value());
  EXPECT_TRUE(touch.skin_points.empty());
  for (const auto& scope : PipelineAccess::traffic(pipeline)) EXPECT_NE(scope.name, "skin");
}

}  // namespace
}  // namespace palpate
