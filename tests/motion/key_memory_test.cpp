// Key frames seen again: what has drifted on the way goes, and teeth or threads that are alike are never
// taken for one another.
#include "engine/motion/key_memory.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/motion/pose_tracker.h"
#include "perf/motion/moved_object.h"

namespace palpate {
namespace {

using namespace scenes;
using Eigen::Vector3d;

constexpr int kTeeth = 24;
constexpr double kTooth_rad = 2 * M_PI / kTeeth;

/// A ring of equal teeth on a flat face.
SolidObject gear() {
  return {"gear", [](double x, double y) {
            const double r = std::hypot(x, y), ring = std::exp(-std::pow((r - 3.5) / 0.8, 2));
            return 0.3 + 0.06 * ring * (1 + std::cos(kTeeth * std::atan2(y, x)));
          }};
}

RigidMotion turned(double rad) {
  return {turn_of({0, 0, rad}), Vector3d::Zero()};
}
RigidMotion slid(double x_mm) {
  return {Eigen::Matrix3d::Identity(), {x_mm, 0, 0}};
}

ContactSurface seen_at_rest(const SolidObject& object, const RigidMotion& motion, std::mt19937& random) {
  return ContactSurface(pressed(object, motion, {}, 0.002, DepthNoise::White, random).map());
}

/// Errors of the same size along the pad and about its normal, the latter in radians.
Matrix6d error_of(double shift_mm, double turn_rad) {
  Vector6d sd;
  sd << shift_mm, shift_mm, 0.005, 0.002, 0.002, turn_rad;
  return sd.cwiseAbs2().asDiagonal();
}

struct Looked {
  bool known;
  double turn_error_rad;
};
/// A first key frame, then a frame that is turned by true_rad and tracked to have turned by tracked_rad.
Looked look(const SolidObject& object, double true_rad, double tracked_rad, double sd_rad) {
  std::mt19937 random(4);
  KeyMemory memory;
  TrackKey first;
  first.surface = seen_at_rest(object, {}, random);
  memory.keep(std::move(first));
  const ContactSurface now = seen_at_rest(object, turned(true_rad), random);
  const auto back = memory.recognise(
      now, {turned(tracked_rad), error_of(0.02, sd_rad), now.centroid_mm(), 0.002}, {}, *host_sums());
  if (!back) return {false, 0};
  return {true, turn_vector(back->found.motion.turn * turned(true_rad).turn.transpose())[2]};
}

TEST(KeyMemory, FindsAKeyFrameAgainAndTakesTheDriftAway) {
  const Looked back = look(textured_dome(), 0.5, 0.53, 0.02);
  ASSERT_TRUE(back.known);
  EXPECT_NEAR(back.turn_error_rad, 0, 0.1 * kDegree);
}

TEST(KeyMemory, TakesNoToothForItsNeighbour) {
  // As sure as it is, the tooth is known; the drift within it goes.
  const Looked near = look(gear(), 0.6 * kTooth_rad, 0.6 * kTooth_rad + 0.01, 0.01);
  ASSERT_TRUE(near.known);
  EXPECT_NEAR(near.turn_error_rad, 0, 0.2 * kDegree);
  // The track may be off by a tooth: every tooth fits, whichever it is nearest to.
  for (const double off : {0.1, 0.5, 0.9, 1.0})
    EXPECT_FALSE(look(gear(), 0, off * kTooth_rad, 0.7 * kTooth_rad).known) << off;
  // So sure and off by a tooth: it fits, at a way that the error does not hold, or where it was tracked to
  // be.
  const Looked far = look(gear(), 0, kTooth_rad, 0.01);
  if (far.known) {
    EXPECT_NEAR(far.turn_error_rad, kTooth_rad, 0.2 * kDegree);
  }
}

// A thread one pitch on is the same surface: nothing tells how far it has gone, and nothing is known again.
TEST(KeyMemory, KnowsNoThreadAgain) {
  std::mt19937 random(4);
  PoseTracker tracker;
  for (int frame = 0; frame <= 60; ++frame) {
    const double x_mm = 3 * std::sin(0.1 * frame);
    const Pose& pose =
        tracker.update(pressed(screw(), slid(x_mm), {}, 0.002, DepthNoise::White, random).map());
    EXPECT_EQ(pose.returns, 0u) << frame;
    if (frame > 0) {
      EXPECT_TRUE(std::isnan(pose.components().shift_mm[0])) << frame;
    }
  }
}

// To and fro over more key frames than are kept: the way back ends where it began.
TEST(KeyMemory, ReturnsToTheFirstKeyFrame) {
  std::mt19937 random(4);
  PoseOptions options;
  options.memory.most = 4;
  PoseTracker tracker(options), plain([] {
    PoseOptions none;
    none.memory.most = 0;
    return none;
  }());
  Pose pose, without;
  RigidMotion truth;
  for (int frame = 0; frame <= 40; ++frame) {
    truth = slid(9 * std::sin(M_PI * frame / 40));
    const PressedMap map = pressed(textured_plane(), truth, {}, 0.002, DepthNoise::Reach3, random);
    pose = tracker.update(map.map());
    without = plain.update(map.map());
    ASSERT_NE(pose.state, PoseState::Lost) << frame;
  }
  EXPECT_EQ(without.returns, 0u);
  EXPECT_GE(pose.returns, 1u);
  const Vector6d error = twist_between(pose.motion, truth, pose.at_mm);
  std::printf("%u key frames, %u seen again: %.4f mm off, %.4f without; stated %.4f and %.4f\n", pose.keys,
              pose.returns, error.head<2>().norm(),
              twist_between(without.motion, truth, without.at_mm).head<2>().norm(),
              std::sqrt(pose.covariance(0, 0)), std::sqrt(without.covariance(0, 0)));
  EXPECT_LT(pose.covariance(0, 0), without.covariance(0, 0));
  for (int c = 0; c < 2; ++c) EXPECT_LT(std::abs(error[c]), 3 * std::sqrt(pose.covariance(c, c))) << c;
}

}  // namespace
}  // namespace palpate
