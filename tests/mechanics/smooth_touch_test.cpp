// A smooth change of a gel's image is a touch where its slopes are a surface's, and light where they are not.
#include "engine/measure/contact/smooth_touch.h"

#include <gtest/gtest.h>

#include <cmath>

namespace palpate {
namespace {

constexpr uint32_t kWidth_px = 320, kHeight_px = 240;
constexpr size_t kAcross = kWidth_px / 4, kDown = kHeight_px / 4;

class SmoothTouchTest : public testing::Test {
 protected:
  SmoothTouchTest() {
    sensor_.pitch_mm_per_px = 0.07;
    sensor_.photometric.wx = {{1}, {0}, {0}};
    sensor_.photometric.wy = {{0}, {1}, {0}};
    for (auto& colour : change_) colour.assign(kAcross * kDown, 0);
  }

  /// A dome of 1 mm and 6 mm radius, as the solve has it; red and green show `of_surface` of its slopes and
  /// `of_light` of a glow that has the same strength.
  void show(double of_surface, double of_light) {
    constexpr double kRadius_mm = 6, kHeight_mm = 1;
    const double cell_mm = 4 * sensor_.pitch_mm_per_px;
    for (size_t y = 0; y < kDown; ++y)
      for (size_t x = 0; x < kAcross; ++x) {
        const size_t cell = y * kAcross + x;
        const double u = (static_cast<double>(x) - kAcross / 2.0) * cell_mm,
                     v = (static_cast<double>(y) - kDown / 2.0) * cell_mm;
        const double inside = std::max(0.0, 1 - (u * u + v * v) / (kRadius_mm * kRadius_mm));
        const double steep = -4 * kHeight_mm * inside / (kRadius_mm * kRadius_mm);
        level_mm_[cell] = static_cast<float>(kHeight_mm * inside * inside);
        raised_[cell] = inside > 0 ? 8.0f : 0.0f;
        const double p = of_surface * steep * u - of_light * steep * v;  // the glow's slopes turn around it
        const double q = of_surface * steep * v + of_light * steep * u;
        const double up = 1 / std::sqrt(1 + p * p + q * q);
        change_[0][cell] = static_cast<float>(255 * p * up);
        change_[1][cell] = static_cast<float>(255 * q * up);
      }
  }
  SmoothTouch::TakenOff look_at() {
    SmoothTouch touch(sensor_, {kWidth_px, kHeight_px, 3, 8});
    return touch.look_at({at_rest_, raised_, level_mm_, depth_mm_, change_});
  }

  Sensor sensor_;
  std::vector<uint8_t> at_rest_ = std::vector<uint8_t>(kAcross * kDown, 1);
  std::vector<float> raised_ = std::vector<float>(kAcross * kDown), level_mm_ = raised_, depth_mm_ = raised_;
  std::array<std::vector<float>, 3> change_;
};

using enum SmoothTouch::TakenOff;

TEST_F(SmoothTouchTest, SlopesOfASurfaceAreATouch) {
  show(1, 0);
  EXPECT_EQ(look_at(), Touch);
}

TEST_F(SmoothTouchTest, SlopesThatNoSurfaceHasAreLight) {
  show(0.2, 1);
  EXPECT_EQ(look_at(), Nothing);
}

TEST_F(SmoothTouchTest, SomeOfBothMayBeATouch) {
  show(1, 0.3);
  EXPECT_EQ(look_at(), PerhapsTouch);
}

TEST_F(SmoothTouchTest, LittleThatIsTakenOffDoesNotMatter) {
  show(1, 0);
  depth_mm_.front() = 3;  // more is left
  EXPECT_EQ(look_at(), Nothing);
  depth_mm_.front() = 0;
  for (float& level : level_mm_) level *= 0.05f;
  EXPECT_EQ(look_at(), Nothing);
}

TEST_F(SmoothTouchTest, WhatLiesInContactsIsNotTakenOff) {
  show(1, 0);
  for (size_t i = 0; i < at_rest_.size(); ++i) at_rest_[i] = raised_[i] > 0 ? 0 : 1;
  EXPECT_EQ(look_at(), Nothing);
}

}  // namespace
}  // namespace palpate
