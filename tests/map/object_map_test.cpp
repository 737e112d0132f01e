#include "engine/map/object_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <thread>

#include "palpate/error.h"
#include "perf/map/relief.h"
#include "tests/support/thorough.h"

namespace palpate {
namespace {

using namespace scenes;

struct Mapped {
  std::shared_ptr<const MapSnapshot> map;
  MapErrors errors;       ///< of the largest piece
  double return_mm = 0;   ///< error of the last frame's place against the first's
  double tracked_mm = 0;  ///< the same by the tracker alone
  int lost = 0;
};
Mapped mapped(const Relief& relief, const std::vector<RigidMotion>& path, DepthNoise kind,
              MapOptions options = {}, double noise_mm = 0.002, double pad_slope_sd = 0,
              uint32_t pad_seed = 77) {
  PadView pad = wide_pad(thorough());
  pad.slope_error = pad_slope_sd;
  pad.slope_seed = pad_seed;
  const SolidObject object = relief.object();
  std::mt19937 random(1);
  PoseTracker tracker;
  ObjectMap map(options);
  Mapped out;
  Pose pose;
  for (size_t frame = 0; frame < path.size(); ++frame) {
    const PressedMap seen = pressed(object, path[frame], pad, noise_mm, kind, random);
    pose = tracker.update(seen.map());
    out.lost += pose.state == PoseState::Lost ? 1 : 0;
    map.add(seen.map(), pose, frame);
    while (frame % 8 == 0 && map.work()) {
    }
  }
  map.finish();
  out.map = map.snapshot();
  if (out.map->pieces.empty()) return out;
  const MapPiece& largest = out.map->pieces.front();
  out.errors = errors_of(largest.map, relief, pad.skin_px * pad.pitch_mm, path[largest.keys.front().frame]);
  const RigidMotion truth = path.back() * path.front().inverse();
  out.tracked_mm = twist_between(pose.motion, truth, pose.at_mm).head<3>().norm();
  if (const auto place = map.place())
    out.return_mm = twist_between(place->motion, truth, pose.at_mm).head<3>().norm();
  return out;
}

void print(const char* name, const Mapped& m) {
  std::printf(
      "%s: lost %d, keys %u, pieces %zu, smooth %u, loops %u, refused %u, left out %u, missed %u, factor "
      "%.2f; map RMS %.4f mm "
      "(relief %.4f), stated %.4f, held %.3f, noise %.4f, seam %.4f, covered %.3f, return %.4f mm (tracker "
      "%.4f)\n",
      name, m.lost, m.map->keys, m.map->pieces.size(), m.map->smooth, m.map->loops, m.map->refused,
      m.map->left_out, m.map->missed, m.map->variance_factor, m.errors.rms_mm, m.errors.relief_rms_mm,
      m.errors.stated_mm, m.errors.held, m.map->pieces.empty() ? 0 : m.map->pieces[0].map.noise_mm,
      m.errors.seam_mm, m.errors.covered, m.return_mm, m.tracked_mm);
  std::fflush(stdout);
}

// A relief of 60 x 20 mm under a pad of 16 x 12 mm: the map is right to 0.02 mm, and back at its start the
// pad knows it to 0.1 mm.
TEST(ObjectMap, IsRightAlongARasterAndByHand) {
  const Relief relief;
  const std::pair<DepthNoise, const char*> noises[] = {
      {DepthNoise::White, "white"}, {DepthNoise::Reach3, "reach 3"}, {DepthNoise::Integrated, "integrated"}};
  for (const auto& [kind, noise] : noises)
    for (const bool raster : {true, false}) {
      if (!thorough() && kind == DepthNoise::Reach3) continue;
      if (!thorough() && (kind == DepthNoise::White) == raster) continue;
      const Mapped m = mapped(relief, raster ? raster_path() : free_path(), kind);
      print((std::string(raster ? "raster, " : "by hand, ") + noise).c_str(), m);
      ASSERT_EQ(m.map->pieces.size(), 1u);
      EXPECT_EQ(m.map->smooth, 0u);
      EXPECT_EQ(m.map->missed, 0u);
      EXPECT_LT(m.errors.rms_mm, 0.02);
      EXPECT_LT(m.errors.relief_rms_mm, 0.02);
      EXPECT_LT(m.return_mm, 0.1);
      EXPECT_LT(m.errors.seam_mm, 2 * m.map->pieces[0].map.noise_mm);
      EXPECT_GT(m.errors.covered, 0.95);
      EXPECT_GT(m.errors.held, 0.85);
    }
}

// What the pad itself errs by goes over the object with it, and no number of key frames takes it away. Its
// curvature bends the whole map, which no difference shows and the stated error holds all the same.
TEST(ObjectMap, TellsWhatThePadItselfErrsBy) {
  const Mapped right = mapped(Relief(6), straight_path(), DepthNoise::White);
  print("a pad that is right", right);
  ASSERT_EQ(right.map->pieces.size(), 1u);
  const FusedMap& good = right.map->pieces[0].map;
  EXPECT_LT(good.pad_mm, 0.0004);
  EXPECT_LT(good.bend_mm, 0.0005);
  EXPECT_GT(right.errors.held, 0.9);
  double held = 0, squares_mm2 = 0, stated_mm2 = 0;
  const int pads = of_sweep(12, 5);
  for (int k = 0; k < pads; ++k) {
    const Mapped wrong = mapped(Relief(6), straight_path(), DepthNoise::White, {}, 0.002, 0.003,
                                static_cast<uint32_t>(101 + k));
    print("slopes wrong by 0.003", wrong);
    ASSERT_EQ(wrong.map->pieces.size(), 1u);
    const FusedMap& bad = wrong.map->pieces[0].map;
    std::printf("of the pad: %.5f mm, bend %.5f mm\n", bad.pad_mm, bad.bend_mm);
    EXPECT_GT(bad.pad_mm, 0.001);
    EXPECT_GT(wrong.errors.stated_mm, std::hypot(bad.pad_mm, 0.99 * bad.bend_mm));
    const MapKey& end = wrong.map->pieces[0].keys.back();
    EXPECT_GT(std::sqrt(end.covariance(2, 2)), 0.5 * bad.bend_mm) << "key frames' places say it, too";
    held += wrong.errors.held / pads;
    squares_mm2 += wrong.errors.rms_mm * wrong.errors.rms_mm / pads;
    stated_mm2 += wrong.errors.stated_mm * wrong.errors.stated_mm / pads;
  }
  std::printf("all pads: RMS %.4f mm, stated %.4f mm, held %.3f\n", std::sqrt(squares_mm2),
              std::sqrt(stated_mm2), held);
  EXPECT_GT(held, 0.8);
  EXPECT_LT(stated_mm2, 4 * squares_mm2);
}

// A smooth band wider than the pad: what lies beyond it is a piece of its own, and the band none.
TEST(ObjectMap, InventsNothingAcrossASmoothBand) {
  const Mapped m = mapped(Relief(5, 24), straight_path(), DepthNoise::White);
  print("smooth band", m);
  ASSERT_EQ(m.map->pieces.size(), 2u);
  for (const MapPiece& piece : m.map->pieces) {
    const MapErrors errors =
        errors_of(piece.map, Relief(5, 24), wide_pad(thorough()).skin_px * wide_pad(thorough()).pitch_mm,
                  straight_path()[piece.keys.front().frame]);
    EXPECT_LT(errors.rms_mm, 0.02);
    EXPECT_LT(piece.map.width * piece.map.pitch_mm, 40);
  }
}

// Nothing but smooth: at most what one frame shows, whose noise nothing tells.
TEST(ObjectMap, MakesNothingOfAPlane) {
  const Mapped m = mapped(Relief(5, 90), straight_path(), DepthNoise::White);
  print("plane", m);
  ASSERT_EQ(m.map->pieces.size(), m.map->keys == 1 ? 1u : 0u);
  for (const MapPiece& piece : m.map->pieces) {
    EXPECT_TRUE(std::isnan(piece.map.noise_mm));
    EXPECT_LT(piece.map.covered_mm2(), 16.0 * 12);
  }
}

// To and fro over one place: what shows the same is left out, and where there is no more room nothing is
// kept.
TEST(ObjectMap, StaysSmall) {
  std::vector<RigidMotion> path = straight_path();
  path.resize(path.size() / 4);
  const size_t once = path.size();
  for (int turn = 0; turn < 3; ++turn) {
    for (size_t k = once; k-- > 0;) path.push_back(path[k]);
    for (size_t k = 0; k < once; ++k) path.push_back(path[k]);
  }
  const Mapped again = mapped(Relief(), path, DepthNoise::White, {.enough = 3});
  print("to and fro", again);
  EXPECT_GT(again.map->left_out, 3u);
  EXPECT_LT(again.map->keys, 16u);
  EXPECT_EQ(again.map->pieces.size(), 1u);
  const Mapped full =
      mapped(Relief(), straight_path(), DepthNoise::White, {.most_keys = 4, .most_map_px = 20'000});
  print("full", full);
  EXPECT_EQ(full.map->keys, 4u);
  EXPECT_GT(full.map->missed, 0u);
  ASSERT_EQ(full.map->pieces.size(), 1u);
  EXPECT_LE(size_t{full.map->pieces[0].map.width} * full.map->pieces[0].map.height, 22'000u);
}

// Work in a thread of its own gives a map too, while frames are added; the place is told meanwhile.
TEST(ObjectMap, WorksBesideTheFrames) {
  const PadView pad = wide_pad(false);
  const SolidObject object = Relief().object();
  const std::vector<RigidMotion> path = straight_path();
  std::mt19937 random(1);
  PoseTracker tracker;
  ObjectMap map;
  {
    const std::jthread worker([&](const std::stop_token& stop) { map.run(stop); });
    for (size_t frame = 0; frame < 20; ++frame) {
      const PressedMap seen = pressed(object, path[frame], pad, 0.002, DepthNoise::White, random);
      map.add(seen.map(), tracker.update(seen.map()), frame);
    }
  }
  map.finish();
  ASSERT_EQ(map.snapshot()->pieces.size(), 1u);
  EXPECT_GT(map.snapshot()->pieces[0].keys.size(), 2u);
  const auto place = map.place();
  ASSERT_TRUE(place);
  EXPECT_EQ(place->piece, 0u);
  const RigidMotion truth = path[19] * path[0].inverse();
  EXPECT_LT(twist_between(place->motion, truth, Eigen::Vector3d::Zero()).head<3>().norm(), 0.01);
}

TEST(ObjectMap, RefusesMapsThatDoNotFit) {
  ObjectMap map;
  const std::vector<float> depth(100, 0.1f);
  const std::vector<uint8_t> contact(99, 1);
  Pose pose;
  pose.state = PoseState::Begun;
  pose.track = 1;
  EXPECT_THROW(
      map.add({.width = 10, .height = 10, .pitch_mm_per_px = 0.1, .depth_mm = depth, .contact = contact},
              pose),
      Error);
}

}  // namespace
}  // namespace palpate
