// Presses by hand in recordings of the synthetic block, held against what its hand did.
#include "capture/run/palpation/hand_recording.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "capture/synthetic/tissue.h"
#include "engine/lump/network/network.h"
#include "engine/palpation/hand/hand_scan.h"
#include "engine/palpation/hand/light_relief.h"
#include "engine/palpation/press_detector.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr double kPerDegree = std::numbers::pi / 180;

HandRecording read_tissue(const std::string& keys) {
  std::vector<std::string> notes;
  return read_hand_presses({"synthetic:tissue?size=320x240&cells=16&" + keys}, "", {}, notes, {});
}

/// The first frame of each press at its highest force.
std::vector<uint64_t> tops(const TissueSensor& source) {
  std::vector<uint64_t> found;
  for (uint64_t k = 1; k < *source.frame_count(); ++k)
    if (source.block_force_N(k) > 0 && source.block_force_N(k - 1) < source.block_force_N(k) &&
        source.block_force_N(k + 1) <= source.block_force_N(k))
      found.push_back(k);
  return found;
}

/// Where the pad is, trembling, in the frames of a press that the highest load is read from.
HeldPose held_when_read(const TissueSensor& source, uint64_t top, double top_N) {
  uint64_t first = top, last = top;
  while (source.block_force_N(first - 1) > 0) --first;
  while (source.block_force_N(last + 1) > 0) ++last;
  std::vector<double> force_N;
  for (uint64_t k = first; k <= last; ++k) force_N.push_back(source.block_force_N(k));
  const std::vector<size_t> read = plan_press("", force_N, top_N, PressReading{}.loads).loads.back();
  HeldPose mean = source.held(top);
  mean.at_mm = {0, 0};
  for (const size_t i : read)
    for (size_t c = 0; c < 2; ++c)
      mean.at_mm[c] += source.held(first + i).at_mm[c] / static_cast<double>(read.size());
  return mean;
}

TEST(HandRecording, PlacesAndTiltsAreThoseOfTheHand) {
  const std::string keys = "hand=9&d=12&h=3&ratio=4&rate=20";
  const HandRecording recording = read_tissue(keys);
  for (const auto& [name, reason] : recording.left_out) std::printf("%s: %s\n", name.c_str(), reason.c_str());
  ASSERT_EQ(recording.presses.size(), 9u);
  const HandScan scan = hand_scan(recording.presses, lump::Network::built_in().model());
  const TissueSensor source(parse_tissue("synthetic:tissue?size=320x240&cells=16&" + keys));
  const std::vector<uint64_t> frames = tops(source);
  ASSERT_EQ(frames.size(), 9u);
  std::vector<double> highest_N;
  for (const uint64_t frame : frames) highest_N.push_back(source.block_force_N(frame));
  const double top_N = common_force_N(highest_N);
  const HeldPose first = held_when_read(source, frames[0], top_N);
  const double c = std::cos(first.turn_rad), s = std::sin(first.turn_rad);
  double places = 0, turns = 0, tilts = 0, count = 0, in_errors = 0;
  const auto variance = [&](size_t of) { return scan.places.covariance[of * 3 * 9 + of]; };
  for (size_t p = 1; p < 9; ++p) {
    if (!scan.left_out[p].empty()) continue;
    ++count;
    const HeldPose held = held_when_read(source, frames[p], top_N);
    // The first press's frame is the map's.
    const double x = held.at_mm[0] - first.at_mm[0], y = held.at_mm[1] - first.at_mm[1];
    const double off_x = scan.places.places[p].at_mm[0] - (c * x + s * y),
                 off_y = scan.places.places[p].at_mm[1] - (c * y - s * x);
    places += off_x * off_x + off_y * off_y;
    in_errors += off_x * off_x / variance(3 * p) + off_y * off_y / variance(3 * p + 1);
    turns += std::pow(scan.places.places[p].turn_rad - (held.turn_rad - first.turn_rad), 2);
    tilts += std::pow(scan.tilt[p].x_deg - held.tilt_rad[0] / kPerDegree, 2) +
             std::pow(scan.tilt[p].y_deg - held.tilt_rad[1] / kPerDegree, 2);
  }
  std::printf("RMS of a place %.3f mm or %.1f of its stated errors, a turn %.2f, a tilt %.2f degrees\n",
              std::sqrt(places / (2 * count)), std::sqrt(in_errors / (2 * count)),
              std::sqrt(turns / count) / kPerDegree, std::sqrt(tilts / (2 * count)));
  EXPECT_GE(count, 7);
  EXPECT_LT(std::sqrt(places / (2 * count)), 0.05);
  EXPECT_LT(std::sqrt(in_errors / (2 * count)), 2.5);
  EXPECT_LT(std::sqrt(turns / count), 0.5 * kPerDegree);
  EXPECT_LT(std::sqrt(tilts / (2 * count)), 1);
}

