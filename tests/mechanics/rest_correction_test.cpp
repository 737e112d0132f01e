// The rest correction: means and what is taken off are those of plain loops; tilt and bowl around a press go,
// the press stays.
#include "engine/measure/rest_correction.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>

#include "engine/base/divide_up.h"
#include "shaders/shared/cell_change.h"

namespace palpate {
namespace {

constexpr uint32_t kSide = shared::kCellSide;

/// Heights whose rows' padding is no number.
struct Heights {
  Heights(uint32_t width, uint32_t height, const std::function<double(double, double)>& at)
      : values(size_t{height} * (width + 5), std::numeric_limits<float>::quiet_NaN()),
        rows{values, width, height, width + 5},
        cells_x(divide_up(width, kSide)),
        cells_y(divide_up(height, kSide)) {
    for (uint32_t y = 0; y < height; ++y)
      for (uint32_t x = 0; x < width; ++x) rows.row(y)[x] = static_cast<float>(at(x, y));
  }
  std::vector<uint8_t> beyond(double x_px, double y_px, double radius_px) const {
    std::vector<uint8_t> rest(size_t{cells_x} * cells_y);
    for (uint32_t y = 0; y < cells_y; ++y)
      for (uint32_t x = 0; x < cells_x; ++x)
        rest[size_t{y} * cells_x + x] =
            std::hypot(x * kSide + 1.5 - x_px, y * kSide + 1.5 - y_px) > radius_px;
    return rest;
  }

  std::vector<float> values;
  HeightRows rows;
  uint32_t cells_x, cells_y;
};

TEST(RestCorrectionTest, MeansAndInterpolationArePlainLoops) {
  const auto height = [](double x, double y) { return std::sin(x / 7) + 0.01 * y; };
  for (const auto& [width, rows] : {std::array{379u, 277u}, {256u, 8u}, {640u, 5u}, {3u, 2u}, {4u, 9u}}) {
    Heights heights(width, rows, height);
    std::vector<float> means(size_t{heights.cells_x} * heights.cells_y), levels(means.size());
    cell_means(heights.rows, means);
    for (uint32_t cy = 0; cy < heights.cells_y; ++cy)
      for (uint32_t cx = 0; cx < heights.cells_x; ++cx) {
        double sum = 0, n = 0;
        for (uint32_t y = cy * kSide; y < std::min((cy + 1) * kSide, rows); ++y)
          for (uint32_t x = cx * kSide; x < std::min((cx + 1) * kSide, width); ++x)
            sum += height(x, y), n += 1;
        ASSERT_NEAR(means[size_t{cy} * heights.cells_x + cx], sum / n, 1e-6) << cx << ", " << cy;
      }
    for (size_t i = 0; i < levels.size(); ++i) levels[i] = static_cast<float>(i * 37 % 101) / 50;
    take_off(heights.rows, levels);
    const auto level = [&](int64_t x, int64_t y) {
      x = std::clamp<int64_t>(x, 0, heights.cells_x - 1), y = std::clamp<int64_t>(y, 0, heights.cells_y - 1);
      return double{levels[static_cast<size_t>(y) * heights.cells_x + static_cast<size_t>(x)]};
    };
    for (uint32_t y = 0; y < rows; ++y)
      for (uint32_t x = 0; x < width; ++x) {
        const double u = (x - 1.5) / kSide, v = (y - 1.5) / kSide;
        const double fu = std::floor(u), fv = std::floor(v), s = u - fu, t = v - fv;
        const auto i = static_cast<int64_t>(fu), j = static_cast<int64_t>(fv);
        const double off = (1 - t) * ((1 - s) * level(i, j) + s * level(i + 1, j)) +
                           t * ((1 - s) * level(i, j + 1) + s * level(i + 1, j + 1));
        ASSERT_NEAR(heights.rows.row(y)[x], height(x, y) - off, 2e-6) << x << ", " << y;
      }
  }
}

TEST(RestCorrectionTest, TiltAndBowlGoThePressStays) {
  const double x0 = 200, y0 = 130, radius = 60;
  const auto press = [&](double x, double y) {
    return 1.5 * std::max(0.0, 1 - (std::pow(x - x0, 2) + std::pow(y - y0, 2)) / (radius * radius));
  };
  const auto error = [](double x, double y) { return 0.3 + 0.002 * x - 0.001 * y + 8e-6 * (x * x - y * y); };
  Heights heights(379, 277, [&](double x, double y) { return press(x, y) + error(x, y); });
  RestCorrection correction(379, 277);
  correction.look_at(heights.rows);
  ASSERT_TRUE(correction.find(heights.beyond(x0, y0, radius + 20)));
  take_off(heights.rows, correction.level_mm());
  double worst = 0, deepest = 0;
  for (uint32_t y = 0; y < 277; ++y)
    for (uint32_t x = 0; x < 379; ++x) {
      const double height_mm = double{heights.rows.row(y)[x]};
      worst = std::max(worst, std::abs(height_mm - press(x, y)));
      deepest = std::max(deepest, height_mm);
    }
  EXPECT_LT(worst, 0.03);  // of errors of up to 1 mm
  EXPECT_NEAR(deepest, 1.5, 0.02);
}

TEST(RestCorrectionTest, WithoutRestNothingIsTakenOff) {
  Heights heights(379, 277, [](double, double) { return 1.0; });
  RestCorrection correction(379, 277);
  correction.look_at(heights.rows);
  EXPECT_FALSE(correction.find(heights.beyond(0, 0, 1e9)));
}

}  // namespace
}  // namespace palpate
