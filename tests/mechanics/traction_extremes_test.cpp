// Traction where it is hard: contacts that the frame cuts off, faces as wide as the frame, noise alone,
// layers thin and thick.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "capture/synthetic/slope_noise.h"
#include "engine/base/text.h"
#include "engine/pad/layer_continuation.h"
#include "engine/pad/traction.h"
#include "tests/support/pressed_surface.h"

namespace palpate {
namespace {

constexpr Material kExtremeGel{0.15, 0.485};

/// A sphere of which the grid sees a part, and what presses in that part.
struct CutSphere {
  CutSphere(double thickness_mm, double contact_mm, double at_x)
      : surface({64, 48, 0.3125}),
        press(Layer(kExtremeGel, thickness_mm).press_sphere_to_radius(contact_mm, 3 * contact_mm)) {
    surface.add(press, at_x, 0.5);
    constexpr int kParts = 6;
    const double cell_mm = surface.grid.cell_mm;
    for (size_t i = 0; i < surface.depth.size(); ++i) {
      double sum = 0;
      for (int a = 0; a < kParts; ++a)
        for (int b = 0; b < kParts; ++b)
          sum += press.pressure_MPa(std::hypot(surface.x_of(i) - at_x + ((a + 0.5) / kParts - 0.5) * cell_mm,
                                               surface.y_of(i) - 0.5 + ((b + 0.5) / kParts - 0.5) * cell_mm));
      pressure.push_back(sum / (kParts * kParts));
      force += pressure.back() * cell_mm * cell_mm;
    }
  }
  Traction solve(double thickness_mm, bool goes_on) const {
    TractionOptions options;
    options.slope_sd = 0.02;
    TractionSolver solver({kExtremeGel, thickness_mm}, surface.grid, options);
    TractionInput input = surface.input();
    input.goes_on = goes_on;
    return solver.solve(input);
  }
  double in_grid(const Traction& found) const {
    double sum = 0;
    for (const float one : found.pressure_MPa) sum += double{one};
    return sum * surface.grid.cell_mm * surface.grid.cell_mm;
  }
  /// Root of the mean square over the contact in the grid, over the largest pressure.
  double error(const Traction& found) const {
    double squares = 0, cells = 0, peak = 0;
    for (size_t i = 0; i < pressure.size(); ++i) {
      if (pressure[i] <= 0) continue;
      squares += std::pow(double{found.pressure_MPa[i]} - pressure[i], 2);
      peak = std::max(peak, pressure[i]);
      ++cells;
    }
    return std::sqrt(squares / cells) / peak;
  }
  /// The largest of the outermost cells, found over true.
  double ridge(const Traction& found) const {
    const uint32_t w = surface.grid.width, h = surface.grid.height;
    double most = 0, wanted = 0;
    for (size_t i = 0; i < pressure.size(); ++i) {
      const size_t x = i % w, y = i / w;
      if (x != 0 && y != 0 && x + 1 != w && y + 1 != h) continue;
      most = std::max(most, double{found.pressure_MPa[i]});
      wanted = std::max(wanted, pressure[i]);
    }
    return most / wanted;
  }

