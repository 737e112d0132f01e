// What a pose tracker says where things are not one rigid object on a calm pad: within two frames, and never
// on honest runs.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>
#include <string_view>

#include "engine/motion/pose_tracker.h"
#include "engine/motion/repeats.h"
#include "perf/motion/moved_object.h"
#include "tests/support/thorough.h"

namespace palpate {
namespace {

using namespace scenes;
using Eigen::Vector3d;

RigidMotion shifted(double x_mm, double y_mm = 0, double z_mm = 0) {
  return {Eigen::Matrix3d::Identity(), {x_mm, y_mm, z_mm}};
}

/// Small textured domes about x_mm.
SolidObject small_dome(double x_mm, double depth_mm) {
  return {"small dome", [=, dome = textured_dome()](double x, double y) {
            const double square = (x - x_mm) * (x - x_mm) + y * y;
            return depth_mm + dome.depth_mm(x, y) - 0.45 + (x * x + y * y) / 60 - square / 14;
          }};
}

PressedMap both(PressedMap one, const PressedMap& other) {
  for (size_t i = 0; i < one.depth.size(); ++i) {
    one.depth[i] = std::max(one.depth[i], other.depth[i]);
    one.contact[i] = one.contact[i] | other.contact[i];
  }
  return one;
}

TEST(PoseStates, HonestRunsRaiseNoDoubt) {
  for (const SolidObject& object : {textured_dome(), coin(), key_relief(), ball(), plane()})
    for (const DepthNoise kind : {DepthNoise::White, DepthNoise::Integrated}) {
      std::mt19937 random(8);
      PoseTracker tracker;
      for (int frame = 0; frame <= of_sweep(300, 45); ++frame) {
        const Pose& pose =
            tracker.update(pressed(object, on_path(frame / 60.0), {}, 0.002, kind, random).map());
        if (frame == 0) continue;
        ASSERT_EQ(pose.state, PoseState::Tracked) << object.name << frame << to_string(pose.loss);
        EXPECT_EQ(pose.doubt, PoseDoubt::None) << object.name << frame << to_string(pose.doubt);
      }
    }
}

// Two objects lie still, then the smaller one slides away: the larger one's pose is told, with that doubt.
TEST(PoseStates, TellsThatAnotherContactMovesUnlike) {
  constexpr int kMoves = 6;
  std::mt19937 random(12);
  PoseTracker tracker;
  int told_at = -1;
  for (int frame = 0; frame < 14; ++frame) {
    const double since = std::max(frame - kMoves + 1, 0);
    const PressedMap large =
        pressed(small_dome(-3, 0.5), shifted(0.01 * frame), {}, 0.002, DepthNoise::White, random);
    const PressedMap small = pressed(small_dome(3, 0.42), shifted(0.01 * frame, -0.1 * since), {}, 0.002,
                                     DepthNoise::White, random);
    const Pose& pose = tracker.update(both(large, small).map());
    if (frame == 0) continue;
    ASSERT_EQ(pose.state, PoseState::Tracked) << frame << to_string(pose.loss);
    if (frame < kMoves) {
      EXPECT_EQ(pose.doubt, PoseDoubt::None) << frame;
    }
    if (pose.doubt == PoseDoubt::OthersMove && told_at < 0) told_at = frame;
    const Vector6d error = twist_between(pose.motion, shifted(0.01 * frame), pose.at_mm);
    EXPECT_LT(error.head<3>().norm(), 0.02) << frame;
  }
  std::printf("one of two begins to move in frame %d: told in %d\n", kMoves, told_at);
  EXPECT_GE(told_at, kMoves);
  EXPECT_LE(told_at, kMoves + 1);
}

TEST(PoseStates, TellsAShapeThatChanges) {
  constexpr int kChanges = 8;
  for (const double rate_mm : {0.004, 0.02}) {  // of the middle, a frame
    std::mt19937 random(12);
    PoseTracker tracker;
    int told_at = -1;
    std::string_view as;
    for (int frame = 0; frame < 14; ++frame) {
      const double swollen = rate_mm * std::max(frame - kChanges + 1, 0);
      const SolidObject dome{"swelling dome", [=, calm = textured_dome()](double x, double y) {
                               return calm.depth_mm(x, y) + swollen * std::cos(x) * std::cos(0.8 * y);
                             }};
      const Pose& pose =
          tracker.update(pressed(dome, shifted(0.02 * frame), {}, 0.002, DepthNoise::White, random).map());
      const bool told = pose.state == PoseState::Lost || pose.doubt == PoseDoubt::ShapeChanges;
      if (!told || told_at >= 0) continue;
      told_at = frame;
      as = pose.state == PoseState::Lost ? to_string(pose.loss) : to_string(pose.doubt);
    }
    std::printf("a shape changes by %g mm a frame from frame %d on: told in %d as %s\n", rate_mm, kChanges,
                told_at, std::string(as).c_str());
    EXPECT_GE(told_at, kChanges);
    EXPECT_LE(told_at, kChanges + 1);
  }
}

// The camera leaves out up to ten frames of a motion: what is told afterwards is right, or the track is lost.
TEST(PoseStates, DroppedFramesAreFollowedOrTold) {
  int followed = 0, lost = 0;
  for (const SolidObject& object : {textured_dome(), coin()})
    for (int dropped = 1; dropped <= 10; ++dropped) {
      std::mt19937 random(5);
      PoseTracker tracker;
      Vector6d rate;  // mm and radians a frame
      rate << 0.08, 0.05, 0, 0, 0, 0.6 * kDegree;
      const auto seen = [&](int frame) {
        const RigidMotion truth = motion_about(Vector3d::Zero(), rate * frame);
        return tracker.update(pressed(object, truth, {}, 0.002, DepthNoise::White, random).map());
      };
      for (int frame = 0; frame < 6; ++frame) seen(frame);
      for (int frame = 6 + dropped; frame < 9 + dropped; ++frame) {
        const Pose pose = seen(frame);
        if (pose.state != PoseState::Tracked || pose.track > 1) {
          ++lost;
          break;
        }
        ++followed;
        const Vector6d error =
            twist_between(pose.motion, motion_about(Vector3d::Zero(), rate * frame), pose.at_mm);
        EXPECT_LT(error.head<3>().norm(), 0.01) << object.name << " " << dropped << " " << frame;
        EXPECT_LT(error.tail<3>().norm(), 0.2 * kDegree) << object.name << " " << dropped << " " << frame;
      }
    }
  std::printf("%d frames followed, %d of 20 tracks lost\n", followed, lost);
  EXPECT_GT(followed, 45);
}

// A gel's depth falls back by a twentieth while the object rests: that is in what is stated for the map's
// level; along the pad nothing moves.
TEST(PoseStates, ACreepingGelIsNoMotionAlongThePad) {
  for (const SolidObject& object : {textured_dome(), coin()}) {
    std::mt19937 random(5);
    PoseTracker tracker;
    for (int frame = 0; frame < 60; ++frame) {
      const float left = 1 - 0.05f * (1 - std::exp(-static_cast<float>(frame) / 20));
      PressedMap pressed_map = pressed(object, {}, {}, 0, DepthNoise::None, random);
      for (float& depth : pressed_map.depth) depth *= left;
      std::normal_distribution<float> noise(0, 0.002f);
      for (float& depth : pressed_map.depth) depth += noise(random);
      HeightMap map = pressed_map.map();
      map.level_sd_mm = 0.015;
      const Pose& pose = tracker.update(map);
      if (frame == 0) continue;
      ASSERT_EQ(pose.state, PoseState::Tracked) << object.name << frame << to_string(pose.loss);
      const PoseComponents told = pose.components();
      for (const int c : {0, 1}) EXPECT_LT(std::abs(told.shift_mm[c]), 0.005) << object.name << frame;
      EXPECT_LT(std::abs(told.shift_mm[2]), 1.96 * told.shift_sd_mm[2]) << object.name << frame;
      for (const double turn : told.turn_rad)
        EXPECT_LT(std::abs(turn), 0.1 * kDegree) << object.name << frame;
    }
  }
}

SolidObject relief(const char* name, double (*depth_mm)(double, double)) {
  return {name, depth_mm};
}
double wave(double x_mm, double length_mm) {
  return std::cos(2 * std::numbers::pi * x_mm / length_mm);
}

// Waves or dimples that repeat fit themselves a wave farther, which no error states.
TEST(PoseStates, TellsThatASurfaceFitsElsewhere) {
  const std::pair<SolidObject, bool> cases[] = {
      {relief("grating", [](double x, double y) { return 0.5 + 0.03 * wave(0.8 * x + 0.6 * y, 1.6); }), true},
      {relief("lattice", [](double x, double y) { return 0.5 + 0.02 * wave(x, 1.9) * wave(y, 1.5); }), true},
      {relief("bent lattice",
              [](double x, double y) {
                return 0.6 - (x * x + y * y) / 60 + 0.02 * (wave(x, 1.9) + wave(y, 1.5));
              }),
       true},
      {textured_dome(), false},
      {textured_plane(), false},
      {key_relief(), false},
      {coin(), false},
      {ball(), false},
      {plane(), false},
      {cylinder(), false},
  };
  for (const auto& [object, wanted] : cases)
    for (const DepthNoise kind : {DepthNoise::White, DepthNoise::Integrated}) {
      std::mt19937 random(8);
      const PressedMap map = pressed(object, {}, {}, 0.002, kind, random);
      const ContactSurface surface(map.map());
      std::printf("%s %.2f\n", object.name.c_str(),
                  fits_elsewhere(surface, 0.67 * surface.radius_mm(), 0.01));
      PoseTracker tracker;
      for (int frame = 0; frame < 4; ++frame) {
        const Pose& pose = tracker.update(
            pressed(object, shifted(0.03 * frame, 0.02 * frame), {}, 0.002, kind, random).map());
        if (frame == 0) continue;
        ASSERT_EQ(pose.state, PoseState::Tracked) << object.name << frame << to_string(pose.loss);
        EXPECT_EQ(pose.doubt, wanted ? PoseDoubt::FitsElsewhere : PoseDoubt::None) << object.name << frame;
      }
    }
}

// What was lost is found elsewhere, in the frame after: a new track, never a motion of the old one.
TEST(PoseStates, AContactElsewhereIsANewTrack) {
  std::mt19937 random(5);
  PoseTracker tracker;
  for (int frame = 0; frame < 12; ++frame) {
    const Pose& pose = tracker.update(
        pressed(small_dome(frame < 6 ? -4 : 4, 0.5), {}, {}, 0.002, DepthNoise::White, random).map());
    if (frame == 6) {
      EXPECT_EQ(pose.state, PoseState::Lost);
      EXPECT_EQ(pose.loss, PoseLoss::LittleOverlap) << to_string(pose.loss);
    }
    EXPECT_EQ(pose.track, frame < 7 ? 1u : 2u);
  }
}

}  // namespace
}  // namespace palpate
