// A scan from its presses to the numbers, on a block pressed by a fake of the solver (small strain).
#include "engine/palpation/scan.h"

#include <gtest/gtest.h>

#include <cmath>

#include "palpate/error.h"
#include "tests/lump/press_slightly.h"

namespace palpate {
namespace {

ScanPlan plan() {
  ScanPlan p;
  p.scene.cells = {32, 32, 16};
  p.scene.inclusion->offset_mm = {4, -3};
  p.sensor.size_px = {320, 240};
  return p;
}

TEST(LumpScan, PlacesCoverTheBlockAndOverlap) {
  for (const std::array<double, 2> window :
       {std::array{27.84, 20.88}, std::array{15.0, 10.0}, std::array{60.0, 50.0}}) {
    const auto places = scan_places({40, 40, 20}, window);
    for (double y = -18; y <= 18; y += 1)
      for (double x = -18; x <= 18; x += 1) {
        const bool seen = std::any_of(places.begin(), places.end(), [&](const std::array<double, 2>& p) {
          return std::abs(x - p[0]) <= window[0] / 2 && std::abs(y - p[1]) <= window[1] / 2;
        });
        EXPECT_TRUE(seen) << x << " " << y << " of window " << window[0];
      }
  }
  EXPECT_EQ(scan_places({40, 40, 20}, {60, 50}).size(), 1u);
  EXPECT_THROW(scan_places({40, 40, 20}, {2, 2}), Error);
  EXPECT_THROW(scan_places({40, 40, 20}, {0, 10}), Error);
}

TEST(LumpScan, FromPressesToNumbers) {
  const ScanPlan p = plan();
  const std::vector<lump::ScanPress> presses = simulate_scan(p, press_slightly);
  EXPECT_EQ(presses.size(), scan_places(p.scene.block_mm, p.sensor.window_mm).size());
  bool asked = false;
  const ScanAnswer answer = evaluate_scan(presses, {}, [&](const lump::Observation& observation) {
    asked = true;
    EXPECT_EQ(observation.force_N.size(), 4u);
    EXPECT_EQ(observation.block_mm, p.scene.block_mm);
    lump::Estimate estimate;
    estimate.reasons = {"a reason"};
    return estimate;
  });
  EXPECT_TRUE(asked);
  EXPECT_GT(answer.map.seen_fraction, 0.99);
  ASSERT_TRUE(answer.outline.found && answer.outline.closed) << answer.outline.reason;
  EXPECT_NEAR(answer.outline.x_mm.value, 4, 0.5);
  EXPECT_NEAR(answer.outline.y_mm.value, -3, 0.5);
  EXPECT_TRUE(answer.fit.found);
  EXPECT_NEAR(answer.fit.center_mm, 4, 0.5);
  EXPECT_FALSE(answer.second_outline);
  EXPECT_TRUE(answer.presses.empty());
  EXPECT_EQ(std::count(answer.warnings.begin(), answer.warnings.end(), "a reason"), 1);
  // The same seed is the same scan.
  const std::vector<lump::ScanPress> again = simulate_scan(p, press_slightly);
  for (size_t i = 0; i < presses.size(); ++i)
    EXPECT_EQ(presses[i].observation.force_N, again[i].observation.force_N);
}

TEST(LumpScan, TissueAloneHasNoOutline) {
  ScanPlan p = plan();
  p.scene.inclusion.reset();
  for (p.seed = 1; p.seed <= 4; ++p.seed) {
    const ScanAnswer answer = evaluate_scan(simulate_scan(p, press_slightly), {}, {});
    EXPECT_FALSE(answer.outline.found) << p.seed << " " << answer.outline.height_Pa.value;
    EXPECT_FALSE(answer.estimate.has_value());
    EXPECT_FALSE(answer.warnings.empty());
  }
}

TEST(LumpScan, TwoLumpsAreOutlinedBothAndPressesThatSeeOneAreAsked) {
  ScanPlan p = plan();
  p.scene.inclusion->offset_mm = {-8, 0};
  p.scene.others = {*p.scene.inclusion};
  p.scene.others[0].offset_mm = {8, 0};
  p.sensor.window_mm = {20, 20};
  const ScanAnswer answer =
      evaluate_scan(simulate_scan(p, press_slightly), {}, [](const lump::Observation& observation) {
        lump::Estimate estimate;
        estimate.verdict = lump::Status::Found;
        estimate.size_mm = {observation.window_mm[0], 0, 0};
        return estimate;
      });
  ASSERT_TRUE(answer.second_outline);
  ASSERT_TRUE(answer.outline.found && answer.second_outline->found)
      << answer.outline.reason << answer.second_outline->reason;
  const double one = answer.outline.x_mm.value, other = answer.second_outline->x_mm.value;
  EXPECT_NEAR(std::min(one, other), -8, 1);
  EXPECT_NEAR(std::max(one, other), 8, 1);
  EXPECT_NEAR(answer.outline.y_mm.value, 0, 1);
  ASSERT_FALSE(answer.presses.empty());
  for (const ScannedPress& press : answer.presses) {
    EXPECT_NEAR(std::abs(press.bump_mm[0]), 8, 2);
    // Its window is on the side of the bump that it tells of.
    EXPECT_GT(press.bump_mm[0] * press.estimate.size_mm.value, 0) << press.name;
  }
}

TEST(LumpScan, SaysWhatItDoesNotKnow) {
  lump::Estimate e;
  e.verdict = lump::Status::StiffnessOpen;
  e.stiffness_ratio = {9, 3, 30};
  e.size_mm = {8, 7, 9};
  const auto value_of = [&](const char* name) {
    for (const auto& [row, value] : estimate_rows(e))
      if (row == name) return value;
    return std::string();
  };
  EXPECT_EQ(value_of("stiffness over the tissue's"), "between 3 and 30: not determined");
  EXPECT_EQ(value_of("size"), "8 mm (90 %: 7 to 9)");
  e.verdict = lump::Status::NoLump;
  EXPECT_EQ(value_of("size"), "");
  EXPECT_EQ(value_of("verdict"), "no lump");
  e.verdict = lump::Status::Unusable;
  e.reasons = {"saturated"};
  EXPECT_EQ(value_of("reason"), "saturated");
}

TEST(LumpScan, APressThatDoesNotGetThereIsRefused) {
  const fem::PressSolver gives_up = [](const fem::Scene&, const std::vector<fem::PressLoad>&) {
    fem::LargeStrainResult result;
    result.last_force_N = 1.5;
    return result;
  };
  try {
    simulate_scan(plan(), gives_up);
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("1.5 N"), std::string::npos) << error.what();
  }
  ScanPlan p = plan();
  p.loads = 0;
  EXPECT_THROW(simulate_scan(p, press_slightly), Error);
}

}  // namespace
}  // namespace palpate
