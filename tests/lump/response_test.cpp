// What finite elements answer to a reading's forces, on several grids.
#include "engine/lump/fem_inverse/response.h"

#include <gtest/gtest.h>

#include <cmath>

namespace palpate {
namespace {

LumpReading empty_reading() {
  LumpReading reading;
  reading.block_mm = {40, 40, 20};
  reading.young_Pa = 4000;
  reading.force_N = {1};
  reading.pressure_Pa.resize(1);
  ForwardMap& map = reading.pressure_Pa[0];
  map.width = map.height = 25;
  map.pitch_mm = {1.25, 1.25};
  map.values.assign(size_t{25} * 25, 0);
  return reading;
}

LumpCase::Lump ball() {
  LumpCase::Lump lump;
  lump.diameter_mm = 8;
  lump.depth_mm = 4;
  lump.stiffness_ratio = 8;
  return lump;
}

LumpResponseOptions on(std::vector<uint32_t> grids) {
  LumpResponseOptions options;
  options.cells = {12, 12, 6};
  options.grids = std::move(grids);
  options.searched = options.grids[0];
  options.centred = true;
  options.residual = 1e-6;
  return options;
}

TEST(LumpResponse, MoreGridsAreNearerToCellsOfNoSize) {
  const LumpReading reading = empty_reading();
  const ComparedNodes nodes(reading, 4);
  const auto without_size = [&](const LumpResponseOptions& options) -> Eigen::VectorXd {
    const FittedLump lump{ball(), response_cells(reading, ball(), options)};
    const LumpPrediction prediction = predict(nodes, lump, options, false);
    const GridCorrection grids = grid_correction(nodes, lump, options);
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
  const LumpReading reading = empty_reading();
  const ComparedNodes nodes(reading, 4);
  const auto sum = [&](uint32_t searched) -> Eigen::VectorXd {
    LumpResponseOptions options = on({1, 2});
    options.searched = searched;
    const FittedLump lump{ball(), response_cells(reading, ball(), options)};
    return predict(nodes, lump, options, false).pressure_Pa + grid_correction(nodes, lump, options).add_Pa;
  };
  const Eigen::VectorXd a = sum(1), b = sum(2);
  EXPECT_LT((a - b).cwiseAbs().maxCoeff(), 1e-3 * a.maxCoeff());
  EXPECT_GT(a.maxCoeff(), 600);
}

}  // namespace
}  // namespace palpate
