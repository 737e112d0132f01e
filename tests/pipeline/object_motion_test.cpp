// The motion of what touches the pad, through the whole engine: frames in, pose out.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "capture/files/npy.h"
#include "capture/synthetic/object.h"
#include "engine/motion/rigid_motion.h"
#include "engine/pipeline/object_follower.h"
#include "palpate/error.h"
#include "palpate/pipeline.h"
#include "tests/scenes/synthetic_run.h"
#include "tests/support/gpu_fixture.h"
#include "tests/support/test_folder.h"

namespace palpate {
namespace {

constexpr Outputs kMeasured = Output::Force | Output::Surface | Output::Contacts,
                  kMoving = kMeasured | Output::Motion;

class ObjectMotion : public GpuTest {
 protected:
  /// A ball that presses, then slides.
  SyntheticRun run_{"slide?mode=gel&size=320x240"};

  Touch measured(Pipeline& pipeline, uint64_t k) {
    Frame frame = run_.frame(k);
    frame.sequence = k;
    return pipeline.process(frame).touch;
  }
};

// A ball's centre has a way, its surface none, and nothing shows whether it turns.
TEST_F(ObjectMotion, FollowsTheCentreOfABall) {
  Pipeline pipeline = run_.pipeline(context(), {.outputs = kMoving});
  Truth first;
  uint32_t tracked = 0;
  double farthest_mm = 0;
  for (uint64_t k = 0; k < run_.count(); ++k) {
    const Touch touch = measured(pipeline, k);
    ASSERT_TRUE(touch.object);
    const ObjectPose& pose = *touch.object;
    const Truth truth = run_.truth(k);
    if (pose.state == PoseState::Begun) first = truth;
    if (pose.state != PoseState::Tracked) continue;
    ++tracked;
    ASSERT_EQ(pose.track, 1u) << k;
    EXPECT_EQ(pose.surface, Slippage::Ball) << k;
    const double x_mm = (truth.center_x_px - first.center_x_px) * run_.sensor.pitch_mm_per_px,
                 y_mm = (truth.center_y_px - first.center_y_px) * run_.sensor.pitch_mm_per_px;
    EXPECT_TRUE(pose.shift_mm[0].valid() && pose.shift_mm[1].valid() && pose.shift_mm[2].valid()) << k;
    EXPECT_NEAR(pose.shift_mm[0].value, x_mm, 0.05) << k;
    EXPECT_NEAR(pose.shift_mm[1].value, y_mm, 0.05) << k;
    for (const Estimate& turn : pose.turn_rad) {
      EXPECT_EQ(turn.validity, Validity::Undetermined) << k;
      EXPECT_TRUE(std::isnan(turn.value)) << k;
    }
    farthest_mm = std::max(farthest_mm, std::hypot(x_mm, y_mm));
  }
  EXPECT_GT(tracked, 60u);
  EXPECT_GT(farthest_mm, 3);
}

TEST_F(ObjectMotion, CountsAnewWhereAskedToAndAfterAGap) {
  Pipeline pipeline = run_.pipeline(context(), {.outputs = kMoving});
  const auto pose = [&](uint64_t k) { return *measured(pipeline, k).object; };
  EXPECT_EQ(pose(0).state, PoseState::NoContact);
  EXPECT_EQ(pose(40).state, PoseState::Begun);
  EXPECT_EQ(pose(41).state, PoseState::Tracked);
  pipeline.restart_motion();
  EXPECT_EQ(pose(42).state, PoseState::Begun);
  EXPECT_EQ(pose(43).track, 2u);
  Frame late = run_.frame(60);
  late.after_gap = true;
  EXPECT_EQ(pipeline.process(late).touch.object->state, PoseState::Begun);
}

// All other numbers are as without it, and without it nothing of it is there.
TEST_F(ObjectMotion, LeavesTheOtherNumbersAlone) {
  Pipeline with = run_.pipeline(context(), {.outputs = kMoving, .solve_by = SolveBy::Host});
  Pipeline without = run_.pipeline(context(), {.outputs = kMeasured});
  EXPECT_EQ(with.memory_bytes(), without.memory_bytes());
  for (const uint64_t k : {0u, 30u, 50u, 80u}) {
    const Touch a = measured(with, k), b = measured(without, k);
    EXPECT_FALSE(b.object);
    EXPECT_EQ(a.gray_sum, b.gray_sum);
    EXPECT_EQ(a.area_px, b.area_px);
    EXPECT_EQ(a.surface->depth_max_mm, b.surface->depth_max_mm);
  }
}

TEST_F(ObjectMotion, SeparatePicturesHaveNone) {
  Pipeline pipeline = run_.pipeline(context(), {.outputs = kMoving, .separate = true});
  EXPECT_FALSE(measured(pipeline, 60).object);
}

TEST_F(ObjectMotion, IsNotKnownOfADamagedPicture) {
  Pipeline pipeline = run_.pipeline(context(), {.outputs = kMoving});
  for (uint64_t k = 30; k < 42; ++k) measured(pipeline, k);
  Frame green = run_.frame(42);
  for (uint32_t y = 120; y < 240; ++y)
    for (uint32_t x = 0; x < 320; ++x) {
      green.set(0, x, y, 0);
      green.set(1, x, y, 135);
      green.set(2, x, y, 0);
    }
  const Touch touch = pipeline.process(green).touch;
  ASSERT_NE(touch.picture, PictureFault::None);
  EXPECT_EQ(touch.object->state, PoseState::PictureDamaged);
  EXPECT_EQ(touch.object->shift_mm[0].validity, Validity::PictureDamaged);
  const ObjectPose next = *measured(pipeline, 43).object;
  EXPECT_EQ(next.state, PoseState::Tracked);
  EXPECT_EQ(next.track, 1u);
}

TEST_F(ObjectMotion, WantsASurfaceAndAScale) {
  EXPECT_THROW(run_.pipeline(context(), {.outputs = Output::Force | Output::Motion}), Error);
  Sensor unscaled = run_.sensor;
  unscaled.pitch_mm_per_px = 0;
  EXPECT_THROW(Pipeline(context(), unscaled, run_.source.format(), {.outputs = kMoving}), Error);
}

// Frames of more pixels than the skin has detail are followed on a coarser level.
TEST_F(ObjectMotion, PixelsFinerThanTheSkinAreNotCounted) {
  Sensor sensor = run_.sensor;
  for (const auto& [pitch_mm, level] : {std::pair{0.06, 0u}, {0.04, 0u}, {0.03, 1u}, {0.015, 2u}}) {
    sensor.pitch_mm_per_px = pitch_mm;
    EXPECT_EQ(pose_options(sensor).registration.finest_level, level) << pitch_mm;
  }
}

/// Every frame of a simulated object through a pipeline, with its truth.
template <typename See>
void measure_object(Device& device, const std::string& keys, const PipelineOptions& options, See see) {
  const ObjectOptions scene = parse_object("synthetic:object?" + keys);
  ObjectSensor source(scene);
  Pipeline pipeline(device, object_sensor(scene), source.format(), options);
  pipeline.set_background(*source.own_background());
  for (Frame frame; source.next(frame);) see(pipeline.process(frame).touch, *source.truth(frame.sequence));
}

// A disc whose edge is steeper than pictures show lacks depth, and says so; a dome does not.
TEST_F(ObjectMotion, SteepFlanksAreInTheErrorOfDepth) {
  struct Way {
    double worst_mm = 0, largest_sd_mm = 0;
    uint32_t told = 0, held = 0;
  };
  const auto way_of = [&](const char* keys) {
    Way way;
    double begun_mm = 0;
    measure_object(context(), keys, {.outputs = kMoving}, [&](const Touch& touch, const Truth& truth) {
      const ObjectPose& pose = *touch.object;
      if (!truth.motion) return;
      if (pose.state == PoseState::Begun) begun_mm = truth.motion->shift_mm[2];
      if (pose.state != PoseState::Tracked || !pose.shift_mm[2].valid()) return;
      const double error_mm = pose.shift_mm[2].value - (truth.motion->shift_mm[2] - begun_mm);
      ++way.told;
      way.held += std::abs(error_mm) < 1.96 * pose.shift_mm[2].standard_error;
      way.worst_mm = std::max(way.worst_mm, std::abs(error_mm));
      way.largest_sd_mm = std::max(way.largest_sd_mm, pose.shift_mm[2].standard_error);
    });
    return way;
  };
  const std::string scene = "&size=320x240&seconds=0.4&rate=30";
  const Way disc = way_of(("shape=plane&path=slide" + scene).c_str()),
            dome = way_of(("shape=textured&path=slide" + scene).c_str());
  std::printf("disc: %.4f mm at worst, error %.4f mm; dome: %.4f mm, %.4f mm\n", disc.worst_mm,
              disc.largest_sd_mm, dome.worst_mm, dome.largest_sd_mm);
  EXPECT_GT(disc.told, 15u);
  EXPECT_GT(disc.worst_mm, 0.03);
  EXPECT_GE(disc.held, disc.told * 9 / 10);
  EXPECT_GE(dome.held, dome.told * 9 / 10);
  EXPECT_LT(dome.largest_sd_mm, 0.006);
}

/// Two domes, 5.5 mm to the left and to the right, the left one larger and higher; it lifts step by step
/// while the other one stays. The scene's keys.
std::string rocking_domes() {
  constexpr uint32_t kWide = 101, kHigh = 45;
  constexpr double kPitch_mm = 0.2, kApart_mm = 11, kDeep_mm = 0.5, kDegree = M_PI / 180;
  const std::filesystem::path folder = test_folder("pipeline");
  std::vector<float> height(size_t{kWide} * kHigh);
  for (uint32_t i = 0; i < height.size(); ++i) {
    const double x = (double(i % kWide) - (kWide - 1) / 2.0) * kPitch_mm,
                 y = (double(i / kWide) - (kHigh - 1) / 2.0) * kPitch_mm;
    const auto dome = [&](double middle_mm, double radius_mm) {
      return -(std::pow(x - middle_mm, 2) + y * y) / (2 * radius_mm);
    };
    const double texture = 0.02 * std::cos(5 * x + 2 * y) + 0.02 * std::cos(5 * y - x);
    height[i] =
        static_cast<float>(std::max(dome(-kApart_mm / 2, 9), dome(kApart_mm / 2, 7) - 0.06) + texture);
  }
  write_npy(folder / "domes.npy", height, {kHigh, kWide});
  std::ofstream path(folder / "path.csv");
  path << "t_s,x_mm,y_mm,z_mm,rx_deg,ry_deg,rz_deg\n";
  const auto row = [&](double time_s, double deep_mm, double lift_mm) {
    const double angle = std::asin(lift_mm / kApart_mm);
    path << time_s << ",0,0," << deep_mm - lift_mm / 2 << ",0," << -angle / kDegree << ",0\n";
  };
  row(0, -0.3, 0);
  double time_s = 0.05;
  for (const double left_mm : {0.5, 0.5, 0.5, 0.3, 0.2, 0.14, 0.11, 0.09, 0.07, 0.05, -0.3, -0.3})
    row(time_s, kDeep_mm, kDeep_mm - left_mm), time_s += 0.05;
  return "file=" + (folder / "domes.npy").string() + "&path=" + (folder / "path.csv").string() +
         "&pitch_mm=0.2&size=320x240&rate=20";
}

// Where too little is left of the contact that is followed and another one stays, the next track begins on
// that one in the same frame.
TEST_F(ObjectMotion, BeginsAtOnceOnWhatStillTouches) {
  std::vector<ObjectPose> begun;
  size_t touched = 0, told = 0;
  measure_object(context(), rocking_domes(), {.outputs = kMoving}, [&](const Touch& touch, const Truth&) {
    const ObjectPose& pose = *touch.object;
    touched += touch.contact;
    told += pose.state == PoseState::Begun || pose.state == PoseState::Tracked;
    if (pose.state == PoseState::Begun) begun.push_back(pose);
  });
  EXPECT_GT(touched, 7u);
  EXPECT_EQ(told, touched) << "no frame is lost between the two";
  ASSERT_EQ(begun.size(), 2u);
  EXPECT_EQ(begun[1].track, 2u);
  EXPECT_LT(begun[0].at_mm[0], -4);
  EXPECT_GT(begun[1].at_mm[0], 4);
}

// What a frame's noise makes of slopes is nothing that stays with the pad.
TEST_F(ObjectMotion, OnlyThePadsPartOfTheErrorStaysWithThePad) {
  Sensor sensor = run_.sensor;
  sensor.pitch_mm_per_px = 0.05;
  sensor.photometric.normal_sd = 0.05;
  sensor.photometric.noise_sd = 0;
  EXPECT_EQ(pose_options(sensor).registration.pad_slope_sd, 0.05);
  sensor.photometric.noise_sd = 0.03;
  sensor.photometric.pad_reach_px = 20;
  EXPECT_NEAR(pose_options(sensor).registration.pad_slope_sd, 0.04, 1e-12);
  EXPECT_NEAR(pose_options(sensor).registration.pad_reach_mm, 1, 1e-12);
}

// A coin is pressed deeper, slides and turns: its stamped edges are cut short, which the depth's error
// states.
TEST_F(ObjectMotion, IntervalsHoldTheWayOfACoin) {
  std::array<size_t, 6> held{}, told{};
  std::array<double, 6> squares{};
  RigidMotion begun;
  measure_object(
      context(), "shape=coin&size=320x240&rate=20&seconds=4&seed=9", {.outputs = kMoving},
      [&](const Touch& touch, const Truth& truth) {
        const ObjectPose& pose = *touch.object;
        if (!truth.motion) return;
        const auto& [shift, turn] = *truth.motion;
        const RigidMotion since{turn_of({turn[0], turn[1], turn[2]}), {shift[0], shift[1], shift[2]}};
        if (pose.state == PoseState::Begun) begun = since;
        if (pose.state != PoseState::Tracked) return;
        const RigidMotion way = since * begun.inverse();
        const Eigen::Vector3d at(pose.at_mm[0], pose.at_mm[1], pose.at_mm[2]);
        const Eigen::Vector3d moved = at - way.inverse() * at, turned = turn_vector(way.turn);
        for (size_t c = 0; c < 6; ++c) {
          const Estimate& seen = c < 3 ? pose.shift_mm[c] : pose.turn_rad[c - 3];
          if (!seen.valid()) continue;
          const auto k = static_cast<Eigen::Index>(c % 3);
          const double error = (seen.value - (c < 3 ? moved : turned)[k]) / seen.standard_error;
          ++told[c];
          held[c] += std::abs(error) < 1.96;
          squares[c] += error * error;
        }
      });
  for (size_t c = 0; c < 6; ++c) {
    std::printf("component %zu: %zu of %zu held, RMS %.2f of the stated error\n", c, held[c], told[c],
                std::sqrt(squares[c] / static_cast<double>(told[c])));
    ASSERT_GT(told[c], 50u) << c;
    EXPECT_GE(static_cast<double>(held[c]), 0.85 * static_cast<double>(told[c])) << c;
    EXPECT_GT(squares[c], 0.04 * static_cast<double>(told[c])) << c << ": five times too wide";
  }
}

// Device and host add up in different orders.
TEST_F(ObjectMotion, OfDeviceAndHostAreAlike) {
  const std::string keys = "shape=textured&size=160x120&seconds=1.2&seed=2";
  std::vector<ObjectPose> host;
  measure_object(context(), keys, {.outputs = kMoving, .solve_by = SolveBy::Host},
                 [&](const Touch& touch, const Truth&) { host.push_back(*touch.object); });
  size_t at = 0, tracked = 0;
  measure_object(context(), keys, {.outputs = kMoving, .solve_by = SolveBy::Device},
                 [&](const Touch& touch, const Truth&) {
                   const ObjectPose &device = *touch.object, &wanted = host[at++];
                   ASSERT_EQ(device.state, wanted.state) << at;
                   if (device.state != PoseState::Tracked) return;
                   ++tracked;
                   for (size_t c = 0; c < 3; ++c) {
                     EXPECT_NEAR(device.translation_mm[c], wanted.translation_mm[c], 2e-4) << at;
                     EXPECT_NEAR(device.shift_mm[c].standard_error, wanted.shift_mm[c].standard_error,
                                 0.02 * wanted.shift_mm[c].standard_error)
                         << at;
                   }
                 });
  EXPECT_GT(tracked, 20u);
}

// Dragged to and fro under friction: the skin goes along, then stays behind.
TEST_F(ObjectMotion, SlipsOnTheSkinWhereFrictionGivesWay) {
  constexpr double kFriction = 0.3;
  size_t told = 0, right = 0, slipping = 0;
  double worst_mm = 0, stuck_at_mm = 0;
  measure_object(context(), "shape=textured&path=drag&skin=markers&friction=0.3&seconds=2.6&size=320x240",
                 {.outputs = kMoving | Output::Skin}, [&](const Touch& touch, const Truth& truth) {
                   const ObjectPose& pose = *touch.object;
                   if (pose.state != PoseState::Tracked || !truth.motion) {
                     EXPECT_EQ(pose.on_skin == OnSkin::Slips, false);
                     return;
                   }
                   ++told;
                   right += (pose.on_skin == OnSkin::Slips) == truth.slipping;
                   slipping += truth.slipping;
                   const double x_mm = truth.motion->shift_mm[0];
                   if (!truth.slipping) stuck_at_mm = x_mm;
                   if (!truth.slipping || pose.on_skin != OnSkin::Slips) return;
                   // The skin's way is friction times depth; at the last place where both stuck it was less.
                   const double most_mm = std::abs(x_mm - stuck_at_mm);
                   EXPECT_TRUE(pose.slip_mm[0].valid());
                   EXPECT_LT(std::abs(pose.slip_mm[0].value), most_mm + 0.06);
                   worst_mm = std::max(worst_mm, std::abs(pose.slip_mm[0].value));
                 });
  std::printf("%zu frames told, %zu as in truth, %zu of them slip, by up to %.2f mm (friction %.1f)\n", told,
              right, slipping, worst_mm, kFriction);
  EXPECT_GT(slipping, 30u);
  EXPECT_GT(right, 0.85 * static_cast<double>(told));
  EXPECT_GT(worst_mm, 1.4);
}

// Where no skin is followed nothing is said of it.
TEST_F(ObjectMotion, KnowsNoSlipWithoutSkin) {
  measure_object(context(), "shape=textured&size=160x120&seconds=1", {.outputs = kMoving},
                 [](const Touch& touch, const Truth&) {
                   EXPECT_EQ(touch.object->on_skin, OnSkin::Unknown);
                   EXPECT_TRUE(std::isnan(touch.object->slip_mm[0].value));
                   EXPECT_FALSE(touch.object->slip_mm[0].valid());
                 });
}

// A strip over the whole width leaves no tile of the frame untouched, but the pad at rest beside it.
TEST_F(ObjectMotion, DepthCountsFromThePadAtRestBesideAStrip) {
  size_t touched = 0;
  measure_object(context(), "shape=relief&path=hand&size=320x240&rate=10&seconds=10", {.outputs = kMeasured},
                 [&](const Touch& touch, const Truth& truth) {
                   if (!touch.contact || truth.indentation_mm < 0.3) return;
                   ++touched;
                   EXPECT_TRUE(touch.surface->rest_from_untouched) << truth.sequence;
                   EXPECT_NEAR(touch.surface->depth_max_mm, truth.indentation_mm, 0.12) << truth.sequence;
                 });
  EXPECT_GT(touched, 80u);
}

}  // namespace
}  // namespace palpate
