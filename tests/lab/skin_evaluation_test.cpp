// Judgement of readings by their skins: who is counted where.
#include "perf/lab/study/skin_evaluation.h"

#include <gtest/gtest.h>

namespace palpate {
namespace {

lump::Judged judged(std::optional<fem::Skin> skin, lump::Status verdict, double size_mm) {
  lump::Judged j;
  j.truth.size_mm = 8;
  j.truth.depth_mm = 5;
  j.truth.stiffness_ratio = 6;
  j.truth.skin = skin;
  j.estimate.verdict = verdict;
  j.estimate.size_mm = {size_mm, size_mm - 1, size_mm + 1};
  j.estimate.depth_mm = {5, 4, 6};
  j.estimate.stiffness_ratio = {3, 2, 4};
  return j;
}

TEST(SkinRows, AreOfTheirSkins) {
  const fem::Skin skin{2, 5};
  std::vector<lump::Judged> all = {judged({}, lump::Status::Found, 8),
                                   judged(skin, lump::Status::Found, 9.6),
                                   judged(skin, lump::Status::StiffnessOpen, 8.8),
                                   judged(skin, lump::Status::Found, 9.2),
                                   judged(skin, lump::Status::OutsideTraining, 80),
                                   judged(skin, lump::Status::Inconsistent, 80)};
  all.push_back(judged(skin, lump::Status::Found, 8));
  all.back().truth.lump = false;
  const std::vector<lump::SkinRow> rows = skin_rows(all);
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].skin_mm[1], 0);
  EXPECT_EQ(rows[0].lumps, 1u);
  EXPECT_EQ(rows[0].held[0], 1);
  EXPECT_EQ(rows[0].held[2], 0);
  const lump::SkinRow& row = rows[1];
  EXPECT_EQ(row.ratio[0], 5);
  EXPECT_EQ(row.lumps, 5u);
  EXPECT_EQ(row.reported, 3u);
  EXPECT_EQ(row.outside, 1u);
  EXPECT_EQ(row.inconsistent, 1u);
  EXPECT_EQ(row.plain, 1u);
  EXPECT_EQ(row.alarms, 1u);
  EXPECT_NEAR(row.held[0], 1.0 / 3, 1e-9);
  EXPECT_NEAR(row.moved[0], 0.15, 1e-9);
  EXPECT_NEAR(row.moved[2], -0.5, 1e-9);
  EXPECT_NEAR(row.width[1], 1.5, 1e-9);
}

TEST(SkinRows, AreOfTheirPlates) {
  std::vector<lump::Judged> all(4, judged({}, lump::Status::Found, 8));
  all[1].truth.plate_sticks = true;
  all[2].truth.plate_friction = 0.03;
  const std::vector<lump::SkinRow> rows = skin_rows(all);
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_EQ(rows[0].plate, "slides");
  EXPECT_EQ(rows[0].lumps, 2u);
  EXPECT_EQ(rows[1].plate, "0.03");
  EXPECT_EQ(rows[2].plate, "sticks");
  EXPECT_NE(skin_csv(rows).find(",sticks\n"), std::string::npos);
}

TEST(SkinRows, ManySkinsAreFourQuarters) {
  std::vector<lump::Judged> all;
  for (int n = 0; n < 40; ++n)
    all.push_back(judged(fem::Skin{1 + n / 20.0, n % 2 == 0 ? 0.4 : 3}, lump::Status::Found, 8));
  const std::vector<lump::SkinRow> rows = skin_rows(all);
  ASSERT_EQ(rows.size(), 4u);
  size_t lumps = 0;
  for (const lump::SkinRow& row : rows) {
    lumps += row.lumps;
    EXPECT_EQ(row.ratio[0], row.ratio[1]);
    EXPECT_TRUE(row.skin_mm[1] <= 2 || row.skin_mm[0] > 2);
  }
  EXPECT_EQ(lumps, 40u);
}

}  // namespace
}  // namespace palpate
