// Traction found from surfaces that finite elements of the whole layer answer with: solid bricks that know
// nothing of the layer's transfer functions.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "engine/fem/linear/solver.h"
#include "engine/fem/solve.h"
#include "engine/pad/traction.h"
#include "tests/reference/layer_press.h"

namespace palpate {
namespace {

constexpr double kYoung_MPa = 0.15, kThickness_mm = 4, kHalf_mm = 20, kDisc_mm = 4.2;
constexpr double kCell_mm = 0.5;  // of the traction's grid
constexpr auto kCells = static_cast<uint32_t>(2 * kHalf_mm / kCell_mm);

/// A load that is itself but for signs when x or y turns round: of each component, whether it is odd.
struct Load {
  std::array<std::array<bool, 2>, 3> odd;  ///< components x, y, z; in x and in y
  std::function<std::array<double, 3>(double x, double y)> traction_MPa;
};

double dome(double x, double y) {
  return std::sqrt(std::max(0.0, 1 - (x * x + y * y) / (kDisc_mm * kDisc_mm)));
}

// Of 1 MPa in the middle or, of the twist, what 1 MPa at the rim would be without the dome. Forces
// 2/3 pi a^2, the twist's moment 4/15 pi a^3.
const Load kPressure{{{{true, false}, {false, true}, {false, false}}}, [](double x, double y) {
                       return std::array{0.0, 0.0, dome(x, y)};
                     }};
const Load kDrag{{{{false, false}, {true, true}, {true, false}}}, [](double x, double y) {
                   return std::array{dome(x, y), 0.0, 0.0};
                 }};
const Load kTwist{{{{false, true}, {true, false}, {true, true}}}, [](double x, double y) {
                    return std::array{-y / kDisc_mm * dome(x, y), x / kDisc_mm * dome(x, y), 0.0};
                  }};

/// Displacement of the surface at the nodes of a quarter of the block, x, y >= 0, components one behind the
/// other.
std::vector<double> quarter_surface(const Load& load, double poisson, double pitch_mm, double half_mm) {
  const auto along = static_cast<uint32_t>(std::lround(half_mm / pitch_mm));
  const auto down = static_cast<uint32_t>(std::lround(kThickness_mm / pitch_mm));
  fem::CellGrid grid;
  grid.cells = {along, along, down};
  grid.size_x_mm = grid.size_y_mm = pitch_mm;
  grid.size_z_mm.assign(down, pitch_mm);
  grid.young.assign(grid.cell_count(), static_cast<float>(kYoung_MPa));
  const size_t nodes = grid.nodes();
  fem::FixedNodes fixed(nodes);
  for (uint32_t k = 0; k <= down; ++k)
    for (uint32_t j = 0; j <= along; ++j)
      for (uint32_t i = 0; i <= along; ++i) {
        uint8_t& bits = fixed[grid.node(i, j, k)];
        if (k == down) bits = fem::kFixedAll;
        for (size_t c = 0; c < 3; ++c)
          if ((i == 0 && load.odd[c][0]) || (j == 0 && load.odd[c][1]))
            bits |= static_cast<uint8_t>(fem::kFixedX << c);
      }
  std::vector<double> force(3 * nodes), moved(3 * nodes);
  constexpr int kParts = 8;  // of a cell, so that the dome's rim is integrated
  const double part_mm = pitch_mm / kParts;
  for (uint32_t j = 0; j < along; ++j)
    for (uint32_t i = 0; i < along; ++i)
      for (int b = 0; b < kParts; ++b)
        for (int a = 0; a < kParts; ++a) {
          const double s = (a + 0.5) / kParts, t = (b + 0.5) / kParts;
          const auto traction = load.traction_MPa((i + s) * pitch_mm, (j + t) * pitch_mm);
          for (uint32_t corner = 0; corner < 4; ++corner) {
            const uint32_t right = corner % 2, below = corner / 2;
            const size_t n = grid.node(i + right, j + below, 0);
            const double weight = (right ? s : 1 - s) * (below ? t : 1 - t) * part_mm * part_mm;
            for (size_t c = 0; c < 3; ++c)
              if ((fixed[n] >> c & 1) == 0) force[c * nodes + n] += weight * traction[c];
          }
        }
  WorkTeam team(0);
  fem::Solver solver(grid, poisson, fixed, team);
  EXPECT_TRUE(solver.solve(force, moved, 1e-7, 500).converged);
  const size_t plane = size_t{along + 1} * (along + 1);
  std::vector<double> surface;
  for (size_t c = 0; c < 3; ++c)
    surface.insert(surface.end(), moved.begin() + static_cast<std::ptrdiff_t>(c * nodes),
                   moved.begin() + static_cast<std::ptrdiff_t>(c * nodes + plane));
  return surface;
}

/// Means over the cells of the traction's grid, each component kCells x kCells: bricks of a quarter of a
/// millimetre, extrapolated by those of a half.
std::array<std::vector<double>, 3> surface_of(const Load& load, double poisson) {
  const std::vector<double> coarse = quarter_surface(load, poisson, kCell_mm, kHalf_mm);
  const std::vector<double> fine = quarter_surface(load, poisson, kCell_mm / 2, kHalf_mm);
  const size_t few = kCells / 2 + 1, many = kCells + 1;
  std::array<std::vector<double>, 3> out;
  for (size_t c = 0; c < 3; ++c) {
    const auto error = [&](size_t i, size_t j) {
      return (fine[(c * many + 2 * j) * many + 2 * i] - coarse[(c * few + j) * few + i]) / 3;
    };
    const auto at = [&](size_t i, size_t j) {
      const double added = (error(i / 2, j / 2) + error((i + 1) / 2, j / 2) + error(i / 2, (j + 1) / 2) +
                            error((i + 1) / 2, (j + 1) / 2)) /
                           4;
      return fine[(c * many + j) * many + i] + added;
    };
    for (uint32_t y = 0; y < kCells; ++y)
      for (uint32_t x = 0; x < kCells; ++x) {
        const auto place = [](uint32_t k) { return k < kCells / 2 ? kCells / 2 - 1 - k : k - kCells / 2; };
        double sum = 0;
        for (size_t b = 0; b < 3; ++b)
          for (size_t a = 0; a < 3; ++a)
            sum += (a == 1 ? 4 : 1) * (b == 1 ? 4 : 1) * at(2 * place(x) + a, 2 * place(y) + b) / 36;
        if (load.odd[c][0] && x < kCells / 2) sum = -sum;
        if (load.odd[c][1] && y < kCells / 2) sum = -sum;
        out[c].push_back(sum);
      }
  }
  return out;
}

/// View of the layer by a camera under part of each load, MPa.
struct Seen {
  Seen(double poisson, double pressure, double drag, double twist)
      : contact(size_t{kCells} * kCells),
        depth(contact.size()),
        shift_x(contact.size()),
        shift_y(contact.size()) {
    for (const auto& [load, part] :
         {std::pair{&kPressure, pressure}, std::pair{&kDrag, drag}, std::pair{&kTwist, twist}}) {
      if (part == 0) continue;
      const auto surface = surface_of(*load, poisson);
      for (size_t i = 0; i < depth.size(); ++i) {
        shift_x[i] += static_cast<float>(part * surface[0][i]);
        shift_y[i] += static_cast<float>(part * surface[1][i]);
        depth[i] += static_cast<float>(part * surface[2][i]);
      }
    }
    for (size_t i = 0; i < contact.size(); ++i) {
      const double x = (static_cast<double>(i % kCells) + 0.5) * kCell_mm - kHalf_mm;
      const double y = (static_cast<double>(i / kCells) + 0.5) * kCell_mm - kHalf_mm;
      contact[i] = std::hypot(x, y) < kDisc_mm + 0.7 * kCell_mm ? 1 : 0;
    }
  }
  TractionInput input() const {
    return {.depth_mm = depth, .contact = contact, .shift_x_mm = shift_x, .shift_y_mm = shift_y};
  }
  std::vector<uint8_t> contact;
  std::vector<float> depth, shift_x, shift_y;
};

TractionOptions exact() {
  TractionOptions options;
  options.slope_sd = 1e-4;
  options.shift_sd_mm = 1e-5;
  options.tolerance = 1e-4;
  return options;
}

// Pressure, drag and twist at once, as a sphere that is pressed obliquely and turned: six components.
TEST(LayerTraction, ObliqueAndTwistedOnFiniteElements) {
  for (const double poisson : {0.3, 0.485}) {
    const double pressure = 0.05, drag = 0.02, twist = 0.015;
    const Seen seen(poisson, pressure, drag, twist);
    TractionSolver solver({{kYoung_MPa, poisson}, kThickness_mm}, {kCells, kCells, kCell_mm}, exact());
    const Traction& found = solver.solve(seen.input());
    const Wrench& wrench = found.wrench;
    const double unit = 2.0 / 3 * std::numbers::pi * kDisc_mm * kDisc_mm,
                 turn = 4.0 / 15 * std::numbers::pi * std::pow(kDisc_mm, 3);
    const std::string told = testing::PrintToString(wrench.force_N) + " N, " +
                             testing::PrintToString(wrench.moment_Nmm) + " N mm, nu " +
                             std::to_string(poisson);
    EXPECT_TRUE(found.converged);
    EXPECT_NEAR(wrench.force_N[0], drag * unit, 0.02 * drag * unit) << told;
    EXPECT_NEAR(wrench.force_N[1], 0, 0.02 * drag * unit) << told;
    EXPECT_NEAR(wrench.force_N[2], pressure * unit, 0.01 * pressure * unit) << told;
    EXPECT_NEAR(wrench.moment_Nmm[2], twist * turn, 0.02 * drag * unit * kDisc_mm) << told;
    for (const size_t axis : {0, 1})
      EXPECT_NEAR(wrench.moment_Nmm[axis], 0, 0.02 * pressure * unit * kDisc_mm) << told;
  }
}

// The block is wide enough: sides a thickness nearer change nothing that counts.
TEST(LayerTraction, SidesOfTheBlockAreFarEnough) {
  for (const Load* load : {&kPressure, &kDrag}) {
    const size_t c = load == &kDrag ? 0 : 2;
    const auto middle = [&](double half_mm) {
      const std::vector<double> surface = quarter_surface(*load, 0.485, 1, half_mm);
      return surface[c * surface.size() / 3];
    };
    EXPECT_NEAR(middle(kHalf_mm - kThickness_mm), middle(kHalf_mm), 3e-3 * middle(kHalf_mm));
  }
}

/// Error for a rigid sphere on a block of so many bricks through its thickness: force found over true force.
struct SphereError {
  double force = 0, peak = 0;
};
SphereError sphere_on_bricks(uint32_t down) {
  fem::Scene scene;
  scene.block_mm = {20, 20, 4};
  scene.young_Pa = 1e6 * kYoung_MPa;
  scene.poisson = 0.485;
  scene.inclusion.reset();
  scene.presser = fem::Presser::Sphere;
  scene.ball_radius_mm = 12;
  scene.press_mm = 0.4;
  scene.cells = {5 * down, 5 * down, down};
  const fem::Result block = fem::solve(scene);
  EXPECT_TRUE(block.converged);
  // A node is the middle of a cell.
  const PressureMap& depth = block.deflection_mm;
  const double pitch = depth.pitch_mm[0];
  std::vector<uint8_t> contact(depth.values.size());
  for (size_t i = 0; i < contact.size(); ++i) {
    const double x = (static_cast<double>(i % depth.width) - (depth.width - 1) / 2.0) * pitch;
    const double y = (static_cast<double>(i / depth.width) - (depth.height - 1) / 2.0) * pitch;
    contact[i] = std::hypot(x, y) < block.contact_radius_mm + 1.5 * pitch ? 1 : 0;
  }
  TractionOptions options = exact();
  options.errors = false;
  TractionSolver solver({{kYoung_MPa, scene.poisson}, 4}, {depth.width, depth.height, pitch}, options);
  const Traction& found = solver.solve({.depth_mm = depth.values, .contact = contact});
  const double peak = *std::max_element(found.pressure_MPa.begin(), found.pressure_MPa.end());
  return {found.wrench.force_N[2] / block.force_N - 1, peak / (1e-6 * block.center_stress_Pa) - 1};
}

// A rigid sphere in frictionless contact that finite elements found. The bricks' own errors shrink with their
// square, nearly (7.9, 3.5, 2.5 and 1.1 % of the force at 8, 12, 16 and 24 through the thickness).
TEST(LayerTraction, SphereOnFiniteElements) {
  const SphereError coarse = sphere_on_bricks(8), fine = sphere_on_bricks(16);
  EXPECT_LT(fine.force, 0.5 * coarse.force);
  EXPECT_NEAR((4 * fine.force - coarse.force) / 3, 0, 0.01) << fine.force;
  EXPECT_NEAR((4 * fine.peak - coarse.peak) / 3, 0, 0.03) << fine.peak;
}

// The same by axisymmetric elements that end at the contact's edge: nothing is left to extrapolate.
TEST(LayerTraction, SphereOnAxisymmetricElements) {
  for (const double poisson : {0.3, 0.485, 0.4999}) {
    SCOPED_TRACE(poisson);
    const fem::IndenterOnLayer what{.thickness_mm = kThickness_mm,
                                    .young_MPa = kYoung_MPa,
                                    .poisson = poisson,
                                    .radius_mm = 12,
                                    .large_strain = false,
                                    .cell_mm = 0.2,
                                    .reach_mm = 4};
    const auto pressed = fem::press_layer(what, {0.4});
    ASSERT_EQ(pressed.size(), 1u);
    constexpr uint32_t kAlong = 96;
    constexpr double kSide_mm = 0.25;
    const fem::SeenPress seen = fem::seen_by_camera(pressed[0], kAlong, kSide_mm);
    TractionOptions options = exact();
    options.errors = false;
    TractionSolver solver({{kYoung_MPa, poisson}, kThickness_mm}, {kAlong, kAlong, kSide_mm}, options);
    const Traction& found = solver.solve({.depth_mm = seen.depth_mm, .contact = seen.contact});
    const double peak = *std::max_element(found.pressure_MPa.begin(), found.pressure_MPa.end());
    EXPECT_NEAR(found.wrench.force_N[2], pressed[0].force_N, 0.01 * pressed[0].force_N);
    EXPECT_NEAR(peak, pressed[0].pressure_max_MPa, 0.03 * peak);
  }
}

}  // namespace
}  // namespace palpate
