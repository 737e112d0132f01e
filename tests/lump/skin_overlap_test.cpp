// Two reliefs of one skin: found in each other without a guess, then exactly.
#include "engine/palpation/hand/skin_overlap.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "engine/palpation/hand/held_pad.h"
#include "engine/palpation/hand/skin_fit.h"

namespace palpate {
namespace {

constexpr double kPitch_mm = 0.17;

/// Skin that is stretched about its middle, under a pad there, with noise, and a rim at the pad's left side.
SkinRelief relief_of(const SkinTexture& skin, const HeldPose& pose, double stretch, double rim_mm,
                     uint64_t seed) {
  SkinRelief relief{160, 120, kPitch_mm, {}, {}, 1};
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0, 0.003);
  for (int j = 0; j < 120; ++j)
    for (int i = 0; i < 160; ++i) {
      const double u = (i - 79.5) * kPitch_mm, v = (j - 59.5) * kPitch_mm;
      const auto [x, y] = pose.block(u, v);
      const double ridge = 0.03 * std::exp(-std::abs(u + 79.5 * kPitch_mm - rim_mm));
      relief.contact.push_back(i * kPitch_mm >= rim_mm);
      relief.depth_mm.push_back(
          static_cast<float>(skin.at(x / stretch, y / stretch) + ridge + noise(random)));
    }
  return relief;
}

SkinTexture skin_of(uint64_t seed) {
  std::mt19937_64 random(seed);
  return {0.012, {0.5, 2}, random};
}

TEST(SkinOverlap, IsFoundAmongWavesAndRims) {
  for (uint64_t seed = 1; seed <= 4; ++seed) {
    const SkinTexture skin = skin_of(seed);
    // Along the block's side, whose rim both see: it is like itself at every place.
    const HeldPose far{{0.5, 9}, 0, {}};
    const SkinRelief first = relief_of(skin, {}, 1, 2, seed),
                     second = relief_of(skin, far, 1, 1.5, seed + 10);
    const SkinOverlap found = find_skin_overlap(first, second);
    EXPECT_TRUE(found.sure()) << seed << ": " << found.significance << ", elsewhere " << found.elsewhere;
    EXPECT_NEAR(found.shift_mm[0], 0.5, 0.3) << seed;
    EXPECT_NEAR(found.shift_mm[1], 9, 0.3) << seed;
    EXPECT_NEAR(found.turn_rad, 0, 0.035) << seed;
    const SkinOverlap other = find_skin_overlap(first, relief_of(skin_of(seed + 20), far, 1, 1.5, seed));
    EXPECT_FALSE(other.sure()) << seed << ": " << other.significance << ", elsewhere " << other.elsewhere;
  }
}

TEST(SkinOverlap, AFitIsExactAndTellsTheStretch) {
  const SkinTexture skin = skin_of(5);
  const HeldPose pose{{6, -4}, 0.05, {}};
  constexpr double kStretch = 1.02;
  const SkinLevels first(relief_of(skin, {}, 1, 0, 1)), second(relief_of(skin, pose, kStretch, 0, 2));
  const RigidMotion start = RigidMotion{turn_of({0, 0, 0.07}), {6.15, -4.15, 0}}.inverse();
  const auto found = fit_skin(first, second, start);
  ASSERT_TRUE(found);
  const auto sd = [&](int c) { return std::sqrt(found->covariance(c, c)); };
  EXPECT_LT(sd(0), 0.01);
  EXPECT_NEAR(found->turn_rad, -0.05, 4 * sd(2));
  EXPECT_NEAR(std::log(found->stretch), std::log(kStretch), 4 * sd(3));
  const auto [x, y] = pose.block(found->at_mm[0], found->at_mm[1]);
  EXPECT_NEAR(x, kStretch * found->from_mm[0], 4 * sd(0));
  EXPECT_NEAR(y, kStretch * found->from_mm[1], 4 * sd(1));
  EXPECT_FALSE(fit_skin(first, SkinLevels(relief_of(skin_of(6), pose, 1, 0, 3)), start));
}

}  // namespace
}  // namespace palpate
