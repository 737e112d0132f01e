// Traction from the shape of a layer's surface, against exact solutions of bonded layers.
#include "engine/pad/traction.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <numbers>
#include <random>

#include "capture/synthetic/slope_noise.h"
#include "engine/elasticity/layer.h"
#include "engine/pad/layer_convolution.h"
#include "engine/pad/layer_response.h"
#include "palpate/error.h"
#include "tests/support/pressed_surface.h"

namespace palpate {
namespace {

constexpr Material kGel{0.15, 0.485};

// The point load's loss of the exact contact, by other quadratures.
TEST(LayerKernel, DepthIsThePointLoads) {
  for (const double poisson : {0.0, 0.3, 0.485, 0.5}) {
    const LayerKernel layer({{0.2, poisson}, 3}, 0.1);
    const PointLoadLoss loss(poisson);
    const double scale = 0.1 / (std::numbers::pi * effective_modulus_MPa({0.2, poisson}));
    EXPECT_NEAR(layer.depth_scale_mm_per_MPa(), scale, 1e-12 * scale);
    for (const double x : {0.0, 1.0, 7.0, 60.0, 400.0})
      for (const double y : {0.0, 2.0, 30.0}) {
        EXPECT_NEAR(layer.depth_loss(std::hypot(x, y)), loss(std::hypot(x, y) / 30) / 30, 1e-8);
        double taken = 0;
        constexpr int kParts = 10;
        for (int i = 0; i < kParts; ++i)
          for (int j = 0; j < kParts; ++j)
            taken += loss(std::hypot(x + (i + 0.5) / kParts - 0.5, y + (j + 0.5) / kParts - 0.5) / 30) / 30;
        const double depth = scale * (love_cell(x, y) - taken / (kParts * kParts));
        EXPECT_NEAR(layer.depth(x, y), depth, 1e-6 * layer.depth(0, 0)) << x << " " << y;
        EXPECT_EQ(layer.at(x, y).depth, layer.depth(x, y));
      }
  }
}

// A wave of traction that does not vary across: summed against the kernel it gives the transfer functions.
TEST(LayerKernel, TransferFunctionsComeBack) {
  for (const double poisson : {0.0, 0.485, 0.5}) {
    const Material pad{0.3, poisson};
    for (const double thickness_cells : {0.5, 3.0, 20.0}) {
      const double cell = 0.1, thickness = cell * thickness_cells;
      const double shear_MPa = pad.young_MPa / (2 * (1 + poisson));
      const LayerKernel kernel({pad, thickness}, cell);
      const int reach = static_cast<int>(16 * thickness_cells) + 2;
      for (const double s : {0.3, 1.0, 2.5}) {
        const double k = std::min(s / thickness, 1.5 / cell);
        double normal = 0, along = 0, across = 0, coupling = 0;
        for (int x = -reach; x <= reach; ++x) {
          CellAnswer line{};
          for (int y = -reach; y <= reach; ++y) {
            const CellAnswer at = kernel.at(x, y);
            line.depth += at.depth;
            line.x_by_pressure += at.x_by_pressure;
            line.x_by_x += at.x_by_x;
            line.y_by_y += at.y_by_y;
          }
          const double phase = k * cell * x;
          normal += line.depth * std::cos(phase);
          along += line.x_by_x * std::cos(phase);
          across += line.y_by_y * std::cos(phase);
          coupling -= line.x_by_pressure * std::sin(phase);
        }
        // Sampled at cells: the wave and its images beyond the grid's shortest wave.
        LayerResponse sum{};
        for (int image = -400; image <= 400; ++image) {
          const double wave = k + 2 * std::numbers::pi * image / cell;
          const double box = std::sin(wave * cell / 2) / (wave * cell / 2);
          const LayerResponse at = layer_response(std::abs(wave) * thickness, poisson);
          const double weight = box / (shear_MPa * std::abs(wave));
          sum.normal += at.normal * weight;
          sum.along += at.along * weight;
          sum.across += at.across * weight;
          sum.coupling += at.coupling * weight * (wave > 0 ? 1 : -1);
        }
        const double scale = 1 / (shear_MPa * k);
        for (const auto& [found, wanted, name] :
             {std::tuple{normal, sum.normal, "normal"}, std::tuple{along, sum.along, "along"},
              std::tuple{across, sum.across, "across"}, std::tuple{coupling, sum.coupling, "coupling"}})
          EXPECT_NEAR(found, wanted, 1e-3 * scale)
              << name << ", nu " << poisson << ", " << thickness_cells << " cells, s " << s;
      }
    }
  }
}

TEST(LayerKernel, RefusesWhatIsNoLayer) {
  EXPECT_THROW(LayerKernel({{0, 0.4}, 1}, 0.1), Error);
  EXPECT_THROW(LayerKernel({{std::numeric_limits<double>::infinity(), 0.4}, 1}, 0.1), Error);
  EXPECT_THROW(LayerKernel({{0.1, 0.51}, 1}, 0.1), Error);
  EXPECT_THROW(LayerKernel({{0.1, 0.4}, -1}, 0.1), Error);
  EXPECT_THROW(LayerKernel({{0.1, 0.4}, 0}, 0.1), Error);
  EXPECT_THROW(LayerKernel({{0.1, 0.4}, 1, Base::Frictionless}, 0.1), Error);
  EXPECT_THROW(LayerKernel({{0.1, 0.4}, 1}, 0), Error);
}

// Pressure's work on what shear moves is shear's work on what pressure moves.
TEST(LayerConvolution, IsReciprocal) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  const uint32_t width = 23, height = 17;
  LayerConvolution layer(LayerKernel({{0.2, 0.4}, 0.7}, 0.2), width, height, true);
  std::vector<double> p(width * height), tx(p), ty(p), sx(p), sy(p);
  for (std::vector<double>* field : {&p, &tx, &ty, &sx, &sy})
    for (double& value : *field) value = normal(random);
  std::vector<double> depth, x, y, shift_x, shift_y, other_x, other_y;
  const auto dot = [](const std::vector<double>& a, const std::vector<double>& b) {
    double sum = 0;
    for (size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
    return sum;
  };
  layer.depth_by_shear(tx, ty, depth);
  layer.shift_by_pressure(p, x, y);
  EXPECT_NEAR(dot(p, depth), dot(tx, x) + dot(ty, y), 1e-9);
  layer.shift_by_shear(tx, ty, shift_x, shift_y);
  layer.shift_by_shear(sx, sy, other_x, other_y);
  EXPECT_NEAR(dot(sx, shift_x) + dot(sy, shift_y), dot(tx, other_x) + dot(ty, other_y), 1e-9);
}

using Surface = PressedSurface;

TractionOptions exact() {
  TractionOptions options;
  options.slope_sd = 1e-4;
  options.tolerance = 1e-5;
  return options;
}

double peak_MPa(const Traction& traction) {
  return *std::max_element(traction.pressure_MPa.begin(), traction.pressure_MPa.end());
}

// From exact surfaces, which any constant may be added to: force within 1 %, peak 3 %, moments 2 % of force
// times radius; from incompressible to none, thick and thin.
TEST(TractionSolver, SphereAndFlatPunch) {
  std::printf("nu      H, mm  shape    force, N   peak (exact), kPa    iterations\n");
  for (const double poisson : {0.0, 0.3, 0.485, 0.4999, 0.5})
    for (const double thickness : {1.0, 5.5, 40.0})
      for (const bool flat : {false, true}) {
        const Layer layer({0.15, poisson}, thickness);
        const LayerContact press = flat ? layer.press_flat(1, 3) : layer.press_sphere(1, 8);
        // A flat punch ends at an edge, which cells blur.
        Surface surface({120, 100, flat ? 0.1 : 0.2});
        surface.add(press, 1.3, -0.7);
        for (float& depth : surface.depth) depth += 0.37f;
        TractionSolver solver({{0.15, poisson}, thickness}, surface.grid, exact());
        const Traction& found = solver.solve(surface.input());
        const Wrench& wrench = found.wrench;
        std::printf("%.4f %6.1f  %-6s %9.4f %9.2f (%.2f) %11u\n", poisson, thickness,
                    flat ? "flat" : "sphere", wrench.force_N[2], 1e3 * peak_MPa(found),
                    flat ? 0 : 1e3 * press.pressure_MPa(0), found.iterations);
        EXPECT_TRUE(found.converged);
        EXPECT_FALSE(found.at_border);
        EXPECT_NEAR(wrench.force_N[2], 1, 0.01);
        const double least = 0.02 * press.summary().radius_mm;
        EXPECT_NEAR(wrench.moment_Nmm[0], -0.7, least);
        EXPECT_NEAR(wrench.moment_Nmm[1], -1.3, least);
        if (!flat) {
          EXPECT_NEAR(peak_MPa(found), press.pressure_MPa(0), 0.03 * press.pressure_MPa(0));
        }
      }
}

TEST(TractionSolver, TwoSpheres) {
  const Layer layer(kGel, 5.5);
  const LayerContact large = layer.press_sphere(1.5, 8), small = layer.press_sphere(0.4, 4);
  Surface surface({120, 100, 0.2});
  surface.add(large, -5, 2);
  surface.add(small, 6, -3);
  TractionSolver solver({kGel, 5.5}, surface.grid, exact());
  const Wrench& wrench = solver.solve(surface.input()).wrench;
  EXPECT_NEAR(wrench.force_N[2], 1.9, 0.019);
  EXPECT_NEAR(wrench.moment_Nmm[0], 1.5 * 2 - 0.4 * 3, 0.05);
  EXPECT_NEAR(wrench.moment_Nmm[1], 1.5 * 5 - 0.4 * 6, 0.1);
}

/// A dragged and twisted sphere: pressure and shear of a given shape, and the surface that they make.
struct Drag {
  explicit Drag(const TractionGrid& on, double thickness_mm) : surface(on) {
    const size_t n = surface.depth.size();
    std::vector<double> p(n), tx(n), ty(n);
    for (size_t i = 0; i < n; ++i) {
      const double x = surface.x_of(i) - 1.1, y = surface.y_of(i) + 0.6, q = 1 - (x * x + y * y) / 9;
      if (q <= 0) continue;
      surface.contact[i] = 1;
      p[i] = 0.05 * std::sqrt(q);
      tx[i] = 0.4 * p[i] - 0.004 * y;
      ty[i] = -0.2 * p[i] + 0.004 * x;
      const double area = on.cell_mm * on.cell_mm;
      force = {force[0] + area * tx[i], force[1] + area * ty[i], force[2] + area * p[i]};
      turn += area * (surface.x_of(i) * ty[i] - surface.y_of(i) * tx[i]);
    }
    LayerConvolution layer(LayerKernel({kGel, thickness_mm}, on.cell_mm), on.width, on.height, true);
    surface.load(layer, p, tx, ty);
  }
  Surface surface;
  std::array<double, 3> force{};
  double turn = 0;
};

TEST(TractionSolver, SixComponents) {
  for (const double thickness : {1.5, 5.5}) {
    const Drag drag({64, 56, 0.25}, thickness);
    TractionOptions options = exact();
    options.shift_sd_mm = 1e-5;
    TractionSolver solver({kGel, thickness}, drag.surface.grid, options);
    const Traction& found = solver.solve(drag.surface.input());
    EXPECT_TRUE(found.converged);
    for (size_t axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(found.wrench.force_N[axis], drag.force[axis], 0.02 * std::abs(drag.force[axis])) << axis;
    EXPECT_NEAR(found.wrench.moment_Nmm[2], drag.turn, 0.02 * drag.force[2] * 3);
  }
}

// With errors of the slopes: the force's interval of 95 % holds, and noise alone is no force where nothing
// touches.
TEST(TractionSolver, IntervalsHoldUnderNoise) {
  const Layer layer(kGel, 5.5);
  std::mt19937 random(11);
  int held = 0, held_moment = 0;
  const int trials = 60;
  for (int trial = 0; trial < trials; ++trial) {
    Surface surface({60, 50, 0.4});
    const LayerContact press = layer.press_sphere(0.3 + 0.03 * trial, 6 + trial % 5);
    surface.add(press, 0, 0);
    TractionOptions options;
    options.slope_sd = 0.02;
    add_slope_noise(surface.depth, surface.grid, options.slope_sd, random);
    TractionSolver solver({kGel, 5.5}, surface.grid, options);
    const Traction& found = solver.solve(surface.input());
    const double force = press.summary().force_N;
    held += std::abs(found.wrench.force_N[2] - force) <= 1.96 * found.wrench.force_sd_N[2] ? 1 : 0;
    held_moment += std::abs(found.wrench.moment_Nmm[0]) <= 1.96 * found.wrench.moment_sd_Nmm[0] ? 1 : 0;
    if (trial % 12 == 0)
      std::printf("%.2f N: %.3f +- %.3f N, unexplained slopes %.4f (noise %.4f)\n", force,
                  found.wrench.force_N[2], found.wrench.force_sd_N[2], found.slope_rms, options.slope_sd);
    EXPECT_NEAR(found.wrench.force_N[2], force, 5 * found.wrench.force_sd_N[2]);
  }
  std::printf("intervals of 95 %% hold %d and %d of %d\n", held, held_moment, trials);
  EXPECT_GE(held, trials * 85 / 100);
  EXPECT_GE(held_moment, trials * 85 / 100);
}

TEST(TractionSolver, NothingFromNothing) {
  const TractionGrid grid{40, 30, 0.5};
  TractionSolver solver({kGel, 5.5}, grid, {});
  std::vector<float> depth(40 * 30, 2.5f);
  const Traction& flat = solver.solve({.depth_mm = depth});
  EXPECT_TRUE(flat.converged);
  EXPECT_EQ(flat.wrench.force_N[2], 0);
  std::mt19937 random(3);
  std::normal_distribution<float> normal;
  for (float& value : depth) value += 0.01f * normal(random);
  const std::vector<uint8_t> untouched(depth.size(), 0);
  EXPECT_EQ(solver.solve({.depth_mm = depth, .contact = untouched}).wrench.force_N[2], 0);
}

// A frame that follows begins where the last one ended, and comes to the same.
TEST(TractionSolver, FollowsFrames) {
  const Layer layer(kGel, 5.5);
  TractionSolver follows({kGel, 5.5}, {60, 50, 0.4}, {});
  uint32_t first = 0, later = 0;
  for (int frame = 0; frame < 6; ++frame) {
    Surface surface({60, 50, 0.4});
    surface.add(layer.press_sphere(1 + 0.1 * frame, 8), 0.05 * frame, 0);
    const Traction& found = follows.solve(surface.input());
    TractionSolver anew({kGel, 5.5}, surface.grid, {});
    EXPECT_NEAR(found.wrench.force_N[2], anew.solve(surface.input()).wrench.force_N[2], 3e-3);
    (frame == 0 ? first : later) += found.iterations;
  }
  EXPECT_LE(later, 5 * first);
}

TEST(TractionSolver, ContactAtTheBorderIsSaid) {
  const Layer layer(kGel, 5.5);
  Surface surface({60, 50, 0.4});
  surface.add(layer.press_sphere(2, 8), 11.5, 0);
  TractionSolver solver({kGel, 5.5}, surface.grid, exact());
  const Traction& found = solver.solve(surface.input());
  EXPECT_TRUE(found.at_border);
  EXPECT_LT(found.wrench.force_N[2], 2);
  EXPECT_GT(found.wrench.force_N[2], 0.8);
}

// Depth that is not known in part of the contact: the interval grows.
TEST(TractionSolver, UnknownCellsWidenTheInterval) {
  const Layer layer(kGel, 5.5);
  Surface surface({60, 50, 0.4});
  surface.add(layer.press_sphere(2, 8), 0, 0);
  TractionSolver solver({kGel, 5.5}, surface.grid, {});
  const double sd = solver.solve(surface.input()).wrench.force_sd_N[2];
  std::vector<uint8_t> known(surface.depth.size(), 1);
  for (size_t i = 0; i < known.size(); ++i)
    if (std::hypot(surface.x_of(i) - 0.5, surface.y_of(i)) < 2.2) known[i] = 0;
  for (size_t i = 0; i < known.size(); ++i)
    if (known[i] == 0) surface.depth[i] = std::numeric_limits<float>::quiet_NaN();
  TractionInput input = surface.input();
  input.known = known;
  TractionSolver partly({kGel, 5.5}, surface.grid, {});
  const Traction& found = partly.solve(input);
  std::printf("%.3f +- %.3f N with a hole, +- %.3f N without\n", found.wrench.force_N[2],
              found.wrench.force_sd_N[2], sd);
  EXPECT_GT(found.wrench.force_sd_N[2], 1.2 * sd);
  EXPECT_NEAR(found.wrench.force_N[2], 2, 3 * found.wrench.force_sd_N[2]);
  EXPECT_THROW(partly.solve(surface.input()), Error);
}

}  // namespace
}  // namespace palpate
