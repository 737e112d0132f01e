// Two days that differ in more than the lump: what is told of each.
#include "perf/lab/study/days/day_extremes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "tests/lab/pressed_ball.h"

namespace palpate {
namespace {

TEST(DayExtremes, HaveNamesOfTheirOwn) {
  std::set<std::string> names;
  for (const lump::DayExtreme& e : lump::day_extremes({})) EXPECT_TRUE(names.insert(e.name).second) << e.name;
  EXPECT_GE(names.size(), 8u);
}

TEST(DayExtremes, EachIsRightOrNotComparableWithAReason) {
  const std::vector<lump::Example> block = {ball_aside()};
  std::vector<lump::DayExtreme> extremes = lump::day_extremes({});
  std::erase_if(extremes, [](const lump::DayExtreme& e) {
    return e.name != "same pad" && !e.turned && e.young_factor[1] != 1.3;
  });
  ASSERT_EQ(extremes.size(), 3u);
  lump::ChangeJob job;
  job.place_mm = 1;
  job.place_sd_mm = 0.6;
  job.sources = {};
  const std::vector<lump::ExtremeRow> rows = lump::judge_extremes(block, block, extremes, false, job);
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_EQ(rows[0].compared, 1u) << rows[0].reason;
  EXPECT_EQ(rows[0].told_grown + rows[0].told_shrunk, 0u);
  EXPECT_EQ(rows[0].hold[0], 1u);
  EXPECT_EQ(rows[1].compared, 0u);
  EXPECT_NE(rows[1].reason.find("turned"), std::string::npos) << rows[1].reason;
  EXPECT_EQ(rows[2].compared, 0u);
  EXPECT_NE(rows[2].reason.find("modulus"), std::string::npos) << rows[2].reason;
  EXPECT_EQ(rows[1].unexplained + rows[2].unexplained, 0u);
}

}  // namespace
}  // namespace palpate
