// Spread of repeated presses next to the errors that they state.
#include "perf/lab/study/days/repeat_evaluation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/base/normal.h"
#include "palpate/error.h"

namespace palpate {
namespace {

lump::Value value(double at, double sd) {
  return {at, at * std::exp(-kNormal90 * sd), at * std::exp(kNormal90 * sd)};
}

lump::Estimate estimate(double size_mm) {
  lump::Estimate e;
  e.verdict = lump::Status::Found;
  e.size_mm = value(size_mm, 0.05);
  e.depth_mm = value(4, 0.1);
  e.stiffness_ratio = value(6, 0.2);
  return e;
}

TEST(Repeats, SpreadIsThatOfReportedLogarithms) {
  lump::RepeatedBlock block;
  block.estimates = {estimate(8), estimate(8 * std::exp(0.02)), estimate(8 * std::exp(-0.02)), estimate(80)};
  block.estimates.back().verdict = lump::Status::OutsideTraining;
  const lump::Spread spread = estimates_spread(block);
  EXPECT_EQ(spread.readings, 3u);
  EXPECT_NEAR(spread.spread[0], 0.02, 1e-12);
  EXPECT_NEAR(spread.stated[0], 0.05, 1e-12);
  EXPECT_NEAR(spread.over_stated()[0], 0.4, 1e-12);
  EXPECT_EQ(spread.spread[1], 0);
}

TEST(Repeats, ChangesSpreadAboutNone) {
  lump::RepeatedBlock block;
  for (const double factor : {1.03, 1.03}) {
    lump::LumpChange change;
    change.verdict = lump::ChangeVerdict::NoChange;
    change.factor.fill(value(factor, 0.02));
    block.changes.push_back(change);
  }
  block.changes.emplace_back();
  block.changes.back().factor.fill({std::nan(""), std::nan(""), std::nan("")});
  const lump::Spread spread = changes_spread(block);
  EXPECT_EQ(spread.readings, 2u);
  EXPECT_NEAR(spread.spread[2], std::log(1.03), 1e-12);
  EXPECT_NEAR(spread.stated[2], 0.02, 1e-12);
}

TEST(Repeats, TooFewLoadsAreRefused) {
  lump::Example example;
  example.pressure_Pa.resize(4);
  example.force_N = {1, 2, 3, 4};
  EXPECT_THROW((void)lump::judge_repeats({example}, {}), Error);
}

// The estimator sees loads around the nominal ones, and a window whose place is not told.
TEST(Repeats, PressesAreFreeInLoadAndPlace) {
  lump::Example example;
  example.size_mm = 8;
  for (int load = 1; load <= 6; ++load) {
    PressureMap map;
    map.width = map.height = 33;
    map.pitch_mm = {1.25, 1.25};
    for (int n = 0; n < 33 * 33; ++n) {
      const double x = (n % 33 - 16) / 5.0, y = (n / 33 - 16) / 5.0;
      map.values.push_back(static_cast<float>(200.0 * load * (1 + std::exp(-x * x - y * y))));
    }
    example.pressure_Pa.push_back(map);
    example.force_N.push_back(0.3 * load);
  }
  std::vector<double> highest, middle;
  lump::RepeatJob job;
  job.presses = 6;
  job.estimator = lump::Inverse([&](const lump::Observation& o) {
    EXPECT_EQ(o.force_N.size(), 4u);
    EXPECT_EQ(o.window_mm[0], 0);
    EXPECT_NEAR(o.force_N[0], o.force_N[3] / 4, 0.01 * o.force_N[3]);
    highest.push_back(o.force_N[3]);
    const PressureMap& map = o.pressure_Pa.back();
    middle.push_back(double{map.at(map.width / 2, map.height / 2)} / o.force_N[3]);
    return lump::Estimate{};
  });
  const auto blocks = lump::judge_repeats({example}, job);
  ASSERT_EQ(blocks.size(), 1u);
  EXPECT_EQ(blocks[0].estimates.size(), 6u);
  EXPECT_EQ(estimates_spread(blocks[0]).readings, 0u);
  const auto [least, most] = std::minmax_element(highest.begin(), highest.end());
  EXPECT_GT(*most / *least, 1.01);
  EXPECT_GE(*least, 1.8 * 0.9 / 1.1 * 0.99);
  EXPECT_LE(*most, 1.8 * 1.01);
  const auto [low, high] = std::minmax_element(middle.begin(), middle.end());
  EXPECT_GT(*high / *low, 1.002) << "the window lies elsewhere";
}

}  // namespace
}  // namespace palpate
