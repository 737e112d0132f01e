// A sphere in a bonded layer by axisymmetric finite elements: the small press is the integral equation's.
#include "tests/reference/sphere_press.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "engine/base/text.h"
#include "engine/elasticity/layer.h"
#include "engine/pad/traction.h"
#include "palpate/error.h"
#include "tests/support/csv_table.h"
#include "tests/support/thorough.h"

namespace palpate {
namespace {

/// What the exact layer answers at that indentation.
LayerContact at_depth(const Layer& layer, double depth_mm, double radius_mm) {
  double low = 0, high = 2 * std::sqrt(radius_mm * depth_mm);
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (layer.press_sphere_to_radius(middle, radius_mm).summary().indentation_mm < depth_mm ? low : high) =
        middle;
  }
  return layer.press_sphere_to_radius(low, radius_mm);
}

// Force, contact and pressure: small strain at a tenth of the thickness, large strain where it hardly begins.
TEST(SpherePress, SmallPressIsTheLinearLayers) {
  for (const bool large_strain : {false, true})
    for (const auto& [poisson, radius] : {std::pair{0.3, 4.0}, std::pair{0.4999, 0.5}}) {
      SCOPED_TRACE(text("%s, nu %g, radius %g", large_strain ? "large" : "small", poisson, radius));
      const double depth = large_strain ? 0.0005 : 0.1;
      fem::SphereOnLayer what{.poisson = poisson, .radius_mm = radius, .large_strain = large_strain};
      what.reach_mm = 1.3 * std::sqrt(radius * depth);
      what.cell_mm = std::min(what.reach_mm / 10, 0.1);
      const auto pressed = fem::press_sphere(what, {depth});
      ASSERT_EQ(pressed.size(), 1u);
      const IndenterContact exact = at_depth(Layer({1, poisson}, 1), depth, radius).summary();
      EXPECT_NEAR(pressed[0].force_N, exact.force_N, 0.01 * exact.force_N);
      EXPECT_NEAR(pressed[0].pressure_max_MPa, exact.pressure_max_MPa, 0.02 * exact.pressure_max_MPa);
      EXPECT_NEAR(pressed[0].contact_radius_mm, exact.radius_mm, what.cell_mm);
    }
}

TEST(SpherePress, HalvedMeshHardlyMatters) {
  fem::SphereOnLayer what{.radius_mm = 1, .cell_mm = 1.0 / 12, .reach_mm = 0.8};
  const auto fine = fem::press_sphere(what, {0.33});
  what.cell_mm *= 2;
  const auto coarse = fem::press_sphere(what, {0.1, 0.33});
  ASSERT_EQ(fine.size(), 1u);
  ASSERT_EQ(coarse.size(), 2u);
  EXPECT_NEAR(coarse[1].force_N, fine[0].force_N, 0.01 * fine[0].force_N);
  // The same press in other units.
  const auto other = fem::press_sphere(
      {.thickness_mm = 5, .young_MPa = 0.15, .radius_mm = 5, .cell_mm = 5.0 / 6, .reach_mm = 4}, {0.5});
  ASSERT_EQ(other.size(), 1u);
  EXPECT_NEAR(other[0].force_N, 25 * 0.15 * coarse[0].force_N, 1e-4 * other[0].force_N);
}

/// What the traction solve makes of the surface over the force that is there.
double found_ratio(double poisson, const fem::PressedLayer& pressed) {
  constexpr double kCell = 0.06, kAround = 2.5;
  const auto along = 2 * static_cast<uint32_t>(std::ceil((pressed.contact_radius_mm + kAround) / kCell));
  const fem::SeenPress seen = fem::seen_by_camera(pressed, along, kCell, 1);
  TractionOptions options;
  options.slope_sd = 1e-3;
  options.errors = false;
  TractionSolver solver({{1, poisson}, 1}, {along, along, kCell}, options);
  const Traction& found = solver.solve({.depth_mm = seen.depth_mm, .contact = seen.contact});
  return found.wrench.force_N[2] / pressed.force_N;
}

// The table that the READMEs quote: small presses are the linear layer's, meshes agree, and a row (in a
// thorough run all of them) is found again.
TEST(SpherePress, StoredTable) {
  std::ifstream file(std::string(PALPATE_SOURCE_DIR) +
                     "/perf/results/lavapipe-22.3.6-2-cores/traction/beyond_linear.csv");
  const Table table{std::string(std::istreambuf_iterator<char>(file), {})};
  table.expect_whole();
  ASSERT_GE(table.rows.size(), 24u);
  for (size_t row = 0; row < table.rows.size(); ++row) {
    const double radius = table.number(row, "radius"), depth = table.number(row, "depth");
    const double poisson = table.number(row, "poisson"), force = table.number(row, "force");
    SCOPED_TRACE(text("radius %g, depth %g", radius, depth));
    if (depth >= 0.1) {
      EXPECT_LT(table.number(row, "force_error"), 0.01);
    }
    const double exact = at_depth(Layer({1, poisson}, 1), depth, radius).summary().force_N;
    EXPECT_NEAR(table.number(row, "linear_force"), exact, 1e-4 * exact);
    EXPECT_NEAR(table.number(row, "force_ratio"), force / exact, 1e-3);
    if (depth < 0.05) {
      EXPECT_NEAR(force, exact, 0.02 * exact);
    }
    if (!thorough() && !(radius == 2 && depth == 0.33)) continue;
    const double sunk = std::min(depth, radius);
    const fem::SphereOnLayer what{.poisson = poisson,
                                  .radius_mm = radius,
                                  .cell_mm = 1.0 / (thorough() ? 24 : 8),
                                  .reach_mm = 1.1 * std::sqrt(2 * radius * sunk - sunk * sunk)};
    const auto again = fem::press_sphere(what, {depth});
    ASSERT_EQ(again.size(), 1u);
    EXPECT_NEAR(again[0].force_N, force, 0.01 * force);
    EXPECT_NEAR(found_ratio(poisson, again[0]), table.number(row, "found_ratio"), 0.01);
  }
}

TEST(SpherePress, RefusesWhatIsNoPress) {
  const auto refuses = [](const fem::SphereOnLayer& what, const std::vector<double>& press) {
    EXPECT_THROW(fem::press_sphere(what, press), Error);
  };
  refuses({.thickness_mm = 0}, {0.1});
  refuses({.poisson = 0.5}, {0.1});
  refuses({.radius_mm = -1}, {0.1});
  refuses({.cell_mm = 0.3}, {0.1});
  refuses({}, {0.2, 0.1});
  refuses({}, {1});
}

}  // namespace
}  // namespace palpate
