#include "engine/motion/pose_tracker.h"

#include <gtest/gtest.h>

#include <cmath>

#include "perf/motion/moved_object.h"
#include "tests/support/thorough.h"

namespace palpate {
namespace {

using namespace scenes;

struct Followed {
  Pose last;
  Vector6d error;  ///< of the last frame, seen at the contact
  double worst_mm = 0, worst_rad = 0;
  int held = 0, asked = 0;  ///< components within 95 %, of every tenth frame
  int lost = 0;
};
Followed follow(const SolidObject& object, DepthNoise kind, double seconds, uint32_t seed) {
  std::mt19937 random(seed);
  PoseTracker tracker;
  Followed run;
  const double rate_Hz = of_sweep(60, 30);
  const int frames = static_cast<int>(seconds * rate_Hz);
  for (int frame = 0; frame <= frames; ++frame) {
    const RigidMotion truth = on_path(frame / rate_Hz);
    const PressedMap map = pressed(object, truth, {}, 0.002, kind, random);
    const Pose& pose = tracker.update(map.map());
    run.last = pose;
    if (pose.state == PoseState::Lost) ++run.lost;
    if (pose.state != PoseState::Tracked) continue;
    run.error = twist_between(pose.motion, truth, pose.at_mm);
    run.worst_mm = std::max(run.worst_mm, run.error.head<3>().norm());
    run.worst_rad = std::max(run.worst_rad, run.error.tail<3>().norm());
    if (frame % 10 != 0) continue;
    const PoseComponents told = pose.components();
    for (int c = 0; c < 6; ++c) {
      const double sd = c < 3 ? told.shift_sd_mm[c] : told.turn_sd_rad[c - 3];
      if (std::isnan(sd)) continue;
      ++run.asked;
      run.held += std::abs(run.error[c]) < 1.96 * sd ? 1 : 0;
    }
  }
  return run;
}

// Ten seconds of sliding and turning: at most 0.05 mm and 0.3 degrees.
TEST(PoseTracker, FollowsATexturedObjectForTenSeconds) {
  int held = 0, asked = 0;
  for (const DepthNoise kind :
       of_sweep<std::vector<DepthNoise>>({DepthNoise::White, DepthNoise::Reach3, DepthNoise::Integrated},
                                         {DepthNoise::Reach3, DepthNoise::Integrated})) {
    for (const SolidObject& object : {textured_dome(), coin()}) {
      if (!thorough() && (kind == DepthNoise::Reach3) == (object.name == "coin")) continue;
      const Followed run = follow(object, kind, 10, 1);
      std::printf(
          "%-13s noise %d: %u keys, at the end %.4f mm %.3f degrees, worst %.4f mm %.3f degrees, held %d of "
          "%d\n",
          object.name.c_str(), int(kind), run.last.keys, run.error.head<3>().norm(),
          run.error.tail<3>().norm() / kDegree, run.worst_mm, run.worst_rad / kDegree, run.held, run.asked);
      EXPECT_EQ(run.lost, 0) << object.name;
      EXPECT_EQ(run.last.track, 1u) << object.name;
      EXPECT_LT(run.worst_mm, 0.05) << object.name;
      EXPECT_LT(run.worst_rad, 0.3 * kDegree) << object.name;
      held += run.held;
      asked += run.asked;
    }
  }
  EXPECT_GT(held, 0.9 * asked);
}

// A key frame's level is in the motion to it and, with the other sign, in the one from it: after any number
// of them depth is wrong by the first and the last frame's levels, and by its own noise, which is far less.
TEST(PoseTracker, LevelsOfFramesBetweenCancel) {
  constexpr double kLevel_mm = 0.02;
  std::mt19937 random(11);
  std::normal_distribution<double> level(0, kLevel_mm);
  PoseTracker tracker;
  double squares = 0, stated = 0, frames = 0, first_mm = 0;
  for (int frame = 0; frame < 120; ++frame) {
    const RigidMotion truth = on_path(frame / 20.0);
    PressedMap pressed_map = pressed(textured_dome(), truth, {}, 0.001, DepthNoise::White, random);
    const double wrong_mm = level(random);
    if (frame == 0) first_mm = wrong_mm;
    for (float& depth : pressed_map.depth) depth += static_cast<float>(wrong_mm);
    HeightMap map = pressed_map.map();
    map.level_sd_mm = kLevel_mm;
    const Pose& pose = tracker.update(map);
    if (frame == 0) continue;
    ASSERT_EQ(pose.state, PoseState::Tracked) << frame;
    const double error_mm = twist_between(pose.motion, truth, pose.at_mm)[2];
    EXPECT_NEAR(-error_mm, wrong_mm - first_mm, 0.004) << frame;
    squares += error_mm * error_mm;
    stated += pose.covariance(2, 2);
    ++frames;
  }
  EXPECT_GT(
      tracker.update(pressed(textured_dome(), on_path(6), {}, 0.001, DepthNoise::White, random).map()).keys,
      3u);
  EXPECT_NEAR(std::sqrt(stated / frames), std::sqrt(2.0) * kLevel_mm, 0.1 * kLevel_mm);
  EXPECT_NEAR(std::sqrt(squares / frames), std::sqrt(2.0) * kLevel_mm, 0.6 * kLevel_mm);
}

// A ball and a plane on the same way: what they do not show is NaN in every frame.
TEST(PoseTracker, NeverCallsASlidingDirectionDetermined) {
  std::mt19937 random(4);
  for (const bool round : {true, false}) {
    const SolidObject object = round ? ball() : plane();
    PoseTracker tracker;
    for (int frame = 0; frame < 60; ++frame) {
      const RigidMotion truth = on_path(frame / 60.0);
      const PressedMap map = pressed(object, truth, {}, 0.002, DepthNoise::White, random);
      const Pose& pose = tracker.update(map.map());
      if (frame == 0) continue;
      ASSERT_EQ(pose.state, PoseState::Tracked) << object.name << frame;
      EXPECT_EQ(pose.surface, round ? Slippage::Ball : Slippage::Plane) << frame;
      const PoseComponents told = pose.components();
      EXPECT_TRUE(std::isnan(told.shift_mm[0]) && std::isnan(told.shift_mm[1]) &&
                  std::isnan(told.turn_rad[2]));
      EXPECT_EQ(std::isnan(told.turn_rad[0]), round) << frame;
      if (!round) {
        EXPECT_NEAR(told.shift_mm[2], (pose.at_mm - truth.inverse() * pose.at_mm)[2], 3 * told.shift_sd_mm[2])
            << frame;
        continue;
      }
      // The centre's way is known.
      const PoseComponents center = pose.components(pose.pivot_mm);
      const Eigen::Vector3d middle(0, 0, 0.7 - 8), moved = truth * middle - middle;
      for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(center.shift_mm[c], moved[c], 0.02) << frame << " " << c;
        EXPECT_TRUE(std::isnan(center.turn_rad[c])) << frame << " " << c;
      }
    }
  }
}

// A jump by more than a third of the contact is told in the frame that shows it; then a new track begins.
TEST(PoseTracker, TellsALostTrack) {
  for (const double jump_mm : {4.0, 6.0})
    for (const SolidObject& object : {textured_dome(), ball(8, 0.7)}) {
      std::mt19937 random(9);
      PoseTracker tracker;
      int lost_at = -1;
      for (int frame = 0; frame < 12; ++frame) {
        const double x = 0.05 * frame + (frame >= 8 ? jump_mm : 0) - 2;
        const PressedMap map =
            pressed(object, {Eigen::Matrix3d::Identity(), {x, 0, 0}}, {}, 0.002, DepthNoise::White, random);
        const Pose& pose = tracker.update(map.map());
        if (pose.state == PoseState::Lost && lost_at < 0) lost_at = frame;
        if (frame == 11)
          std::printf("%s %g mm: lost at %d, %s\n", object.name.c_str(), jump_mm, lost_at,
                      to_string(pose.state));
      }
      EXPECT_GE(lost_at, 8) << object.name << jump_mm;
      EXPECT_LE(lost_at, 9) << object.name << jump_mm;
    }
}

// A plane with waves of 1.1 to 2 mm slides on, from one frame to the next without a slow begin. Where a
// frame's way is more than half a wave the search may end a wave farther: then the track is lost at once.
TEST(PoseTracker, TellsThatItMissedAWave) {
  for (const double speed_mm_s : {45, 70, 100, 140}) {
    std::mt19937 random(3);
    PoseTracker tracker;
    int told_frames = 0, lost = 0;
    RigidMotion begin;
    for (int frame = 0; frame < 15; ++frame) {
      Vector6d twist;
      twist << speed_mm_s * frame / 60, 0.3 * speed_mm_s * frame / 60, 0, 0, 0, 0.5 * frame / 60;
      const RigidMotion truth = motion_about(Eigen::Vector3d::Zero(), twist);
      const PressedMap map = pressed(textured_plane(), truth, {}, 0.002, DepthNoise::White, random);
      const Pose& pose = tracker.update(map.map());
      lost += pose.state == PoseState::Lost;
      if (frame == 2 && speed_mm_s >= 100) {
        EXPECT_GE(lost, 1) << speed_mm_s;
      }
      if (pose.state == PoseState::Begun) begin = truth;
      if (pose.state != PoseState::Tracked) continue;
      const Vector6d error = twist_between(pose.motion, truth * begin.inverse(), pose.at_mm);
      const PoseComponents told = pose.components();
      for (int c = 0; c < 2; ++c) {
        if (std::isnan(told.shift_mm[c])) continue;
        ++told_frames;
        EXPECT_LT(std::abs(error[c]), 0.02) << speed_mm_s << " mm/s, frame " << frame;
      }
    }
    std::printf("%g mm/s: %d of 28 shifts told, lost in %d frames\n", speed_mm_s, told_frames, lost);
    if (speed_mm_s == 45) {
      EXPECT_EQ(lost, 0);
      EXPECT_EQ(told_frames, 28);
    }
  }
}

// After turns of any size a component's error is that of the number that is told.
TEST(PoseTracker, ErrorsAreThoseOfTheComponentsTold) {
  std::mt19937 random(4);
  std::normal_distribution<double> any;
  for (const double turn_deg : {1.0, 40.0, 90.0, 179.0}) {
    const Eigen::Vector3d axis = Eigen::Vector3d(any(random), any(random), any(random)).normalized();
    Pose pose;
    pose.motion = {turn_of(axis * turn_deg * kDegree), {1, -2, 0.3}};
    pose.at_mm = {3, 1, 0.4};
    for (int k = 0; k < 6; ++k) {
      constexpr double kSmall = 1e-5;
      const Vector6d twist = kSmall * Vector6d::Unit(k);
      pose.covariance = twist * twist.transpose();
      Pose other = pose;
      other.motion = motion_about(pose.at_mm, twist) * pose.motion;
      const PoseComponents told = pose.components(), moved = other.components();
      for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(std::abs(moved.shift_mm[c] - told.shift_mm[c]), told.shift_sd_mm[c], 1e-3 * kSmall);
        EXPECT_NEAR(std::abs(moved.turn_rad[c] - told.turn_rad[c]), told.turn_sd_rad[c], 1e-3 * kSmall);
      }
    }
  }
}

// No contact, then another one: a new track.
TEST(PoseTracker, BeginsANewTrackAfterNoContact) {
  std::mt19937 random(9);
  PoseTracker tracker;
  const SolidObject object = textured_dome();
  const auto seen = [&](double depth_mm) {
    return tracker.update(
        pressed(object, {Eigen::Matrix3d::Identity(), {0, 0, depth_mm}}, {}, 0.002, DepthNoise::White, random)
            .map());
  };
  EXPECT_EQ(seen(0).state, PoseState::Begun);
  EXPECT_EQ(seen(0.01).state, PoseState::Tracked);
  EXPECT_EQ(seen(-2).state, PoseState::NoContact);
  const Pose again = seen(0);
  EXPECT_EQ(again.state, PoseState::Begun);
  EXPECT_EQ(again.track, 2u);
}

}  // namespace
}  // namespace palpate
