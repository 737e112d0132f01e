// Bending: what it counts of a change of known shape, and what it does not.
#include "engine/measure/bending.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

namespace palpate {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kPitch_mm = 0.05, kGel_mm = 2;

/// A colour gel of an even gray, and a change of it, gray levels, of a place in mm, alike in all colours.
class Gel {
 public:
  explicit Gel(uint8_t gray, FrameFormat format = {.width = 402, .height = 301, .channels = 3})
      : format_(format), bending_(format, kPitch_mm, kGel_mm) {
    Frame frame;
    frame.reshape(format);
    std::ranges::fill(frame.bytes, gray);
    bending_.set_background(frame);
  }
  double mm2() const { return format_.width * format_.height * kPitch_mm * kPitch_mm; }
  double measure(const std::function<double(double x_mm, double y_mm)>& change) {
    std::vector<shared::CellChange> cells;
    for (uint32_t y = 0; y < format_.height; y += shared::kCellSide)
      for (uint32_t x = 0; x < format_.width; x += shared::kCellSide) {
        double sum = 0;
        for (uint32_t v = y; v < std::min(y + shared::kCellSide, format_.height); ++v)
          for (uint32_t u = x; u < std::min(x + shared::kCellSide, format_.width); ++u)
            sum += change(u * kPitch_mm, v * kPitch_mm);
        const int whole = static_cast<int>(std::lround(sum));
        cells.push_back({whole, whole, whole, 0, 0, 0});
      }
    return bending_.measure(cells);
  }

 private:
  FrameFormat format_;
  Bending bending_;
};

// A wave across: as steep as it is, less what a bell of a quarter of the thickness takes away.
TEST(Bending, CountsWavesAtWhichAPadCarriesLoad) {
  Gel gel(100);
  const auto waves = [&](double length_mm) {
    return gel.measure([&](double x, double) { return 40 * std::sin(2 * kPi * x / length_mm); });
  };
  const auto expected = [&](double length_mm) {
    const double wave = 2 * kPi / length_mm, sd_mm = kGel_mm / 4;
    const double cell_mm = shared::kCellSide * kPitch_mm, mean_of_cosine = 2 / kPi;
    // Slopes are differences over two cells.
    return std::sqrt(3.0) * 0.4 * std::sin(wave * cell_mm) / cell_mm * mean_of_cosine *
           std::exp(-wave * wave * sd_mm * sd_mm / 2) * gel.mm2();
  };
  for (const double length_mm : {10.0, 5.0, 2.5}) {
    const double found = waves(length_mm);
    EXPECT_NEAR(found, expected(length_mm), 0.04 * expected(length_mm)) << length_mm << " mm";
  }
  // Texture as fine as a third of the thickness, many times as steep as the longest wave, counts for less.
  EXPECT_LT(waves(kGel_mm / 3), 0.1 * waves(10));
}

TEST(Bending, EvenLightIsNone) {
  Gel gel(100);
  EXPECT_LT(gel.measure([](double, double) { return 30; }), 1e-3);
  // A lamp that falls off by a tenth over the frame bends as little as a hundredth of a touch.
  const double touch = gel.measure([](double x, double y) {
    const double r = std::hypot(x - 10, y - 7);
    return r < 4 ? 15 * (x - 10) : 0;
  });
  EXPECT_LT(gel.measure([](double x, double) { return 8 * (1 - x / 200); }), 0.05 * touch);
}

// Twice the light is the same touch.
TEST(Bending, CountsRelativeToTheUntouchedImage) {
  Gel dark(60), bright(120);
  const auto touch = [](double gain) {
    return [gain](double x, double y) {
      return gain * std::exp(-(x - 9) * (x - 9) / 8 - (y - 8) * (y - 8) / 8);
    };
  };
  const double of_dark = dark.measure(touch(30));
  EXPECT_NEAR(bright.measure(touch(60)), of_dark, 0.01 * of_dark);
}

TEST(Bending, SmallestFrames) {
  for (const FrameFormat format : {FrameFormat{.width = 1, .height = 1, .channels = 3},
                                   FrameFormat{.width = 5, .height = 90, .channels = 3}}) {
    Gel gel(100, format);
    EXPECT_EQ(gel.measure([](double, double) { return 0; }), 0);
    EXPECT_TRUE(std::isfinite(gel.measure([](double, double y) { return 50 * y; })));
  }
}

}  // namespace
}  // namespace palpate
