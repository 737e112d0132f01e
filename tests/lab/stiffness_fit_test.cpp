// The fit behind the modulus by the way of the plate, on blocks that a known relation presses.
#include "perf/lab/study/stiffness_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "palpate/error.h"

namespace palpate::lump {
namespace {

constexpr BlockStiffness kKnown{{0.2, -0.05, 0.01, 0.01, -0.02, -0.005, 0.001, 0.006, -0.01},
                                {-0.1, -0.9, 0.3, 0.2, -0.5, 0.1, -0.05, 0.05, 0.3, 0.2}};

std::vector<Example> pressed_blocks(size_t count, bool lump) {
  std::mt19937 random(lump ? 1 : 2);
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  std::vector<Example> all;
  for (size_t n = 0; n < count; ++n) {
    Example e;
    e.lump = lump;
    e.block_mm = {40, 40, between(16, 24)};
    e.young_Pa = between(2000, 30000);
    Case::Lump inside;
    inside.shape = e.shape = static_cast<InclusionShape>(n % 4);
    inside.diameter_mm = e.size_mm = between(5, 9);
    inside.depth_mm = e.depth_mm = between(2, 6);
    inside.stiffness_ratio = e.stiffness_ratio = between(2, 30);
    inside.offset_mm = e.offset_mm = {between(-6, 6), between(-6, 6)};
    for (const double compression : {0.05, 0.1, 0.15, 0.2}) {
      e.press_mm.push_back(compression * e.block_mm[2]);
      e.force_N.push_back(1600e-6 * e.young_Pa *
                          kKnown.load(e.block_mm, lump ? std::optional(inside) : std::nullopt, compression));
    }
    all.push_back(e);
  }
  return all;
}

TEST(StiffnessFit, FindsTheRelationThatPressedTheBlocks) {
  std::vector<Example> blocks = pressed_blocks(40, false);
  for (const Example& e : pressed_blocks(80, true)) blocks.push_back(e);
  const BlockStiffness fit = fit_stiffness(blocks);
  for (size_t i = 0; i < fit.plain.size(); ++i) EXPECT_NEAR(fit.plain[i], kKnown.plain[i], 1e-6) << i;
  for (size_t i = 0; i < fit.lump.size(); ++i) EXPECT_NEAR(fit.lump[i], kKnown.lump[i], 1e-4) << i;
  EXPECT_LT(fit.plain_sd, 1e-6);
  EXPECT_LT(fit.lump_sd, 1e-3);

  for (Example& e : blocks)
    if (e.lump) e.force_N.back() *= 1.02;
  const StiffnessErrors errors = judge_stiffness(fit, blocks);
  EXPECT_EQ(errors.plain, 40u);
  EXPECT_EQ(errors.lumps, 80u);
  EXPECT_NEAR(errors.with_lump_rms, std::log(1.02) / 2, 1e-4) << "one load in four";
  EXPECT_NEAR(errors.with_lump_worst, std::log(1.02), 1e-4);
  EXPECT_LT(errors.plain_worst, 1e-6);
}

TEST(StiffnessFit, TooFewBlocksAreRefused) {
  EXPECT_THROW((void)fit_stiffness(pressed_blocks(40, false)), Error);
  EXPECT_THROW((void)fit_stiffness(pressed_blocks(80, true)), Error);
}

}  // namespace
}  // namespace palpate::lump
