// Pictures that do not go with an untouched image, on a simulated gel.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <random>

#include "capture/calibrate/photometric/pad_match.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr FrameFormat kPadFormat{160, 120, 3, 8};

class PadMatchTest : public testing::Test {
 protected:
  using Gray = std::function<double(uint32_t channel, double x, double y)>;

  Frame picture(const Gray& gray) {
    std::normal_distribution<double> noise(0, 1);
    Frame f;
    f.reshape(kPadFormat);
    for (uint32_t c = 0; c < 3; ++c)
      for (uint32_t y = 0; y < kPadFormat.height; ++y)
        for (uint32_t x = 0; x < kPadFormat.width; ++x)
          f.set(c, x, y, static_cast<uint32_t>(std::clamp(gray(c, x, y) + noise(random_) + 0.5, 0.0, 255.0)));
    return f;
  }
  /// The pad at rest: lamps of three colours from three sides.
  static double rest(uint32_t c, double x, double y) {
    constexpr std::array<double, 3> kAcross{0.3, -0.2, 0.05}, kDown{0.1, 0.2, -0.35};
    return 90 + 15.0 * c + kAcross[c] * (x - 80) + kDown[c] * (y - 60) +
           12 * std::sin(x / 17) * std::cos(y / 23);
  }
  /// A ball of 60 px across, pressed there: it covers a seventh of the picture.
  static double pressed(uint32_t c, double x, double y) {
    const double dx = x - 70, dy = y - 65;
    const double side = c == 0 ? dx : c == 1 ? -dx / 2 + dy : -dx / 2 - dy;
    return rest(c, x, y) + (std::hypot(dx, dy) < 30 ? 1.5 * side : 0);
  }

  std::mt19937 random_{1};
  Sensor sensor_;
  Frame untouched_ = picture(rest);
};

TEST_F(PadMatchTest, PressesOfThePadGoWithItsUntouchedImage) {
  PadMatch match(untouched_, sensor_);
  EXPECT_EQ(match.look_at(picture(rest)), "");
  EXPECT_EQ(match.look_at(picture(pressed)), "");
  EXPECT_EQ(match.look_at(picture([](uint32_t c, double x, double y) { return 1.03 * pressed(c, x, y); })),
            "");
  EXPECT_EQ(match.pictures(), 3u);
  EXPECT_EQ(match.foreign(), 0u);
  EXPECT_EQ(match.describe(), "");
  EXPECT_NO_THROW(match.refuse_most("presses"));
}

TEST_F(PadMatchTest, WhatIsForeignIsNamed) {
  const struct {
    const char* what;
    Gray gray;
  } cases[] = {
      {"brightness +30 %", [](uint32_t c, double x, double y) { return 1.3 * pressed(c, x, y); }},
      {"brightness -30 %", [](uint32_t c, double x, double y) { return 0.7 * pressed(c, x, y); }},
      {"brightness +5 %, red +15",
       [](uint32_t c, double x, double y) { return (c == 0 ? 1.15 : 1) * pressed(c, x, y); }},
      {"colours exchanged", [](uint32_t c, double x, double y) { return pressed(2 - c, x, y); }},
      {"another pad or camera mode", [](uint32_t c, double x, double y) { return pressed(c, 159 - x, y); }},
      {"another pad or camera mode", [](uint32_t c, double x, double y) { return pressed(c, x, 119 - y); }},
      {"another pad or camera mode",
       [](uint32_t c, double x, double y) { return pressed(c, 20 + 0.7 * x, 15 + 0.7 * y); }},
  };
  for (const auto& one : cases) {
    PadMatch match(untouched_, sensor_);
    for (int i = 0; i < 3; ++i) match.look_at(picture(one.gray));
    EXPECT_EQ(match.foreign(), 3u) << one.what;
    EXPECT_NE(match.describe().find(one.what), std::string::npos) << one.what << ": " << match.describe();
    try {
      match.refuse_most("presses");
      ADD_FAILURE() << one.what;
    } catch (const Error& error) {
      EXPECT_EQ(error.failure(), Failure::Input);
      EXPECT_NE(error.found().find("3 of 3 pictures"), std::string::npos) << error.what();
    }
  }
}

TEST_F(PadMatchTest, AFewForeignPicturesAreLeftOutOneByOne) {
  PadMatch match(untouched_, sensor_);
  for (int i = 0; i < 4; ++i) EXPECT_EQ(match.look_at(picture(pressed)), "");
  EXPECT_NE(match.look_at(picture([](uint32_t c, double x, double y) { return 0.8 * pressed(c, x, y); })),
            "");
  EXPECT_NE(match.look_at(picture([](uint32_t c, double x, double y) { return pressed(c, 159 - x, y); })),
            "");
  EXPECT_EQ(match.foreign(), 2u);
  EXPECT_NE(match.describe().find("2 of 6 pictures"), std::string::npos) << match.describe();
  EXPECT_NO_THROW(match.refuse_most("presses"));
}

}  // namespace
}  // namespace palpate
