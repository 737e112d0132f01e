// Judging by cells: exact bands against known binomials, a planted bad corner, estimators that keep their
// promise, and cases with nothing in them.
#include "palpate/error.h"
#include "perf/lab/judge/cells.h"
#include "perf/lab/judge/report.h"
#include "tests/support/csv_table.h"
#include "tests/support/json.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <string>

namespace palpate::judge {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Probability of at most `count` of `all`, added up term by term.
double sum_of_terms(size_t count, size_t all, double rate) {
  long double sum = 0, term = std::pow(1 - static_cast<long double>(rate), static_cast<long double>(all));
  for (size_t k = 0; k <= count; ++k) {
    sum += term;
    term *= static_cast<long double>(all - k) / static_cast<long double>(k + 1) *
            (rate / (1 - static_cast<long double>(rate)));
  }
  return static_cast<double>(sum);
}

TEST(Judge, BinomialTailsAreTheirSums) {
  for (const size_t all : {1u, 7u, 50u, 400u})
    for (const double rate : {0.03, 0.5, 0.9, 0.97})
      for (size_t count = 0; count < all; count += 1 + all / 9)
        EXPECT_NEAR(at_most(count, all, rate), sum_of_terms(count, all, rate), 1e-12)
            << count << " of " << all << " at " << rate;
  EXPECT_EQ(at_most(5, 5, 0.3), 1);
}

TEST(Judge, BandsAreThoseOfClopperAndPearson) {
  // None of n: the upper end is 1 - tail^(1/n) by definition.
  EXPECT_NEAR(exact_band(0, 20, 0.95).high, 1 - std::pow(0.025, 1.0 / 20), 1e-12);
  EXPECT_EQ(exact_band(0, 20, 0.95).low, 0);
  EXPECT_EQ(exact_band(20, 20, 0.95).high, 1);
  // Published: 5 of 10, 95 %: 0.1871 to 0.8129; 81 of 263: 0.2527 to 0.3676 (Brown, Cai, DasGupta's
  // examples).
  EXPECT_NEAR(exact_band(5, 10, 0.95).low, 0.1871, 5e-5);
  EXPECT_NEAR(exact_band(5, 10, 0.95).high, 0.8129, 5e-5);
  EXPECT_NEAR(exact_band(81, 263, 0.95).low, 0.2527, 5e-5);
  EXPECT_NEAR(exact_band(81, 263, 0.95).high, 0.3676, 5e-5);
  const Band of_none = exact_band(0, 0, 0.9);
  EXPECT_EQ(of_none.low, 0);
  EXPECT_EQ(of_none.high, 1);
}

/// Cases of three conditions whose intervals hold with `hold(size, depth, ratio)`.
template <typename Hold>
Cases made(size_t count, uint64_t seed, const Hold& hold) {
  Cases cases;
  cases.conditions = {{"size_mm", {}}, {"depth_mm", {}}, {"shape", {"ball", "egg"}}};
  cases.quantities = {{"young_kPa", 0.9}};
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> even;
  for (size_t i = 0; i < count; ++i) {
    const double size = 2 + 10 * even(random), depth = 1 + 9 * even(random),
                 shape = even(random) < 0.5 ? 0 : 1;
    const bool inside = even(random) < hold(size, depth, shape);
    const double truth = 10 + 90 * even(random), value = truth * (inside ? 1.02 : 1.3);
    cases.cases.push_back({{size, depth, shape}, {{truth, value, 0.9 * value, 1.1 * value}}});
  }
  return cases;
}

TEST(Judge, APlantedCornerIsFoundAndNamed) {
  const Cases cases = made(
      3000, 3, [](double size, double depth, double) { return size < 4.5 && depth > 7.75 ? 0.6 : 0.92; });
  const Judgement j = judge_cells(cases, {});
  EXPECT_EQ(j.grids.size(), 3u);
  ASSERT_TRUE(j.worst[0]);
  EXPECT_EQ(j.worst[0]->grid, 0u);
  EXPECT_EQ(j.worst[0]->x, 0u);
  EXPECT_EQ(j.worst[0]->y, 3u);
  const Coverage& worst = j.cell(*j.worst[0]).quantities[0];
  EXPECT_TRUE(worst.accused);
  EXPECT_LT(worst.band.high, 0.8);
  EXPECT_GT(worst.band.low, 0.45);
  EXPECT_NEAR(worst.ninetieth_error, 0.3, 1e-9);
  // The mean alone would have said little.
  EXPECT_GT(j.all.quantities[0].rate(), 0.88);
  const std::string summary = judgement_summary(j);
  EXPECT_NE(summary.find("worst cell: " + name_of(j, *j.worst[0])), std::string::npos) << summary;
  EXPECT_NE(summary.find("below its promise"), std::string::npos) << summary;
}

TEST(Judge, AnHonestEstimatorIsAccusedAsRarelyAsStated) {
  constexpr int kSeeds = 400;
  int accused = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    CellOptions options;
    options.seed = static_cast<uint64_t>(seed);
    const Judgement j = judge_cells(
        made(500, 1000 + static_cast<uint64_t>(seed), [](double, double, double) { return 0.9; }), options);
    accused += j.cell(*j.worst[0]).quantities[0].accused;
  }
  // 5 % of 400 are 20 with a standard deviation of 4.4; counts are whole, which makes it a little rarer.
  EXPECT_LE(accused, 34);
  EXPECT_GE(accused, 8);
}

