// Response of finite elements to an observation's forces, on several grids.

#include <gtest/gtest.h>

#include <cmath>

#include "engine/lump/fem_inverse/effort.h"
#include "engine/lump/fem_inverse/grid_series.h"
#include "engine/lump/fem_inverse/prediction.h"

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

/// Of cells of no size.
Eigen::VectorXd pressure_Pa(const std::optional<lump::GridAnswer>& answer) {
  return answer ? Eigen::VectorXd(answer->searched_Pa + answer->correction.add_Pa) : Eigen::VectorXd();
}

std::optional<lump::GridAnswer> all_of(const lump::ComparedNodes& nodes, const lump::ResponseOptions& options,
                                       const lump::FittedLump& lump) {
  lump::Effort effort(0, {});
  return lump::GridSeries(nodes, options, effort).lump(lump, lump::AskedGrids::All, nullptr);
}

TEST(LumpResponse, MoreGridsAreNearerToCellsOfNoSize) {
  const lump::Observation observation = empty_observation();
  const lump::ComparedNodes nodes(observation, 4);
  const auto without_size = [&](const lump::ResponseOptions& options) {
    const lump::FittedLump lump{ball(), response_cells(observation, ball(), options)};
    return pressure_Pa(all_of(nodes, options, lump));
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
  const auto sum = [&](uint32_t searched) {
    lump::ResponseOptions options = on({1, 2});
    options.searched = searched;
    const lump::FittedLump lump{ball(), response_cells(observation, ball(), options)};
    return pressure_Pa(all_of(nodes, options, lump));
  };
  const Eigen::VectorXd a = sum(1), b = sum(2);
  EXPECT_LT((a - b).cwiseAbs().maxCoeff(), 1e-3 * a.maxCoeff());
  EXPECT_GT(a.maxCoeff(), 600);
}

// A finer grid starts from a coarser one's answer and ends near the forces: the grids by themselves, each
// from rest to the forces, answer the same.
TEST(LumpResponse, GridsThatStartFromOthersAnswerAsFromRest) {
  lump::Observation observation = empty_observation();
  observation.force_N = {0.5, 1, 1.5};
  observation.pressure_Pa.resize(3, observation.pressure_Pa[0]);
  const lump::ComparedNodes nodes(observation, 4);
  lump::ResponseOptions options = on({1, 2, 3});
  options.searched = 2;
  options.residual = 1e-5;
  lump::Effort effort(0, {});
  lump::GridSeries series(nodes, options, effort);
  lump::FittedLump lump{ball(), response_cells(observation, ball(), options)};
  const auto from_rest = [&](uint32_t times) {
    lump::ResponseOptions one = options;
    one.searched = times;
    return predict(nodes, lump, one, false, effort).pressure_Pa;
  };
  const auto expect_grids = [&](const std::optional<lump::GridAnswer>& answer) {
    // The polynomial in the square of the cells' size through 12, 24 and 36 cells.
    const Eigen::VectorXd wanted = from_rest(1) / 24 - from_rest(2) * 16 / 15 + from_rest(3) * 81 / 40;
    ASSERT_TRUE(answer);
    // The finest grid is asked at the first load and at the last.
    EXPECT_LT((pressure_Pa(answer) - wanted).cwiseAbs().maxCoeff(), 1e-3 * wanted.maxCoeff());
  };
  ASSERT_TRUE(series.lump(lump, lump::AskedGrids::All, nullptr));
  // The next lump starts from the last one's fields, with the same cells.
  lump.lump.diameter_mm *= 1.03;
  lump.lump.stiffness_ratio *= 1.3;
  expect_grids(series.lump(lump, lump::AskedGrids::All, nullptr));
  lump.lump.depth_mm *= 1.02;
  const lump::GridCorrection none;
  const auto searched = series.lump(lump, lump::AskedGrids::Searched, &none);
  ASSERT_TRUE(searched);
  EXPECT_LT((searched->searched_Pa - from_rest(2)).cwiseAbs().maxCoeff(), 3e-4 * from_rest(2).maxCoeff());
}

// What the finest grid says of one lump serves another nearby, so that the coarser ones are enough there.
TEST(LumpResponse, TheFinestGridsPartServesLumpsNearby) {
  const lump::Observation observation = empty_observation();
  const lump::ComparedNodes nodes(observation, 4);
  lump::ResponseOptions options = on({1, 2, 3});
  options.searched = 2;
  lump::FittedLump lump{ball(), response_cells(observation, ball(), options)};
  lump::Effort effort(0, {});
  lump::GridSeries series(nodes, options, effort);
  const auto first = series.lump(lump, lump::AskedGrids::All, nullptr);
  ASSERT_TRUE(first);
  EXPECT_TRUE(first->of_all);
  lump.lump.diameter_mm *= 1.02;
  lump.lump.stiffness_ratio *= 1.1;
  const double before = effort.done();
  const auto near = series.lump(lump, lump::AskedGrids::Coarse, &first->correction);
  const double coarse = effort.done() - before;
  const auto alone = series.lump(lump, lump::AskedGrids::Coarse, nullptr);
  const double between = effort.done();
  const auto all = series.lump(lump, lump::AskedGrids::All, nullptr);
  ASSERT_TRUE(near && alone && all);
  EXPECT_FALSE(near->of_all);
  const Eigen::VectorXd wanted = pressure_Pa(all);
  const double off = (pressure_Pa(near) - wanted).norm(), off_alone = (pressure_Pa(alone) - wanted).norm();
  EXPECT_LT(off, 0.25 * off_alone);
  EXPECT_LT(off, 1e-3 * wanted.norm());
  EXPECT_LT(coarse, effort.done() - between);
}

TEST(LumpResponse, NothingIsPressedBeyondTheLimitOfWorkButTissue) {
  const lump::Observation observation = empty_observation();
  const lump::ComparedNodes nodes(observation, 4);
  const lump::ResponseOptions options = on({1, 2});
  const lump::FittedLump lump{ball(), response_cells(observation, ball(), options)};
  // One press takes more than a hundred iterations of 216 cells.
  const double most = 20 * 216;
  lump::Effort effort(most, {});
  lump::GridSeries series(nodes, options, effort);
  EXPECT_FALSE(series.lump(lump, lump::AskedGrids::All, nullptr));
  EXPECT_TRUE(effort.spent());
  EXPECT_LT(effort.done(), most + 5 * 216) << "the press ends soon after";
  const double spent = effort.done();
  EXPECT_FALSE(series.lump(lump, lump::AskedGrids::All, nullptr));
  EXPECT_FALSE(predict(nodes, lump, options, true, effort).converged);
  EXPECT_EQ(effort.done(), spent);
  EXPECT_TRUE(series.tissue());
}

}  // namespace
}  // namespace palpate
