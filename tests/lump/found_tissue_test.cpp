// The tissue's modulus by the way of the plate: blocks of another program's finite elements, of one's own,
// and what contradicts itself.
#include "engine/lump/tissue/found_tissue.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "engine/lump/error_sources.h"
#include "engine/lump/network/network.h"
#include "engine/lump/tissue/block_stiffness.h"
#include "palpate/error.h"
#include "tests/support/calculix.h"

namespace palpate {
namespace {

using lump::FoundTissue;
using lump::TissuePrior;

constexpr double kUnknown = std::numeric_limits<double>::infinity();

/// A block that CalculiX pressed, its modulus not told.
lump::Observation untold(const CalculixCase& block) {
  lump::Observation o;
  o.block_mm = block.scene.block_mm;
  o.young_Pa = 0;
  for (const CalculixCase::Load& load : block.loads) {
    o.pressure_Pa.push_back(without_rim(load.pressure_Pa));
    o.force_N.push_back(load.force_N);
    o.press_mm.push_back(load.press_mm);
  }
  const PressureMap& last = o.pressure_Pa.back();
  o.noise_Pa = 0.002 * double{*std::max_element(last.values.begin(), last.values.end())};
  return o;
}

lump::Estimator estimator(const lump::ErrorSources& sources = {}) {
  return {[](const lump::Observation& o) { return lump::Network::built_in().estimate(o); }, sources};
}

/// The same block of stated stiffness, on loads that the relation itself makes.
lump::Observation by_relation(double young_Pa, double thickness_mm) {
  lump::Observation o;
  o.block_mm = {40, 40, thickness_mm};
  o.young_Pa = 0;
  for (const double compression : {0.05, 0.09, 0.12, 0.15}) {
    o.press_mm.push_back(compression * thickness_mm);
    o.force_N.push_back(1600e-6 * young_Pa *
                        lump::BlockStiffness::built_in().load(o.block_mm, std::nullopt, compression));
  }
  return o;
}

TEST(FoundTissue, AnotherProgramsBlocksHaveTheirModulus) {
  for (const char* name : {"plain", "small_ball", "cylinder", "deep_ellipsoid"}) {
    SCOPED_TRACE(name);
    const CalculixCase block = calculix_case(name);
    const lump::Estimate found = estimator()(untold(block));
    ASSERT_TRUE(found.tissue);
    const lump::Value& young = found.tissue->young_Pa;
    std::printf("%s: modulus %.0f Pa (%.0f to %.0f) of %.0f\n", name, young.value, young.low, young.high,
                block.scene.young_Pa);
    EXPECT_NEAR(young.value / block.scene.young_Pa, 1, 0.015);
    EXPECT_LE(young.low, block.scene.young_Pa);
    EXPECT_GE(young.high, block.scene.young_Pa);
    EXPECT_LT(young.high / young.low, 1.35);
    if (!block.scene.inclusion) {
      EXPECT_EQ(found.verdict, lump::Status::NoLump);
      continue;
    }
    ASSERT_TRUE(reports_numbers(found.verdict)) << to_string(found.verdict);
    EXPECT_LE(found.size_mm.low, block.scene.inclusion->size_mm[1]);
    EXPECT_GE(found.size_mm.high, block.scene.inclusion->size_mm[1]);
  }
}

TEST(FoundTissue, ALumpIsNotTakenForStifferTissue) {
  const CalculixCase block = calculix_case("cylinder");
  const lump::Observation o = untold(block);
  const double alone = find_tissue(o, {kUnknown, 0}, {}).young_Pa;
  const lump::Estimate found = estimator(lump::ErrorSources::none())(o);
  ASSERT_TRUE(found.tissue);
  EXPECT_GT(alone / block.scene.young_Pa, 1.02) << "without the lump that makes it stiffer";
  EXPECT_LT(std::abs(found.tissue->young_Pa.value / block.scene.young_Pa - 1),
            0.5 * (alone / block.scene.young_Pa - 1));
}

TEST(FoundTissue, AStatedModulusThatTheWayContradictsIsInconsistent) {
  lump::Observation o = untold(calculix_case("deep_ellipsoid"));
  for (const double factor : {0.7, 1.0, 1.4}) {
    o.young_Pa = 4000 * factor;
    const lump::Estimate found = estimator()(o);
    SCOPED_TRACE(factor);
    if (factor == 1) {
      EXPECT_TRUE(reports_numbers(found.verdict));
    } else {
      EXPECT_EQ(found.verdict, lump::Status::Inconsistent);
      ASSERT_FALSE(found.reasons.empty());
      EXPECT_NE(found.reasons.front().find("by the way of the plate"), std::string::npos);
    }
  }
}

TEST(FoundTissue, AWayThatIsHardlyKnownLeavesTheStatedModulus) {
  lump::Observation o = by_relation(4000, 20);
  o.young_Pa = 4800;
  o.press_sd_mm = 3;
  const FoundTissue found = find_tissue(o, {0.05, 0}, {});
  EXPECT_TRUE(found.contradiction.empty()) << found.contradiction;
  EXPECT_NEAR(found.young_Pa, 4800, 100);
  EXPECT_NEAR(found.young_sd, 0.05, 0.005);
}

TEST(FoundTissue, UnitsAndZerosThatAreWrongFitNoTissue) {
  lump::Observation o = by_relation(4000, 20);
  EXPECT_TRUE(find_tissue(o, {kUnknown, 0}, {}).contradiction.empty());
  for (double& way : o.press_mm) way += 0.6;  // counted from before the plate touches
  EXPECT_NE(find_tissue(o, {kUnknown, 0}, {}).contradiction.find("from where the plate touches"),
            std::string::npos);
}

/// Errors of the way as they are stated: intervals hold nine times in ten, and not always.
TEST(FoundTissue, IntervalsHoldWhatTheySay) {
  uint64_t state = 1;
  const auto normal = [&state] {
    double sum = -6;  // twelve even numbers make a normal one
    for (int i = 0; i < 12; ++i) {
      state = state * 6364136223846793005ULL + 1442695040888963407ULL;
      sum += static_cast<double>(state >> 11) / 9007199254740992.0;
    }
    return sum;
  };
  for (const double thickness_sd : {0.0, 0.03}) {
    int young = 0, thickness = 0, young_at_thickness = 0;
    constexpr int kTrials = 1000;
    for (int trial = 0; trial < kTrials; ++trial) {
      lump::Observation o = by_relation(6000, 20);
      const double zero_mm = std::sqrt(0.5) * o.press_sd_mm * normal();
      for (double& way : o.press_mm) way += zero_mm + std::sqrt(0.5) * o.press_sd_mm * normal();
      const double model = lump::BlockStiffness::built_in().plain_sd * normal();
      for (double& force : o.force_N) force *= std::exp(model + 0.002 * normal());
      const double off = thickness_sd * normal();
      o.block_mm[2] *= std::exp(off);
      const FoundTissue found = find_tissue(o, {kUnknown, thickness_sd}, {});
      const auto [by_way, thick] = found.tissue();
      young += by_way.low <= 6000 && by_way.high >= 6000;
      thickness += thick.low <= 20 && thick.high >= 20;
      const double given =
          std::log(found.young_Pa) + found.young_by_thickness * std::log(20 / found.thickness_mm);
      young_at_thickness += std::abs(given - std::log(6000)) < 1.645 * found.young_sd_at_thickness;
    }
    SCOPED_TRACE(thickness_sd);
    for (const int held : {young, young_at_thickness}) {
      EXPECT_GT(held, 0.87 * kTrials);
      EXPECT_LT(held, 0.93 * kTrials);
    }
    if (thickness_sd > 0) {
      EXPECT_GT(thickness, 0.87 * kTrials);
      EXPECT_LT(thickness, 0.93 * kTrials);
    }
  }
}

TEST(FoundTissue, BlocksBeyondTheRelationSayWhy) {
  lump::Observation thick = by_relation(4000, 20);
  thick.block_mm[2] = 30;
  lump::Observation wide = by_relation(4000, 20);
  wide.block_mm[0] = 50;
  lump::Observation deep = by_relation(4000, 20);
  deep.press_mm.back() = 7;
  for (const auto& [o, word] :
       {std::pair{thick, "16 to 24 mm"}, {wide, "40 x 40"}, {deep, "0.3 of the thickness"}}) {
    const lump::Estimate found = estimator()(o);
    EXPECT_EQ(found.verdict, lump::Status::Unusable);
    ASSERT_FALSE(found.reasons.empty());
    EXPECT_NE(found.reasons.front().find(word), std::string::npos) << found.reasons.front();
  }
}

TEST(FoundTissue, WaysThatAreNoneAreRefused) {
  lump::Observation few = by_relation(4000, 20), falling = few, endless = few;
  few.press_mm.pop_back();
  std::swap(falling.press_mm[0], falling.press_mm[1]);
  endless.press_mm[2] = std::numeric_limits<double>::quiet_NaN();
  for (const lump::Observation& o : {few, falling, endless})
    EXPECT_THROW((void)find_tissue(o, {kUnknown, 0}, {}), Error);
}

}  // namespace
}  // namespace palpate
