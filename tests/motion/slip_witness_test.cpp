// Slip between an object and the skin from the motions of both.
#include "engine/motion/slip_witness.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "perf/motion/moved_object.h"

namespace palpate {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

PoseComponents object(double x_mm, double y_mm, double sd_mm = 0.01) {
  PoseComponents out;
  out.shift_mm[0] = x_mm, out.shift_mm[1] = y_mm;
  out.shift_sd_mm[0] = out.shift_sd_mm[1] = sd_mm;
  return out;
}
SkinDisplacement skin(double x_mm, double y_mm, double sd_mm = 0.02) {
  return {.shift_mm = {x_mm, y_mm}, .shift_sd_mm = {sd_mm, sd_mm}};
}

TEST(SlipWitness, NamesStickSlipAndDisagreement) {
  EXPECT_EQ(slip_between(object(0.5, 0.3), skin(0.52, 0.28)).on_skin, OnSkin::Sticks);
  EXPECT_EQ(slip_between(object(0, 0), skin(0, 0)).on_skin, OnSkin::Sticks);
  const SlipWitness slid = slip_between(object(1, 0.6), skin(0.5, 0.3));
  EXPECT_EQ(slid.on_skin, OnSkin::Slips);
  EXPECT_NEAR(slid.slip_mm[0], 0.5, 1e-12);
  EXPECT_NEAR(slid.slip_mm[1], 0.3, 1e-12);
  EXPECT_NEAR(slid.slip_sd_mm[0], std::hypot(0.01, 0.02), 1e-12);
  EXPECT_EQ(slip_between(object(1, 0), skin(1.3, 0)).on_skin, OnSkin::Disagrees);    // the skin goes farther
  EXPECT_EQ(slip_between(object(1, 0), skin(-0.3, 0)).on_skin, OnSkin::Disagrees);   // back
  EXPECT_EQ(slip_between(object(1, 0), skin(0.4, 0.3)).on_skin, OnSkin::Disagrees);  // across
  EXPECT_EQ(slip_between(object(0, 0), skin(0.4, 0)).on_skin,
            OnSkin::Disagrees);  // texture that stays with the pad
}

TEST(SlipWitness, UsesWhatIsKnownOfBoth) {
  PoseComponents half = object(1, 0);
  half.shift_mm[1] = half.shift_sd_mm[1] = kNaN;
  const SlipWitness witness = slip_between(half, skin(0.4, 0.7));
  EXPECT_EQ(witness.on_skin, OnSkin::Slips);
  EXPECT_TRUE(std::isnan(witness.slip_mm[1]) && std::isnan(witness.slip_sd_mm[1]));
  EXPECT_EQ(slip_between(half, skin(1.02, 0.7)).on_skin, OnSkin::Sticks);
  EXPECT_EQ(slip_between(half, skin(kNaN, 0.7)).on_skin, OnSkin::Unknown);
  EXPECT_TRUE(std::isnan(witness.turn_rad));
}

// Motions with errors as stated: sticking is called slip or disagreement in a twentieth.
TEST(SlipWitness, CallsSlipAsOftenAsItSays) {
  std::mt19937 random(4);
  std::normal_distribution<double> of_object(0, 0.01), of_skin(0, 0.02);
  int apart = 0;
  constexpr int kTrials = 4000;
  for (int k = 0; k < kTrials; ++k) {
    const double x = 0.001 * (k % 700), y = 0.0005 * (k % 300);
    const PoseComponents seen = object(x + of_object(random), y + of_object(random));
    apart += slip_between(seen, skin(x + of_skin(random), y + of_skin(random))).on_skin != OnSkin::Sticks;
  }
  EXPECT_NEAR(double(apart) / kTrials, 0.05, 0.012);
}

// A tracked object that slides on after the skin has stopped: the difference is the slip.
TEST(SlipWitness, SlipOfATrackedObject) {
  using namespace scenes;
  std::mt19937 random(6);
  PoseTracker tracker;
  for (int frame = 0; frame < 30; ++frame) {
    const double gone_mm = 0.03 * frame, skin_mm = std::min(gone_mm, 0.4);
    const RigidMotion truth{Eigen::Matrix3d::Identity(), {0.8 * gone_mm, 0.6 * gone_mm, 0}};
    const Pose& pose =
        tracker.update(pressed(textured_dome(), truth, {}, 0.002, DepthNoise::Reach3, random).map());
    if (frame == 0) continue;
    ASSERT_EQ(pose.state, PoseState::Tracked);
    const SlipWitness witness = slip_between(pose.components(), skin(0.8 * skin_mm, 0.6 * skin_mm, 0.005));
    if (gone_mm < 0.39) {
      EXPECT_EQ(witness.on_skin, OnSkin::Sticks) << frame;
    }
    if (gone_mm > 0.46) {
      EXPECT_EQ(witness.on_skin, OnSkin::Slips) << frame;
    }
    EXPECT_NEAR(witness.slip_mm[0], 0.8 * (gone_mm - skin_mm), 0.01) << frame;
  }
}

}  // namespace
}  // namespace palpate
