// A part of the contact lifts while the rest slides on: the motion told is the rest's.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "engine/motion/pose_tracker.h"
#include "perf/motion/moved_object.h"

namespace palpate {
namespace {

using namespace scenes;

enum class Lift { Bends, ComesOff };  ///< by lift_mm at the far end, or all alike

/// What lies more than 3.2 mm to the right, 15 % of a round contact, lifts from the pad.
PressedMap with_lifted_part(const SolidObject& object, Lift how, double lift_mm, const RigidMotion& motion,
                            std::mt19937& random) {
  constexpr double kCut_mm = 3.2;
  const double reach_mm = PadView{}.radius_mm - kCut_mm;
  const SolidObject bent{object.name, [&](double x, double y) {
                           const double beyond = std::max(x - kCut_mm, 0.0) / reach_mm,
                                        part = how == Lift::Bends ? beyond : std::min(10 * beyond, 1.0);
                           return object.depth_mm(x, y) - lift_mm * part;
                         }};
  return pressed(bent, motion, {}, 0.002, DepthNoise::Integrated, random);
}

TEST(LiftedPart, IsNoPartOfTheMotion) {
  for (const SolidObject& object : {textured_dome(), coin(), key_relief()})
    for (const auto& [how, rate_mm] :
         {std::pair{Lift::Bends, 0.004}, {Lift::Bends, 0.04}, {Lift::ComesOff, 0.01}}) {
      std::mt19937 random(31);
      PoseTracker tracker;
      double worst_mm = 0, worst_deg = 0;
      int told = 0, held = 0;
      for (int frame = 0; frame < 14; ++frame) {
        const double lift_mm = rate_mm * std::max(frame - 3, 0);
        const RigidMotion truth{Eigen::Matrix3d::Identity(), {0.02 * frame, 0.01 * frame, 0}};
        const Pose& pose = tracker.update(with_lifted_part(object, how, lift_mm, truth, random).map());
        if (frame == 0) continue;
        ASSERT_EQ(pose.state, PoseState::Tracked) << object.name << frame << to_string(pose.loss);
        const Vector6d error = twist_between(pose.motion, truth, pose.at_mm);
        worst_mm = std::max(worst_mm, error.head<3>().norm());
        worst_deg = std::max(worst_deg, error.tail<3>().norm() / kDegree);
        for (int c = 0; c < 6; ++c) held += std::abs(error[c]) < 1.96 * std::sqrt(pose.covariance(c, c));
        told += 6;
      }
      std::printf("%-14s %s by %.3f mm a frame: %.4f mm, %.3f degrees wrong at worst, held %d of %d\n",
                  object.name.c_str(), how == Lift::Bends ? "bends" : "comes off", rate_mm, worst_mm,
                  worst_deg, held, told);
      EXPECT_LT(worst_mm, 0.01) << object.name;
      EXPECT_LT(worst_deg, 0.2) << object.name;
      EXPECT_GE(held, 0.85 * told) << object.name;
    }
}

}  // namespace
}  // namespace palpate
