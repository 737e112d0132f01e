// Plates that are smaller than the block, that rub and that hold the tissue: against the whole plate, each
// other and a stiffness from the literature.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/fem/large_strain/large_strain.h"
#include "engine/fem/large_strain/model.h"
#include "engine/fem/solve.h"
#include "palpate/error.h"

namespace palpate {
namespace {

fem::Scene plain_block(uint32_t cells = 16) {
  fem::Scene scene;
  scene.cells = {cells, cells, cells / 2};
  scene.inclusion.reset();
  return scene;
}

double force_N(const fem::Scene& scene, double press_mm) {
  const fem::LargeStrainResult result = solve_large_strain(scene, {{press_mm, std::nullopt}});
  EXPECT_TRUE(result.converged);
  return result.loads.empty() ? 0 : result.loads[0].force_N;
}

TEST(Plate, AsWideAsTheBlockIsTheWholeSurface) {
  fem::Scene scene = plain_block();
  const double whole = force_N(scene, 2);
  scene.plate_half_mm = {20, 20};
  EXPECT_NEAR(force_N(scene, 2), whole, 1e-9 * whole);
}

// A square of half width B on a half space: 4.54 G B / (1 - nu) (Gazetas 1991), raised by 1 + 1.3 R / H on a
// layer of height H over rock, R that of a circle of the same area (Kausel 1974).
TEST(Plate, SmallOneOnADeepBlockHasTheStiffnessOfTheLiterature) {
  fem::Scene scene = plain_block();
  scene.block_mm = {48, 48, 48};
  scene.cells = {48, 48, 48};
  scene.poisson = 0.33;
  scene.plate_half_mm = {4, 4};
  scene.press_mm = 0.01;
  const fem::Result result = fem::solve(scene);
  ASSERT_TRUE(result.converged);
  const double shear = 4000e-6 / (2 * 1.33), radius = 8 / std::sqrt(M_PI);
  const double wanted_N = 0.01 * 4.54 * shear * 4 / (1 - 0.33) * (1 + 1.3 * radius / 48);
  EXPECT_NEAR(result.force_N, wanted_N, 0.1 * wanted_N);
  EXPECT_EQ(result.tension_fraction, 0);
}

// The free surface beside the plate carries nothing and gives way less than the plate.
TEST(Plate, SurfaceBesideItIsFree) {
  fem::Scene scene = plain_block();
  scene.plate_half_mm = {10, 10};
  const fem::LargeStrainResult result = solve_large_strain(scene, {{2, std::nullopt}});
  ASSERT_TRUE(result.converged);
  const fem::PressedBlock& block = result.loads[0];
  EXPECT_NEAR(block.deflection_mm.at(8, 8), 2, 1e-6);
  EXPECT_NEAR(block.deflection_mm.at(12, 8), 2, 1e-6) << "its edge";
  EXPECT_LT(block.deflection_mm.at(13, 8), 1.5);
  const float peak = block.pressure_Pa.at(8, 8);
  EXPECT_GT(peak, 0);
  EXPECT_LT(std::abs(block.pressure_Pa.at(15, 8)), 0.01f * peak);
}

TEST(Plate, FrictionLiesBetweenSlidingAndSticking) {
  fem::Scene scene = plain_block();
  double last = force_N(scene, 1);
  const double slides = last;
  for (const double friction : {0.03, 0.1}) {
    scene.plate_friction = friction;
    const double force = force_N(scene, 1);
    EXPECT_GT(force, 1.005 * last) << friction;
    last = force;
  }
  scene.plate_friction = 0;
  scene.plate_sticks = true;
  const double sticks = force_N(scene, 1);
  EXPECT_GT(sticks, 1.1 * last);
  EXPECT_LT(sticks, 2 * slides);
}

TEST(Plate, MuchFrictionReachesDeepPressesAlikeInAnySteps) {
  fem::Scene scene = plain_block();
  const double way_mm = 0.2 * scene.block_mm[2];
  const auto pressed = [&](double step_mm) {
    fem::LargeStrainOptions options;
    options.residual = 1e-5;
    options.step_mm = step_mm;
    const fem::LargeStrainResult result = solve_large_strain(scene, {{way_mm, std::nullopt}}, options);
    EXPECT_TRUE(result.converged) << scene.plate_friction;
    return result.converged ? result.loads[0].force_N : 0;
  };
  scene.plate_sticks = true;
  const double sticks = pressed(2);
  scene.plate_sticks = false;
  double last = pressed(2);
  for (const double friction : {0.3, 1.0}) {
    scene.plate_friction = friction;
    const double force = pressed(2);
    EXPECT_GT(force, 1.01 * last) << friction;
    EXPECT_LT(force, sticks) << friction;
    EXPECT_NEAR(pressed(0.7), force, 1e-4 * force) << "the whole slide counts, not its steps";
    last = force;
  }
}

TEST(Plate, StickingOneHoldsTheTissueAndRubbingOneSlowsIt) {
  const auto spread_mm = [](const fem::Scene& scene) {
    WorkTeam team(1);
    fem::LargeStrainModel model(scene, {}, team);
    fem::LargeStrainResult result;
    EXPECT_TRUE(model.move_to(0.5, result));
    return model.surface().x_mm.back();  // the corner's
  };
  fem::Scene scene = plain_block();
  const double slides = spread_mm(scene);
  scene.plate_friction = 0.1;
  const double rubs = spread_mm(scene);
  scene.plate_friction = 0;
  scene.plate_sticks = true;
  EXPECT_GT(slides, 0.05);
  EXPECT_LT(rubs, slides);
  EXPECT_GT(rubs, 0);
  EXPECT_EQ(spread_mm(scene), 0);
}

TEST(Plate, WhatNoModelHasIsRefused) {
  fem::Scene scene = plain_block();
  scene.plate_half_mm = {9, 10};
  EXPECT_THROW(check(scene), Error) << "no plane of nodes at 9 mm";
  scene.plate_half_mm = {10, 10};
  EXPECT_NO_THROW(check(scene));
  scene.pad = {{2, 30000}};
  EXPECT_THROW(check(scene), Error) << "a pad";
  scene = plain_block();
  scene.plate_friction = 0.1;
  EXPECT_NO_THROW(check(scene));
  EXPECT_THROW(fem::solve(scene), Error) << "small strain";
  scene.plate_sticks = true;
  EXPECT_THROW(check(scene), Error) << "both";
}

}  // namespace
}  // namespace palpate
