// Scores over noise, exposure and loads: each row is of its own setting.
#include "perf/lab/study/evaluation_table.h"

#include "engine/lump/tissue/block_stiffness.h"
#include "tests/support/json.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

namespace palpate {
namespace {

lump::Example example(bool lump) {
  lump::Example e;
  e.lump = lump;
  e.size_mm = 8;
  e.depth_mm = 5;
  e.stiffness_ratio = 6;
  for (int k = 1; k <= 4; ++k) {
    PressureMap map{33, 33, {1.25, 1.25}, {}};
    for (int n = 0; n < 33 * 33; ++n)
      map.values.push_back(static_cast<float>(
          250 * k *
          (1 + (lump ? 0.8 : 0.0) * std::exp(-(std::pow(n % 33 - 16, 2) + std::pow(n / 33 - 16, 2)) / 20))));
    e.pressure_Pa.push_back(std::move(map));
    e.force_N.push_back(0.5 * k);
  }
  return e;
}

struct Heard {
  size_t loads;
  double noise, saturated;
};

TEST(LumpEvaluationTable, RowsAreOfTheirSettings) {
  std::vector<Heard> heard;
  lump::EvaluationJob job;
  job.sensor.size_px = {64, 48};
  job.sensor.noise_fraction = 0.003;
  job.estimator = [&](const lump::Observation& observation) {
    heard.push_back({observation.force_N.size(), observation.noise_Pa, observation.saturated_fraction});
    lump::Estimate e;
    e.verdict = observation.saturated_fraction > 0.5 ? lump::Status::Saturated : lump::Status::Found;
    e.detection_statistic = 2;
    e.size_mm = {4, 3, 5};
    e.depth_mm = {5, 4, 6};
    e.stiffness_ratio = {6, 5, 7};
    return e;
  };
  size_t told = 0;
  job.progress = [&told](size_t done) {
    told = done;
    return true;
  };
  const std::vector<lump::Example> examples = {example(true), example(false)};
  for (const lump::ScoreOver what :
       {lump::ScoreOver::Noise, lump::ScoreOver::Exposure, lump::ScoreOver::Loads}) {
    heard.clear();
    const std::vector<lump::ScoreRow> rows = scores_over(what, examples, job);
    ASSERT_EQ(rows.size(), rows_of(what));
    ASSERT_EQ(heard.size(), 2 * rows.size());
    EXPECT_EQ(told, heard.size());
    for (size_t r = 0; r < rows.size(); ++r) {
      EXPECT_EQ(heard[2 * r].loads, rows[r].loads);
      EXPECT_NEAR(rows[r].saturated_fraction, heard[2 * r].saturated, 1e-12);
      EXPECT_EQ(rows[r].score.lumps, 1u);
      EXPECT_EQ(rows[r].score.plain, 1u);
      EXPECT_NEAR(rows[r].score.median[0], 0.5, 1e-12);
      EXPECT_EQ(rows[r].score.coverage[0], 0);
      EXPECT_EQ(rows[r].score.coverage[1], 1);
    }
    if (what == lump::ScoreOver::Noise) {
      EXPECT_GT(heard.back().noise, 20 * heard.front().noise);
    }
    if (what == lump::ScoreOver::Exposure) {
      EXPECT_EQ(heard.front().saturated, 0);
      EXPECT_GT(rows.back().saturated_fraction, 0.5);
      EXPECT_EQ(rows.back().score.verdicts[static_cast<size_t>(lump::Status::Saturated)], 1u);
    }
    const auto json = parse_json(rows_json(rows).dump());
    ASSERT_EQ(json.size(), rows.size());
    EXPECT_EQ(json[0]["loads"], rows[0].loads);
    const std::string csv = rows_csv(rows), text = rows_text(rows);
    EXPECT_EQ(static_cast<size_t>(std::count(csv.begin(), csv.end(), '\n')), rows.size() + 1);
    EXPECT_EQ(csv.find("nan"), std::string::npos);
    EXPECT_EQ(static_cast<size_t>(std::count(text.begin(), text.end(), '\n')), rows.size() + 2);
  }
}

TEST(LumpEvaluation, SomeOfTheBlocksAreJudgedAsAmongAll) {
  lump::EvaluationJob job;
  job.sensor.size_px = {64, 48};
  job.estimator = [](const lump::Observation& observation) {
    lump::Estimate e;
    e.size_mm.value = double{observation.pressure_Pa.back().values.front()};  // noise: of its seed
    return e;
  };
  const std::vector<lump::Example> examples(7, example(true));
  const std::vector<lump::Judged> all = judge_lumps(examples, job);
  ASSERT_EQ(all.size(), 7u);
  EXPECT_NE(all[1].estimate.size_mm.value, all[4].estimate.size_mm.value);
  job.first = 1;
  job.every = 3;
  EXPECT_EQ(count_judged(examples.size(), job), 2u);
  const std::vector<lump::Judged> some = judge_lumps(examples, job);
  ASSERT_EQ(some.size(), 2u);
  EXPECT_EQ(some[1].number, 4u);
  EXPECT_EQ(some[0].estimate.size_mm.value, all[1].estimate.size_mm.value);
  EXPECT_EQ(some[1].estimate.size_mm.value, all[4].estimate.size_mm.value);
  job.first = 7;
  EXPECT_EQ(count_judged(examples.size(), job), 0u);
  EXPECT_TRUE(judge_lumps(examples, job).empty());
}

TEST(LumpEvaluation, TheWayOfThePlateIsToldInPlaceOfTheModulus) {
  lump::EvaluationJob job;
  job.sensor.size_px = {64, 48};
  job.press_sd_mm = 0.1;
  job.repeats = 400;
  lump::Example e = example(false);
  e.young_Pa = 5000;
  e.press_mm = {1, 2, 3, 4};
  for (size_t k = 0; k < e.press_mm.size(); ++k)
    e.force_N[k] =
        1600e-6 * e.young_Pa *
        lump::BlockStiffness::built_in().load(e.block_mm, std::nullopt, e.press_mm[k] / e.block_mm[2]);
  double calls = 0, squares = 0, together = 0;
  job.estimator = [&](const lump::Observation& o) {
    EXPECT_EQ(o.press_sd_mm, 0.1);
    ++calls;
    squares += std::pow(o.press_mm.at(3) - 4, 2);
    together += (o.press_mm.at(0) - 1) * (o.press_mm.at(3) - 4);
    return lump::Estimate{};
  };
  const lump::Score score = score_of(judge_lumps({e}, job));
  EXPECT_EQ(score.tissues, 400u);
  EXPECT_GT(score.young_median, 0.005);
  EXPECT_LT(score.young_median, 0.03);
  EXPECT_GT(score.young_coverage, 0.86);
  EXPECT_LT(score.young_coverage, 0.97);
  EXPECT_NEAR(squares / calls / 0.01, 1, 0.25);
  EXPECT_NEAR(together / squares, 0.5, 0.15) << "half of the variance is alike at all loads";
}

TEST(LumpEvaluation, WhatWasJudgedBeforeAStopIsKept) {
  lump::EvaluationJob job;
  job.sensor.size_px = {64, 48};
  job.estimator = [](const lump::Observation&) { return lump::Estimate{}; };
  job.progress = [](size_t done) { return done < 2; };
  const std::vector<lump::Example> examples(5, example(true));
  const std::vector<lump::Judged> judged = judge_lumps(examples, job);
  ASSERT_EQ(judged.size(), 2u);
  EXPECT_EQ(judged[1].number, 1u);
  EXPECT_THROW(scores_over(lump::ScoreOver::Loads, examples, job), Stopped);
}

}  // namespace
}  // namespace palpate
