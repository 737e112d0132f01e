// The rest correction: means and what is taken off are those of plain loops; tilt and bowl beside a press go,
// the press stays.
#include "engine/stages/surface/rest_correction.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>

#include "engine/gpu/commands.h"
#include "tests/support/gpu_fixture.h"

namespace palpate {
namespace {

constexpr uint32_t kSide = shared::kCellSide;

class RestCorrectionTest : public GpuTest {
 protected:
  RestCorrectionTest(uint32_t width = 379, uint32_t height = 277)
      : grid_(grid_for(width, height)),
        correction_(context(), grid_),
        slot_(correction_.slot(context())),
        upload_(context(), "heights", grid_.bytes(), gpu::Memory::Upload),
        download_(context(), "heights", grid_.bytes(), gpu::Memory::Readback),
        depth_(context(), "depth", grid_) {}

  uint32_t cells_x() const { return (grid_.width + kSide - 1) / kSide; }
  uint32_t cells_y() const { return (grid_.height + kSide - 1) / kSide; }
  size_t at(uint32_t x, uint32_t y) const { return size_t{y} * grid_.pitch * 4 + x; }

  void write(const std::function<double(double, double)>& height) {
    const auto values = upload_.as<float>();
    std::ranges::fill(values, std::numeric_limits<float>::quiet_NaN());  // padding must not matter
    for (uint32_t y = 0; y < grid_.height; ++y)
      for (uint32_t x = 0; x < grid_.width; ++x) values[at(x, y)] = static_cast<float>(height(x, y));
    upload_.flush();
    gpu::Commands commands(context());
    commands.begin();
    commands.copy(upload_, depth_.buffer, grid_.bytes());
    commands.barrier();
    correction_.record_means(commands, depth_, slot_);
    commands.host_barrier();
    commands.end();
    commands.submit();
    commands.wait();
  }
  std::span<const float> correct() {
    gpu::Commands commands(context());
    commands.begin();
    correction_.record(commands, depth_, slot_);
    commands.copy(depth_.buffer, download_, grid_.bytes());
    commands.host_barrier();
    commands.end();
    commands.submit();
    commands.wait();
    download_.invalidate();
    return download_.as<const float>();
  }
  std::vector<uint8_t> beyond(double x_px, double y_px, double radius_px) const {
    std::vector<uint8_t> rest(size_t{cells_x()} * cells_y());
    for (uint32_t y = 0; y < cells_y(); ++y)
      for (uint32_t x = 0; x < cells_x(); ++x)
        rest[size_t{y} * cells_x() + x] =
            std::hypot(x * kSide + 1.5 - x_px, y * kSide + 1.5 - y_px) > radius_px;
    return rest;
  }

  Grid grid_;
  RestCorrection correction_;
  RestCorrection::Slot slot_;
  gpu::DeviceBuffer upload_, download_;
  FloatMap depth_;
};

TEST_F(RestCorrectionTest, MeansAndInterpolationArePlainLoops) {
  const auto height = [](double x, double y) { return std::sin(x / 7) + 0.01 * y; };
  write(height);
  slot_.means.invalidate();
  const auto means = slot_.means.as<const float>();
  for (uint32_t cy = 0; cy < cells_y(); ++cy)
    for (uint32_t cx = 0; cx < cells_x(); ++cx) {
      double sum = 0, n = 0;
      for (uint32_t y = cy * kSide; y < std::min((cy + 1) * kSide, grid_.height); ++y)
        for (uint32_t x = cx * kSide; x < std::min((cx + 1) * kSide, grid_.width); ++x)
          sum += height(x, y), n += 1;
      ASSERT_NEAR(means[size_t{cy} * cells_x() + cx], sum / n, 1e-5) << cx << ", " << cy;
    }
  const auto levels = slot_.levels.as<float>();
  for (size_t i = 0; i < size_t{cells_x()} * cells_y(); ++i)
    levels[i] = static_cast<float>(i * 37 % 101) / 50;
  slot_.levels.flush();
  const auto corrected = correct();
  const auto level = [&](int64_t x, int64_t y) {
    x = std::clamp<int64_t>(x, 0, cells_x() - 1), y = std::clamp<int64_t>(y, 0, cells_y() - 1);
    return double{levels[static_cast<size_t>(y) * cells_x() + static_cast<size_t>(x)]};
  };
  for (uint32_t y = 0; y < grid_.height; ++y)
    for (uint32_t x = 0; x < grid_.width; ++x) {
      const double u = (x - 1.5) / kSide, v = std::clamp((y - 1.5) / kSide, 0.0, cells_y() - 1.0);
      const double fu = std::floor(u), fv = std::floor(v), s = u - fu, t = v - fv;
      const auto i = static_cast<int64_t>(fu), j = static_cast<int64_t>(fv);
      const double off = (1 - t) * ((1 - s) * level(i, j) + s * level(i + 1, j)) +
                         t * ((1 - s) * level(i, j + 1) + s * level(i + 1, j + 1));
      ASSERT_NEAR(corrected[at(x, y)], height(x, y) - off, 1e-5) << x << ", " << y;
    }
}

TEST_F(RestCorrectionTest, TiltAndBowlGoThePressStays) {
  const double x0 = 200, y0 = 130, radius = 60;
  const auto press = [&](double x, double y) {
    return 1.5 * std::max(0.0, 1 - (std::pow(x - x0, 2) + std::pow(y - y0, 2)) / (radius * radius));
  };
  const auto error = [](double x, double y) { return 0.3 + 0.002 * x - 0.001 * y + 8e-6 * (x * x - y * y); };
  write([&](double x, double y) { return press(x, y) + error(x, y); });
  const std::vector<uint8_t> rest = beyond(x0, y0, radius + 20);
  ASSERT_TRUE(correction_.find(slot_, rest));
  const auto corrected = correct();
  double worst = 0, deepest = 0;
  for (uint32_t y = 0; y < grid_.height; ++y)
    for (uint32_t x = 0; x < grid_.width; ++x) {
      worst = std::max(worst, std::abs(corrected[at(x, y)] - press(x, y)));
      deepest = std::max(deepest, double{corrected[at(x, y)]});
    }
  EXPECT_LT(worst, 0.03);  // of errors of up to 1 mm
  EXPECT_NEAR(deepest, 1.5, 0.02);
}

TEST_F(RestCorrectionTest, WithoutRestNothingIsTakenOff) {
  write([](double, double) { return 1.0; });
  EXPECT_FALSE(correction_.find(slot_, std::vector<uint8_t>(size_t{cells_x()} * cells_y())));
}

}  // namespace
}  // namespace palpate
