// The forward model against CalculiX: the same blocks, other elements (20 nodes, reduced integration), other
// cells around the lump and another solver.
#include "tests/support/calculix.h"

#include <gtest/gtest.h>

#include "engine/fem/large_strain/extrapolation.h"
#include "engine/tissue/map_sampling.h"

namespace palpate {
namespace {

class Calculix : public testing::TestWithParam<const char*> {};

// On the grids that data sets have.
TEST_P(Calculix, ForceAndMapOfAPressAreTheSame) {
  CalculixCase block = calculix_case(GetParam());
  block.scene.cells = {48, 48, 24};
  fem::LargeStrainOptions options;
  options.residual = 1e-5;
  options.step_mm = 2;
  options.map_nodes = {33, 33};
  std::vector<fem::PressLoad> loads;
  for (const CalculixCase::Load& load : block.loads) loads.push_back({load.press_mm, std::nullopt});
  const fem::LargeStrainResult pressed = solve_extrapolated(block.scene, loads, options);
  ASSERT_TRUE(pressed.converged);
  for (size_t l = 0; l < loads.size(); ++l) {
    const fem::PressedBlock& ours = pressed.loads[l];
    const CalculixCase::Load& theirs = block.loads[l];
    const PressureMap wanted = without_rim(theirs.pressure_Pa),
                      found =
                          node_means(ours.pressure_Pa, {0, 0},
                                     {block.scene.block_mm[0], block.scene.block_mm[1]}, wanted.pitch_mm[0]);
    ASSERT_EQ(found.values.size(), wanted.values.size());
    double squares = 0, most = 0;
    const double peak = double{*std::max_element(wanted.values.begin(), wanted.values.end())};
    for (size_t n = 0; n < wanted.values.size(); ++n) {
      const double off = double{found.values[n]} - double{wanted.values[n]};
      squares += off * off;
      most = std::max(most, std::abs(off));
    }
    const double rms = std::sqrt(squares / static_cast<double>(wanted.values.size())) / peak;
    const double force = ours.force_N / theirs.force_N - 1;
    RecordProperty("load_" + std::to_string(l + 1),
                   "force " + std::to_string(100 * force) + " %, map " + std::to_string(100 * rms) +
                       " % (RMS), " + std::to_string(100 * most / peak) + " % (most) of the peak");
    EXPECT_LT(std::abs(force), 0.005) << loads[l].press_mm.value_or(0);
    EXPECT_LT(rms, 0.004) << loads[l].press_mm.value_or(0) << ' ' << most / peak;
  }
}

INSTANTIATE_TEST_SUITE_P(Blocks, Calculix,
                         testing::Values("plain", "small_ball", "cylinder", "deep_ellipsoid"),
                         [](const auto& block) { return std::string(block.param); });

}  // namespace
}  // namespace palpate
