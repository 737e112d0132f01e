// Response of finite elements to an observation's forces, on several grids.
#include "engine/lump/fem_inverse/response.h"

#include <gtest/gtest.h>

#include <cmath>

namespace palpate {
namespace {

lump::Observation empty_observation() {
  lump::Observation observation;
  observation.block_mm = {40, 40, 20};
  observation.young_Pa = 4000;
  observation.force_N = {1};
  observation.pressure_Pa.resize(1);
  PressureMap& map = observation.pressure_Pa[0];
  map.width = map.height = 25;
  map.pitch_mm = {1.25, 1.25};
  map.values.assign(size_t{25} * 25, 0);
  return observation;
}

lump::Case::Lump ball() {
  lump::Case::Lump lump;
  lump.diameter_mm = 8;
  lump.depth_mm = 4;
  lump.stiffness_ratio = 8;
  return lump;
}

lump::ResponseOptions on(std::vector<uint32_t> grids) {
  lump::ResponseOptions options;
  options.cells = {12, 12, 6};
  options.grids = std::move(grids);
  options.searched = options.grids[0];
  options.centred = true;
  options.residual = 1e-6;
  return options;
}

TEST(LumpResponse, MoreGridsAreNearerToCellsOfNoSize) {
  const lump::Observation observation = empty_observation();
  const lump::ComparedNodes nodes(observation, 4);
  const auto without_size = [&](const lump::ResponseOptions& options) -> Eigen::VectorXd {
    const lump::FittedLump lump{ball(), response_cells(observation, ball(), options)};
    const lump::Prediction prediction = predict(nodes, lump, options, false);
    const lump::GridCorrection grids = grid_correction(nodes, lump, options);
    EXPECT_TRUE(prediction.converged && grids.converged);
    return prediction.pressure_Pa + grids.add_Pa;
  };
  const Eigen::VectorXd truth = without_size(on({2, 3, 4}));
  const double one = (without_size(on({2})) - truth).norm(), two = (without_size(on({1, 2})) - truth).norm(),
               three = (without_size(on({1, 2, 3})) - truth).norm();
  EXPECT_LT(two, 0.6 * one);
  EXPECT_LT(three, 0.5 * two);
}

TEST(LumpResponse, WhichGridIsSearchedDoesNotChangeTheSum) {
  const lump::Observation observation = empty_observation();
  const lump::ComparedNodes nodes(observation, 4);
  const auto sum = [&](uint32_t searched) -> Eigen::VectorXd {
    lump::ResponseOptions options = on({1, 2});
    options.searched = searched;
    const lump::FittedLump lump{ball(), response_cells(observation, ball(), options)};
    return predict(nodes, lump, options, false).pressure_Pa + grid_correction(nodes, lump, options).add_Pa;
  };
  const Eigen::VectorXd a = sum(1), b = sum(2);
  EXPECT_LT((a - b).cwiseAbs().maxCoeff(), 1e-3 * a.maxCoeff());
  EXPECT_GT(a.maxCoeff(), 600);
}

}  // namespace
}  // namespace palpate
