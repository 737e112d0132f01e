// The forward model's equations: product, cycle and solver against the plain assembled matrix.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>

#include "engine/fem/linear/solver.h"
#include "engine/fem/linear/transfer.h"
#include "palpate/error.h"
#include "tests/reference/forward.h"

namespace palpate {
namespace {

fem::CellGrid random_cells(std::mt19937& random, std::array<uint32_t, 3> cells, double contrast) {
  std::uniform_real_distribution<double> unit(0, 1);
  fem::CellGrid grid;
  grid.cells = cells;
  grid.size_x_mm = 0.5 + unit(random);
  grid.size_y_mm = 0.5 + unit(random);
  for (uint32_t k = 0; k < cells[2]; ++k) grid.size_z_mm.push_back(0.5 + unit(random));
  for (size_t i = 0; i < grid.cell_count(); ++i)
    grid.young.push_back(static_cast<float>(std::pow(contrast, unit(random))));
  return grid;
}

std::vector<double> random_nodes(std::mt19937& random, size_t n) {
  std::uniform_real_distribution<double> either(-1, 1);
  std::vector<double> field(n);
  for (double& x : field) x = either(random);
  return field;
}

double norm(const std::vector<double>& a) {
  double sum = 0;
  for (const double x : a) sum += x * x;
  return std::sqrt(sum);
}

double relative_error(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(sum) / norm(b);
}

TEST(ForwardOperator, ElementIsTheDefinitions) {
  for (const double poisson : {0.0, 0.3, 0.4999}) {
    const std::array<double, 3> size = {0.7, 1.1, 0.4};
    const auto wanted = reference::brick(size, poisson);
    const auto found = fem::element_matrix(size, poisson);
    for (size_t a = 0; a < 24; ++a)
      for (size_t b = 0; b < 24; ++b)
        ASSERT_NEAR(found[24 * a + b], wanted[a][b], 1e-12 * wanted[a][a]) << poisson << " " << a << " " << b;
  }
}

TEST(ForwardOperator, ProductIsThatOfTheAssembledMatrix) {
  std::mt19937 random(1);
  // More than one chunk of a row, one cell only, odd and even sides, more threads than planes.
  const std::array<uint32_t, 3> sizes[] = {{7, 5, 6}, {1, 1, 1}, {131, 2, 3}, {128, 1, 2}, {16, 9, 2}};
  for (const auto& cells : sizes)
    for (const double poisson : {0.0, 0.3, 0.495, 0.4999})
      for (const uint32_t threads : {1u, 2u, 5u}) {
        SCOPED_TRACE(testing::Message() << cells[0] << "x" << cells[1] << "x" << cells[2] << " nu " << poisson
                                        << " threads " << threads);
        const fem::CellGrid grid = random_cells(random, cells, 100);
        WorkTeam team(threads);
        const fem::Stiffness stiffness(grid, poisson);
        const std::vector<double> u = random_nodes(random, 3 * grid.nodes());
        const std::vector<double> wanted = reference::ForwardEquations(grid, poisson).forces(u);
        std::vector<double> found(u.size());
        stiffness.apply(u.data(), found.data(), nullptr, team);
        EXPECT_LT(relative_error(found, wanted), 1e-12);
        const std::vector<float> single(u.begin(), u.end());
        std::vector<float> found_single(u.size());
        stiffness.apply(single.data(), found_single.data(), nullptr, team);
        EXPECT_LT(relative_error({found_single.begin(), found_single.end()}, wanted), 2e-6);
        // The layers one by one sum to the whole.
        std::vector<double> part(u.size()), sum(u.size());
        for (uint32_t k = 0; k < cells[2]; ++k) {
          stiffness.apply_layers(u.data(), part.data(), k, k + 1);
          for (size_t n = 0; n < sum.size(); ++n) sum[n] += part[n];
        }
        EXPECT_LT(relative_error(sum, wanted), 1e-12);
      }
}

TEST(ForwardOperator, FixedDisplacementsHaveNoForce) {
  std::mt19937 random(2);
  const fem::CellGrid grid = random_cells(random, {5, 4, 3}, 10);
  const size_t nodes = grid.nodes();
  fem::FixedNodes fixed(nodes);
  for (uint8_t& bits : fixed) bits = static_cast<uint8_t>(random() % 8);
  WorkTeam team(2);
  const fem::Stiffness stiffness(grid, 0.495);
  const std::vector<double> u = random_nodes(random, 3 * nodes);
  std::vector<double> all(u.size()), kept(u.size());
  stiffness.apply(u.data(), all.data(), nullptr, team);
  stiffness.apply(u.data(), kept.data(), &fixed, team);
  for (size_t n = 0; n < u.size(); ++n)
    EXPECT_EQ(kept[n], (fixed[n % nodes] >> (n / nodes) & 1) != 0 ? 0 : all[n]) << n;
}

// No eigenvalue of the scaled matrix lies above the element's bound, and a homogeneous grid comes near it.
TEST(ForwardOperator, BoundHolds) {
  std::mt19937 random(3);
  for (const double poisson : {0.0, 0.3, 0.495, 0.4999})
    for (const double contrast : {1.0, 1e4}) {
      fem::CellGrid grid = random_cells(random, {4, 4, 4}, contrast);
      grid.size_z_mm.assign(4, grid.size_z_mm[0]);
      const fem::Stiffness stiffness(grid, poisson);
      const auto nodes = static_cast<int>(grid.nodes());
      const std::vector<float> inverse = stiffness.inverse_blocks(fem::FixedNodes(grid.nodes()));
      Eigen::VectorXd x = Eigen::VectorXd::Random(3 * nodes);
      WorkTeam team(1);
      double largest = 0;
      for (int step = 0; step < 300; ++step) {
        Eigen::VectorXd f(3 * nodes), y(3 * nodes);
        stiffness.apply(x.data(), f.data(), nullptr, team);
        const int row[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};
        for (int n = 0; n < nodes; ++n)
          for (int a = 0; a < 3; ++a) {
            y(a * nodes + n) = 0;
            for (int b = 0; b < 3; ++b)
              y(a * nodes + n) += double{inverse[row[a][b] * nodes + n]} * f(b * nodes + n);
          }
        largest = y.norm() / x.norm();
        x = y / y.norm();
      }
      const double bound = fem::element_bound(stiffness.cell_size_mm(0), poisson);
      EXPECT_LT(largest, bound * (1 + 1e-5)) << poisson << " " << contrast;
      if (contrast == 1) {
        EXPECT_GT(largest, 0.8 * bound) << poisson;
      }
    }
}

// <P c, f> = <c, P^T f>, and a linear field is carried over exactly, also between layers of unequal height.
class ForwardTransfer : public testing::TestWithParam<std::optional<uint32_t>> {};
INSTANTIATE_TEST_SUITE_P(Slits, ForwardTransfer, testing::Values(std::nullopt, 1u, 2u, 4u));
TEST_P(ForwardTransfer, UpIsTheTransposeOfDown) {
  std::mt19937 random(4);
  fem::CellGrid fine = random_cells(random, {8, 6, GetParam() ? *GetParam() + 5 : 4}, 10);
  fine.slit = GetParam();
  if (fine.slit) fine.size_z_mm[*fine.slit] = 0;
  const fem::CellGrid coarse = halve(fine).value();
  fem::FixedNodes fixed(fine.nodes());
  for (uint8_t& bits : fixed) bits = random() % 5 == 0 ? static_cast<uint8_t>(random() % 8) : 0;
  if (fine.slit)  // both sides share what is along z
    for (size_t at = fine.node(0, 0, *fine.slit); at < fine.node(0, 0, *fine.slit + 1); ++at)
      fixed[at + fine.node(0, 0, 1)] = fixed[at];
  const fem::FixedNodes coarse_fixed = halve(fine, coarse, fixed);
  const size_t n = fine.nodes(), m = coarse.nodes();
  std::vector<float> f(3 * n), c(3 * m), up(3 * n), down(3 * m);
  std::uniform_real_distribution<float> either(-1, 1);
  for (size_t i = 0; i < 3 * n; ++i) f[i] = (fixed[i % n] >> (i / n) & 1) != 0 ? 0.0f : either(random);
  for (size_t i = 0; i < 3 * m; ++i) c[i] = (coarse_fixed[i % m] >> (i / m) & 1) != 0 ? 0.0f : either(random);
  share_across_slit(coarse, c.data());
  WorkTeam team(2);
  prolong_add(fine, coarse, fixed, c.data(), up.data(), team);
  restrict_to(fine, coarse, coarse_fixed, f.data(), down.data(), team);
  double a = 0, b = 0;
  for (size_t i = 0; i < 3 * n; ++i) a += double{up[i]} * double{f[i]};
  for (size_t i = 0; i < 3 * m; ++i) b += double{down[i]} * double{c[i]};
  EXPECT_NEAR(a, b, 1e-5 * std::abs(a));

  const auto linear = [](const fem::CellGrid& grid, uint32_t i, uint32_t j, uint32_t k) {
    double z = 0;
    for (uint32_t layer = 0; layer < k; ++layer) z += grid.size_z_mm[layer];
    return static_cast<float>(1 + 2 * i * grid.size_x_mm - 3 * j * grid.size_y_mm + 5 * z);
  };
  for (size_t component = 0; component < 3; ++component)
    for (uint32_t k = 0; k <= coarse.cells[2]; ++k)
      for (uint32_t j = 0; j <= coarse.cells[1]; ++j)
        for (uint32_t i = 0; i <= coarse.cells[0]; ++i)
          c[component * m + coarse.node(i, j, k)] = linear(coarse, i, j, k);
  std::fill(up.begin(), up.end(), 0.0f);
  prolong_add(fine, coarse, fem::FixedNodes(n), c.data(), up.data(), team);
  for (uint32_t k = 0; k <= fine.cells[2]; ++k)
    for (uint32_t j = 0; j <= fine.cells[1]; ++j)
      for (uint32_t i = 0; i <= fine.cells[0]; ++i)
        EXPECT_NEAR(up[2 * n + fine.node(i, j, k)], linear(fine, i, j, k), 1e-4) << i << " " << j << " " << k;
}

TEST(ForwardSolver, FindsWhatTheDirectSolveFinds) {
  std::mt19937 random(5);
  for (const double poisson : {0.0, 0.3, 0.495, 0.4999})
    for (const double contrast : {1.0, 10.0, 100.0}) {
      SCOPED_TRACE(testing::Message() << "nu " << poisson << " contrast " << contrast);
      fem::CellGrid grid = random_cells(random, {8, 12, 8}, contrast);
      const size_t nodes = grid.nodes();
      fem::FixedNodes fixed(nodes);
      std::vector<double> load = random_nodes(random, 3 * nodes), u(3 * nodes), wanted(3 * nodes);
      for (uint32_t j = 0; j <= grid.cells[1]; ++j)
        for (uint32_t i = 0; i <= grid.cells[0]; ++i) {
          fixed[grid.node(i, j, grid.cells[2])] = 7;
          const size_t top = grid.node(i, j, 0);
          fixed[top] |= fem::kFixedZ;
          u[2 * nodes + top] = wanted[2 * nodes + top] = 0.1 * static_cast<double>(i) - 0.3;
        }
      reference::ForwardEquations(grid, poisson).solve(fixed, load, wanted);
      WorkTeam team(2);
      fem::Solver solver(grid, poisson, fixed, team);
      const fem::SolveStatistics statistics = solver.solve(load, u, 1e-10, 4000);
      EXPECT_TRUE(statistics.converged) << statistics.residual << " after " << statistics.iterations;
      EXPECT_LT(relative_error(u, wanted), 1e-6) << statistics.iterations;
    }
}

// A block of three layers slides on one of eight; the upper one is thin, so that it cannot be halved upright.
TEST(ForwardSolver, SlitIsTheDirectSolves) {
  std::mt19937 random(6);
  for (const double poisson : {0.3, 0.495})
    for (const double contrast : {1.0, 30.0}) {
      SCOPED_TRACE(testing::Message() << "nu " << poisson << " contrast " << contrast);
      fem::CellGrid grid = random_cells(random, {8, 12, 12}, contrast);
      constexpr uint32_t kSlit = 3;
      grid.slit = kSlit;
      grid.size_z_mm[kSlit] = 0;
      std::fill_n(grid.young.begin() + static_cast<std::ptrdiff_t>(grid.cell(0, 0, kSlit)), 8 * 12, 0.0f);
      const size_t nodes = grid.nodes(), plane = 9 * 13;
      fem::FixedNodes fixed(nodes);
      std::vector<double> load = random_nodes(random, 3 * nodes), u(3 * nodes), wanted(3 * nodes);
      for (size_t n = 0; n < plane; ++n) {
        fixed[n] = fixed[nodes - 1 - n] = fem::kFixedAll;
        u[2 * nodes + n] = wanted[2 * nodes + n] = 0.1;
      }
      reference::ForwardEquations(grid, poisson).solve(fixed, load, wanted);
      // Each side of the slit gets half of what the other is loaded with.
      double* shared = load.data() + 2 * nodes + kSlit * plane;
      for (size_t n = 0; n < plane; ++n) shared[n] = shared[plane + n] = (shared[n] + shared[plane + n]) / 2;
      WorkTeam team(2);
      fem::Solver solver(grid, poisson, fixed, team);
      const fem::SolveStatistics statistics = solver.solve(load, u, 1e-10, 400);
      EXPECT_TRUE(statistics.converged) << statistics.residual << " after " << statistics.iterations;
      EXPECT_LT(relative_error(u, wanted), 1e-6) << statistics.iterations;
      EXPECT_GT(std::abs(u[kSlit * plane + 60] - u[(kSlit + 1) * plane + 60]), 1e-6);
    }
}

TEST(ForwardSolver, SaysWhereItDidNotConverge) {
  std::mt19937 random(6);
  const fem::CellGrid grid = random_cells(random, {8, 8, 8}, 1e4);
  fem::FixedNodes fixed(grid.nodes());
  for (size_t n = grid.node(0, 0, 8); n < grid.nodes(); ++n) fixed[n] = 7;
  const std::vector<double> load = random_nodes(random, 3 * grid.nodes());
  std::vector<double> u(load.size());
  WorkTeam team(1);
  fem::Solver solver(grid, 0.4999, fixed, team);
  const fem::SolveStatistics statistics = solver.solve(load, u, 1e-8, 3);
  EXPECT_FALSE(statistics.converged);
  EXPECT_GT(statistics.residual, 1e-8);
  EXPECT_LE(statistics.iterations, 3u);
}

TEST(ForwardSolver, RefusesWhatItCannotHalve) {
  fem::CellGrid grid;
  grid.cells = {31, 31, 31};
  grid.size_x_mm = grid.size_y_mm = 1;
  grid.size_z_mm.assign(31, 1);
  grid.young.assign(grid.cell_count(), 1);
  WorkTeam team(1);
  EXPECT_THROW(fem::Solver(grid, 0.3, fem::FixedNodes(grid.nodes(), 7), team), Error);
}

}  // namespace
}  // namespace palpate
