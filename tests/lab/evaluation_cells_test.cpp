// Judged lumps as cases: which verdicts report, which are wrong, what counts as stated.
#include "perf/lab/study/evaluation_cells.h"

#include <gtest/gtest.h>

#include <cmath>

#include "perf/lab/judge/cells.h"

namespace palpate::lump {
namespace {

Judged judged(Status verdict, double size_mm, Value size, Value ratio) {
  Judged j;
  j.truth.size_mm = size_mm;
  j.truth.depth_mm = 5;
  j.truth.stiffness_ratio = 6;
  j.truth.offset_mm = {3, 4};
  j.truth.shape = InclusionShape::Sphere;
  j.estimate.verdict = verdict;
  j.estimate.detection_statistic = 3;
  j.estimate.size_mm = size;
  j.estimate.depth_mm = {5.1, 4.9, 5.3};
  j.estimate.stiffness_ratio = ratio;
  return j;
}

TEST(LumpEvaluationCells, VerdictsReportRefuseAndAreWrong) {
  Judged plain = judged(Status::Found, 0, {8, 7, 9}, {6, 5, 7});
  plain.truth.lump = false;
  Judged quiet = plain;
  quiet.estimate.verdict = Status::NoLump;
  const judge::Cases cases = cases_of({judged(Status::Found, 8, {8.2, 7.5, 8.6}, {6.1, 5, 7}),
                                       judged(Status::Found, 8, {3.9, 3.5, 4.4}, {6.1, 5, 7}),
                                       judged(Status::Found, 8, {3.9, 3.5, 8.4}, {6.1, 5, 7}),
                                       judged(Status::StiffnessOpen, 8, {8.2, 7.5, 8.6}, {20, 9, 60}),
                                       judged(Status::OutsideTraining, 8, {1, 1, 1}, {1, 1, 1}),
                                       judged(Status::NoLump, 8, {1, 1, 1}, {1, 1, 1}), plain, quiet});
  const std::vector<bool> reported = {true, true, true, true, false, false, true, false},
                          wrong = {false, true, false, false, true, true, true, true};
  for (size_t i = 0; i < cases.cases.size(); ++i) {
    EXPECT_EQ(cases.cases[i].reported, reported[i]) << i;
    EXPECT_EQ(cases.cases[i].wrong, wrong[i]) << i;
  }
  // An open ratio has an interval and no middle.
  EXPECT_TRUE(std::isnan(cases.cases[3].values[2].value));
  EXPECT_EQ(cases.cases[3].values[2].high, 60);
  EXPECT_NEAR(cases.cases[0].conditions[4], 5, 1e-12);
  EXPECT_TRUE(std::isnan(cases.cases[6].conditions[0]));

  const judge::Judgement j = judge::judge_cells(cases, {{"size_mm", "depth_mm"}});
  EXPECT_EQ(j.all.wrong, 2u);
  EXPECT_EQ(j.all.refused, 3u);
  EXPECT_EQ(j.outside.count, 2u);
  EXPECT_EQ(j.outside.wrong, 1u);
  EXPECT_EQ(j.all.quantities[0].judged, 4u);
  EXPECT_EQ(j.all.quantities[0].inside, 3u);
  EXPECT_EQ(j.all.quantities[2].judged, 4u);
  EXPECT_EQ(j.all.quantities[2].inside, 3u);
}

}  // namespace
}  // namespace palpate::lump
