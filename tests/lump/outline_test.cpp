// The outline of a bump on a block's map: where it is, how wide, with intervals that hold; and no outline
// where there is none.
#include "engine/lump/observation/outline.h"
#include "engine/fem/solve.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "palpate/error.h"

namespace palpate {
namespace {

struct Bump {
  double height_Pa = 800, x_mm = 3, y_mm = -2, long_mm = 4, short_mm = 3, angle_rad = 0.5;
};

/// A dome with a Gaussian on it, exactly as the fit has them.
lump::Observation observation(const Bump& b, double noise_Pa, uint64_t seed = 1) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> deviate(0, 1);
  lump::Observation r;
  r.noise_Pa = noise_Pa;
  r.force_N = {2};
  PressureMap map{33, 33, {1.25, 1.25}, {}};
  for (uint32_t j = 0; j < 33; ++j)
    for (uint32_t i = 0; i < 33; ++i) {
      const double x = (i - 16.0) * 1.25, y = (j - 16.0) * 1.25;
      const double dome = 1500 - 0.8 * (x * x + y * y) - 1e-3 * x * x * y * y + 2 * x;
      const double c = std::cos(b.angle_rad), s = std::sin(b.angle_rad), dx = x - b.x_mm, dy = y - b.y_mm;
      const double u = (c * dx + s * dy) / b.long_mm, v = (c * dy - s * dx) / b.short_mm;
      map.values.push_back(static_cast<float>(dome + b.height_Pa * std::exp(-0.5 * (u * u + v * v)) +
                                              noise_Pa * deviate(random)));
    }
  r.pressure_Pa = {map};
  return r;
}

bool within_interval(const lump::Value& value, double truth) {
  return value.low <= truth && truth <= value.high;
}

TEST(LumpOutline, AnExactBumpComesBack) {
  const Bump b;
  const lump::Outline o = outline_lump(observation(b, 0));
  ASSERT_TRUE(o.found) << o.reason;
  ASSERT_TRUE(o.closed) << o.reason;
  EXPECT_NEAR(o.x_mm.value, b.x_mm, 1e-3);
  EXPECT_NEAR(o.y_mm.value, b.y_mm, 1e-3);
  EXPECT_NEAR(o.height_Pa.value, b.height_Pa, 0.5);
  EXPECT_NEAR(o.half_widths_mm[0], b.long_mm, 1e-2);
  EXPECT_NEAR(o.half_widths_mm[1], b.short_mm, 1e-2);
  EXPECT_NEAR(o.angle_rad, b.angle_rad, 1e-2);
  // Half height of a Gaussian lies at s sqrt(2 ln 2).
  const double area = std::numbers::pi * b.long_mm * b.short_mm * 2 * std::log(2.0);
  EXPECT_NEAR(o.area_mm2.value, area, 0.02 * area);
  for (const auto& p : o.points_mm) {
    const double c = std::cos(b.angle_rad), s = std::sin(b.angle_rad), dx = p[0] - b.x_mm, dy = p[1] - b.y_mm;
    const double u = (c * dx + s * dy) / b.long_mm, v = (c * dy - s * dx) / b.short_mm;
    EXPECT_NEAR(std::sqrt(u * u + v * v), std::sqrt(2 * std::log(2.0)), 0.03);
  }
}

TEST(LumpOutline, ASoftPlaceIsADip) {
  const lump::Outline o = outline_lump(observation({.height_Pa = -300}, 10));
  ASSERT_TRUE(o.found) << o.reason;
  EXPECT_TRUE(o.closed);
  EXPECT_LT(o.height_Pa.high, 0);
}

// 90 % intervals hold the truth in about nine of ten noisy maps.
TEST(LumpOutline, IntervalsCover) {
  const Bump b;
  const double area = std::numbers::pi * b.long_mm * b.short_mm * 2 * std::log(2.0);
  int x = 0, height = 0, within = 0, tried = 0;
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    const lump::Outline o = outline_lump(observation(b, 25, seed), seed, 10);
    if (!o.found || !o.closed) continue;
    ++tried;
    x += within_interval(o.x_mm, b.x_mm);
    height += within_interval(o.height_Pa, b.height_Pa);
    within += within_interval(o.area_mm2, area);
  }
  EXPECT_EQ(tried, 20);
  EXPECT_GE(x, 15);
  EXPECT_GE(height, 15);
  EXPECT_GE(within, 14);
}

TEST(LumpOutline, NoBumpNoOutline) {
  int found = 0;
  for (uint64_t seed = 1; seed <= 8; ++seed) {
    const lump::Outline o = outline_lump(observation({.height_Pa = 0}, 20, seed), seed, 5);
    found += o.found;
    EXPECT_NE(o.found,
              o.reason.find("no bump") != std::string::npos || o.reason.find("wide") != std::string::npos);
    EXPECT_TRUE(o.found || o.points_mm.empty());
  }
  EXPECT_LE(found, 1);
}

TEST(LumpOutline, ALineThatLeavesWhatWasSeenIsOpen) {
  lump::Observation r = observation({}, 5);
  PressureMap& map = r.pressure_Pa[0];
  for (uint32_t j = 0; j < map.height; ++j)
    for (uint32_t i = 20; i < map.width; ++i) map.values[size_t{j} * map.width + i] = NAN;
  const lump::Outline o = outline_lump(r);
  EXPECT_FALSE(o.closed);
  EXPECT_TRUE(o.points_mm.empty());
  EXPECT_FALSE(o.reason.empty());
  for (float& value : map.values) value = NAN;
  EXPECT_THROW(outline_lump(r), Error);
}

// On a solved block: the bump of a sphere sits over it and is round.
TEST(LumpOutline, OverASolvedLump) {
  fem::Scene scene;
  scene.inclusion->offset_mm = {4, -3};
  scene.cells = {32, 32, 16};
  const fem::Result solved = fem::solve(scene);
  lump::Observation r;
  r.pressure_Pa = {solved.stress_Pa};
  r.force_N = {solved.force_N};
  r.noise_Pa = 2;
  const lump::Outline o = outline_lump(r);
  ASSERT_TRUE(o.found && o.closed) << o.reason;
  EXPECT_NEAR(o.x_mm.value, 4, 0.3);
  EXPECT_NEAR(o.y_mm.value, -3, 0.3);
  EXPECT_NEAR(o.half_widths_mm[0] / o.half_widths_mm[1], 1, 0.1);
  EXPECT_GT(o.width_mm.value, 6);
  EXPECT_LT(o.width_mm.value, 12);
  scene.inclusion.reset();
  r.pressure_Pa = {fem::solve(scene).stress_Pa};
  EXPECT_FALSE(outline_lump(r).found);
}

}  // namespace
}  // namespace palpate
