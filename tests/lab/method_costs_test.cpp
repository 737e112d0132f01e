// Costs of the ways to estimate a lump.
#include "perf/lab/study/method_costs.h"

#include <gtest/gtest.h>

#include "tests/lab/pressed_ball.h"

namespace palpate {
namespace {

TEST(MethodCosts, AreOfEachWayUntilStopped) {
  lump::Example ball = ball_aside();
  lump::EvaluationJob job;
  job.sensor.gauge_fraction = 0;
  size_t ways = 0;
  const std::vector<lump::MethodCost> costs =
      lump::method_costs({ball, ball}, job, {.threads = 1, .stop = [&] { return ways == 4; }},
                         [&](size_t done) { ways = done; });
  ASSERT_EQ(costs.size(), 4u);
  EXPECT_EQ(costs[0].method, "network");
  EXPECT_EQ(costs[0].loads, 1u);
  EXPECT_EQ(costs[3].method, "refined");
  for (const lump::MethodCost& c : costs) {
    EXPECT_EQ(c.judged, 2u) << c.method;
    EXPECT_GT(c.cpu_s, 0);
    EXPECT_GE(c.slowest_s, c.cpu_s);
    EXPECT_LT(c.median[0], 0.2) << c.method << " at " << c.loads;
  }
}

TEST(MethodCosts, TableHasARowOfEach) {
  const std::string csv =
      lump::method_costs_csv({{"direct", 4, 8, 7, {0.01, 0.02, 0.03}, 5, 9, {0.9, 1, 0.8}}});
  EXPECT_NE(csv.find("\ndirect,4,8,7,5,9,0.01,0.02,0.03,0.9,1,0.8\n"), std::string::npos) << csv;
}

}  // namespace
}  // namespace palpate
