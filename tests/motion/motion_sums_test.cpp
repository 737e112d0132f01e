// The motion sums stage: sums and motions of the device are those of the processor, on frames of moved
// objects.
#include "engine/stages/motion_sums.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/motion/pose_tracker.h"
#include "perf/motion/moved_object.h"
#include "tests/support/gpu_fixture.h"

namespace palpate {
namespace {

using namespace scenes;

struct Pair {
  Pair(const SolidObject& object, const PadView& pad, double along_mm, double turn_deg) {
    std::mt19937 random(7);
    Vector6d twist = Vector6d::Zero();
    twist[0] = along_mm;
    twist[2] = 0.01;
    twist[5] = turn_deg * kDegree;
    const RigidMotion moved = motion_about(Eigen::Vector3d::Zero(), twist);
    key = ContactSurface(pressed(object, {}, pad, 0.002, DepthNoise::White, random).map());
    now = ContactSurface(pressed(object, moved, pad, 0.002, DepthNoise::White, random).map());
  }
  ContactSurface key, now;
};

/// Relative to the largest.
double apart(const Eigen::MatrixXd& got, const Eigen::MatrixXd& wanted) {
  return (got - wanted).cwiseAbs().maxCoeff() / wanted.cwiseAbs().maxCoeff();
}

/// All that both say of one guess.
void expect_alike(PixelSums& device, PixelSums& host, const Pair& pair, size_t level, Spread by) {
  const MotionGuess guess({turn_of({0.01, -0.005, 0.02}), {0.05, -0.02, 0.003}}, pair.key.centroid_mm());
  device.set(pair.key, pair.now);
  host.set(pair.key, pair.now);
  const LeftOver got = device.compare(level, guess, by), wanted = host.compare(level, guess, by);
  EXPECT_EQ(got.compared, wanted.compared);
  EXPECT_NEAR(got.scale, wanted.scale, 1e-4 * wanted.scale);
  EXPECT_NEAR(got.mean_precision, wanted.mean_precision, 1e-5 * wanted.mean_precision);
  const MotionSums step = device.step(), host_step = host.step();
  EXPECT_LT(apart(step.square, host_step.square), 1e-4);
  EXPECT_LT(apart(step.gradient, host_step.gradient), 1e-3);
  EXPECT_NEAR(step.weight, host_step.weight, 1e-4 * host_step.weight);
  const MotionSums judged = device.judged(), host_judged = host.judged();
  EXPECT_LT(apart(judged.square, host_judged.square), 1e-3);
  EXPECT_LT(apart(judged.difference, host_judged.difference), 1e-3);
  const ScoreField field = device.field(), host_field = host.field();
  EXPECT_NEAR(double(field.pixel.size()), double(host_field.pixel.size()), 3);  // at the bound itself
  EXPECT_NEAR(device.loss(2 * wanted.scale), host.loss(2 * wanted.scale), 1e-4 * host.loss(2 * wanted.scale));
}

class MotionSumsTest : public GpuTest {};

TEST_F(MotionSumsTest, EqualTheProcessorsOnEachLevel) {
  DeviceMotionSums device(context());
  const auto host = host_sums();
  for (const SolidObject& object : {textured_dome(), coin()}) {
    const Pair pair(object, {}, 0.2, 2);
    for (size_t level = 0; level < pair.now.levels().size(); ++level)
      for (const Spread by : {Spread::Median, Spread::Squares}) {
        SCOPED_TRACE(object.name + " level " + std::to_string(level));
        expect_alike(device, *host, pair, level, by);
      }
  }
}

// Larger frames after smaller ones, more than the stage holds at once, and frames in turn.
TEST_F(MotionSumsTest, HoldFramesOfAnySize) {
  DeviceMotionSums device(context());
  const auto host = host_sums();
  std::vector<Pair> pairs;
  for (const uint32_t width : {64u, 200u, 96u})
    pairs.emplace_back(textured_dome(),
                       PadView{.width = width, .height = width * 3 / 4, .pitch_mm = 16.0 / width}, 0.1, 1);
  for (const Pair& pair : pairs) expect_alike(device, *host, pair, 0, Spread::Median);
  expect_alike(device, *host, pairs.front(), 0, Spread::Median);
  EXPECT_GT(device.memory_bytes(), 0u);
}

TEST_F(MotionSumsTest, AreTheSameEachTime) {
  DeviceMotionSums device(context());
  const Pair pair(textured_dome(), {}, 0.2, 2);
  Registration first;
  for (int run = 0; run < 3; ++run) {
    const Registration found = register_surface(pair.key, pair.now, {}, {}, device);
    ASSERT_TRUE(found.found && found.converged);
    if (run == 0) first = found;
    EXPECT_EQ(found.motion.turn, first.motion.turn);
    EXPECT_EQ(found.motion.shift_mm, first.motion.shift_mm);
    EXPECT_EQ(found.covariance, first.covariance);
  }
}

// A second of sliding and turning: the track is the processor's to a thousandth of a pixel.
TEST_F(MotionSumsTest, FollowAsTheProcessorDoes) {
  const PadView pad;
  for (const SolidObject& object : {textured_dome(), coin(), ball()}) {
    PoseTracker by_device({}, std::make_unique<DeviceMotionSums>(context())), by_host;
    std::mt19937 random(1);
    for (int frame = 0; frame <= 60; ++frame) {
      const PressedMap map = pressed(object, on_path(frame / 60.0), pad, 0.002, DepthNoise::White, random);
      const Pose device = by_device.update(map.map()), host = by_host.update(map.map());
      ASSERT_EQ(device.state, host.state) << object.name << frame;
      const Vector6d apart = twist_between(device.motion, host.motion, host.at_mm);
      EXPECT_LT(apart.head<3>().norm(), 1e-4) << object.name << frame;
      EXPECT_LT(apart.tail<3>().norm(), 1e-4) << object.name << frame;
      EXPECT_EQ(device.freedom.kind, host.freedom.kind) << object.name << frame;
    }
  }
}

TEST_F(MotionSumsTest, NothingInContactIsNothingFound) {
  DeviceMotionSums device(context());
  std::vector<float> depth(32 * 24);
  std::vector<uint8_t> contact(depth.size());
  const ContactSurface nothing(
      HeightMap{.width = 32, .height = 24, .pitch_mm_per_px = 0.1, .depth_mm = depth, .contact = contact});
  EXPECT_FALSE(register_surface(nothing, nothing, {}, {}, device).found);
}

}  // namespace
}  // namespace palpate
