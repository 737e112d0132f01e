#include "capture/calibrate/photometric/still_noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace palpate {
namespace {

/// A frame of one grey with noise, and a spot of `touch` gray levels more.
Frame still_frame(double noise_gray, uint32_t touch, std::mt19937& random) {
  Frame frame;
  frame.reshape({.width = 80, .height = 60, .channels = 3, .bit_depth = 8});
  std::normal_distribution<double> noise(0, noise_gray);
  for (uint32_t c = 0; c < 3; ++c)
    for (uint32_t y = 0; y < 60; ++y)
      for (uint32_t x = 0; x < 80; ++x)
        frame.set(c, x, y,
                  static_cast<uint32_t>(std::lround(100 + noise(random))) + (x < 40 && y < 30 ? touch : 0));
  return frame;
}

TEST(StillNoise, IsThatOfOneFrame) {
  std::mt19937 random(3);
  StillNoise still;
  EXPECT_EQ(still.sd()[0], 0);
  still.add(still_frame(2, 0, random));
  EXPECT_EQ(still.sd()[0], 0) << "one frame tells none";
  for (const uint32_t touch : {0u, 0u, 20u, 20u, 20u, 20u}) still.add(still_frame(2, touch, random));
  for (const double sd : still.sd()) EXPECT_NEAR(255 * sd, std::sqrt(4 + 1.0 / 12), 0.06);
}

TEST(StillNoise, AFrameDeliveredTwiceTellsNothing) {
  std::mt19937 random(3);
  StillNoise still;
  const Frame frame = still_frame(2, 0, random);
  for (int k = 0; k < 3; ++k) still.add(frame);
  EXPECT_EQ(still.sd()[0], 0);
}

}  // namespace
}  // namespace palpate