TEST(Judge, CasesThatErrTogetherCountAsOne) {
  // 40 calibrations of ten readings each; those of every fifth all miss: as cases far below 90 %, as
  // calibrations (8 of 40) hardly.
  Cases cases = made(400, 4, [](double, double, double) { return 1; });
  for (size_t i = 0; i < cases.cases.size(); ++i)
    if (i / 10 % 5 == 0) cases.cases[i].values[0].truth = 1000;
  const Judgement alone = judge_cells(cases, {{"shape"}});
  EXPECT_TRUE(alone.cell(*alone.worst[0]).quantities[0].accused);
  for (size_t i = 0; i < cases.cases.size(); ++i) cases.cases[i].group = 1 + i / 10;
  const Judgement together = judge_cells(cases, {{"shape"}});
  EXPECT_FALSE(together.cell(*together.worst[0]).quantities[0].accused);
}

TEST(Judge, TheSmallestCellIsNotTheWorstByChance) {
  // Two of four held say less than 60 of 100.
  Cases cases;
  cases.conditions = {{"part", {"few", "many", "good"}}};
  cases.quantities = {{"x", 0.9}};
  const auto add = [&](double part, size_t inside, size_t outside) {
    for (size_t i = 0; i < inside + outside; ++i)
      cases.cases.push_back({{part}, {{1, 1.1, i < inside ? 0.9 : 1.05, 1.2}}});
  };
  add(0, 2, 2);
  add(1, 60, 40);
  add(2, 100, 0);
  CellOptions options;
  options.fewest = 1;
  const Judgement j = judge_cells(cases, options);
  ASSERT_TRUE(j.worst[0]);
  EXPECT_EQ(name_of(j, *j.worst[0]), "part many");
  EXPECT_FALSE(j.grids[0].cells[0].quantities[0].accused);
  options.fewest = 20;
  const Judgement usual = judge_cells(cases, options);
  EXPECT_TRUE(usual.grids[0].cells[0].quantities[0].too_few);
  EXPECT_NE(judgement_text(usual).find("too few: 4"), std::string::npos);
}

