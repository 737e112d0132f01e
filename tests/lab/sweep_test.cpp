// The sweep of a data set of lumps: even, inside its ranges, and the same case for the same number.
#include "perf/lab/dataset/sweep.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "engine/numeric/sobol.h"
#include "lump_cases.h"
#include "palpate/error.h"

namespace palpate {
namespace {

TEST(Sobol, EveryIntervalOfEveryCoordinateHoldsOnePoint) {
  for (const uint64_t seed : {1, 2, 77})
    for (const uint32_t begin : {0u, 512u, 3u * 512u}) {
      std::array<std::set<int>, kSobolDimensions> taken;
      for (uint32_t n = begin; n < begin + 512; ++n) {
        const auto point = sobol(seed, n);
        for (size_t d = 0; d < kSobolDimensions; ++d) {
          ASSERT_GT(point[d], 0);
          ASSERT_LT(point[d], 1);
          taken[d].insert(static_cast<int>(point[d] * 512));
        }
      }
      for (const std::set<int>& places : taken) EXPECT_EQ(places.size(), 512u);
    }
}

// Random points would leave a mean product of 0.0026; and a wrong table leaves coordinates that follow each
// other.
TEST(Sobol, CoordinatesAreIndependent) {
  constexpr uint32_t kPoints = 4096;
  for (const uint64_t seed : {1, 5}) {
    double products[kSobolDimensions][kSobolDimensions] = {};
    for (uint32_t n = 0; n < kPoints; ++n) {
      const auto p = sobol(seed, n);
      for (size_t i = 0; i < kSobolDimensions; ++i)
        for (size_t j = 0; j < i; ++j) products[i][j] += (p[i] - 0.5) * (p[j] - 0.5) / kPoints;
    }
    for (size_t i = 0; i < kSobolDimensions; ++i)
      for (size_t j = 0; j < i; ++j) EXPECT_LT(std::abs(products[i][j]), 0.0004) << i << " " << j;
  }
}

TEST(Sobol, SeedsDiffer) {
  int same = 0;
  for (uint32_t n = 0; n < 100; ++n) same += std::abs(sobol(1, n)[0] - sobol(2, n)[0]) < 0.01;
  EXPECT_LT(same, 10);
}

void expect_fits(const lump::Sweep& s, const lump::Case& what) {
  EXPECT_GE(what.thickness_mm, s.thickness_mm.low);
  EXPECT_LE(what.thickness_mm, s.thickness_mm.high);
  EXPECT_GE(what.young_Pa, s.young_Pa.low);
  EXPECT_LE(what.young_Pa, s.young_Pa.high);
  ASSERT_EQ(what.press_mm.size(), s.loads);
  EXPECT_TRUE(std::is_sorted(what.press_mm.begin(), what.press_mm.end()));
  EXPECT_GE(what.press_mm.back(), s.greatest_press.low * what.thickness_mm * (1 - 1e-12));
  EXPECT_LE(what.press_mm.back(), s.greatest_press.high * what.thickness_mm * (1 + 1e-12));
  check(scene_of(s, what));
  if (!what.lump) return;
  const lump::Case::Lump& lump = *what.lump;
  EXPECT_GE(lump.diameter_mm, s.size_mm.low);
  EXPECT_LE(lump.diameter_mm, s.size_mm.high);
  EXPECT_GE(lump.depth_mm, s.depth_mm.low);
  EXPECT_LE(lump.depth_mm, s.depth_mm.high);
  EXPECT_GE(lump.stiffness_ratio, s.stiffness_ratio.low);
  EXPECT_LE(lump.stiffness_ratio, s.stiffness_ratio.high * (1 + 1e-12));
  const std::array<double, 3> size = lump.size_mm();
  EXPECT_LE(lump.depth_mm + size[2], what.thickness_mm - s.floor_mm + 1e-9);
  for (size_t c = 0; c < 2; ++c) {
    EXPECT_LE(std::abs(lump.offset_mm[c]), s.offset_mm);
    EXPECT_LE(std::abs(lump.offset_mm[c]) + size[c] / 2, s.block_mm[c] / 2 - s.rim_mm + 1e-9);
  }
}

TEST(LumpSweep, AllCasesLieInTheirRangesAndFit) {
  const lump::Sweep sweep;
  lump::Sweep tight;
  tight.thickness_mm = {7, 9};
  tight.block_mm = {24, 16};
  lump::Sweep exact = tight;  // the smallest lump just fits
  exact.thickness_mm = {6.5, 6.5};
  exact.block_mm = {14, 14};
  for (const lump::Sweep& s : {sweep, tight, exact}) {
    check(s);
    for (uint32_t n = 0; n < 2000; ++n) {
      SCOPED_TRACE(n);
      expect_fits(s, lump_case(s, n));
      if (HasFailure()) return;
    }
  }
}

TEST(LumpSweep, SecondLumpsLieBesideTheFirst) {
  lump::Sweep sweep;
  sweep.size_mm = {5, 8};
  sweep.no_lump_fraction = 0;
  sweep.second_gap_mm = 1.5;
  sweep.shapes = {InclusionShape::Sphere, InclusionShape::Cylinder};
  check(sweep);
  double nearest_mm = 1e9, farthest_mm = 0;
  for (uint32_t n = 0; n < 500; ++n) {
    const lump::Case what = lump_case(sweep, n);
    ASSERT_TRUE(what.second) << n;
    expect_fits(sweep, what);
    lump::Case other = what;
    other.lump = what.second;
    other.second.reset();
    expect_fits(sweep, other);
    const double apart = std::hypot(what.lump->offset_mm[0] - what.second->offset_mm[0],
                                    what.lump->offset_mm[1] - what.second->offset_mm[1]);
    const double gap = apart - (what.lump->diameter_mm + what.second->diameter_mm) / 2;
    nearest_mm = std::min(nearest_mm, gap);
    farthest_mm = std::max(farthest_mm, apart);
  }
  EXPECT_GE(nearest_mm, 1.5 - 1e-9);
  EXPECT_LT(nearest_mm, 1.8);
  EXPECT_GT(farthest_mm, 14);
  EXPECT_EQ(lump::sweep_from_json(lump::to_json(sweep).dump()).second_gap_mm, 1.5);
  sweep.size_mm = {5, 14};
  EXPECT_THROW(check(sweep), Error) << "no room for two";
}

TEST(LumpSweep, FillsItsRangesEvenly) {
  lump::Sweep sweep;
  sweep.thickness_mm = {30, 30};  // nothing is squeezed
  sweep.block_mm = {80, 80};
  constexpr uint32_t kCases = 2048;
  int without = 0, along_y = 0, long_ones = 0, centred = 0;
  std::array<int, 4> shapes{}, diameters{}, depths{}, ratios{};
  for (uint32_t n = 0; n < kCases; ++n) {
    const lump::Case what = lump_case(sweep, n);
    if (!what.lump) {
      ++without;
      continue;
    }
    centred += what.lump->offset_mm[0] == 0 && what.lump->offset_mm[1] == 0;
    ++shapes[static_cast<size_t>(what.lump->shape)];
    ++diameters[static_cast<size_t>(std::log(what.lump->diameter_mm / 4) / std::log(14 / 4.) * 4)];
    ++depths[static_cast<size_t>(std::log(what.lump->depth_mm / 1.5) / std::log(10 / 1.5) * 4)];
    ++ratios[static_cast<size_t>(std::log(what.lump->stiffness_ratio / 1.3) / std::log(40 / 1.3) * 4)];
    const auto size = what.lump->size_mm();
    if (size[0] != size[1]) ++long_ones;
    along_y += what.lump->along_y;
  }
  const double with = kCases - without;
  EXPECT_NEAR(without, kCases / 12.0, 2);
  for (const auto& counts : {shapes, diameters, depths, ratios})
    for (const int count : counts) EXPECT_NEAR(count, with / 4, 0.03 * with / 4);
  EXPECT_NEAR(centred, 0.67 * with, 0.03 * with);
  EXPECT_NEAR(along_y, long_ones / 2.0, 0.05 * long_ones);
}

// Files refuse what their sweep would not make again: this sequence is part of their format.
TEST(LumpSweep, ACaseIsItsNumberForEver) {
  lump::Sweep even;
  even.logarithmic = false;
  const lump::Case what = lump_case(even, 12345);
  ASSERT_TRUE(what.lump);
  const lump::Case again = lump_case(even, 12345);
  EXPECT_EQ(what.lump->diameter_mm, again.lump->diameter_mm);
  EXPECT_EQ(what.press_mm, again.press_mm);
  EXPECT_NEAR(what.thickness_mm, 19.481614354067, 1e-9);
  EXPECT_NEAR(what.lump->diameter_mm, 11.654202164849, 1e-9);
  EXPECT_NEAR(what.lump->depth_mm, 5.095061306414, 1e-9);
  EXPECT_NEAR(what.lump->stiffness_ratio, 2.662091656994, 1e-9);
  EXPECT_EQ(to_string(what.lump->shape), std::string("ellipsoid"));
  const lump::Case spread = lump_case(lump::Sweep(), 12345);
  EXPECT_NEAR(std::log(spread.lump->diameter_mm / 4) / std::log(14 / 4.), (what.lump->diameter_mm - 4) / 10,
              1e-12);
  EXPECT_EQ(spread.lump->stiffness_ratio, what.lump->stiffness_ratio);
}

TEST(LumpSweep, MapsHaveTheAxesOfTheCase) {
  lump::Sweep sweep = small_sweep();
  sweep.nodes = {41, 31};
  sweep.block_mm = {40, 36};
  sweep.shapes = {InclusionShape::Ellipsoid, InclusionShape::LyingCylinder};
  int checked[2] = {};
  for (uint32_t n = 0; n < 40; ++n) {
    const lump::Sample sample = quick_sample(sweep, n);
    if (!sample.what.lump) continue;
    const PressureMap& map = sample.pressure_Pa[0];
    ASSERT_EQ(map.width, 41u);
    ASSERT_EQ(map.height, 31u);
    EXPECT_DOUBLE_EQ(map.pitch_mm[1], 1.2);
    // Centre and spread of the bump.
    double sum = 0, first[2] = {}, second[2] = {};
    const float rest = *std::min_element(map.values.begin(), map.values.end());
    for (uint32_t y = 0; y < map.height; ++y)
      for (uint32_t x = 0; x < map.width; ++x) {
        const double bump = double{map.at(x, y)} - double{rest};
        const double at[2] = {x * map.pitch_mm[0] - 20, y * map.pitch_mm[1] - 18};
        sum += bump;
        for (size_t c = 0; c < 2; ++c) first[c] += bump * at[c], second[c] += bump * at[c] * at[c];
      }
    for (size_t c = 0; c < 2; ++c) first[c] /= sum, second[c] = second[c] / sum - first[c] * first[c];
    for (size_t c = 0; c < 2; ++c) EXPECT_NEAR(first[c], sample.what.lump->offset_mm[c], 1.5) << n;
    EXPECT_EQ(second[1] > second[0], sample.what.lump->along_y) << n;
    ++checked[sample.what.lump->along_y];
  }
  EXPECT_GT(checked[0], 5);
  EXPECT_GT(checked[1], 5);
}

TEST(LumpSweep, GoesThroughJson) {
  lump::Sweep sweep = small_sweep(uint64_t{1} << 60);
  sweep.shapes = {InclusionShape::LyingCylinder};
  sweep.young_Pa = {1234.5, 1.0 / 3 * 1e5};
  const std::string line = lump::to_json(sweep).dump();
  EXPECT_EQ(lump::to_json(lump::sweep_from_json(line)).dump(), line);
  for (const char* text : {"", "{}", "nonsense", "[1]"})
    EXPECT_THROW(lump::sweep_from_json(text), Error) << text;
  std::string other = line;
  other.replace(other.find("lying"), 5, "cubic");
  EXPECT_THROW(lump::sweep_from_json(other), Error);
}

TEST(LumpSweep, SkinsChangeNothingElse) {
  lump::Sweep plain;
  plain.depth_mm.low = 3.2;
  lump::Sweep skinned = plain;
  skinned.skin_mm = {1, 3};
  skinned.skin_ratio = {0.3, 5};
  check(skinned);
  const std::string line = lump::to_json(skinned).dump();
  EXPECT_EQ(lump::to_json(lump::sweep_from_json(line)).dump(), line);
  EXPECT_EQ(lump::to_json(plain).dump().find("skin"), std::string::npos);
  double thick = 0, stiff = 0;
  constexpr uint32_t kCases = 500;
  for (uint32_t n = 0; n < kCases; ++n) {
    const lump::Case a = lump_case(plain, n), b = lump_case(skinned, n);
    ASSERT_TRUE(b.skin && !a.skin);
    EXPECT_EQ(a.thickness_mm, b.thickness_mm);
    EXPECT_EQ(a.press_mm, b.press_mm);
    if (a.lump) {
      EXPECT_EQ(a.lump->diameter_mm, b.lump->diameter_mm);
      EXPECT_EQ(a.lump->stiffness_ratio, b.lump->stiffness_ratio);
    }
    check(scene_of(skinned, b));
    thick += b.skin->thickness_mm / kCases;
    stiff += std::log(b.skin->stiffness_ratio) / kCases;
  }
  EXPECT_NEAR(thick, 2, 0.02);
  EXPECT_NEAR(stiff, std::log(0.3 * 5) / 2, 0.03);
}

TEST(LumpSweep, APlateChangesNothingElse) {
  lump::Sweep slides, rubs, sticks;
  rubs.plate_friction = 0.1;
  sticks.plate_sticks = true;
  EXPECT_EQ(lump::to_json(slides).dump().find("plate"), std::string::npos);
  for (const lump::Sweep* sweep : {&rubs, &sticks}) {
    check(*sweep);
    const std::string line = lump::to_json(*sweep).dump();
    EXPECT_EQ(lump::to_json(lump::sweep_from_json(line)).dump(), line);
    for (uint32_t n = 0; n < 40; ++n) {
      const lump::Case a = lump_case(slides, n), b = lump_case(*sweep, n);
      EXPECT_EQ(a.press_mm, b.press_mm);
      EXPECT_EQ(a.lump.has_value(), b.lump.has_value());
      const fem::Scene scene = scene_of(*sweep, b);
      EXPECT_EQ(scene.plate_friction, sweep->plate_friction);
      EXPECT_EQ(scene.plate_sticks, sweep->plate_sticks);
      check(scene);
    }
  }
}

TEST(LumpSweep, RefusesWhatCannotBe) {
  const auto refused = [](const auto& change, const char* word) {
    lump::Sweep sweep;
    change(sweep);
    try {
      check(sweep);
      ADD_FAILURE() << word << " was accepted";
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
      EXPECT_EQ(error.failure(), Failure::Usage);
    }
  };
  refused([](lump::Sweep& s) { s.size_mm = {9, 4}; }, "diameter");
  refused([](lump::Sweep& s) { s.size_mm = {NAN, 4}; }, "diameter");
  refused([](lump::Sweep& s) { s.thickness_mm = {6, 20}; }, "6.5 mm thick");
  refused([](lump::Sweep& s) { s.block_mm = {40, 12}; }, "14 mm wide");
  refused([](lump::Sweep& s) { s.stiffness_ratio = {0, 4}; }, "stiffness");
  refused([](lump::Sweep& s) { s.greatest_press = {0.1, 0.6}; }, "press");
  refused([](lump::Sweep& s) { s.poisson = 0.5; }, "Poisson");
  refused([](lump::Sweep& s) { s.loads = 0; }, "loads");
  refused([](lump::Sweep& s) { s.cells = {32, 3, 16}; }, "cells");
  refused([](lump::Sweep& s) { s.coarser_cells = {24, 24, 16}; }, "proportions");
  refused([](lump::Sweep& s) { s.coarser_cells = {48, 48, 24}; }, "coarser cells");
  refused([](lump::Sweep& s) { s.nodes = {33, 1}; }, "nodes");
  refused([](lump::Sweep& s) { s.centred_fraction = -0.1; }, "middle");
  refused([](lump::Sweep& s) { s.skin_mm = {1, 2}; }, "below the skin");
  refused([](lump::Sweep& s) { s.plate_friction = 3; }, "friction");
  refused([](lump::Sweep& s) { s.plate_sticks = true, s.plate_friction = 1; }, "sticks");
  refused([](lump::Sweep& s) { s.shapes.clear(); }, "shape");
  refused([](lump::Sweep& s) { s.no_lump_fraction = 1.5; }, "without a lump");
}

}  // namespace
}  // namespace palpate