  PressedSurface surface;
  LayerContact press;
  std::vector<double> pressure;
  double force = 0;
};

// A load beyond the border pulls on the surface inside. Where the contact is stated to go on, the
// outermost cells do not carry it: the ridge is gone, the pressure in the grid is right whatever the
// surface's tilt, and the force of the whole contact is within its interval.
TEST(TractionAtTheBorder, ContactThatGoesOn) {
  for (const double thickness : {5.5, 40.0})
    for (const double contact : {4.0, 9.0})
      for (const double at_x : {8.0, 10.0, 12.0}) {  // the border is at 10
        SCOPED_TRACE(text("%g mm thick, contact of %g mm at %g", thickness, contact, at_x));
        CutSphere cut(thickness, contact, at_x);
        const Traction ends = cut.solve(thickness, false), goes_on = cut.solve(thickness, true);
        EXPECT_TRUE(goes_on.converged);
        EXPECT_TRUE(goes_on.at_border);
        // Of a small contact whose middle lies outside little is left to go by.
        const bool sliver = contact < 5 && at_x > 10;
        EXPECT_LT(cut.error(goes_on), 0.5 * cut.error(ends));
        EXPECT_LE(cut.error(goes_on), sliver ? 0.16 : 0.11);
        EXPECT_GT(cut.ridge(ends), 1.9);
        EXPECT_LT(cut.ridge(goes_on), sliver ? 1.35 : 1.2);
        EXPECT_NEAR(cut.in_grid(goes_on), cut.force, (sliver ? 0.25 : 0.1) * cut.force);
        const double whole_N = cut.press.summary().force_N, sd_N = goes_on.wrench.force_sd_N[2];
        EXPECT_NEAR(goes_on.wrench.force_N[2], whole_N, 1.96 * sd_N);
        EXPECT_LT(sd_N, (sliver ? 0.8 : 0.35) * whole_N);
        EXPECT_NEAR(goes_on.wrench.force_N[2], whole_N, (at_x == 10 ? 0.25 : 0.5) * whole_N);
        // A tilt of the whole surface says nothing about what presses.
        for (size_t i = 0; i < cut.surface.depth.size(); ++i)
          cut.surface.depth[i] += static_cast<float>(0.03 * cut.surface.x_of(i) - 0.05 * cut.surface.y_of(i));
        EXPECT_NEAR(cut.solve(thickness, true).wrench.force_N[2], goes_on.wrench.force_N[2], 0.01 * whole_N);
      }
}

// A contact of which the grid, 20 x 15 mm, sees the middle and hardly any rim, or none: then an even pressure
// leaves no slopes, and the interval has to hold it.
TEST(TractionAtTheBorder, ContactWiderThanTheGrid) {
  for (const double contact : {10.5, 12.0, 14.0}) {
    SCOPED_TRACE(contact);
    const CutSphere wide(5.5, contact, 0);
    const Traction found = wide.solve(5.5, true);
    const double whole_N = wide.press.summary().force_N, sd_N = found.wrench.force_sd_N[2];
    std::printf("contact of %.1f mm: %.1f of %.1f N in the grid, %.1f +- %.1f of %.1f N in all\n", contact,
                wide.in_grid(found), wide.force, found.wrench.force_N[2], sd_N, whole_N);
    EXPECT_NEAR(found.wrench.force_N[2], whole_N, 1.96 * sd_N);
    if (contact > 12.5) continue;  // the grid's corners
    EXPECT_NEAR(wide.in_grid(found), wide.force, 0.1 * wide.force);
    EXPECT_LT(sd_N, 0.35 * whole_N);
  }
}

// Inside the grid it changes nothing.
TEST(TractionAtTheBorder, ContactInsideIsTheSame) {
  const CutSphere inside(5.5, 4, 0);
  const Traction ends = inside.solve(5.5, false), goes_on = inside.solve(5.5, true);
  EXPECT_FALSE(ends.at_border);
  EXPECT_NEAR(goes_on.wrench.force_N[2], ends.wrench.force_N[2], 1e-6 * inside.force);
  for (size_t i = 0; i < ends.pressure_MPa.size(); ++i)
    ASSERT_NEAR(goes_on.pressure_MPa[i], ends.pressure_MPa[i], 1e-6);
}

TEST(LayerContinuation, TransposesItself) {
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  LayerContinuation layer(LayerKernel({kExtremeGel, 2}, 0.3), 13, 9, 5, false);
  layer.set_reach(3.2);
  std::vector<double> p(13 * 9), d(p), depth(p), back(p), inside;
  for (double& value : p) value = normal(random);
  for (double& value : d) value = normal(random);
  layer.depth_by_pressure(p, depth);
  layer.pressure_by_depth(d, back);
  double one = 0, other = 0;
  for (size_t i = 0; i < p.size(); ++i) {
    one += d[i] * depth[i];
    other += p[i] * back[i];
  }
  EXPECT_NEAR(one, other, 1e-9 * std::abs(one));
  // Nothing goes on: the grid alone.
  LayerConvolution(LayerKernel({kExtremeGel, 2}, 0.3), 13, 9, false).depth_by_pressure(p, inside);
  layer.set_reach(0);
  layer.depth_by_pressure(p, depth);
  for (size_t i = 0; i < p.size(); ++i) EXPECT_NEAR(depth[i], inside[i], 1e-9);
}

// A flat face over all of the grid leaves no slopes: nothing tells what presses, and that is said.
TEST(TractionAtTheBorder, PlateOverAllOfTheGrid) {
  const TractionGrid grid{40, 30, 0.5};
  const std::vector<float> depth(40 * 30, 0.4f);
  const std::vector<uint8_t> contact(depth.size(), 1);
  TractionSolver solver({kExtremeGel, 5.5}, grid, {});
  EXPECT_TRUE(solver.solve({.depth_mm = depth, .contact = contact}).at_border);
  const Traction& found = solver.solve({.depth_mm = depth, .contact = contact, .goes_on = true});
  EXPECT_TRUE(found.at_border);
  // 0.1 of the thickness under a plate that wide.
  const double poisson = kExtremeGel.poisson, area_mm2 = 20 * 15;
  const double confined =
      kExtremeGel.young_MPa * (1 - poisson) / ((1 + poisson) * (1 - 2 * poisson)) * 0.4 / 5.5 * area_mm2;
  EXPECT_NEAR(found.wrench.force_N[2], confined, 2 * found.wrench.force_sd_N[2]);
}

// Errors of slopes where anything may press make pressure, since it is never negative; the interval has to
// know.
TEST(TractionExtremes, NoiseAloneIsWithinItsInterval) {
  std::mt19937 random(8);
  for (const double thickness : {1.5, 5.5, 40.0}) {
    SCOPED_TRACE(thickness);
    const TractionGrid grid{48, 36, 0.5};
    TractionOptions options;
    options.slope_sd = 0.02;
    TractionSolver solver({kExtremeGel, thickness}, grid, options);
    std::vector<float> depth(size_t{grid.width} * grid.height);
    for (int trial = 0; trial < 3; ++trial) {
      std::ranges::fill(depth, 0.0f);
      add_slope_noise(depth, grid, options.slope_sd, random);
      const Traction& found = solver.solve({.depth_mm = depth});
      EXPECT_LE(found.wrench.force_N[2], 1.96 * found.wrench.force_sd_N[2]);
      EXPECT_GT(found.wrench.force_sd_N[2], 0.5 * found.wrench.force_N[2]);
      solver.forget();
    }
  }
}

}  // namespace
}  // namespace palpate
