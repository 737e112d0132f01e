// Tissue at large strain: bricks against their energy, blocks against closed forms and other programs.
#include "engine/fem/large_strain/large_strain.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "engine/fem/large_strain/extrapolation.h"
#include "engine/fem/large_strain/model.h"
#include "engine/fem/large_strain/pressed_surface.h"
#include "engine/fem/large_strain/rim_error.h"
#include "engine/fem/linear/stiffness.h"
#include "palpate/error.h"
#include "tests/reference/neo_hookean.h"

namespace palpate {
namespace {

fem::CellGrid uneven_grid() {
  fem::CellGrid grid;
  grid.cells = {5, 3, 4};
  grid.size_x_mm = 1.1;
  grid.size_y_mm = 0.8;
  grid.size_z_mm = {0.5, 1, 1.2, 0.7};
  std::mt19937 random(7);
  std::uniform_real_distribution<float> modulus(0.5f, 20.0f);
  for (size_t c = 0; c < grid.cell_count(); ++c) grid.young.push_back(modulus(random));
  return grid;
}

std::vector<double> random_field(size_t count, double size, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> value(-size, size);
  std::vector<double> field(count);
  for (double& x : field) x = value(random);
  return field;
}

/// The same cells with each corner somewhere else.
fem::CellGrid bent_grid() {
  fem::CellGrid grid = uneven_grid();
  const std::vector<double> shift = random_field(3 * grid.nodes(), 0.1, 5);
  grid.place_mm.resize(shift.size());
  for (uint32_t k = 0; k <= grid.cells[2]; ++k)
    for (uint32_t j = 0; j <= grid.cells[1]; ++j)
      for (uint32_t i = 0; i <= grid.cells[0]; ++i) {
        const Eigen::Vector3d at = reference::corner_place(uneven_grid(), i, j, k);
        for (size_t c = 0; c < 3; ++c) {
          const size_t n = c * grid.nodes() + grid.node(i, j, k);
          grid.place_mm[n] = at(static_cast<Eigen::Index>(c)) + shift[n];
        }
      }
  return grid;
}

fem::Scene block(uint32_t cells) {
  fem::Scene scene;
  scene.cells = {cells, cells, cells / 2};
  return scene;
}

std::vector<fem::PressLoad> plate_depths(std::initializer_list<double> mm) {
  std::vector<fem::PressLoad> loads;
  for (const double way : mm) loads.push_back({way, std::nullopt});
  return loads;
}

class NeoHookeanOn : public testing::TestWithParam<bool> {
 protected:
  const fem::CellGrid grid = GetParam() ? bent_grid() : uneven_grid();
};

TEST_P(NeoHookeanOn, ForcesAreTheEnergysSlope) {
  std::vector<double> u = random_field(3 * grid.nodes(), 0.08, 1), force(u.size());
  WorkTeam team(2);
  for (const double poisson : {0.0, 0.3, 0.495}) {
    const fem::NeoHookeanCells cells(grid, poisson);
    cells.forces(u.data(), force.data(), grid.young, team);
    for (size_t n = 0; n < u.size(); n += 17) {
      const double step = 1e-5, at = u[n];
      u[n] = at + step;
      const double above = reference::neo_hookean_energy(grid, poisson, u);
      u[n] = at - step;
      const double below = reference::neo_hookean_energy(grid, poisson, u);
      u[n] = at;
      EXPECT_NEAR(force[n], (above - below) / (2 * step), 1e-6 * (1 + std::abs(force[n]))) << poisson;
    }
  }
}

TEST_P(NeoHookeanOn, TangentIsTheForcesSlope) {
  const std::vector<double> u = random_field(3 * grid.nodes(), 0.08, 2);
  const std::vector<double> way = random_field(u.size(), 1, 3);
  WorkTeam team(2);
  fem::NeoHookeanCells cells(grid, 0.48);
  std::vector<double> pressure, product(u.size()), above(u.size()), below(u.size()), moved(u), none(u.size());
  cells.pressures(u.data(), none.data(), pressure, team);
  cells.form_tangent(u.data(), pressure, team);
  cells.apply(way.data(), product.data(), nullptr, team);
  const double step = 1e-5;
  for (size_t n = 0; n < u.size(); ++n) moved[n] = u[n] + step * way[n];
  cells.forces(moved.data(), above.data(), grid.young, team);
  for (size_t n = 0; n < u.size(); ++n) moved[n] = u[n] - step * way[n];
  cells.forces(moved.data(), below.data(), grid.young, team);
  double largest = 0;
  for (const double p : product) largest = std::max(largest, std::abs(p));
  for (size_t n = 0; n < u.size(); ++n)
    EXPECT_NEAR(product[n], (above[n] - below[n]) / (2 * step), 2e-6 * largest);
}

INSTANTIATE_TEST_SUITE_P(Cells, NeoHookeanOn, testing::Bool(),
                         [](const auto& shape) { return shape.param ? "Bent" : "Bricks"; });

TEST(NeoHookean, SmallDisplacementsAnswerAsTheLinearModel) {
  const fem::CellGrid grid = uneven_grid();
  std::vector<double> u = random_field(3 * grid.nodes(), 1e-7, 4), linear(u.size()), force(u.size());
  WorkTeam team(1);
  fem::Stiffness(grid, 0.495).apply(u.data(), linear.data(), nullptr, team);
  fem::NeoHookeanCells(grid, 0.495).forces(u.data(), force.data(), grid.young, team);
  double largest = 0;
  for (const double f : linear) largest = std::max(largest, std::abs(f));
  for (size_t n = 0; n < u.size(); ++n) EXPECT_NEAR(force[n], linear[n], 1e-5 * largest);
}

// A block that nothing holds sideways is compressed evenly: its side stretch makes the side stress zero.
TEST(LargeStrain, FreeBlockIsTheClosedForm) {
  for (const double poisson : {0.3, 0.495, 0.4999}) {
    fem::Scene scene = block(8);
    scene.inclusion.reset();
    scene.bottom_slides = true;
    scene.poisson = poisson;
    fem::LargeStrainOptions options;
    options.residual = 1e-8;
    const fem::LargeStrainResult result = solve_large_strain(scene, plate_depths({2, 6}), options);
    ASSERT_TRUE(result.converged);
    const double mu = scene.young_Pa / 2 / (1 + poisson), kappa = scene.young_Pa / 3 / (1 - 2 * poisson);
    for (const fem::PressedBlock& state : result.loads) {
      const double z = 1 - state.press_mm / scene.block_mm[2];
      double low = 0.5, high = 2;  // side stretch
      const auto side_stress = [&](double x) {
        const double j = x * x * z;
        return mu * std::pow(j, -5.0 / 3) * (x * x - z * z) / 3 + kappa * (j - 1);
      };
      for (int round = 0; round < 100; ++round)
        (side_stress((low + high) / 2) > 0 ? high : low) = (low + high) / 2;
      const double x = (low + high) / 2, j = x * x * z;
      const double stress = 2 * mu * std::pow(j, -5.0 / 3) * (z * z - x * x) / 3 + kappa * (j - 1);
      EXPECT_NEAR(state.force_N, -stress * x * x * 1600e-6, 1e-6 * state.force_N) << poisson;
      // The pressure is the true one, of the block that has grown wider.
      EXPECT_NEAR(state.pressure_Pa.at(4, 4), -stress, 1e-5 * -stress);
    }
  }
}

// Forces of another program on the same grid.
TEST(LargeStrain, LumpInTissueHasTheForcesItHasElsewhere) {
  const fem::LargeStrainResult result = solve_large_strain(block(32), plate_depths({1, 2, 3, 4}));
  ASSERT_TRUE(result.converged);
  const double wanted[] = {0.424, 0.897, 1.425, 2.014};
  for (size_t l = 0; l < 4; ++l) {
    EXPECT_NEAR(result.loads[l].force_N, wanted[l], 0.0015 * wanted[l]);
    EXPECT_LE(result.loads[l].residual, 1e-6);
  }
  EXPECT_EQ(result.cuts, 0u);
}

TEST(LargeStrain, StiffSoftAndIncompressibleBlocksAreSolved) {
  for (const double poisson : {0.45, 0.495, 0.4999})
    for (const double ratio : {0.1, 1.0, 100.0, 1e4}) {
      fem::Scene scene = block(16);
      scene.poisson = poisson;
      scene.inclusion->stiffness_ratio = ratio;
      const fem::LargeStrainResult result = solve_large_strain(scene, plate_depths({2, 4}));
      EXPECT_TRUE(result.converged) << poisson << ' ' << ratio;
      EXPECT_GT(result.loads.back().force_N, result.loads.front().force_N);
    }
}

TEST(LargeStrain, QuarterIsTheWholeAndForcesFindTheirWays) {
  fem::LargeStrainOptions options;
  const fem::LargeStrainResult quarter = solve_large_strain(block(16), plate_depths({1, 3}), options);
  options.quarter = false;
  std::vector<fem::PressLoad> forces;
  for (const fem::PressedBlock& state : quarter.loads) forces.push_back({std::nullopt, state.force_N});
  const fem::LargeStrainResult whole = solve_large_strain(block(16), forces, options);
  ASSERT_TRUE(quarter.converged && whole.converged);
  for (size_t l = 0; l < 2; ++l) {
    EXPECT_NEAR(whole.loads[l].press_mm, quarter.loads[l].press_mm, 1e-4);
    double sum = 0;
    for (size_t n = 0; n < whole.loads[l].pressure_Pa.values.size(); ++n) {
      const auto peak = double{quarter.loads[l].pressure_Pa.at(8, 8)};
      EXPECT_NEAR(whole.loads[l].pressure_Pa.values[n], quarter.loads[l].pressure_Pa.values[n], 1e-4 * peak);
      sum += double{whole.loads[l].pressure_Pa.values[n]};
    }
    EXPECT_GT(sum, 0);
  }
}

// A lump off the middle: the same whichever way the block is looked at.
TEST(LargeStrain, MirroredLumpHasTheMirroredMap) {
  fem::Scene scene = block(16);
  scene.inclusion->offset_mm = {4, -2};
  const fem::LargeStrainResult one = solve_large_strain(scene, plate_depths({3}));
  scene.inclusion->offset_mm = {-4, -2};
  const fem::LargeStrainResult other = solve_large_strain(scene, plate_depths({3}));
  ASSERT_TRUE(one.converged && other.converged);
  for (uint32_t y = 0; y <= 16; ++y)
    for (uint32_t x = 0; x <= 16; ++x)
      EXPECT_NEAR(one.loads[0].pressure_Pa.at(x, y), other.loads[0].pressure_Pa.at(16 - x, y), 0.05);
}

TEST(LargeStrain, FailureTellsTheLastGoodLoad) {
  fem::Scene scene = block(16);
  scene.inclusion->stiffness_ratio = 1e4;
  fem::LargeStrainOptions options;
  options.step_mm = 20;
  options.most_cuts = 0;
  const fem::LargeStrainResult result = solve_large_strain(scene, plate_depths({1, 9.9}), options);
  EXPECT_FALSE(result.converged);
  ASSERT_EQ(result.loads.size(), 1u);
  EXPECT_DOUBLE_EQ(result.last_press_mm, 1);
  EXPECT_DOUBLE_EQ(result.last_force_N, result.loads[0].force_N);
  ASSERT_FALSE(result.warnings.empty());
  EXPECT_NE(result.warnings.back().find("ended at 1 mm"), std::string::npos) << result.warnings.back();
  // With shorter steps it goes on.
  options.most_cuts = 6;
  EXPECT_TRUE(solve_large_strain(scene, plate_depths({1, 7}), options).converged);
}

TEST(LargeStrain, TwoGridsAreNearerThanEither) {
  fem::LargeStrainOptions options;
  options.map_nodes = {17, 17};
  const auto peak = [](const fem::LargeStrainResult& r) { return double{r.loads[0].pressure_Pa.at(8, 8)}; };
  const double truth = peak(solve_extrapolated(block(48), {32, 32, 16}, plate_depths({3}), options));
  const double fine = peak(solve_large_strain(block(32), plate_depths({3}), options));
  const double two = peak(solve_extrapolated(block(32), {16, 16, 8}, plate_depths({3}), options));
  EXPECT_LT(std::abs(two - truth), 0.3 * std::abs(fine - truth)) << fine << ' ' << two << ' ' << truth;
}

// The rim of a bonded floor: an edge of 90 degrees whose force errs with the 1.19th power of the cells' size
// under a small press (Williams), with less the deeper the press.
TEST(RimError, OrderFallsFromThatOfASmallPress) {
  fem::LargeStrainOptions options;
  options.map_nodes = {9, 9};
  const auto rim = fem::RimError::measure(block(48), {0.02, 1, 2, 3, 4}, options);
  ASSERT_TRUE(rim);
  EXPECT_NEAR(rim->at(0).order, 1.1, 0.15);
  for (size_t l = 1; l < 5; ++l) {
    EXPECT_LT(rim->at(l).order, rim->at(l - 1).order - 0.03);
    EXPECT_GT(rim->force_N(l, 24), rim->force_N(l, 48));
    EXPECT_GT(rim->force_N(l, 48), 0);
  }
  EXPECT_LT(rim->at(4).order, 0.75);
}

TEST(RimError, GridsHaveTheScenesProportions) {
  using Three = std::array<std::array<uint32_t, 3>, 3>;
  EXPECT_EQ(fem::RimError::grids({48, 48, 24}), (Three{{{12, 12, 6}, {16, 16, 8}, {24, 24, 12}}}));
  EXPECT_EQ(fem::RimError::grids({64, 64, 32}), (Three{{{12, 12, 6}, {16, 16, 8}, {24, 24, 12}}}));
  EXPECT_EQ(fem::RimError::grids({32, 32, 16}), (Three{{{8, 8, 4}, {12, 12, 6}, {16, 16, 8}}}));
  EXPECT_FALSE(fem::RimError::grids({24, 24, 12}));  // half as many are too few
  EXPECT_FALSE(fem::RimError::grids({47, 48, 24}));
}

// Forces of tissue alone on 24, 48 and 96 cells along x, extrapolated with the order that the three have.
TEST(LargeStrain, ErrorThatIsStatedHoldsAgainstFinerGrids) {
  fem::LargeStrainOptions options;
  options.map_nodes = {9, 9};
  fem::Scene scene = block(32);
  scene.inclusion.reset();
  const double wanted_N[] = {0.413162, 0.870948, 1.376945};
  const auto pressed = solve_extrapolated(scene, plate_depths({1, 2, 3}), options);
  ASSERT_TRUE(pressed.converged);
  ASSERT_EQ(pressed.rim_order.size(), 3u);
  for (size_t l = 0; l < 3; ++l) {
    const fem::PressedBlock& load = pressed.loads[l];
    const double off_N = std::abs(load.force_N - wanted_N[l]);
    EXPECT_LT(off_N, load.force_error_N);
    EXPECT_LT(off_N, 0.004 * wanted_N[l]);
    EXPECT_LT(load.force_error_N, 0.006 * wanted_N[l]);
    EXPECT_EQ(load.press_error_mm, 0);
  }
  // Asked for the force, the press is what it was.
  std::vector<fem::PressLoad> forces;
  for (const fem::PressedBlock& load : pressed.loads) forces.push_back({std::nullopt, load.force_N});
  const auto found = solve_extrapolated(scene, forces, options);
  ASSERT_TRUE(found.converged);
  for (size_t l = 0; l < 3; ++l) {
    EXPECT_NEAR(found.loads[l].press_mm, static_cast<double>(l + 1), 0.1 * found.loads[l].press_error_mm);
    EXPECT_NEAR(found.loads[l].pressure_Pa.at(4, 4), pressed.loads[l].pressure_Pa.at(4, 4),
                0.5 * pressed.loads[l].pressure_error_Pa);
    EXPECT_EQ(found.loads[l].force_error_N, 0);
  }
}

// Faces between the planes of straight cells are felt where the planes are, not where the faces are.
TEST(LargeStrain, AFacesDepthIsFeltWhereverItLies) {
  fem::LargeStrainOptions options;
  options.map_nodes = {17, 17};
  options.residual = 1e-5;
  fem::Scene scene = block(24);
  scene.inclusion->shape = InclusionShape::Cylinder;
  scene.inclusion->size_mm = {8, 8, 8};
  const auto peak = [&](double depth_mm, uint32_t coarser, bool follows) {
    scene.inclusion->depth_mm = depth_mm;
    const fem::LargeStrainResult pressed =
        solve_extrapolated(scene, {coarser, coarser, coarser / 2}, plate_depths({2}), options);
    EXPECT_EQ(pressed.follows_lump, follows);
    return double{pressed.loads.at(0).pressure_Pa.at(8, 8)};
  };
  const auto unevenness = [&](uint32_t coarser, bool follows) {
    std::vector<double> steps;
    for (double depth_mm = 3; depth_mm < 4.6; depth_mm += 0.4)
      steps.push_back(peak(depth_mm, coarser, follows) - peak(depth_mm + 0.4, coarser, follows));
    double worst = 0;
    for (size_t s = 1; s < steps.size(); ++s) worst = std::max(worst, std::abs(steps[s] / steps[s - 1] - 1));
    return worst;
  };
  EXPECT_LT(unevenness(12, true), 0.25);
  EXPECT_GT(unevenness(16, false), 0.5);
}

TEST(LargeStrain, CellsFollowOneLumpStraightOnTheTissue) {
  const auto follows = [](const fem::Scene& scene) {
    fem::LargeStrainOptions options;
    options.residual = 1e-4;
    return solve_extrapolated(scene, {12, 12, 6}, plate_depths({1}), options).follows_lump;
  };
  fem::Scene scene = block(24);
  EXPECT_TRUE(follows(scene));
  fem::Scene two = scene;
  two.inclusion->offset_mm = {-8, 0};
  two.others = {two.inclusion.value()};
  two.others[0].offset_mm = {8, 0};
  EXPECT_FALSE(follows(two));
  fem::Scene padded = scene;
  padded.pad = {{}};
  padded.pad[0].thickness_mm = 2;
  padded.pad[0].young_Pa = 4000;
  EXPECT_FALSE(follows(padded));
  scene.inclusion.reset();
  EXPECT_FALSE(follows(scene));
}

// Nodes' forces of a pressure that is a paraboloid, each weighted by the node's shape.
TEST(PressureField, IsThePressureAtAPlaceAndNotAMeanAroundIt) {
  fem::PressedSurface surface{9, 9, {0.5, 0.8}, {}, {}, {}, {}};
  surface.x_mm.resize(81);
  surface.y_mm = surface.z_mm = surface.x_mm;
  const auto pressure = [](double x, double y) { return 1000 - 30 * x * x - 20 * y * y; };
  const double mean = (60 * 0.25 + 40 * 0.64) / 12;  // what a node's mean lacks
  for (int y = -4; y <= 4; ++y)
    for (int x = -4; x <= 4; ++x)
      surface.force_N.push_back((pressure(0.5 * x, 0.8 * y) - mean) * 0.4e-6 * (std::abs(x) == 4 ? 0.5 : 1) *
                                (std::abs(y) == 4 ? 0.5 : 1));
  const fem::PressureField field(surface);
  for (int y = -2; y <= 2; ++y)
    for (int x = -2; x <= 2; ++x) EXPECT_NEAR(field.at(0.5 * x, 0.8 * y), pressure(0.5 * x, 0.8 * y), 1e-8);
}

// The derivatives of the direct inversion, against presses of changed blocks.
TEST(LargeStrain, SurfaceChangesAsChangedBlocksDo) {
  fem::Scene scene = block(16);
  scene.inclusion->offset_mm = {2, 1};
  fem::LargeStrainOptions options;
  options.residual = 1e-9;
  WorkTeam team(2);
  fem::LargeStrainResult told;
  fem::LargeStrainModel model(scene, options, team);
  for (const double way : {0.5, 1.0, 1.5, 2.0}) ASSERT_TRUE(model.move_to(way, told));
  const double step = 0.02;
  const auto stiffer = [&](double by) {
    fem::Scene other = scene;
    other.inclusion->stiffness_ratio *= std::exp(by);
    return other;
  };
  const fem::PressedSurface by_ratio = model.change_by_grids(voxelise(stiffer(-step), false),
                                                             voxelise(stiffer(step), false), 2 * step, told),
                            by_press = model.change_by_press(told);
  const auto pressed = [&](const fem::Scene& other, double way) {
    fem::LargeStrainModel changed(other, options, team);
    for (const double on : {way / 4, way / 2, 3 * way / 4, way}) EXPECT_TRUE(changed.move_to(on, told));
    return changed.surface();
  };
  const auto compare = [&](const fem::PressedSurface& change_found, const fem::PressedSurface& high,
                           const fem::PressedSurface& low, double over) {
    double force = 0, place = 0;
    for (size_t n = 0; n < high.force_N.size(); ++n) {
      force = std::max(force, std::abs(high.force_N[n] - low.force_N[n]) / over);
      place = std::max(place, std::abs(high.x_mm[n] - low.x_mm[n]) / over);
    }
    for (size_t n = 0; n < high.force_N.size(); ++n) {
      EXPECT_NEAR(change_found.force_N[n], (high.force_N[n] - low.force_N[n]) / over, 2e-3 * force);
      EXPECT_NEAR(change_found.x_mm[n], (high.x_mm[n] - low.x_mm[n]) / over, 2e-3 * place);
    }
  };
  compare(by_ratio, pressed(stiffer(step), 2), pressed(stiffer(-step), 2), 2 * step);
  compare(by_press, pressed(scene, 2.01), pressed(scene, 1.99), 0.02);
}

TEST(LargeStrain, NonsenseIsRefused) {
  const auto refused = [](const fem::Scene& scene, const std::vector<fem::PressLoad>& loads) {
    try {
      solve_large_strain(scene, loads);
    } catch (const Error& error) {
      return error.failure() == Failure::Usage;
    }
    return false;
  };
  EXPECT_TRUE(refused(block(16), {}));
  EXPECT_TRUE(refused(block(16), plate_depths({2, 1})));
  EXPECT_TRUE(refused(block(16), plate_depths({11})));
  EXPECT_TRUE(refused(block(16), plate_depths({std::nan("")})));
  EXPECT_TRUE(refused(block(16), {{1.0, 1.0}}));
  fem::Scene ball = block(16);
  ball.presser = fem::Presser::Sphere;
  ball.ball_radius_mm = 5;
  EXPECT_TRUE(refused(ball, plate_depths({1})));
  fem::Scene sliding = block(16);
  sliding.pad = {{2, 1e5}};
  sliding.pad_slides = true;
  EXPECT_TRUE(refused(sliding, plate_depths({1})));
  fem::Scene soft = block(16);
  const fem::LargeStrainResult far = solve_large_strain(soft, {{std::nullopt, 1e5}});
  EXPECT_FALSE(far.converged);
  ASSERT_FALSE(far.warnings.empty());
}

}  // namespace
}  // namespace palpate