TEST(HandRecording, ASlideIsReadAtPlacesAlongIt) {
  const std::string keys = "hand=2&slide=12&d=12&h=3&ratio=4&rate=20";
  const HandRecording recording = read_tissue(keys);
  for (const HandPress& press : recording.presses) EXPECT_EQ(press.observation.pressure_Pa.size(), 4u);
  ASSERT_GE(recording.presses.size(), 4u);
  const HandScan scan = hand_scan(recording.presses, lump::Network::built_in().model());
  std::array<double, 2> end_mm{};
  for (size_t p = 0; p < recording.presses.size(); ++p) {
    if (recording.presses[p].name.rfind("press 1", 0) != 0) break;
    const HandPlace& place = scan.places.places[p];
    EXPECT_TRUE(place.placed) << place.reason;
    EXPECT_TRUE(p == 0 || place.at_mm[0] > end_mm[0] + 3) << p;
    end_mm = place.at_mm;
  }
  // Along x, from the block's middle: the last place lies less than a step before the end.
  std::printf("a slide by 12 mm was read up to %.2f, %.2f mm\n", end_mm[0], end_mm[1]);
  EXPECT_GT(end_mm[0], 12 - 6);
  EXPECT_LT(end_mm[0], 12.3);
  EXPECT_LT(std::abs(end_mm[1]), 0.4);
}

TEST(HandRecording, WithoutAPressItSaysHowHardItWasTouched) {
  std::vector<std::string> notes;
  RecordedOptions stiff;
  stiff.young_Pa = 1e6;
  try {
    read_hand_presses({"synthetic:tissue?size=160x120&cells=16&hand=2&lump=none&rate=5"}, "", stiff, notes,
                      {});
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.failure(), Failure::Input);
    EXPECT_NE(std::string(error.what()).find("a press of 24 N or more"), std::string::npos) << error.what();
  }
}

TEST(LightRelief, TellsTheSkinNotThePressureUnderIt) {
  // Ridges 1.5 mm apart, a tenth of a pressure that rises to the right.
  const auto press = [](double rise) {
    PressureMap map{120, 60, {0.15, 0.15}, {}};
    for (uint32_t j = 0; j < map.height; ++j)
      for (uint32_t i = 0; i < map.width; ++i)
        map.values.push_back(static_cast<float>(500 * (1 + rise * i / map.width) *
                                                (1 + 0.1 * std::sin(2 * std::numbers::pi * i / 10.0))));
    return relief_of_pressure(map, 1);
  };
  const SkinRelief level = press(0), tilted = press(0.5);
  for (const uint32_t i : {40u, 55u, 62u, 78u}) {
    const size_t n = size_t{30} * level.width + i;
    EXPECT_TRUE(level.contact[n]);
    EXPECT_NEAR(level.depth_mm[n], 0.01 * std::sin(2 * std::numbers::pi * i / 10.0), 0.0015) << i;
    EXPECT_NEAR(tilted.depth_mm[n], level.depth_mm[n], 0.001) << i;
  }
}

TEST(LightRelief, WhatHangsOverTheRimIsNotSeen) {
  PressureMap map{9, 5, {1.25, 1.25}, std::vector<float>(45, 400)};
  for (uint32_t j = 0; j < 5; ++j) map.values[size_t{j} * 9 + 8] = 30;
  hide_untouched(map);
  for (uint32_t j = 0; j < 5; ++j) {
    EXPECT_TRUE(std::isnan(map.at(8, j)));
    EXPECT_TRUE(std::isnan(map.at(7, j))) << "its cell may lie over the rim";
    EXPECT_EQ(map.at(6, j), 400);
  }
}

TEST(PressDetector, FindsEachPressOfARecording) {
  const double none = std::nan("");
  const std::vector<double> force_N = {0, 0.1, 0.8, 1, 0.9, 0.2, 0, 0, 0.5, 2, 2, none, 2, 0, 0, 0.02, 0};
  const std::vector<PressSpan> found = find_presses(force_N, 0.05);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].first, 1u);
  EXPECT_EQ(found[0].last, 4u);
  EXPECT_EQ(found[0].highest_N, 1);
  EXPECT_EQ(found[1].first, 8u);
  EXPECT_EQ(found[1].last, 10u) << "until the gauge has no reading";
}

}  // namespace
}  // namespace palpate