TEST(Judge, WrongVerdictsAndRefusalsAreCounted) {
  Cases cases = made(400, 5, [](double, double, double) { return 0.95; });
  cases.wrong_means = "off by more than a fifth";
  size_t wrong = 0, refused = 0;
  for (JudgedCase& c : cases.cases) {
    c.reported = c.conditions[0] < 9;
    c.wrong = c.conditions[0] > 6 && c.conditions[1] < 4;
    refused += !c.reported;
    wrong += c.wrong && c.reported;
  }
  cases.cases[0].conditions[1] = kNaN;  // counted apart
  const Judgement j = judge_cells(cases, {{"size_mm", "depth_mm"}});
  EXPECT_EQ(j.all.refused, refused);
  EXPECT_EQ(j.all.wrong, wrong);
  EXPECT_EQ(j.all.quantities[0].judged, 400 - refused);
  EXPECT_EQ(j.outside.count, 1u);
  size_t count = 1, in_cells = j.outside.wrong;
  for (const Cell& cell : j.grids[0].cells) {
    count += cell.count;
    in_cells += cell.wrong;
    EXPECT_LE(cell.wrong_band.low * static_cast<double>(cell.reported()), static_cast<double>(cell.wrong));
  }
  EXPECT_EQ(count, 400u);
  EXPECT_EQ(in_cells, wrong);
  ASSERT_TRUE(j.worst_wrong);
  EXPECT_EQ(j.worst_wrong->y, 0u);
}

TEST(Judge, WhatIsNotKnownIsNotJudged) {
  Cases cases = made(60, 7, [](double, double, double) { return 1; });
  cases.cases[0].values[0].truth = kNaN;
  cases.cases[1].values[0].low = kNaN;
  cases.cases[2].values[0].value = kNaN;  // the interval is judged, its middle is not
  cases.cases[3].values[0].high = std::numeric_limits<double>::infinity();
  cases.cases[4].conditions = {kNaN, kNaN, kNaN};
  const Judgement j = judge_cells(cases, {});
  EXPECT_EQ(j.all.quantities[0].judged, 58u);
  EXPECT_EQ(j.all.quantities[0].inside, 58u);
  EXPECT_NEAR(j.all.quantities[0].median_error, 0.02, 1e-9);
  EXPECT_EQ(j.outside.count, 1u);
  for (const std::string& text : {judgement_text(j), judgement_csv(j), judgement_json(j).dump()})
    EXPECT_EQ(text.find("nan"), std::string::npos) << text;
}

TEST(Judge, NonsenseIsRefused) {
  EXPECT_THROW(judge_cells({}, {}), Error);
  const Cases cases = made(50, 9, [](double, double, double) { return 1; });
  EXPECT_THROW(judge_cells(cases, {{"sise_mm"}}), Error);
  EXPECT_THROW(judge_cells(cases, {{"size_mm", "size_mm"}}), Error);
  EXPECT_THROW(judge_cells(cases, {.bins = 0}), Error);
  EXPECT_THROW(judge_cells(cases, {.fewest = 0}), Error);
  EXPECT_THROW(judge_cells(cases, {.level = 1}), Error);
  Cases certain = cases;
  certain.quantities[0].promise = 1;
  EXPECT_THROW(judge_cells(certain, {}), Error);
  Cases unknown = cases;
  for (JudgedCase& c : unknown.cases) c.conditions[1] = kNaN;
  EXPECT_THROW(judge_cells(unknown, {}), Error);
  EXPECT_NO_THROW(judge_cells(unknown, {{"size_mm", "shape"}}));
}

TEST(Judge, FilesHoldEveryCell) {
  const Judgement j = judge_cells(made(500, 11, [](double, double, double) { return 0.9; }), {});
  const Table csv(judgement_csv(j));
  csv.expect_whole();
  // The whole, and two lines (quantity and verdict) for each of 4 x 4 and twice 4 x 2 cells.
  ASSERT_EQ(csv.rows.size(), 2 + 2 * (16 + 8 + 8u));
  EXPECT_EQ(csv.at(0, "x"), "all");
  EXPECT_EQ(csv.number(0, "judged"), 500);
  EXPECT_NEAR(csv.number(0, "coverage"), j.all.quantities[0].rate(), 1e-5);
  const Json json = parse_json(judgement_json(j).dump());
  ASSERT_EQ(json["grids"].size(), 3u);
  EXPECT_EQ(json["grids"][0]["cells"].size(), 16u);
  EXPECT_EQ(json["worst"]["young_kPa"]["cell"], name_of(j, *j.worst[0]));
  EXPECT_EQ(json["promise"]["young_kPa"], 0.9);
}

}  // namespace
}  // namespace palpate::judge
