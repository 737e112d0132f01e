// The forward model's solver against Eshelby's sphere.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "engine/fem/linear/solver.h"
#include "engine/fem/solve.h"
#include "tests/fem/cube_grid.h"

namespace palpate {
namespace {

/// A sphere in an endless body under uniaxial stress of 1 along z (Eshelby 1957), moduli relative to the
/// body's; outside, the field of its equivalent eigenstrain (Mura 1987, Eq. 11.30 with the sphere's
/// potentials).
struct Eshelby {
  double nu, radius;
  std::array<double, 3> far{}, inside{}, eigen{};  ///< normal strains

  Eshelby(double poisson, double ratio, double radius_) : nu(poisson), radius(radius_) {
    const double alpha = (1 + nu) / (3 * (1 - nu)), beta = 2 * (4 - 5 * nu) / (15 * (1 - nu));
    const double volume = 1 / (1 + alpha * (ratio - 1)), shape = 1 / (1 + beta * (ratio - 1));
    for (size_t c = 0; c < 3; ++c) {
      far[c] = c == 2 ? 1 : -nu;
      const double mean = (1 - 2 * nu) / 3, rest = far[c] - mean;
      inside[c] = shape * rest + volume * mean;
      eigen[c] = (shape - 1) * rest / beta + (volume - 1) * mean / alpha;
    }
  }

  std::array<double, 3> displacement(const std::array<double, 3>& x) const {
    const double r2 = x[0] * x[0] + x[1] * x[1] + x[2] * x[2], r = std::sqrt(r2);
    std::array<double, 3> u{};
    for (size_t i = 0; i < 3; ++i) {
      u[i] = inside[i] * x[i];
      if (r <= radius) continue;
      double third = 0;  // of the biharmonic potential r + a^2 / (5 r)
      for (size_t j = 0; j < 3; ++j) {
        const double sum = x[i] + (i == j ? 2 * x[j] : 0), product = x[i] * x[j] * x[j];
        const double of_r = -sum / (r2 * r) + 3 * product / (r2 * r2 * r);
        const double of_inverse = -15 * product / (r2 * r2 * r2 * r) + 3 * sum / (r2 * r2 * r);
        third += eigen[j] * (of_r + radius * radius / 5 * of_inverse);
      }
      const double slope = -x[i] / (r2 * r), trace = eigen[0] + eigen[1] + eigen[2];
      const double volume = 4 * std::numbers::pi / 3 * radius * radius * radius;
      u[i] = far[i] * x[i] + volume * (third - 2 * nu * trace * slope - 4 * (1 - nu) * eigen[i] * slope) /
                                 (8 * std::numbers::pi * (1 - nu));
    }
    return u;
  }
};

TEST(Forward, EshelbysFieldIsContinuous) {
  const Eshelby truth(0.495, 10, 2);
  EXPECT_NEAR(truth.inside[2], 0.215890518, 1e-9);  // golden numbers
  // Stress inside, 10 times its own strain's by Hooke.
  const double trace = truth.inside[0] + truth.inside[1] + truth.inside[2];
  const auto stress = [&](size_t c) {
    return 10 / 1.495 * (truth.inside[c] + 0.495 / (1 - 2 * 0.495) * trace);
  };
  EXPECT_NEAR(stress(2), 1.779168616, 1e-8);
  EXPECT_NEAR(stress(0), -0.383572284, 1e-8);
  const std::array<double, 3> rim = {0.8, 1.2, std::sqrt(4 - 0.64 - 1.44)};
  const auto out = truth.displacement({rim[0] * 1.0000001, rim[1] * 1.0000001, rim[2] * 1.0000001});
  for (size_t c = 0; c < 3; ++c) EXPECT_NEAR(out[c], truth.inside[c] * rim[c], 1e-6);
}

// An eighth of Eshelby's sphere in a block three radii wide, its exact displacement on the outer faces:
// strain in the core, which is uniform in truth, as the mean over the inner 60 % of the radius. The error is
// of first order in the cells: half as large at 16 to the radius.
TEST(Forward, EshelbysSphere) {
  for (const double ratio : {10.0, 1e4}) {
    constexpr uint32_t n = 24;
    constexpr double nu = 0.495, radius = 8;
    const Eshelby truth(nu, ratio, radius);
    fem::CellGrid grid = cube(n, 1);
    for (uint32_t k = 0; k < n; ++k)
      for (uint32_t j = 0; j < n; ++j)
        for (uint32_t i = 0; i < n; ++i) {
          const std::array<double, 3> low = {1.0 * i, 1.0 * j, 1.0 * k};
          const double inside =
              fem::share_inside(InclusionShape::Sphere, {2 * radius, 2 * radius, 2 * radius}, low,
                                {low[0] + 1, low[1] + 1, low[2] + 1});
          grid.young[grid.cell(i, j, k)] = static_cast<float>(fem::mixed_modulus(inside, ratio));
        }
    const size_t nodes = grid.nodes();
    fem::FixedNodes fixed(nodes);
    std::vector<double> u(3 * nodes);
    for (uint32_t k = 0; k <= n; ++k)
      for (uint32_t j = 0; j <= n; ++j)
        for (uint32_t i = 0; i <= n; ++i) {
          const size_t at = grid.node(i, j, k);
          const bool outer = i == n || j == n || k == n;
          fixed[at] = static_cast<uint8_t>(outer ? fem::kFixedAll
                                                 : (i == 0 ? fem::kFixedX : 0) | (j == 0 ? fem::kFixedY : 0) |
                                                       (k == 0 ? fem::kFixedZ : 0));
          const auto exact = truth.displacement({1.0 * i, 1.0 * j, 1.0 * k});
          for (size_t c = 0; c < 3; ++c) u[c * nodes + at] = exact[c];
        }
    WorkTeam team(0);
    fem::Solver solver(grid, nu, fixed, team);
    ASSERT_TRUE(solver.solve(std::vector<double>(3 * nodes), u, 1e-7, 2000).converged);
    double sum = 0;
    int cells = 0;
    for (uint32_t k = 0; k < n; ++k)
      for (uint32_t j = 0; j < n; ++j)
        for (uint32_t i = 0; i < n; ++i) {
          if (std::hypot(i + 0.5, j + 0.5, k + 0.5) > 0.6 * radius) continue;
          for (uint32_t corner = 0; corner < 4; ++corner) {
            const uint32_t x = i + (corner & 1), y = j + (corner >> 1);
            sum += (u[2 * nodes + grid.node(x, y, k + 1)] - u[2 * nodes + grid.node(x, y, k)]) / 4;
          }
          ++cells;
        }
    EXPECT_NEAR(sum / cells, truth.inside[2], 0.02 * truth.inside[2]) << ratio;
  }
}

}  // namespace
}  // namespace palpate
