// The map that grows beside a live run: from touches and depths as a run gives them.
#include "capture/run/map/growing_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "capture/files/npy.h"
#include "engine/motion/pose_tracker.h"
#include "perf/map/relief.h"
#include "tests/support/json.h"
#include "tests/support/program_fixture.h"

namespace palpate {
namespace {

using namespace scenes;

/// A run over the relief, frame by frame.
class GrowingMapTest : public ::testing::Test {
 protected:
  struct Frame {
    Touch touch;
    PressedMap depths;
  };
  /// Frame `k` of the straight way, of track `track`.
  Frame frame(size_t k) {
    Frame out{{}, pressed(object_, path_[k], pad_, 0.002, DepthNoise::White, random_)};
    const Pose& pose = tracker_.update(out.depths.map());
    ObjectPose& told = out.touch.object.emplace();
    told.state = pose.state;
    told.track = pose.track;
    told.keys = pose.keys;
    told.residual_mm = pose.residual_mm;
    for (size_t i = 0; i < 9; ++i)
      told.rotation[i] = pose.motion.turn(static_cast<int>(i / 3), static_cast<int>(i % 3));
    for (size_t i = 0; i < 3; ++i) told.translation_mm[i] = pose.motion.shift_mm[static_cast<int>(i)];
    out.touch.contact = true;
    out.touch.surface.emplace().depth_sd_mm = 0.002;
    out.touch.sequence = k;
    return out;
  }
  void add(const Frame& frame) {
    map_.add(frame.touch, {pad_.width, pad_.height, 1, 8}, frame.depths.depth);
    map_.finish();  // so that each frame finds room
  }
  /// Width of what is seen, mm.
  double width_mm() const { return map_.seen()->width * map_.seen()->pitch_mm; }

  const PadView pad_ = wide_pad(false);
  const Relief relief_;
  const SolidObject object_ = relief_.object();
  const std::vector<RigidMotion> path_ = straight_path();
  std::mt19937 random_{1};
  PoseTracker tracker_;
  GrowingMap map_{pad_.pitch_mm};
};

TEST_F(GrowingMapTest, GrowsAndIsWrittenAsTheCommandWritesIt) {
  EXPECT_EQ(map_.seen(), nullptr);
  add(frame(0));
  ASSERT_NE(map_.seen(), nullptr);
  const double first_mm = width_mm();
  for (size_t k = 1; k < 25; ++k) add(frame(k));
  const std::shared_ptr<const SeenMap> seen = map_.seen();
  EXPECT_GT(width_mm(), first_mm + 12);
  EXPECT_GT(seen->covered_mm2, 200);
  EXPECT_GT(seen->keys, 2u);
  EXPECT_EQ(seen->pieces, 1u);
  EXPECT_EQ(seen->way_mm.size(), seen->keys);
  EXPECT_GT(seen->error_mm, 0);
  EXPECT_LT(seen->error_mm, 0.01);
  // The pad is where it was moved to: 24 frames on, the other way than the object.
  const std::vector<std::array<double, 2>> pad = map_.pad_mm();
  ASSERT_EQ(pad.size(), 4u);
  const RigidMotion back = path_[0] * path_[24].inverse();
  const Eigen::Vector3d truth = back * Eigen::Vector3d::Zero();
  EXPECT_NEAR((pad[0][0] + pad[2][0]) / 2, truth[0], 0.05);
  EXPECT_NEAR((pad[0][1] + pad[2][1]) / 2, truth[1], 0.05);

  const std::filesystem::path folder = test_folder("growing_map");
  const std::vector<std::string> names = map_.write(folder);
  for (const char* name : {"map.npy", "map_error.npy", "coverage.npy", "map.ply", "map.tif", "map.json"})
    EXPECT_TRUE(std::filesystem::exists(folder / name) && std::ranges::count(names, name) == 1) << name;
  const Json said = parse_json(slurp(folder / "map.json"));
  EXPECT_EQ(said.at("pieces")[0].at("covered_mm2"), seen->covered_mm2);
  EXPECT_EQ(read_npy(folder / "map.npy").shape, (std::vector<size_t>{seen->height, seen->width}));
  std::filesystem::remove_all(folder);
}

TEST_F(GrowingMapTest, BeginsAnewWithTheNextTrack) {
  for (size_t k = 0; k < 12; ++k) add(frame(k));
  ASSERT_GT(map_.seen()->keys, 1u);
  map_.restart();
  map_.finish();
  EXPECT_EQ(map_.seen(), nullptr);
  EXPECT_TRUE(map_.write("nowhere").empty());
  add(frame(12));  // of the track that has ended, still under way
  EXPECT_EQ(map_.seen(), nullptr);
  tracker_.restart();
  add(frame(13));
  ASSERT_NE(map_.seen(), nullptr);
  EXPECT_EQ(map_.seen()->keys, 1u);
}

TEST_F(GrowingMapTest, DoesNothingWithoutATrack) {
  Frame untouched = frame(0);
  for (const PoseState state : {PoseState::NoContact, PoseState::Lost, PoseState::PictureDamaged}) {
    untouched.touch.object->state = state;
    EXPECT_FALSE(map_.wants(untouched.touch)) << to_string(state);
  }
  untouched.touch.object.reset();
  EXPECT_FALSE(map_.wants(untouched.touch)) << "the motion is not measured";
  map_.restart();
  map_.finish();
  EXPECT_EQ(map_.seen(), nullptr);
  EXPECT_TRUE(map_.pad_mm().empty());
}

}  // namespace
}  // namespace palpate
