// The forward model against closed forms and against other programs' answers.
#include "engine/fem/solve.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>

#include "engine/elasticity/hertz.h"
#include "engine/elasticity/layer.h"
#include "engine/fem/linear/solver.h"
#include "palpate/error.h"
#include "tests/fem/cube_grid.h"

namespace palpate {
namespace {

double sum_of(const PressureMap& map) {
  double sum = 0;
  for (uint32_t y = 0; y < map.height; ++y)
    for (uint32_t x = 0; x < map.width; ++x)
      sum += double{map.at(x, y)} * (x == 0 || x + 1 == map.width ? 0.5 : 1) *
             (y == 0 || y + 1 == map.height ? 0.5 : 1) * map.pitch_mm[0] * map.pitch_mm[1] * 1e-6;
  return sum;
}

/// A homogeneous block, coarse enough to be quick.
fem::Scene plain_block() {
  fem::Scene scene;
  scene.inclusion.reset();
  scene.cells = {16, 16, 8};
  return scene;
}

// Any field of constant strain is kept exactly, whatever the cells' shape, with the load free inside.
TEST(ForwardPatch, ConstantStrainIsExact) {
  for (const double poisson : {0.0, 0.3, 0.495, 0.4999}) {
    fem::CellGrid grid = cube(8, 1);
    grid.size_x_mm = 0.7;
    grid.size_z_mm = {1.3, 0.4, 1, 1, 0.6, 2, 1, 1};
    const size_t nodes = grid.nodes();
    const double g[3][3] = {{0.01, -0.02, 0.005}, {0.03, -0.004, 0.01}, {0.002, 0.015, -0.01}};
    fem::FixedNodes fixed(nodes);
    std::vector<double> wanted(3 * nodes), u(3 * nodes);
    double z = 0;
    for (uint32_t k = 0; k <= 8; ++k) {
      for (uint32_t j = 0; j <= 8; ++j)
        for (uint32_t i = 0; i <= 8; ++i) {
          const size_t n = grid.node(i, j, k);
          const bool rim = i % 8 == 0 || j % 8 == 0 || k % 8 == 0;
          fixed[n] = rim ? fem::kFixedAll : 0;
          for (size_t c = 0; c < 3; ++c) {
            wanted[c * nodes + n] = g[c][0] * 0.7 * i + g[c][1] * j + g[c][2] * z;
            if (rim) u[c * nodes + n] = wanted[c * nodes + n];
          }
        }
      if (k < 8) z += grid.size_z_mm[k];
    }
    WorkTeam team(1);
    fem::Solver solver(grid, poisson, fixed, team);
    const fem::SolveStatistics statistics = solver.solve(std::vector<double>(3 * nodes), u, 1e-12, 3000);
    EXPECT_TRUE(statistics.converged) << poisson << " " << statistics.residual;
    for (size_t n = 0; n < u.size(); ++n) ASSERT_NEAR(u[n], wanted[n], 1e-9) << poisson << " " << n;
  }
}

// Between frictionless plates a block is in uniaxial stress.
TEST(Forward, UniaxialBlockIsExact) {
  for (const double poisson : {0.0, 0.3, 0.495, 0.4999})
    for (const bool quarter : {true, false}) {
      fem::Scene scene = plain_block();
      scene.bottom_slides = true;
      scene.poisson = poisson;
      fem::Options options;
      options.quarter = quarter;
      const fem::Result result = fem::solve(scene, options);
      ASSERT_TRUE(result.converged);
      EXPECT_NEAR(result.force_N, 4000 * 0.05 * 1600e-6, 1e-6);
      EXPECT_NEAR(result.core_strain, -0.05, 1e-6);
      for (const float stress : result.stress_Pa.values) ASSERT_NEAR(stress, 200, 0.01);
    }
}

// A wide thin bonded block under a sticking plate: in its middle nothing can go sideways, so the stress is
// that of confined compression, E (1 - nu) / ((1 + nu)(1 - 2 nu)).
TEST(Forward, ConfinedMiddleOfABondedSheet) {
  fem::Scene scene = plain_block();
  scene.poisson = 0.45;
  scene.block_mm = {64, 64, 2};
  scene.cells = {64, 64, 8};
  scene.pad = {{2, 4000}};  // of the same stuff, bonded to the plate
  scene.press_mm = 0.1;
  const fem::Result result = fem::solve(scene);
  ASSERT_TRUE(result.converged);
  const double confined = 4000 * 0.55 / (1.45 * 0.1) * 0.1 / 4;
  EXPECT_NEAR(result.center_stress_Pa, confined, 0.002 * confined);
  EXPECT_NEAR(result.deflection_mm.at(32, 32), 0.05, 0.0002);
}

// The pad problem, whose force and centre pressure other programs' fine grids gave.
TEST(Forward, PadProblem) {
  const fem::Result result = fem::solve(fem::Scene{});
  ASSERT_TRUE(result.converged);
  EXPECT_NEAR(result.force_N, 0.40105, 0.01 * 0.40105);
  EXPECT_NEAR(result.center_stress_Pa, 473.5, 0.01 * 473.5);
  EXPECT_NEAR(sum_of(result.stress_Pa), result.force_N, 1e-6);
  EXPECT_EQ(result.tension_fraction, 0);
  EXPECT_LE(result.residual, 1e-6);
  EXPECT_TRUE(result.warnings.empty()) << result.warnings.front();
}

// A quarter, a whole, and one thread or more are the same scene.
// A hard pad that slides is a rigid plate without friction, one that is bonded holds the surface; without
// Poisson's ratio there is nothing to hold, and layers are springs in series.
TEST(Forward, PadSlidesOrIsBonded) {
  fem::Scene scene;
  scene.cells = {32, 32, 16};
  const fem::Result plate = fem::solve(scene);
  scene.pad = {{2.5, 4e8}};
  const fem::Result bonded = fem::solve(scene);
  scene.pad_slides = true;
  const fem::Result sliding = fem::solve(scene);
  ASSERT_TRUE(plate.converged && bonded.converged && sliding.converged);
  EXPECT_NEAR(sliding.force_N, plate.force_N, 1e-3 * plate.force_N);
  EXPECT_NEAR(sliding.center_stress_Pa, plate.center_stress_Pa, 1e-3 * plate.center_stress_Pa);
  EXPECT_GT(bonded.force_N, 1.1 * plate.force_N);

  // Soft sheets, and the quarter is the whole.
  scene.pad = {{2, 3e4}, {1, 1e4}};
  const fem::Result quarter = fem::solve(scene);
  fem::Options whole;
  whole.quarter = false;
  EXPECT_NEAR(fem::solve(scene, whole).force_N, quarter.force_N, 1e-5 * quarter.force_N);
  EXPECT_LT(quarter.iterations, 100u);

  scene.inclusion.reset();
  scene.poisson = 0;
  const double compliance = 20 / 4e3 + 2 / 3e4 + 1 / 1e4;  // mm / Pa
  const fem::Result springs = fem::solve(scene);
  EXPECT_NEAR(springs.force_N, 40 * 40 * 1e-6 / compliance, 1e-5);

  scene.presser = fem::Presser::Pressure;
  EXPECT_THROW(fem::solve(scene), Error);
  scene.presser = fem::Presser::Flat;
  scene.pad.clear();
  EXPECT_THROW(fem::solve(scene), Error);
}

TEST(Forward, QuarterIsTheWhole) {
  fem::Scene scene;
  scene.cells = {32, 32, 16};
  fem::Options whole;
  whole.quarter = false;
  whole.residual = 1e-9;
  whole.threads = 3;
  fem::Options quarter = whole;
  quarter.quarter = true;
  quarter.threads = 1;
  const fem::Result a = fem::solve(scene, whole), b = fem::solve(scene, quarter);
  ASSERT_TRUE(a.converged && b.converged);
  EXPECT_NEAR(a.force_N, b.force_N, 1e-7 * a.force_N);
  ASSERT_EQ(a.stress_Pa.values.size(), 33u * 33u);
  for (size_t i = 0; i < a.stress_Pa.values.size(); ++i)
    ASSERT_NEAR(a.stress_Pa.values[i], b.stress_Pa.values[i], 1e-3) << i;
}

// All is proportional to the load but under a ball.
TEST(Forward, ForceAndWayAreTheSameQuestion) {
  for (const fem::Presser presser : {fem::Presser::Flat, fem::Presser::Pressure, fem::Presser::Sphere}) {
    fem::Scene scene;
    scene.cells = {32, 32, 16};
    scene.presser = presser;
    scene.ball_radius_mm = 10;
    const fem::Result way = fem::solve(scene);
    ASSERT_TRUE(way.converged);
    EXPECT_NEAR(way.press_mm, 1, 1e-9);
    scene.force_N = way.force_N;
    scene.press_mm.reset();
    const fem::Result force = fem::solve(scene);
    ASSERT_TRUE(force.converged);
    EXPECT_NEAR(force.force_N, way.force_N, 2e-5 * way.force_N);
    EXPECT_NEAR(force.press_mm, 1, 1e-3) << static_cast<int>(presser);
    EXPECT_NEAR(force.center_stress_Pa, way.center_stress_Pa, 2e-3 * way.center_stress_Pa);
    EXPECT_NEAR(sum_of(force.stress_Pa), force.force_N, 1e-4 * force.force_N);
  }
}

// Boussinesq: even pressure on a square of a half space, a quarter of it with the exact displacement on the
// outer faces. The square is eight cells wide: what a single node would carry the cells cannot follow.
TEST(Forward, PressedSquareIsBoussinesq) {
  constexpr uint32_t n = 32;
  constexpr double half = 4;
  for (const double nu : {0.3, 0.495}) {
    const fem::CellGrid grid = cube(n, 1);
    const size_t nodes = grid.nodes();
    fem::FixedNodes fixed(nodes);
    std::vector<double> load(3 * nodes), u(3 * nodes);
    const auto point = [&](double x, double y, double z) {
      const double r2 = x * x + y * y + z * z, r = std::sqrt(r2), c = (1 + nu) / (2 * std::numbers::pi);
      const double side = z / (r2 * r) - (1 - 2 * nu) / (r * (r + z));
      return std::array<double, 3>{c * x * side, c * y * side, c * (z * z / (r2 * r) + 2 * (1 - nu) / r)};
    };
    const auto exact = [&](double x, double y, double z) {
      std::array<double, 3> sum{};
      for (double v = -half + 0.25; v < half; v += 0.5)
        for (double w = -half + 0.25; w < half; w += 0.5) {
          const auto part = point(x - v, y - w, z);
          for (size_t c = 0; c < 3; ++c) sum[c] += 0.25 * part[c];
        }
      return sum;
    };
    for (uint32_t k = 0; k <= n; ++k)
      for (uint32_t j = 0; j <= n; ++j)
        for (uint32_t i = 0; i <= n; ++i) {
          const size_t at = grid.node(i, j, k);
          fixed[at] = static_cast<uint8_t>((i == 0 ? fem::kFixedX : 0) | (j == 0 ? fem::kFixedY : 0));
          if (k == 0 && i <= half && j <= half)
            load[2 * nodes + at] = (i == 0 || i == half ? 0.5 : 1) * (j == 0 || j == half ? 0.5 : 1);
          if (i != n && j != n && k != n) continue;
          fixed[at] = fem::kFixedAll;
          const auto there = exact(i, j, k);
          for (size_t c = 0; c < 3; ++c) u[c * nodes + at] = there[c];
        }
    WorkTeam team(0);
    fem::Solver solver(grid, nu, fixed, team);
    ASSERT_TRUE(solver.solve(load, u, 1e-7, 2000).converged);
    for (const uint32_t r : {6u, 8u, 12u, 16u, 24u}) {
      const double down = exact(r, 0, 0)[2], deep = exact(0, 0, r)[2], across = exact(r, 0, r)[0];
      EXPECT_NEAR(u[2 * nodes + grid.node(r, 0, 0)], down, 0.02 * down) << nu << " " << r;
      EXPECT_NEAR(u[2 * nodes + grid.node(0, 0, r)], deep, 0.02 * deep) << nu << " " << r;
      EXPECT_NEAR(u[grid.node(r, 0, r)], across, 0.02 * across) << nu << " " << r;
    }
  }
}

// A ball on a thin bonded layer, where Hertz is far off, against the exact layer.
TEST(Forward, BallOnAThinLayer) {
  fem::Scene scene = plain_block();
  scene.block_mm = {20, 20, 5};
  scene.cells = {64, 64, 16};
  scene.presser = fem::Presser::Sphere;
  scene.ball_radius_mm = 5;
  scene.press_mm.reset();
  scene.force_N = 0.01;
  const fem::Result result = fem::solve(scene);
  ASSERT_TRUE(result.converged);
  const LayerContact exact = Layer({4000e-6, 0.495}, 5).press_sphere(0.01, 5);
  const double hertz = hertz_contact(0.01, effective_modulus_MPa({4000e-6, 0.495}), 5).indentation_mm;
  EXPECT_NEAR(result.press_mm, exact.summary().indentation_mm, 0.03 * exact.summary().indentation_mm);
  EXPECT_LT(result.press_mm, 0.8 * hertz);
  EXPECT_NEAR(result.center_stress_Pa, 1e6 * exact.summary().pressure_max_MPa,
              0.03e6 * exact.summary().pressure_max_MPa);
}

// Hertz: a rigid ball on a deep block; and the exact bonded layer, which the block truly is.
TEST(Forward, BallIsHertz) {
  fem::Scene scene = plain_block();
  scene.poisson = 0.3;
  scene.block_mm = {24, 24, 24};
  scene.cells = {96, 96, 96};
  scene.presser = fem::Presser::Sphere;
  scene.ball_radius_mm = 5;
  scene.press_mm = 0.4;
  const fem::Result result = fem::solve(scene);
  ASSERT_TRUE(result.converged);
  const double modulus = 4000e-6 / (1 - 0.09), radius = std::sqrt(5 * 0.4);
  const double force = 4.0 / 3 * modulus * std::sqrt(5) * std::pow(0.4, 1.5);
  EXPECT_NEAR(result.force_N, force, 0.03 * force);
  EXPECT_NEAR(result.center_stress_Pa, 1.5 * force / (std::numbers::pi * radius * radius) * 1e6, 0.03 * 790);
  EXPECT_NEAR(result.contact_radius_mm, radius, 0.25);  // whole cells count
  EXPECT_EQ(result.tension_fraction, 0);
  // Outside the contact the surface carries nothing.
  EXPECT_NEAR(result.stress_Pa.at(10, 48), 0, 0.5);
}

// To a residual of 1e-8 on 32 x 32 x 16 cells: how well the cycle knows the matrix.
TEST(Forward, FewIterationsEvenWhereTissueIsNearlyIncompressible) {
  struct Case {
    double poisson;
    uint32_t most_at_10, most_at_1e4;
  };
  for (const Case& c : {Case{0.45, 14, 17}, Case{0.495, 39, 47}, Case{0.499, 78, 93}, Case{0.4999, 198, 243}})
    for (const bool stiff : {false, true}) {
      fem::Scene scene;
      scene.poisson = c.poisson;
      scene.cells = {32, 32, 16};
      scene.inclusion->stiffness_ratio = stiff ? 1e4 : 10;
      fem::Options options;
      options.residual = 1e-8;
      const fem::Result result = fem::solve(scene, options);
      EXPECT_TRUE(result.converged);
      EXPECT_LE(result.iterations, stiff ? c.most_at_1e4 : c.most_at_10) << c.poisson;
    }
}

TEST(Forward, StableToTheEdgesOfItsRange) {
  for (const double poisson : {0.0, 0.495, 0.4999})
    for (const double ratio : {0.1, 1.0, 100.0, 1e4})
      for (const double depth : {0.0, 5.0}) {
        SCOPED_TRACE(testing::Message() << "nu " << poisson << " ratio " << ratio << " depth " << depth);
        fem::Scene scene;
        scene.cells = {16, 16, 8};
        scene.poisson = poisson;
        scene.inclusion->stiffness_ratio = ratio;
        scene.inclusion->depth_mm = depth;
        const fem::Result result = fem::solve(scene);
        ASSERT_TRUE(result.converged) << result.residual << " after " << result.iterations;
        EXPECT_GT(result.force_N, 0.3);
        EXPECT_LT(result.force_N, 0.5);
      }
}

// Effect of an inclusion: stiffer, larger and shallower show more, softer shows less than nothing.
TEST(Forward, OrderingsOfTheLump) {
  const auto centre = [](double diameter, double depth, double ratio) {
    fem::Scene scene;
    scene.cells = {32, 32, 16};
    scene.inclusion->size_mm = {diameter, diameter, diameter};
    scene.inclusion->depth_mm = depth;
    scene.inclusion->stiffness_ratio = ratio;
    return fem::solve(scene).center_stress_Pa;
  };
  const double none = centre(8, 5, 1), middle = centre(8, 5, 10);
  EXPECT_GT(middle, 1.1 * none);
  EXPECT_GT(centre(12, 5, 10), 1.05 * middle);
  EXPECT_GT(centre(8, 3, 10), 1.05 * middle);
  EXPECT_GT(centre(8, 5, 100), 1.02 * middle);
  EXPECT_LT(centre(8, 5, 0.1), 0.9 * none);
}

TEST(Forward, ShapesHaveTheirVolume) {
  for (const InclusionShape shape : {InclusionShape::Sphere, InclusionShape::Ellipsoid,
                                     InclusionShape::Cylinder, InclusionShape::LyingCylinder}) {
    fem::Inclusion lump;
    lump.shape = shape;
    lump.size_mm = {8, 6, 5};
    const std::array<double, 3> size = lump.size();
    double sum = 0;
    for (int k = -6; k < 6; ++k)
      for (int j = -6; j < 6; ++j)
        for (int i = -6; i < 6; ++i)
          sum +=
              fem::share_inside(shape, size, {double(i), double(j), double(k)}, {i + 1.0, j + 1.0, k + 1.0});
    const bool round = shape == InclusionShape::Sphere || shape == InclusionShape::Ellipsoid;
    const double volume = size[0] * size[1] * size[2] * std::numbers::pi / (round ? 6 : 4);
    EXPECT_NEAR(sum, volume, 0.002 * volume) << static_cast<int>(shape);
  }
}

TEST(Forward, ManyScenesAreTheScenesOneByOne) {
  std::vector<fem::Scene> scenes(5);
  for (size_t i = 0; i < scenes.size(); ++i) {
    scenes[i].cells = {16, 16, 8};
    scenes[i].inclusion->depth_mm = 2.0 + static_cast<double>(i);
  }
  fem::Options options;
  options.threads = 3;
  std::atomic<size_t> heard = 0;
  const std::vector<fem::Result> together = fem::solve(scenes, options, [&](size_t) { ++heard; });
  ASSERT_EQ(together.size(), scenes.size());
  EXPECT_EQ(heard, scenes.size());
  for (size_t i = 0; i < scenes.size(); ++i)
    EXPECT_EQ(together[i].stress_Pa.values, fem::solve(scenes[i], {.threads = 1}).stress_Pa.values);
}

TEST(Forward, RefusesWhatMakesNoSense) {
  const auto refused = [](auto change, const char* word) {
    fem::Scene scene;
    scene.cells = {16, 16, 8};
    change(scene);
    try {
      fem::solve(scene);
      ADD_FAILURE() << "taken: " << word;
    } catch (const Error& error) {
      EXPECT_EQ(error.failure(), Failure::Usage);
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
  };
  refused([](fem::Scene& s) { s.poisson = 0.5; }, "Poisson");
  refused([](fem::Scene& s) { s.poisson = NAN; }, "Poisson");
  refused([](fem::Scene& s) { s.block_mm[2] = 0; }, "thickness");
  refused([](fem::Scene& s) { s.young_Pa = -1; }, "modulus");
  refused([](fem::Scene& s) { s.inclusion->depth_mm = 15; }, "base");
  refused([](fem::Scene& s) { s.inclusion->offset_mm = {18, 0}; }, "sides");
  refused([](fem::Scene& s) { s.inclusion->stiffness_ratio = 0; }, "ratio");
  refused([](fem::Scene& s) { s.inclusion->size_mm = {0, 0, 0}; }, "size");
  refused([](fem::Scene& s) { s.force_N = 1; }, "both");
  refused([](fem::Scene& s) { s.press_mm.reset(); }, "neither");
  refused([](fem::Scene& s) { s.press_mm = -1; }, "way");
  refused([](fem::Scene& s) { s.presser = fem::Presser::Sphere; }, "radius");
  refused([](fem::Scene& s) { s.cells = {62, 62, 31}; }, "halved");
  refused([](fem::Scene& s) { s.pad = {{-1, 1000}}; }, "pad sheet");
}

}  // namespace
}  // namespace palpate
