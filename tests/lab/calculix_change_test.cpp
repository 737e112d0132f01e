// Changes between two days of blocks that another program's finite elements pressed (tests/data/calculix).
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "perf/lab/study/days/change_evaluation.h"
#include "perf/lab/training/examples.h"

namespace palpate {
namespace {

using lump::ChangeVerdict;

/// The sets' first two: a ball of 8.4 mm, 4 deep, and an ellipsoid of 9.9, 2.1 deep.
std::vector<lump::Example> day(const char* name) {
  const auto all = lump::read_examples(std::string(PALPATE_SOURCE_DIR "/tests/data/calculix/") + name);
  return {all.at(0), all.at(1)};
}

class CalculixChange : public testing::Test {
 protected:
  /// Each pair read three times, 0.2 % noise, windows up to 2 mm aside untold.
  static std::vector<lump::JudgedChange> judged(const char* second) {
    lump::ChangeJob job;
    job.sensor.window_mm = {36, 28};
    job.repeats = 3;
    return judge_changes(day("first.h5"), day(second), job);
  }
  /// Of the intervals of the change of size, depth and ratio, how many hold.
  static int held(const lump::JudgedChange& one) {
    int hold = 0;
    for (size_t p = 0; p < 3; ++p) {
      const lump::Value& factor = one.change.factor[p];
      hold += factor.low <= one.truth()[p] && factor.high >= one.truth()[p];
    }
    return hold;
  }
};

// One reading in twenty may tell a change that is not there, so that one of six does at most.
TEST_F(CalculixChange, AnotherPressOfTheSameBlockIsNoChange) {
  int told = 0, hold = 0;
  for (const lump::JudgedChange& one : judged("same.h5")) {
    EXPECT_DOUBLE_EQ(one.truth()[0], 1);
    EXPECT_NEAR(one.change.factor[0].value, 1, 0.03) << sentence_of(one.change);
    told += one.change.verdict != ChangeVerdict::NoChange || one.change.ratio_changed;
    hold += held(one);
  }
  EXPECT_LE(told, 1) << "of 6";
  EXPECT_GE(hold, 14) << "of 18";
}

TEST_F(CalculixChange, GrowthByATenthIsTold) {
  int hold = 0;
  for (const lump::JudgedChange& one : judged("grown.h5")) {
    EXPECT_NEAR(one.truth()[0], 1.1, 1e-9);
    EXPECT_EQ(one.change.verdict, ChangeVerdict::Grown) << sentence_of(one.change);
    EXPECT_NEAR(one.change.factor[0].value, 1.1, 0.03) << sentence_of(one.change);
    hold += held(one);
  }
  EXPECT_GE(hold, 14) << "of 18";
}

}  // namespace
}  // namespace palpate
