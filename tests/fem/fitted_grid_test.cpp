// Cells that follow a lump: their positions, and their gain in accuracy over cells that do not.
#include "engine/fem/large_strain/fitted_grid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "engine/fem/large_strain/model.h"
#include "engine/fem/large_strain/neo_hookean.h"
#include "engine/fem/large_strain/pressed_surface.h"
#include "tests/reference/neo_hookean.h"

namespace palpate {
namespace {

fem::Scene scene_with(InclusionShape shape, std::array<double, 2> offset_mm = {0, 0}, uint32_t cells = 16) {
  fem::Scene scene;
  scene.cells = {cells, cells, cells / 2};
  scene.inclusion->shape = shape;
  if (shape == InclusionShape::Ellipsoid) scene.inclusion->size_mm = {12, 8, 8};
  if (shape == InclusionShape::LyingCylinder) scene.inclusion->size_mm = {15, 6, 6};
  scene.inclusion->offset_mm = offset_mm;
  return scene;
}

constexpr InclusionShape kShapes[] = {InclusionShape::Sphere, InclusionShape::Ellipsoid,
                                      InclusionShape::Cylinder, InclusionShape::LyingCylinder};

double volume_of(const fem::Inclusion& lump) {
  const auto [a, b, c] = lump.size();
  const bool ball = lump.shape == InclusionShape::Sphere || lump.shape == InclusionShape::Ellipsoid;
  return a * b * c * std::numbers::pi / (ball ? 6 : 4);
}

/// Volume of the cells whose modulus is the lump's.
double volume_of(const fem::CellGrid& grid, double ratio) {
  fem::CellGrid lump = grid;
  for (float& young : lump.young) young = young == static_cast<float>(ratio) ? 1.0f : 0.0f;
  // Twice the energy of an even swelling (nu = 0: mu = 1/2, kappa = 1/3), which costs its bulk part alone.
  const double grown = 1.001;
  std::vector<double> u = grid.place_mm;
  for (double& x : u) x *= grown - 1;
  const double each = std::pow(std::pow(grown, 3) - 1, 2) / 6;
  return reference::neo_hookean_energy(lump, 0, u) / each;
}

TEST(FittedGrid, CellsEncloseTheLumpAndLeaveTheBlocksFaces) {
  for (const InclusionShape shape : kShapes)
    for (const std::array<double, 2>& offset : {std::array{0.0, 0.0}, std::array{3.3, -4.1}}) {
      const fem::Scene scene = scene_with(shape, offset);
      const fem::InclusionCells cells = fem::inclusion_cells(scene);
      const std::optional<fem::CellGrid> grid = fit(scene, cells, false);
      ASSERT_TRUE(grid);
      EXPECT_NEAR(volume_of(*grid, scene.inclusion->stiffness_ratio) / volume_of(*scene.inclusion), 1, 1e-6);
      // Its middle is the lump's, and its ends are its ends but for what flat cells need to grow.
      const std::array<double, 3> size = scene.inclusion->size();
      const std::array<double, 3> middle = {offset[0], offset[1], scene.inclusion->depth_mm + size[2] / 2};
      for (size_t c = 0; c < 3; ++c) {
        std::array<uint32_t, 3> low = cells.first, high = cells.last;
        for (size_t d = 0; d < 3; ++d)
          if (d != c) low[d] = high[d] = (cells.first[d] + cells.last[d]) / 2;
        const Eigen::Vector3d from = reference::corner_place(*grid, low[0], low[1], low[2]),
                              to = reference::corner_place(*grid, high[0], high[1], high[2]);
        const auto at = static_cast<Eigen::Index>(c);
        EXPECT_NEAR((from(at) + to(at)) / 2, middle[c], 1e-9);
        EXPECT_NEAR((to(at) - from(at)) / size[c], 1, 0.12);
      }
      for (uint32_t j = 0; j <= scene.cells[1]; ++j)
        for (uint32_t i = 0; i <= scene.cells[0]; ++i)
          EXPECT_NEAR(
              (reference::corner_place(*grid, i, j, 0) - Eigen::Vector3d(i * 2.5 - 20, j * 2.5 - 20, 0))
                  .norm(),
              0, 1e-9);
    }
}

TEST(FittedGrid, AQuarterIsAQuarterOfTheWhole) {
  const fem::Scene scene = scene_with(InclusionShape::Sphere);
  const fem::InclusionCells cells = fem::inclusion_cells(scene);
  const fem::CellGrid whole = *fit(scene, cells, false), quarter = *fit(scene, cells, true);
  for (uint32_t k = 0; k <= 8; ++k)
    for (uint32_t j = 0; j <= 8; ++j)
      for (uint32_t i = 0; i <= 8; ++i) {
        EXPECT_NEAR(
            (reference::corner_place(quarter, i, j, k) - reference::corner_place(whole, i + 8, j + 8, k))
                .norm(),
            0, 1e-9);
        if (i == 8 || j == 8 || k == 8) continue;
        EXPECT_EQ(quarter.young[quarter.cell(i, j, k)], whole.young[whole.cell(i + 8, j + 8, k)]);
      }
}

TEST(FittedGrid, ALumpInTheMiddleHasCellsInTheMiddleHoweverLong) {
  for (double length = 2; length < 39; length += 0.3) {
    fem::Scene scene = scene_with(InclusionShape::LyingCylinder);
    scene.inclusion->size_mm = {length, 6, 6};
    const fem::InclusionCells cells = fem::inclusion_cells(scene);
    EXPECT_TRUE(cells.in_middle(scene.cells)) << length;
    EXPECT_TRUE(fit(scene, cells, true)) << length;
  }
}

TEST(FittedGrid, CellsBesideTheMiddleHaveNoQuarter) {
  const fem::Scene scene = scene_with(InclusionShape::Sphere);
  fem::InclusionCells cells = fem::inclusion_cells(scene);
  ++cells.last[0];
  EXPECT_TRUE(fit(scene, cells, false));
  EXPECT_FALSE(fit(scene, cells, true));
}

TEST(FittedGrid, CellsSuitLumpsLikeTheirsAndNoOthers) {
  fem::Scene scene = scene_with(InclusionShape::Sphere, {1, 2});
  const fem::InclusionCells cells = fem::inclusion_cells(scene);
  EXPECT_TRUE(matches(cells, scene));
  scene.inclusion->depth_mm += 0.5;
  EXPECT_TRUE(matches(cells, scene));
  scene.inclusion->depth_mm += 4;
  EXPECT_FALSE(matches(cells, scene));
}

TEST(FittedGrid, CellsThatWouldTurnInsideOutAreNotMade) {
  fem::Scene scene = scene_with(InclusionShape::Sphere);
  EXPECT_TRUE(fit(scene, fem::inclusion_cells(scene), true));
  // Cells of one corner of the block cannot be a lump in the other.
  scene.inclusion->offset_mm = {14, 14};
  EXPECT_FALSE(fit(scene, {{1, 1, 1}, {13, 13, 3}}, false));
}

/// Pressure on the middle, 2 mm pressed.
double press(const fem::Scene& scene, std::optional<fem::CellGrid> grid) {
  WorkTeam team(1);
  fem::LargeStrainOptions options;
  fem::LargeStrainModel model(scene, options, team, std::move(grid));
  fem::LargeStrainResult told;
  EXPECT_TRUE(model.move_to(2, told));
  const fem::PressedSurface surface = model.surface();
  return fem::PressureField(surface).at(0, 0);
}

TEST(FittedGrid, HalfTheCellsSizeIsMoreThanTwiceAsNear) {
  const fem::Scene coarsest = scene_with(InclusionShape::Sphere);
  const auto with = [&](uint32_t finer) {
    const fem::Scene scene = scene_with(InclusionShape::Sphere, {0, 0}, 16 * finer);
    return press(scene, fit(scene, fem::inclusion_cells(coarsest).times(finer), true));
  };
  const double once = with(1), twice = with(2), thrice = with(3);
  const double none = thrice + (thrice - twice) / (9.0 / 4 - 1);
  EXPECT_LT(std::abs(twice - none), 0.35 * std::abs(once - none));
  EXPECT_NEAR((twice + (twice - once) / 3) / none, 1, 0.02);
}

TEST(FittedGrid, ChangesOfTheLumpAreTheDifferencesThatTheyMake) {
  const fem::Scene scene = scene_with(InclusionShape::Sphere);
  const fem::InclusionCells cells = fem::inclusion_cells(scene);
  const auto deeper = [&](double by_mm) {
    fem::Scene other = scene;
    other.inclusion->depth_mm += by_mm;
    return *fit(other, cells, true);
  };
  WorkTeam team(1);
  fem::LargeStrainOptions options;
  options.residual = 1e-9;
  fem::LargeStrainResult told;
  fem::LargeStrainModel model(scene, options, team, fit(scene, cells, true));
  ASSERT_TRUE(model.move_to(2, told));
  const fem::PressedSurface change = model.change_by_grids(deeper(-0.01), deeper(0.01), 0.02, told);
  fem::PressedSurface ends[2];
  for (const int end : {0, 1}) {
    fem::LargeStrainModel moved(scene, options, team, deeper(end == 1 ? 0.1 : -0.1));
    ASSERT_TRUE(moved.move_to(2, told));
    ends[end] = moved.surface();
  }
  double largest = 0;
  for (const double f : change.force_N) largest = std::max(largest, std::abs(f));
  for (size_t n = 0; n < change.force_N.size(); ++n) {
    EXPECT_NEAR(change.force_N[n], (ends[1].force_N[n] - ends[0].force_N[n]) / 0.2, 0.01 * largest);
    EXPECT_NEAR(change.x_mm[n], (ends[1].x_mm[n] - ends[0].x_mm[n]) / 0.2, 2e-4);
  }
}

}  // namespace
}  // namespace palpate
