// The synthetic palpation window: it shows the forward model's pressure, at the gauge's force.
#include "capture/synthetic/tissue.h"

#include <gtest/gtest.h>

#include <cmath>

#include "palpate/error.h"

namespace palpate {
namespace {

TissueOptions small() {
  return parse_tissue(
      "synthetic:tissue?size=64x48&cells=16&force=0.5&loads=2&lx=3&ly=-2&x=2&y=1&noise=off&h=4");
}

TEST(SyntheticTissue, OptionsComeBack) {
  const TissueOptions o = small();
  EXPECT_EQ(o.width, 64u);
  EXPECT_EQ(o.loads, 2u);
  ASSERT_TRUE(o.scene.inclusion);
  EXPECT_EQ(o.scene.inclusion->offset_mm[0], 3);
  EXPECT_EQ(o.scene.inclusion->depth_mm, 4);
  EXPECT_EQ(to_string(parse_tissue(to_string(o))), to_string(o));
  EXPECT_FALSE(parse_tissue("synthetic:tissue?lump=none").scene.inclusion);
  const TissueOptions two = parse_tissue("synthetic:tissue?d=7&lx=-8&lx2=8&ly2=3");
  ASSERT_EQ(two.scene.others.size(), 1u);
  EXPECT_EQ(two.scene.others[0].size_mm[0], 7);
  EXPECT_EQ(two.scene.others[0].offset_mm, (std::array<double, 2>{8, 3}));
  EXPECT_EQ(to_string(parse_tissue(to_string(two))), to_string(two));
  EXPECT_TRUE(is_tissue("synthetic:tissue"));
  EXPECT_FALSE(is_tissue("synthetic:tissues"));
  for (const char* bad : {"size=5x5", "force=0", "force=x", "d=30", "cells=20", "loads=9", "colour=red",
                          "lump=cube", "x=99", "noise=loud", "lump=none&lx2=5"})
    EXPECT_THROW(parse_tissue(std::string("synthetic:tissue?") + bad), Error) << bad;
}

TEST(SyntheticTissue, GrayIsPressureAndForceIsItsIntegral) {
  const TissueOptions o = small();
  TissueSensor source(o);
  const Frame background = *source.own_background();
  const Sensor sensor = tissue_sensor(o);
  ASSERT_TRUE(sensor.force);
  Frame frame;
  double largest_N = 0, most_gray = 0;
  uint64_t frames = 0;
  while (source.next(frame)) {
    ++frames;
    const double block_N = source.block_force_N(frame.sequence);
    largest_N = std::max(largest_N, block_N);
    double sum = 0, peak = 0;
    for (uint32_t y = 0; y < 48; ++y)
      for (uint32_t x = 0; x < 64; ++x) {
        const double light = double(frame.at(0, x, y)) - double(background.at(0, x, y));
        sum += light;
        peak = std::max(peak, light);
        if (frame.sequence % 20 != 0) continue;
        const double x_mm = (x - 31.5) * sensor.pitch_mm_per_px, y_mm = (y - 23.5) * sensor.pitch_mm_per_px;
        const double expected =
            1e-6 * source.pressure_Pa(frame.sequence, x_mm, y_mm) * tissue_gray_per_MPa(o);
        EXPECT_NEAR(light, expected, 1.01 + 0.02 * expected) << x << " " << y << " frame " << frame.sequence;
      }
    most_gray = std::max(most_gray, peak);
    const auto truth = source.truth(frame.sequence);
    ASSERT_TRUE(truth);
    EXPECT_EQ(truth->contact, block_N > 0);
    EXPECT_NEAR(truth->force_N, sum * sensor.force->c1_N_per_gray, 0.02 * truth->force_N + 0.004);
    EXPECT_LT(truth->force_N, block_N + 1e-12);
  }
  EXPECT_EQ(frames, *source.frame_count());
  EXPECT_NEAR(largest_N, 0.5, 1e-9);
  EXPECT_GT(most_gray, 90);
  EXPECT_LT(most_gray, 240);
}

// The frame depends on its number alone, and the noise on the seed.
TEST(SyntheticTissue, FramesAreRepeatable) {
  TissueOptions o = small();
  o.noise = true;
  TissueSensor a(o), b(o);
  Frame first, again;
  ASSERT_TRUE(a.seek(40));
  ASSERT_TRUE(a.next(first));
  ASSERT_TRUE(b.seek(40));
  ASSERT_TRUE(b.next(again));
  EXPECT_EQ(first.bytes, again.bytes);
  o.seed = 2;
  TissueSensor other(o);
  ASSERT_TRUE(other.seek(40));
  ASSERT_TRUE(other.next(again));
  EXPECT_NE(first.bytes, again.bytes);
  EXPECT_FALSE(a.seek(100000));
}

}  // namespace
}  // namespace palpate
