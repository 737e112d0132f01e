// The press that a scan proposes next: towards a lump that is cut off, what was not seen where there is none,
// and no more where none is worth it.
#include "engine/palpation/next_press.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "engine/lump/network/limit_search.h"
#include "palpate/error.h"
#include "tests/lump/emulated_ball.h"

namespace palpate {
namespace {

using Place = std::array<double, 2>;

constexpr Place kWindow_mm = {27.5, 20};
const lump::Model& kModel = lump::Network::built_in().model();

/// A window of a press of the whole block, with or without a ball.
lump::ScanPress press_at(const Place& at, bool ball, uint64_t seed, const Place& ball_mm = {0, -6}) {
  lump::PalpationSensor sensor;
  sensor.window_mm = {40, 40};
  sensor.size_px = {640, 640};
  sensor.noise_fraction = 0.01;
  sensor.gauge_fraction = 0;
  lump::Observation seen = plain_observation(kModel, 20, 4000, {0.4, 0.8, 1.2, 1.6}, sensor, seed);
  if (ball) add_emulated_ball(9, 4, 6, ball_mm, seen);
  for (PressureMap& map : seen.pressure_Pa)
    for (size_t n = 0; n < map.values.size(); ++n) {
      const auto [x, y] = place_of(map, n);
      if (std::abs(x - at[0]) > kWindow_mm[0] / 2 || std::abs(y - at[1]) > kWindow_mm[1] / 2)
        map.values[n] = std::numeric_limits<float>::quiet_NaN();
    }
  return {"press", seen, 0};
}

lump::Estimate estimate_of(const lump::ScanMap& map) {
  return lump::Network::built_in().estimate(map.observation, lump::Method::Refined);
}

double length_of(const lump::Value& value) {
  return std::log(value.high / value.low);
}

double length_of(const lump::Estimate& e) {
  return std::cbrt(length_of(e.size_mm) * length_of(e.depth_mm) * length_of(e.stiffness_ratio));
}

TEST(NextPress, ALumpAtTheWindowsEdgeIsPressedFromItsOtherSide) {
  // The ball's foot lies below the window.
  const lump::ScanPress first = press_at({0, 4}, true, 1);
  const lump::ScanMap map = lump::stitch({first});
  const lump::Estimate estimate = estimate_of(map);
  ASSERT_TRUE(reports_numbers(estimate.verdict));
  const auto next = next_press(kModel, map, estimate, {.window_mm = kWindow_mm});
  ASSERT_TRUE(next);
  EXPECT_LE(next->at_mm[1], 0) << next->at_mm[0] << ", " << next->at_mm[1];
  EXPECT_LE(std::abs(next->at_mm[0]), 4);
  EXPECT_DOUBLE_EQ(next->force_N, 1.6);

  const auto after = [&](const Place& at) {
    return length_of(estimate_of(lump::stitch({first, press_at(at, true, 2)})));
  };
  const double told = std::cbrt(next->narrower[0] * next->narrower[1] * next->narrower[2]);
  const double found = after(next->at_mm) / length_of(estimate);
  std::printf("intervals of %.2f of their length told, %.2f found\n", told, found);
  EXPECT_LT(found, 0.9);
  // What the shapes are that it rules out is not foreseen, so that more may be found than told.
  EXPECT_LT(found, 1.35 * told);
  EXPECT_LT(found, after({-next->at_mm[0], 10}) / length_of(estimate)) << "a press on the far side";
}

TEST(NextPress, WithoutALumpWhatWasNotSeenIsPressed) {
  const Place corner = {-6, -10};
  std::vector<lump::ScanPress> presses = {press_at(corner, false, 1)};
  lump::ScanMap map = lump::stitch(presses);
  auto next = next_press(kModel, map, estimate_of(map), {.window_mm = kWindow_mm});
  ASSERT_TRUE(next);
  EXPECT_GT(next->at_mm[1], 5);
  EXPECT_GT(next->shows_fraction, 0.3);
  EXPECT_TRUE(std::isnan(next->narrower[0]));
  for (int count = 0; next && count < 8; ++count) {
    presses.push_back(press_at(next->at_mm, false, 2 + presses.size()));
    map = lump::stitch(presses);
    next = next_press(kModel, map, estimate_of(map), {.window_mm = kWindow_mm});
  }
  EXPECT_FALSE(next);
  EXPECT_LE(presses.size(), 7u) << "six on a raster";
  EXPECT_GT(map.seen_fraction, 0.95);
  EXPECT_NE(next_press_rows(next, estimate_of(map))[0].second.find("was seen"), std::string::npos);
}

TEST(NextPress, ALumpThatWasSeenOftenNeedsNoMore) {
  std::vector<lump::ScanPress> presses;
  for (uint32_t seed = 1; seed <= 9; ++seed)
    presses.push_back(press_at({0, seed % 3 * 6.0 - 9}, true, seed, {0, -3}));
  const lump::ScanMap map = lump::stitch(presses);
  const lump::Estimate estimate = estimate_of(map);
  ASSERT_TRUE(reports_numbers(estimate.verdict));
  const auto next = next_press(kModel, map, estimate, {.window_mm = kWindow_mm});
  EXPECT_FALSE(next) << next->reason;
  EXPECT_NE(next_press_rows(next, estimate)[0].second.find("narrow"), std::string::npos);
}

TEST(NextPress, ASensorsRangeBoundsTheForce) {
  const lump::ScanMap map = lump::stitch({press_at({0, 4}, true, 1)});
  const lump::Estimate estimate = estimate_of(map);
  const auto free = next_press(kModel, map, estimate, {.window_mm = kWindow_mm});
  ASSERT_TRUE(free);
  EXPECT_NEAR(free->harder_N, 1.5 * 1.6, 1e-9);
  EXPECT_LT(free->harder_narrower[0], free->narrower[0]);
  const auto bounded = next_press(
      kModel, map, estimate, {.window_mm = kWindow_mm, .full_scale_Pa = free->harder_peak_Pa / 1.5 / 0.9});
  ASSERT_TRUE(bounded);
  EXPECT_EQ(bounded->harder_N, 0);
}

TEST(NextPress, AWindowThatIsNoneIsRefused) {
  const lump::ScanMap map = lump::stitch({press_at({0, 4}, true, 1)});
  EXPECT_THROW((void)next_press(kModel, map, estimate_of(map), {.window_mm = {0, 20}}), Error);
}

}  // namespace
}  // namespace palpate
