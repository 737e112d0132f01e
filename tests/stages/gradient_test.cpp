// The gradient stage: its sum is that of plain loops to the last unit, light that changes evenly leaves it
// alone, and it grows with what presses on a gel.
#include "engine/stages/frame/gradient.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>
#include <utility>
#include <vector>

#include "palpate/error.h"
#include "palpate/pipeline.h"
#include "tests/reference/gradient.h"
#include "tests/scenes/synthetic_run.h"
#include "tests/support/gpu_fixture.h"
#include "tests/support/thorough.h"

namespace palpate {
namespace {

class GradientStage : public GpuTest {
 protected:
  static Sensor sensor_for(uint32_t channels, double limit_gray_per_px) {
    Sensor sensor;
    sensor.name = "gradient test";
    sensor.pitch_mm_per_px = 0.1;
    sensor.channels = channels;
    sensor.signal = Signal::Either;
    sensor.gradient_gray_per_px = limit_gray_per_px;
    return sensor;
  }
  /// Frames are noise, which no camera sees.
  static PipelineOptions wanted() {
    return {.outputs = Output::Force | Output::Gradient, .any_picture = true};
  }
  static Frame random_frame(const FrameFormat& format, std::mt19937& random, int lowest, int highest) {
    Frame frame;
    frame.reshape(format);
    std::uniform_int_distribution<uint32_t> gray(static_cast<uint32_t>(lowest),
                                                 static_cast<uint32_t>(highest));
    for (uint32_t c = 0; c < format.channels; ++c)
      for (uint32_t y = 0; y < format.height; ++y)
        for (uint32_t x = 0; x < format.width; ++x) frame.set(c, x, y, gray(random));
    return frame;
  }
};

TEST_F(GradientStage, EqualsPlainLoops) {
  std::mt19937 random(3);
  using Size = std::array<uint32_t, 2>;
  for (const auto& [width, height] : part_of<Size>({{379, 277}, {16, 32}, {1, 1}, {17, 33}, {5, 90}}, 2))
    for (const uint32_t channels : {1u, 3u})
      for (const double limit : {0.0, 20.0}) {
        const FrameFormat format{width, height, channels, 8};
        const Sensor sensor = sensor_for(channels, limit);
        Pipeline pipeline(context(), sensor, format, wanted());
        // Noise, and black against white: the largest sums there are.
        for (const bool extreme : {false, true}) {
          const Frame rest = random_frame(format, random, extreme ? 0 : 100, extreme ? 255 : 130);
          Frame image = random_frame(format, random, extreme ? 0 : 90, extreme ? 255 : 160);
          if (extreme)
            for (uint32_t c = 0; c < channels; ++c)
              for (uint32_t y = 0; y < height; ++y)
                for (uint32_t x = 0; x < width; ++x) image.set(c, x, y, x / 4 % 2 ^ y / 5 % 2 ? 255 : 0);
          pipeline.set_background(rest);
          const Touch t = pipeline.process(image).touch;
          ASSERT_TRUE(t.gradient_sum.has_value());
          const uint64_t plain =
              reference::gradient_sum(image, &rest, static_cast<uint32_t>(limit * shared::kGradientUnits));
          EXPECT_EQ(*t.gradient_sum * shared::kGradientUnits, static_cast<double>(plain))
              << width << " x " << height << ", " << channels << " channels, limit " << limit;
        }
      }
}

TEST_F(GradientStage, FramesThatAreTheChange) {
  std::mt19937 random(4);
  Sensor sensor = sensor_for(1, 2);
  sensor.signal = Signal::Brighter;
  sensor.background.kind = BackgroundKind::None;
  const FrameFormat format{100, 70, 1, 8};
  Pipeline pipeline(context(), sensor, format, wanted());
  const Frame image = random_frame(format, random, 0, 255);
  EXPECT_EQ(pipeline.process(image).touch.gradient_sum.value() * shared::kGradientUnits,
            static_cast<double>(reference::gradient_sum(image, nullptr, 256)));
}

// A camera with automatic exposure: the sum of gray jumps, that of gradients does not.
TEST_F(GradientStage, EvenLightIsNoTouch) {
  std::mt19937 random(5);
  const FrameFormat format{160, 120, 3, 8};
  const Frame rest = random_frame(format, random, 100, 120);
  Frame brighter = rest;
  for (uint32_t c = 0; c < 3; ++c)
    for (uint32_t y = 0; y < 120; ++y)
      for (uint32_t x = 0; x < 160; ++x) brighter.set(c, x, y, rest.at(c, x, y) + 10 + 5 * c);
  Pipeline pipeline(context(), sensor_for(3, 0), format, wanted());
  pipeline.set_background(rest);
  const Touch t = pipeline.process(brighter).touch;
  EXPECT_GT(t.gray_sum, 15.0 * 160 * 120);
  EXPECT_EQ(t.gradient_sum, 0);
}

TEST_F(GradientStage, GrowsWithThePressOnAGel) {
  SyntheticRun run("press?mode=gel&size=320x240");
  Pipeline pipeline = run.pipeline(context(), wanted());
  std::vector<std::pair<double, double>> seen;
  for (uint64_t i = 0; i < run.count(); i += 10)
    seen.emplace_back(run.truth(i).force_N, pipeline.process(run.frame(i)).touch.gradient_sum.value());
  std::sort(seen.begin(), seen.end());
  ASSERT_GT(seen.back().first, 1);
  for (size_t i = 1; i < seen.size(); ++i) {
    if (seen[i].first < seen[i - 1].first + 0.1) continue;
    EXPECT_GT(seen[i].second, seen[i - 1].second) << seen[i].first << " N";
  }
}

TEST_F(GradientStage, OnlyWhereItIsWanted) {
  const FrameFormat format{64, 48, 3, 8};
  std::mt19937 random(6);
  const Frame rest = random_frame(format, random, 100, 120);
  Sensor sensor = sensor_for(3, 1);
  Pipeline without(context(), sensor, format, {.outputs = Output::Force});
  without.set_background(rest);
  EXPECT_FALSE(without.process(rest).touch.gradient_sum.has_value());
  sensor.force = ForceCalibration{.c1_N_per_gray = 1e-3, .gray_max = 1e6, .signal = ForceSignal::Gradient};
  Pipeline by_force(context(), sensor, format, {.outputs = Output::Force});
  by_force.set_background(rest);
  EXPECT_TRUE(by_force.process(rest).touch.gradient_sum.has_value());
  sensor.force.reset();
  sensor.channels = 1;
  sensor.bit_depth = 16;
  sensor.saturation_gray = 65535;
  EXPECT_THROW(Pipeline(context(), sensor, {64, 48, 1, 16}, wanted()), Error);
  sensor.force = ForceCalibration{.c1_N_per_gray = 1e-3, .gray_max = 1e6, .signal = ForceSignal::Gradient};
  EXPECT_THROW(validate(sensor, "test"), Error);
}

}  // namespace
}  // namespace palpate
