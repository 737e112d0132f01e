// Shear over pressure of a sphere that is dragged without sliding yet: it sticks within Cattaneo's core and
// slips around it.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "engine/pad/layer_convolution.h"
#include "engine/pad/traction.h"
#include "palpate/pipeline.h"
#include "tests/support/pressed_surface.h"

namespace palpate {
namespace {

constexpr Material kSlidingGel{0.15, 0.485};
constexpr double kThickness_mm = 5.5, kFriction = 0.5, kRadius_mm = 4, kPeak_MPa = 0.05;

/// Where the skin moves under Hertz pressure and Cattaneo's shear, of which the core of `core` times the
/// contact's radius sticks.
struct PartialSlip {
  PartialSlip(const TractionGrid& on, double core) : surface(on) {
    const size_t n = surface.depth.size();
    std::vector<double> p(n), along(n), none(n);
    for (size_t i = 0; i < n; ++i) {
      const double r = radius_of(i), inner = core > 0 ? r / core : 2;
      if (r >= 1) continue;
      surface.contact[i] = 1;
      p[i] = kPeak_MPa * std::sqrt(1 - r * r);
      along[i] = kFriction * p[i];
      if (inner < 1) along[i] -= kFriction * kPeak_MPa * core * std::sqrt(1 - inner * inner);
    }
    LayerConvolution layer(LayerKernel({kSlidingGel, kThickness_mm}, on.cell_mm), on.width, on.height, true);
    surface.load(layer, p, along, none);
  }
  double radius_of(size_t i) const { return std::hypot(surface.x_of(i), surface.y_of(i)) / kRadius_mm; }

  PressedSurface surface;
};

// The area at the limit is that around the core, whatever its size; skin that is followed to 5 um.
TEST(FrictionRatios, SlipAroundCattaneosCore) {
  for (const double core : {0.0, 0.4, 0.7, 0.9}) {
    PartialSlip press({80, 60, 0.25}, core);
    std::mt19937 random(5);
    std::normal_distribution<float> noise(0, 0.005f);
    for (std::vector<float>* shift : {&press.surface.shift_x, &press.surface.shift_y})
      for (float& value : *shift) value += noise(random);
    TractionOptions options;
    options.slope_sd = 1e-3;
    options.shift_sd_mm = 0.005;
    TractionSolver solver({kSlidingGel, kThickness_mm}, press.surface.grid, options);
    const Traction& found = solver.solve(press.surface.input());
    const TractionGrid& grid = press.surface.grid;
    const std::vector<float> ratios = friction_ratios({.width = grid.width,
                                                       .height = grid.height,
                                                       .pressure_kPa = found.pressure_MPa,
                                                       .shear_x_kPa = found.shear_x_MPa,
                                                       .shear_y_kPa = found.shear_y_MPa});
    ASSERT_EQ(ratios.size(), press.surface.depth.size());
    size_t cells = 0, right = 0;
    for (size_t i = 0; i < ratios.size(); ++i) {
      const double r = press.radius_of(i);
      if (r >= 1) continue;
      ++cells;
      const double inside = core > r ? std::sqrt((core * core - r * r) / (1 - r * r)) : 0;
      right += (double{ratios[i]} >= kSlippingShare * kFriction) == (1 - inside >= kSlippingShare);
    }
    std::printf("core %.1f of the radius: %.1f %% of %zu cells told right\n", core,
                100.0 * static_cast<double>(right) / static_cast<double>(cells), cells);
    EXPECT_GT(right, cells * 85 / 100);
  }
}

// Where hardly anything presses there is no ratio, and without shear there is no map.
TEST(FrictionRatios, OnlyWhereSomethingPresses) {
  const std::vector<float> pressure{10, 1, 0.4f, 0}, x{3, 0, 9, 9}, y{4, 1, 0, 0};
  const TractionMaps maps{
      .width = 4, .height = 1, .cell_px = 8, .pressure_kPa = pressure, .shear_x_kPa = x, .shear_y_kPa = y};
  EXPECT_EQ(friction_ratios(maps), (std::vector<float>{0.5f, 1, 0, 0}));
  EXPECT_TRUE(friction_ratios({.width = 4, .height = 1, .cell_px = 8, .pressure_kPa = pressure}).empty());
  EXPECT_TRUE(friction_ratios({}).empty());
}

}  // namespace
}  // namespace palpate
