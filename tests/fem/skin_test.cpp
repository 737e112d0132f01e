// A skin over tissue against closed forms, against a pad's sheet, which is another way to the same cells, and
// against finer cells.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/fem/large_strain/extrapolation.h"
#include "engine/fem/large_strain/large_strain.h"
#include "engine/fem/linear/grid.h"
#include "engine/fem/solve.h"
#include "palpate/error.h"

namespace palpate {
namespace {

fem::Scene skinned(double skin_mm, double ratio, uint32_t cells = 16) {
  fem::Scene scene;
  scene.cells = {cells, cells, cells / 2};
  scene.inclusion.reset();
  scene.skin = fem::Skin{skin_mm, ratio};
  return scene;
}

// Without a Poisson's ratio nothing goes sideways: springs in series.
TEST(Skin, LayersThatDoNotBulgeAreSpringsInSeries) {
  for (const double ratio : {0.3, 5.0})
    for (const double skin_mm : {1.0, 3.0, 7.0}) {
      fem::Scene scene = skinned(skin_mm, ratio);
      scene.poisson = 0;
      const fem::Result result = fem::solve(scene);
      ASSERT_TRUE(result.converged);
      EXPECT_NEAR(result.force_N, 1600e-6 * 4000 / (skin_mm / ratio + 20 - skin_mm), 1e-6) << ratio;
      EXPECT_NEAR(result.core_strain, -1 / (skin_mm / ratio + 20 - skin_mm), 1e-6);
    }
}

// In the middle of a wide sheet nothing goes sideways either: both layers carry one stress.
TEST(Skin, ConfinedLayersAtLargeStrainAreTheClosedForm) {
  fem::Scene scene = skinned(0.5, 3);
  scene.block_mm = {48, 48, 2};
  scene.cells = {48, 48, 8};
  scene.poisson = 0.3;
  const double press_mm = 0.4, mu = 4000 / 2.6, kappa = 4000 / 1.2;
  fem::LargeStrainOptions options;
  options.step_mm = 0.1;
  const fem::LargeStrainResult result = solve_large_strain(scene, {{press_mm, std::nullopt}}, options);
  ASSERT_TRUE(result.converged);
  const auto stress = [&](double z) {
    return -(2 * mu * std::pow(z, -5.0 / 3) * (z * z - 1) / 3 + kappa * (z - 1));
  };
  double low = 0.5, high = 1;  // stretch of the tissue
  const auto of_skin = [&](double z) { return 1 - (press_mm - 1.5 * (1 - z)) / 0.5; };
  for (int round = 0; round < 100; ++round) {
    const double z = (low + high) / 2;
    (stress(z) > 3 * stress(of_skin(z)) ? low : high) = z;
  }
  const PressureMap& map = result.loads.back().pressure_Pa;
  EXPECT_NEAR(double{map.at(24, 24)} / stress(low), 1, 1e-3);
  EXPECT_GT(stress(low) / stress(1 - press_mm / 2), 1.05) << "the skin hardly matters";
}

// A ball on a sheet that is bonded to the tissue, by the pad's way to the same cells.
TEST(Skin, IsABondedSheetUnderABall) {
  for (const double ratio : {0.3, 4.0}) {
    fem::Scene scene = skinned(2, ratio, 24);
    scene.presser = fem::Presser::Sphere;
    scene.ball_radius_mm = 15;
    fem::Scene sheet = scene;
    sheet.skin.reset();
    sheet.block_mm[2] = 18;
    sheet.cells[2] = 10;
    sheet.pad = {{2, 4000 * ratio}};
    ASSERT_EQ(fem::voxelise(scene, true).size_z_mm.size(), fem::voxelise(sheet, true).size_z_mm.size());
    const fem::Result skin = fem::solve(scene), pad = fem::solve(sheet);
    ASSERT_TRUE(skin.converged && pad.converged);
    EXPECT_NEAR(skin.force_N / pad.force_N, 1, 1e-4);
  }
}

TEST(Skin, OfTheTissuesModulusIsNone) {
  fem::Scene scene = skinned(2, 1, 36), plain = scene;
  plain.skin.reset();
  const std::vector<fem::PressLoad> loads = {{2.0, std::nullopt}, {4.0, std::nullopt}};
  const fem::LargeStrainResult with = solve_extrapolated(scene, {24, 24, 12}, loads),
                               without = solve_extrapolated(plain, {24, 24, 12}, loads);
  ASSERT_TRUE(with.converged && without.converged);
  // Layers below a skin lie elsewhere, and with them the rim of the floor, which errs most: by what both
  // state.
  for (size_t l = 0; l < loads.size(); ++l) {
    const fem::PressedBlock &a = with.loads[l], &b = without.loads[l];
    EXPECT_NEAR(a.force_N, b.force_N, a.force_error_N + b.force_error_N);
    EXPECT_LT(a.force_error_N, 0.01 * a.force_N);
  }
}

TEST(Skin, SmallPressIsTheLinearModels) {
  fem::Scene scene = skinned(1.5, 4, 24);
  scene.inclusion = fem::Inclusion{};
  scene.press_mm = 0.002;
  const fem::Result linear = fem::solve(scene);
  fem::LargeStrainOptions options;
  options.residual = 1e-8;
  const fem::LargeStrainResult large = solve_large_strain(scene, {{0.002, std::nullopt}}, options);
  ASSERT_TRUE(linear.converged && large.converged);
  EXPECT_NEAR(large.loads[0].force_N / linear.force_N, 1, 1e-3);
}

/// Height of a lump's bump at 12 % of press.
double bump_Pa(const fem::Scene& scene, const std::array<uint32_t, 3>& coarser) {
  const std::vector<fem::PressLoad> loads = {{0.12 * scene.block_mm[2], std::nullopt}};
  fem::LargeStrainOptions options;
  options.map_nodes = {17, 17};
  options.step_mm = 2;
  fem::Scene plain = scene;
  plain.inclusion.reset();
  const fem::LargeStrainResult with = solve_extrapolated(scene, coarser, loads, options),
                               without = solve_extrapolated(plain, coarser, loads, options);
  EXPECT_TRUE(with.converged && without.converged);
  EXPECT_TRUE(with.follows_lump);
  return double{with.loads[0].pressure_Pa.at(8, 8)} - double{without.loads[0].pressure_Pa.at(8, 8)};
}

TEST(Skin, ALumpsBumpConvergesAndIsHigherUnderAStiffSkin) {
  fem::Scene scene = skinned(2, 5, 36);
  scene.inclusion = fem::Inclusion{};
  const double coarse = bump_Pa(scene, {24, 24, 12});
  scene.cells = {48, 48, 24};
  const double fine = bump_Pa(scene, {24, 24, 12});
  EXPECT_NEAR(coarse / fine, 1, 0.02);
  scene.skin.reset();
  const double bare = bump_Pa(scene, {24, 24, 12});
  std::printf("bump %.1f Pa by 36 and 24 cells, %.1f by 48 and 24, %.1f without the skin\n", coarse, fine,
              bare);
  EXPECT_GT(fine, 1.2 * bare);
}

TEST(Skin, StaysEvenAboveCellsThatFollowALump) {
  fem::Scene scene = skinned(2, 3, 24);
  scene.inclusion = fem::Inclusion{};
  scene.inclusion->depth_mm = 2.6;
  const auto grid = fit(scene, fem::inclusion_cells(scene), false);
  ASSERT_TRUE(grid);
  const uint32_t of_skin = fem::skin_layers(scene);
  ASSERT_EQ(of_skin, 2u);
  for (uint32_t k = 0; k <= of_skin; ++k)
    for (uint32_t j = 0; j <= 24; ++j)
      for (uint32_t i = 0; i <= 24; ++i) {
        const size_t n = grid->node(i, j, k);
        ASSERT_NEAR(grid->place_mm[n], i * 40.0 / 24 - 20, 1e-9);
        ASSERT_NEAR(grid->place_mm[2 * grid->nodes() + n], k * 1.0, 1e-9);
        if (k == of_skin || i == 24 || j == 24) continue;
        ASSERT_EQ(grid->young[grid->cell(i, j, k)], 3.0f);
      }
}

TEST(Skin, GridsOfOneProportionHaveOneShareInIt) {
  for (const double skin_mm : {0.5, 2.0, 3.0, 5.0})
    for (const uint32_t times : {1u, 2u, 3u, 4u}) {
      fem::Scene scene = skinned(skin_mm, 2, 12);
      const uint32_t least = fem::skin_layers(scene);
      scene.cells = {12 * times, 12 * times, 6 * times};
      EXPECT_EQ(fem::skin_layers(scene), times * least);
      EXPECT_NEAR(fem::plane_mm(scene, times * least), skin_mm, 1e-12);
      EXPECT_NEAR(fem::plane_mm(scene, 6 * times), 20, 1e-12);
    }
}

TEST(Skin, NonsenseIsRefused) {
  const auto refused = [](const fem::Scene& scene, const char* word) {
    try {
      check(scene);
      ADD_FAILURE() << word;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
  };
  EXPECT_THROW(solve_extrapolated(skinned(2, 2, 32), {{1.0, std::nullopt}}), Error)
      << "3 of 16 and 1 of 8 layers";
  refused(skinned(11, 2), "skin's thickness");
  refused(skinned(0, 2), "skin's thickness");
  refused(skinned(2, 0), "skin's stiffness");
  fem::Scene within = skinned(3, 2);
  within.inclusion = fem::Inclusion{};
  within.inclusion->depth_mm = 2;
  refused(within, "below the skin");
}

}  // namespace
}  // namespace palpate
