// The forward model on the device against the processor's: products, cycle and whole solves.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "engine/fem/device/solver.h"
#include "engine/fem/linear/solver.h"
#include "engine/fem/solve.h"
#include "palpate/error.h"
#include "tests/support/gpu_fixture.h"

namespace palpate {
namespace {

class ForwardDeviceTest : public GpuTest {
 protected:
  static std::shared_ptr<const fem::Kernels> kernels(bool layered) {
    static std::shared_ptr<const fem::Kernels> made[2];
    if (!made[layered]) made[layered] = std::make_shared<fem::Kernels>(context(), layered);
    return made[layered];
  }
};

// Layers are of one height, or each of its own.
fem::CellGrid random_grid(std::mt19937& random, std::array<uint32_t, 3> cells, double contrast,
                          bool layered) {
  std::uniform_real_distribution<double> unit(0, 1);
  fem::CellGrid grid;
  grid.cells = cells;
  grid.size_x_mm = 0.5 + unit(random);
  grid.size_y_mm = 0.5 + unit(random);
  for (uint32_t k = 0; k < cells[2]; ++k)
    grid.size_z_mm.push_back(k == 0 || layered ? 0.5 + unit(random) : grid.size_z_mm[0]);
  for (size_t i = 0; i < grid.cell_count(); ++i)
    grid.young.push_back(static_cast<float>(std::pow(contrast, unit(random))));
  return grid;
}

template <typename Real>
std::vector<Real> random_field(std::mt19937& random, size_t n) {
  std::uniform_real_distribution<Real> either(-1, 1);
  std::vector<Real> field(n);
  for (Real& x : field) x = either(random);
  return field;
}

// The floor holds everything, here and there a node is held too.
fem::FixedNodes random_supports(std::mt19937& random, const fem::CellGrid& grid) {
  fem::FixedNodes fixed(grid.nodes());
  for (uint8_t& bits : fixed) bits = random() % 7 == 0 ? static_cast<uint8_t>(random() % 8) : 0;
  std::fill(fixed.begin() + static_cast<std::ptrdiff_t>(grid.node(0, 0, grid.cells[2])), fixed.end(),
            uint8_t{7});
  return fixed;
}

template <typename Real>
double relative(const std::vector<Real>& found, const std::vector<Real>& wanted) {
  double difference = 0, all = 0;
  for (size_t i = 0; i < wanted.size(); ++i) {
    const double d = double{found[i]} - double{wanted[i]};
    difference += d * d;
    all += double{wanted[i]} * double{wanted[i]};
  }
  return std::sqrt(difference / all);
}

const std::array<uint32_t, 3> kSizes[] = {
    {2 * 7, 2 * 5, 2 * 3}, {4, 4, 4}, {20, 4, 6}, {34, 8, 8}, {6, 14, 18}};

TEST_F(ForwardDeviceTest, ProductsAreTheProcessors) {
  std::mt19937 random(1);
  for (const auto& cells : kSizes)
    for (const bool layered : {false, true}) {
      const double poisson = layered ? 0.495 : 0.4999;
      SCOPED_TRACE(testing::Message() << cells[0] << "x" << cells[1] << "x" << cells[2] << " nu " << poisson
                                      << (layered ? " layered" : ""));
      const fem::CellGrid grid = random_grid(random, cells, 100, layered);
      const fem::FixedNodes fixed = random_supports(random, grid);
      const fem::Stiffness stiffness(grid, poisson);
      WorkTeam team(1);
      fem::DeviceSolver device(context(), grid, poisson, fixed, kernels(layered));
      const auto single = random_field<float>(random, 3 * grid.nodes());
      std::vector<float> single_wanted(single.size()), single_found(single.size());
      stiffness.apply(single.data(), single_wanted.data(), &fixed, team);
      device.apply(single.data(), single_found.data());
      EXPECT_LT(relative(single_found, single_wanted), 1e-6);
      const auto wide = random_field<double>(random, 3 * grid.nodes());
      std::vector<double> wide_wanted(wide.size()), wide_found(wide.size());
      stiffness.apply(wide.data(), wide_wanted.data(), &fixed, team);
      device.apply(wide.data(), wide_found.data());
      EXPECT_LT(relative(wide_found, wide_wanted), 1e-14);
    }
}

TEST_F(ForwardDeviceTest, CycleIsTheProcessors) {
  std::mt19937 random(2);
  for (const auto& cells : {std::array<uint32_t, 3>{16, 16, 8}, {24, 12, 12}, {40, 16, 8}})
    for (const bool layered : {false, true}) {
      const double contrast = layered ? 1e4 : 10;
      SCOPED_TRACE(testing::Message() << cells[0] << "x" << cells[1] << "x" << cells[2] << " contrast "
                                      << contrast << (layered ? " layered" : ""));
      const double poisson = 0.45;
      const fem::CellGrid grid = random_grid(random, cells, contrast, layered);
      const fem::FixedNodes fixed = random_supports(random, grid);
      auto residual = random_field<float>(random, 3 * grid.nodes());
      for (size_t i = 0; i < residual.size(); ++i)
        if ((fixed[i % grid.nodes()] >> (i / grid.nodes()) & 1) != 0) residual[i] = 0;
      WorkTeam team(1);
      fem::Multigrid multigrid(grid, poisson, fixed, team);
      fem::DeviceSolver device(context(), grid, poisson, fixed, kernels(layered));
      std::vector<float> wanted(residual.size()), found(residual.size());
      multigrid.precondition(residual.data(), wanted.data());
      device.precondition(residual.data(), found.data());
      EXPECT_LT(relative(found, wanted), 2e-5);
    }
}

class ForwardDeviceSolve : public ForwardDeviceTest, public testing::WithParamInterface<double> {};
INSTANTIATE_TEST_SUITE_P(Poisson, ForwardDeviceSolve, testing::Values(0.45, 0.495, 0.499));

TEST_P(ForwardDeviceSolve, IsTheProcessors) {
  const double poisson = GetParam();
  for (const double ratio : {0.1, 10.0, 1e4}) {
    SCOPED_TRACE(testing::Message() << "nu " << poisson << " E_r " << ratio);
    fem::Scene scene;
    scene.cells = {16, 16, 8};
    scene.poisson = poisson;
    scene.inclusion->stiffness_ratio = ratio;
    const fem::CellGrid grid = voxelise(scene, false);
    const size_t nodes = grid.nodes(), top = grid.node(0, 0, 1);
    fem::FixedNodes fixed(nodes);
    std::vector<double> wanted(3 * nodes), load(3 * nodes);
    for (size_t n = 0; n < top; ++n) {
      fixed[n] = fem::kFixedZ;
      wanted[2 * nodes + n] = 1;
    }
    std::fill(fixed.begin() + static_cast<std::ptrdiff_t>(grid.node(0, 0, grid.cells[2])), fixed.end(),
              uint8_t{7});
    std::vector<double> found = wanted;
    WorkTeam team(1);
    fem::Solver processor(grid, poisson, fixed, team);
    fem::DeviceSolver device(context(), grid, poisson, fixed, kernels(false));
    const fem::SolveStatistics one = processor.solve(load, wanted, 1e-8, 2000);
    const fem::SolveStatistics other = device.solve(load, found, 1e-8, 2000);
    EXPECT_TRUE(one.converged);
    EXPECT_TRUE(other.converged);
    EXPECT_LE(other.residual, 1e-8);
    // Rounding of the single precision cycle moves the count: by 2 of 88 at nu 0.499, by some tenths where
    // stiffness jumps by 1e4.
    EXPECT_NEAR(one.iterations, other.iterations,
                std::max(1.0, (ratio <= 10 ? 0.04 : 0.25) * one.iterations));
    std::vector<double> forces, other_forces;
    processor.forces(wanted, forces);
    processor.forces(found, other_forces);
    double sum = 0, other_sum = 0, largest = 0, difference = 0;
    for (size_t n = 2 * nodes; n < 2 * nodes + top; ++n) {
      sum += forces[n];
      other_sum += other_forces[n];
      largest = std::max(largest, std::abs(forces[n]));
      difference = std::max(difference, std::abs(forces[n] - other_forces[n]));
    }
    EXPECT_NEAR(other_sum / sum, 1, 1e-6);
    EXPECT_LT(difference, 1e-6 * largest);
  }
}

TEST_F(ForwardDeviceTest, SaysWhereItDidNotConverge) {
  std::mt19937 random(3);
  const fem::CellGrid grid = random_grid(random, {8, 8, 8}, 1e4, true);
  fem::FixedNodes fixed(grid.nodes());
  std::fill(fixed.begin() + static_cast<std::ptrdiff_t>(grid.node(0, 0, 8)), fixed.end(), uint8_t{7});
  const auto load = random_field<double>(random, 3 * grid.nodes());
  std::vector<double> u(load.size());
  fem::DeviceSolver device(context(), grid, 0.4999, fixed, kernels(true));
  const fem::SolveStatistics statistics = device.solve(load, u, 1e-8, 3);
  EXPECT_FALSE(statistics.converged);
  EXPECT_GT(statistics.residual, 1e-8);
  EXPECT_EQ(statistics.iterations, 3u);
  // No load, nothing held out of its place: nothing to do.
  const std::vector<double> none(load.size());
  std::fill(u.begin(), u.end(), 0.0);
  const fem::SolveStatistics rest = device.solve(none, u, 1e-8, 100);
  EXPECT_TRUE(rest.converged);
  EXPECT_EQ(rest.iterations, 0u);
  EXPECT_EQ(u, none);
}

TEST_F(ForwardDeviceTest, RefusesWhatDoesNotFit) {
  const auto refusal = [&](std::array<uint32_t, 3> cells) {
    fem::CellGrid grid;
    grid.cells = cells;
    grid.size_x_mm = grid.size_y_mm = 1;
    grid.size_z_mm.assign(cells[2], 1);
    grid.young.assign(grid.cell_count(), 1);
    try {
      fem::DeviceSolver device(context(), grid, 0.3, fem::FixedNodes(grid.nodes(), 7), kernels(false));
    } catch (const Error& error) {
      EXPECT_EQ(error.failure(), Failure::Device);
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(refusal({62, 62, 30}),
              testing::HasSubstr("31 x 31 x 15 cells with 49152 unknowns, more than 1500"));
  EXPECT_THAT(refusal({5, 4, 4}),
              testing::HasSubstr("a grid of 5 x 4 x 4 cells, too small or odd to be halved"));
  EXPECT_EQ(refusal({16, 16, 8}), "");
}

// Scenes as a whole: the ball's contact makes a solver for each change of its supports.
TEST_F(ForwardDeviceTest, ScenesAreTheProcessors) {
  fem::Scene plate;
  plate.cells = {16, 16, 8};
  plate.pad = {{2, 34000}};
  fem::Scene ball;
  ball.cells = {16, 16, 8};
  ball.presser = fem::Presser::Sphere;
  ball.ball_radius_mm = 20;
  for (const fem::Scene& scene : {plate, ball}) {
    fem::Options options;
    options.threads = 1;
    const fem::Result wanted = fem::solve(scene, options);
    options.worker = fem::Worker::Device;
    options.device = [] { return &context(); };
    const fem::Result found = fem::solve(scene, options);
    ASSERT_TRUE(wanted.converged && found.converged);
    EXPECT_EQ(wanted.solver, "processor");
    EXPECT_EQ(found.solver, context().report().name);
    EXPECT_NEAR(found.force_N / wanted.force_N, 1, 1e-5);
    EXPECT_EQ(found.contact_radius_mm, wanted.contact_radius_mm);
    ASSERT_EQ(found.stress_Pa.values.size(), wanted.stress_Pa.values.size());
    for (size_t i = 0; i < wanted.stress_Pa.values.size(); ++i)
      ASSERT_NEAR(found.stress_Pa.values[i], wanted.stress_Pa.values[i], 1e-4 * wanted.center_stress_Pa) << i;
  }
}

TEST_F(ForwardDeviceTest, AutoTriesBothOrSaysWhyNot) {
  using testing::HasSubstr;
  const auto who = [](fem::Scene scene, const std::function<gpu::Context*()>& device) {
    scene.block_mm = {40, 40, 40.0 * scene.cells[2] / scene.cells[0]};
    scene.inclusion.reset();
    fem::Options options;
    options.quarter = false;
    options.worker = fem::Worker::Auto;
    options.device = device;
    options.residual = 1e-2;
    const fem::Result result = fem::solve(scene, options);
    EXPECT_TRUE(result.converged);
    return result.solver;
  };
  fem::Scene scene;
  const auto here = [] { return &context(); };
  const auto nowhere = []() -> gpu::Context* {
    throw Error(Failure::Device, "a card", "an empty slot", "buying one");
  };
  scene.cells = {64, 64, 16};
  const std::string tried = who(scene, here);
  EXPECT_THAT(tried, HasSubstr(" ms an iteration; "));
  EXPECT_THAT(tried, HasSubstr("processor"));
  EXPECT_THAT(tried, HasSubstr(context().report().name));
  EXPECT_EQ(who(scene, nowhere),
            "processor (device passed over: wanted a card; found an empty slot; try buying one)");
  EXPECT_EQ(who(scene, nullptr), "processor (device passed over: none given)");
  scene.cells = {52, 52, 24};
  EXPECT_THAT(who(scene, here), HasSubstr("passed over: a coarsest grid of 13 x 13 x 6 cells"));
  scene.cells = {16, 16, 8};
  EXPECT_EQ(who(scene, here), "processor (device passed over: 2601 nodes, fewer than 60000)");

  fem::Options insisting;
  insisting.worker = fem::Worker::Device;
  EXPECT_THROW(fem::solve(scene, insisting), Error);
  insisting.device = nowhere;
  EXPECT_THROW(fem::solve(scene, insisting), Error);
}

}  // namespace
}  // namespace palpate
