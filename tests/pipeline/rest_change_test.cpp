#include "engine/pipeline/rest_change.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace palpate {
namespace {

constexpr uint32_t kCellsX = 40, kCellsY = 30;

/// A pad at rest whose surface errs by a bowl that stays, and a contact in its middle.
struct Pad {
  std::vector<float> means_mm;
  std::vector<uint8_t> at_rest;

  Pad(double level_mm, double noise_mm, uint32_t contact_left, uint32_t seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> noise(0, 1);
    for (uint32_t y = 0; y < kCellsY; ++y)
      for (uint32_t x = 0; x < kCellsX; ++x) {
        const double bowl_mm = 0.05 * std::pow(x / 20.0 - 1, 2) + 0.03 * x / 40.0;
        const bool touched = x >= contact_left && x < contact_left + 12 && y >= 10 && y < 20;
        const double height_mm = level_mm + bowl_mm + noise_mm * noise(random) - (touched ? 0.5 : 0);
        means_mm.push_back(static_cast<float>(height_mm));
        at_rest.push_back(touched ? 0 : 1);
      }
  }
  PadAtRest rest() const {
    double sum = 0, cells = 0;
    for (size_t i = 0; i < at_rest.size(); ++i)
      if (at_rest[i] != 0) sum += double{means_mm[i]}, ++cells;
    return {.level_mm = sum / cells,
            .level_sd_mm = 0.02,
            .cells_x = kCellsX,
            .means_mm = means_mm,
            .at_rest = at_rest};
  }
};

// The mean of what is at rest changes by 0.002 mm as the contact moves over the bowl, the pad itself does
// not.
TEST(RestChange, WhatStaysWithThePadIsNoChange) {
  const Pad before(0, 0.001, 4, 1), after(0.01, 0.001, 24, 2);
  RestChange change;
  const RestChange::Level first = change.since(before.rest());
  EXPECT_EQ(first.mm, before.rest().level_mm);
  EXPECT_EQ(first.sd_mm, 0);
  change.begin(before.rest(), first.mm);
  EXPECT_GT(std::abs(after.rest().level_mm - before.rest().level_mm - 0.01), 0.001);
  const RestChange::Level level = change.since(after.rest());
  EXPECT_NEAR(level.mm, first.mm + 0.01, 2e-4);
  EXPECT_LT(level.sd_mm, 3e-4);
  EXPECT_GT(level.sd_mm, 1e-5);
}

// A change that differs from part to part is what the level may be wrong by.
TEST(RestChange, UnevenChangeIsTheLevelsError) {
  const Pad before(0, 0, 14, 1);
  Pad after(0, 0, 14, 1);
  for (uint32_t y = 0; y < kCellsY; ++y)
    for (uint32_t x = 0; x < kCellsX; ++x) after.means_mm[size_t{y} * kCellsX + x] += x < 20 ? 0.01f : -0.01f;
  RestChange change;
  change.begin(before.rest(), 0);
  const RestChange::Level level = change.since(after.rest());
  EXPECT_GT(level.sd_mm, 0.005);
}

// Skin next to an object that was taken for at rest.
TEST(RestChange, FewWrongCellsDoNotMoveTheLevel) {
  const Pad before(0, 0.001, 14, 1);
  Pad after(0, 0.001, 14, 3);
  for (uint32_t y = 0; y < kCellsY; ++y)
    for (uint32_t x = 8; x < 16; ++x) after.means_mm[size_t{y} * kCellsX + x] -= 0.1f;
  RestChange change;
  change.begin(before.rest(), 0);
  const RestChange::Level level = change.since(after.rest());
  EXPECT_NEAR(level.mm, 0, 5e-4);
  EXPECT_LT(level.sd_mm, 1e-3);
}

TEST(RestChange, TiltIsOfStepsBetweenParts) {
  const Pad before(0, 0, 14, 1);
  Pad after(0, 0, 14, 1);
  for (uint32_t y = 0; y < kCellsY; ++y)
    for (uint32_t x = 0; x < kCellsX; ++x) {
      after.means_mm[size_t{y} * kCellsX + x] +=
          0.001f * static_cast<float>(x) + 0.001f * static_cast<float>(y);
    }
  RestChange change;
  change.begin(before.rest(), 0);
  EXPECT_NEAR(change.since(after.rest()).tilt_sd_per_cell, 1.48 * 0.001 / std::sqrt(2.0), 1e-4);
}

TEST(RestChange, IsAsStatedWhereTooLittleIsAtRest) {
  const Pad before(0, 0.001, 14, 1);
  Pad after(0.3, 0.001, 14, 2);
  std::fill(after.at_rest.begin() + 60, after.at_rest.end(), uint8_t{0});
  RestChange change;
  change.begin(before.rest(), 0);
  const PadAtRest rest = after.rest();
  EXPECT_EQ(change.since(rest).mm, rest.level_mm);
  EXPECT_GT(change.since(rest).sd_mm, 0.01);
  const PadAtRest unknown{.level_mm = 0.2, .level_sd_mm = 0.02};
  EXPECT_EQ(change.since(unknown).mm, 0.2);
  EXPECT_GT(change.since(unknown).sd_mm, 0.01);
}

}  // namespace
}  // namespace palpate
