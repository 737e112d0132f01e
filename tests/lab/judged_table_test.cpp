// Tables of judged cases: what columns mean, what is refused, and that our own come back as they were.
#include "perf/lab/judge/judged_table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "palpate/error.h"
#include "perf/lab/judge/report.h"
#include "tests/support/test_folder.h"
#include "tests/support/text_file.h"

namespace palpate {
namespace {

class JudgedTable : public testing::Test {
 protected:
  void SetUp() override { folder_ = test_folder("judged_table"); }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  judge::Cases read(const std::string& text, const JudgedTableOptions& options = {}) {
    spill(folder_ / "table.csv", text);
    return read_judged_table(folder_ / "table.csv", options);
  }
  void expect_error(const std::string& text, const std::string& words,
                    const JudgedTableOptions& options = {}) {
    try {
      read(text, options);
      ADD_FAILURE() << "no error: " << text;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  }

  std::filesystem::path folder_;
};

TEST_F(JudgedTable, ColumnsAreWhatTheirNamesSay) {
  const judge::Cases cases = read(
      "depth_mm,tool,size_truth,size,size_low,size_high,ratio_truth,ratio,verdict\n"
      "2,ball,5,5.5,5.2,6,3,4,found\n"
      "3,flat end,6,,,,2,2,no lump\n"
      "nan,ball,7,7,6,8,,2,found\n");
  ASSERT_EQ(cases.quantities.size(), 2u);
  EXPECT_EQ(cases.quantities[0].name, "size");
  EXPECT_EQ(cases.quantities[1].name, "ratio");
  ASSERT_EQ(cases.conditions.size(), 2u);
  EXPECT_EQ(cases.conditions[0].name, "depth_mm");
  EXPECT_TRUE(cases.conditions[0].labels.empty());
  EXPECT_EQ(cases.conditions[1].labels, (std::vector<std::string>{"ball", "flat end"}));
  ASSERT_EQ(cases.cases.size(), 3u);
  EXPECT_EQ(cases.cases[1].conditions[1], 1);
  EXPECT_TRUE(std::isnan(cases.cases[2].conditions[0]));
  EXPECT_EQ(cases.cases[0].values[0].low, 5.2);
  EXPECT_TRUE(std::isnan(cases.cases[0].values[1].low));
  EXPECT_TRUE(std::isnan(cases.cases[2].values[1].truth));
  EXPECT_TRUE(cases.cases[0].reported);
  EXPECT_FALSE(cases.cases[1].reported);
  EXPECT_TRUE(cases.wrong_means.empty());
}

TEST_F(JudgedTable, ChosenConditionsPromiseAndVerdicts) {
  JudgedTableOptions options;
  options.by = {"b"};
  options.promise = 0.95;
  options.reported = {"good"};
  const judge::Cases cases = read(
      "truth;value;low;high;a;b;verdict;wrong;group\n1;1,5;1;2;x;0,25;good;1;7\n1;1;1;2;x;0,5;found;0;8\n",
      options);
  ASSERT_EQ(cases.conditions.size(), 1u);
  EXPECT_EQ(cases.cases[0].conditions[0], 0.25);
  EXPECT_EQ(cases.quantities[0].promise, 0.95);
  EXPECT_EQ(cases.quantities[0].name, "value");
  EXPECT_EQ(cases.cases[0].values[0].value, 1.5);
  EXPECT_TRUE(cases.cases[0].reported && cases.cases[0].wrong);
  EXPECT_FALSE(cases.cases[1].reported);
  EXPECT_EQ(cases.cases[1].group, 8u);
}

// By a quantity that was estimated, cases go by what was true of it.
TEST_F(JudgedTable, EstimatesAreCrossedByTheirTruth) {
  JudgedTableOptions options;
  options.by = {"size_mm"};
  const judge::Cases own = read("size_mm_truth,size_mm,verdict\n5,6,found\n7,6.5,found\n", options);
  EXPECT_EQ(own.cases[0].conditions[0], 5);
  EXPECT_EQ(own.cases[1].conditions[0], 7);
  EXPECT_EQ(own.cases[1].values[0].value, 6.5);
  const judge::Cases named =
      read("true_size_mm,size_mm_truth,size_mm,verdict\n5.5,5,6,found\n7.5,7,6.5,found\n", options);
  EXPECT_EQ(named.conditions[0].name, "size_mm");
  EXPECT_EQ(named.cases[0].conditions[0], 5.5);
}

TEST_F(JudgedTable, OurOwnComeBackAsTheyWere) {
  judge::Cases cases;
  cases.conditions = {{"young_kPa", {}}, {"shape", {"ball", "flat, round"}}};
  cases.quantities = {{"young_kPa", 0.9}};
  cases.wrong_means = "off";
  const double nan = std::nan(""), open = std::numeric_limits<double>::infinity();
  cases.cases = {{{1.0 / 3, 1}, {{7, 7.1, 6, open}}, true, false, 3},
                 {{2, 0}, {{8, nan, nan, nan}}, false, true, 4}};
  const judge::Cases again = read(judge::cases_csv(cases));
  ASSERT_EQ(again.cases.size(), 2u);
  EXPECT_EQ(again.conditions[1].labels, (std::vector<std::string>{"flat, round", "ball"}));
  EXPECT_EQ(again.conditions[0].name, "true_young_kPa");
  EXPECT_EQ(again.cases[0].conditions[0], 1.0 / 3);
  EXPECT_GT(again.cases[0].values[0].high, 1e300);
  EXPECT_TRUE(std::isnan(again.cases[1].values[0].low));
  EXPECT_TRUE(again.cases[1].wrong && !again.cases[1].reported);
  EXPECT_EQ(again.cases[1].group, 4u);
}

TEST_F(JudgedTable, NonsenseIsOneLine) {
  expect_error("", "empty file");
  expect_error("truth,value,low,high,a\n", "judged cases");
  expect_error("a,b\n1,2\n", "columns of the truth");
  expect_error("truth,low,high,a\n1,1,2,3\n", "'value'");
  expect_error("x_truth,x_low,x_high,a\n1,1,2,3\n", "'x'");
  expect_error("truth,value,low,a\n1,1,2,3\n", "one of them");
  expect_error("truth,value,low,high\n1,1,0,2\n", "a condition");
  expect_error("truth,value,low,high,a\n1,1,0,2,3\n1,1,3,2,3\n", "line 3");
  expect_error("truth,value,low,high,a\n1,one,0,2,3\n", "column 'value'");
  expect_error("truth,value,low,high,a\n1,1,0,2\n", "5 cells");
  expect_error("verdict,a\nno,3\n", "--reported");
  expect_error("verdict,a,group\nyes,3,1.5\n", "whole number");
  JudgedTableOptions by;
  by.by = {"shapes"};
  expect_error("verdict,shape\nyes,3\n", "did you mean 'shape'?", by);
  std::string words = "verdict,a\n";
  for (int i = 0; i < 30; ++i) words += "yes,w" + std::to_string(i) + "\n";
  expect_error(words, "different words");
}

}  // namespace
}  // namespace palpate
