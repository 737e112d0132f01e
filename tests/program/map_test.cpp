// palpate map: a strip longer than the pad, recorded by a gel, as one height map.
#include <algorithm>
#include <cmath>
#include <csignal>
#include <opencv2/imgcodecs.hpp>
#include <random>
#include <sstream>

#include "capture/files/npy.h"
#include "capture/synthetic/optics.h"
#include "capture/synthetic/synthetic.h"
#include "engine/base/text.h"
#include "engine/numeric/dense.h"
#include "palpate/sensor.h"
#include "perf/map/relief.h"
#include "tests/support/eventually.h"
#include "tests/support/json.h"
#include "tests/support/program_fixture.h"

namespace palpate {
namespace {

using namespace scenes;

constexpr double kPitch_mm = 0.05;

/// A rough strip along x, 8 mm wide, that the pad reaches beyond on both sides. Its flanks are not so steep
/// that the gel's lights cast shadows there.
SolidObject strip(const Relief& relief) {
  return {"strip", [relief](double x, double y) {
            const double inside = std::clamp((4.4 - std::abs(y)) / 1.5, 0.0, 1.0);
            return (relief.depth_mm(x, y) + 0.2) * inside - 0.6 * (1 - inside);
          }};
}

/// What the gel's camera shows of depths, with its noise.
cv::Mat picture(const PressedMap& map, std::mt19937& random) {
  const auto w = static_cast<int>(map.width), h = static_cast<int>(map.height);
  std::normal_distribution<double> noise(0, 0.7);
  cv::Mat out(h, w, CV_8UC3);
  const auto depth = [&](int x, int y) {
    return double{map.depth[static_cast<size_t>(std::clamp(y, 0, h - 1)) * map.width +
                            static_cast<size_t>(std::clamp(x, 0, w - 1))]};
  };
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      // Of the surface itself: a difference over two pixels is 2 % flatter where waves are short.
      const auto slope = [&](int right, int down) {
        const auto rise = [&](int k) {
          return depth(x + k * right, y + k * down) - depth(x - k * right, y - k * down);
        };
        return (8 * rise(1) - rise(2)) / (12 * kPitch_mm);
      };
      const double by_x = slope(1, 0), by_y = slope(0, 1);
      const double long_ = std::sqrt(1 + by_x * by_x + by_y * by_y);
      for (int c = 0; c < 3; ++c) {
        const auto from = optics::gel_light(c);
        const double light = optics::gel_brightness(c, 2.0 * x / (w - 1) - 1, 2.0 * y / (h - 1) - 1) * 255 *
                             std::max(0.0, (by_x * from[0] + by_y * from[1] + from[2]) / long_);
        out.at<cv::Vec3b>(y, x)[2 - c] =
            cv::saturate_cast<uint8_t>(std::lround(optics::kBlack_gray + light + noise(random)));
      }
    }
  return out;
}

class MapProgram : public Program {
 protected:
  /// Frames of the object along `way`, a sensor file and an untouched image.
  void record(const SolidObject& object, const std::vector<RigidMotion>& way) {
    SyntheticOptions gel;
    gel.width = 320;
    gel.height = 240;
    gel.mode = SyntheticMode::Gel;
    Sensor sensor = synthetic_sensor(gel);
    sensor.pitch_mm_per_px = kPitch_mm;
    save_sensor(sensor, folder_ / "gel.json");
    fs::remove_all(folder_ / "frames");
    fs::create_directories(folder_ / "frames");
    std::mt19937 random(3);
    PadView pad = wide_pad(true);
    const PressedMap rest =
        pressed(object, {Eigen::Matrix3d::Identity(), {0, 0, -3}}, pad, 0, DepthNoise::None, random);
    cv::imwrite((folder_ / "rest.png").string(), picture(rest, random));
    for (size_t k = 0; k < way.size(); ++k) {
      const PressedMap map = pressed(object, way[k], pad, 0, DepthNoise::None, random);
      char name[32];
      std::snprintf(name, sizeof name, "%06zu.png", k);
      cv::imwrite((folder_ / "frames" / name).string(), picture(map, random));
    }
  }
  std::vector<std::string> command(const std::vector<std::string>& more) const {
    std::vector<std::string> all = {"map",          folder_ / "frames",  "--sensor", folder_ / "gel.json",
                                    "--background", folder_ / "rest.png"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
};

std::vector<RigidMotion> slide(int frames, double step_mm) {
  std::vector<RigidMotion> way;
  for (int k = 0; k < frames; ++k) {
    Vector6d twist;
    twist << 0, 0, 0.01 * std::sin(0.3 * k), 0, 0, 3 * kDegree * std::sin(0.1 * k);
    way.push_back(motion_about(Eigen::Vector3d::Zero(), twist) *
                  RigidMotion{Eigen::Matrix3d::Identity(), {step_mm * (frames / 2.0 - k), 0, 0}});
  }
  return way;
}

TEST_F(MapProgram, MapsAStripLongerThanThePad) {
  const Relief relief(8);
  const std::vector<RigidMotion> way = slide(40, 0.5);
  record(strip(relief), way);
  const Ended ended = run(command({"--out", folder_ / "out", "--json", "--validation"}));
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  const Json said = parse_json(ended.out);
  EXPECT_EQ(said.at("frames"), 40);
  EXPECT_EQ(said.at("frames_tracked"), 40);
  ASSERT_EQ(said.at("pieces").size(), 1u);
  const Json& piece = said.at("pieces")[0];
  EXPECT_EQ(parse_json(slurp(folder_ / "out" / "map.json")), said);
  const NpyArray heights = read_npy(folder_ / "out" / "map.npy"),
                 errors = read_npy(folder_ / "out" / "map_error.npy"),
                 coverage = read_npy(folder_ / "out" / "coverage.npy");
  EXPECT_EQ(heights.shape, (std::vector<size_t>{piece.at("rows"), piece.at("columns")}));
  EXPECT_GT(double(piece.at("columns")) * double(piece.at("pitch_mm")), 30);
  FusedMap map{.width = piece.at("columns"),
               .height = piece.at("rows"),
               .pitch_mm = piece.at("pitch_mm"),
               .left_mm = piece.at("left_mm"),
               .top_mm = piece.at("top_mm"),
               .height_mm = heights.values,
               .error_mm = errors.values,
               .coverage = coverage.values,
               .noise_mm = piece.at("noise_mm")};
  // The strip's flanks are no relief.
  for (uint32_t row = 0; row < map.height; ++row)
    for (uint32_t column = 0; column < map.width; ++column)
      if (std::abs(map.top_mm + row * map.pitch_mm) > 2.2)
        map.height_mm[size_t{row} * map.width + column] = NAN;
  const MapErrors off = errors_of(map, relief, 0.15, way[piece.at("key_frames")[0].at("frame")]);
  std::printf("strip: RMS %.4f mm, stated %.4f mm, held %.3f, seam %.4f mm\n", off.rms_mm, off.stated_mm,
              off.held, off.seam_mm);
  EXPECT_LT(off.rms_mm, 0.02);
  EXPECT_GT(off.held, 0.75);
  const cv::Mat tiff = cv::imread((folder_ / "out" / "map.tif").string(), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(tiff.type(), CV_32FC1);
  for (int row = 0; row < tiff.rows; ++row)
    for (int column = 0; column < tiff.cols; ++column) {
      const float value = heights.values[static_cast<size_t>(row) * static_cast<size_t>(tiff.cols) +
                                         static_cast<size_t>(column)];
      if (!std::isnan(value)) {
        ASSERT_EQ(tiff.at<float>(row, column), value);
      }
    }
  EXPECT_TRUE(contains(slurp(folder_ / "out" / "map.ply").substr(0, 400), "property float error_mm"));
  EXPECT_TRUE(fs::exists(folder_ / "out" / "map.png"));
}

TEST_F(MapProgram, SaysWhatIsMissing) {
  record(ball(6, 0.5), slide(6, 0.4));
  const Ended smooth = run(command({}));
  EXPECT_TRUE(contains(smooth.out, "no texture")) << smooth.out << smooth.err;
  const Ended one = run(command({"--frames", "1"}));
  EXPECT_EQ(one.exit_code, 0) << one.err;
  EXPECT_TRUE(contains(one.out, "one key frame alone")) << one.out;
  EXPECT_TRUE(contains(one.out, "error not known")) << one.out;
  record(ball(6, -2), slide(3, 0.4));
  const Ended none = run(command({"--out", folder_ / "out"}));
  EXPECT_TRUE(contains(none.out, "no map")) << none.out;
  EXPECT_EQ(none.exit_code, 3);
  EXPECT_EQ(parse_json(slurp(folder_ / "out" / "map.json")).at("pieces").size(), 0u);
  expect_refusal({"map", folder_ / "frames"}, 2, {"surface", "--sensor"});
  expect_refusal({"map", folder_ / "nowhere"}, 3, {"nowhere"});
  expect_refusal(command({"--pitch-mm", "0"}), 2, {"--pitch-mm"});
  expect_refusal(command({"--links", "0"}), 2, {"--links"});
}

/// What a process has read of files so far.
uint64_t bytes_read(pid_t process) {
  std::istringstream words(slurp("/proc/" + std::to_string(process) + "/io"));
  uint64_t bytes = 0;
  for (std::string name; words >> name && name != "rchar:";) {
  }
  words >> bytes;
  return bytes;
}

TEST_F(MapProgram, CtrlCMapsWhatThereIs) {
  record(strip(Relief(8)), slide(16, 0.5));
  // So many rounds to and fro that it cannot come to their end meanwhile.
  const fs::path frames = folder_ / "frames";
  uint64_t first = 0;
  for (int k = 0; k < 16; ++k) first += fs::file_size(frames / palpate::text("%06d.png", k));
  for (int k = 16; k < 3000; ++k)
    fs::create_hard_link(frames / palpate::text("%06d.png", k % 30 < 16 ? k % 30 : 30 - k % 30),
                         frames / palpate::text("%06d.png", k));
  const pid_t child = start(command({"--out", folder_ / "out", "--json"}));
  ASSERT_TRUE(eventually([&] { return fs::exists(folder_ / "out"); }));
  const uint64_t before = bytes_read(child);
  ASSERT_TRUE(eventually([&] { return bytes_read(child) > before + 2 * first; }));
  ASSERT_EQ(kill(child, SIGINT), 0);
  const Ended ended = finish(child);
  EXPECT_EQ(ended.exit_code, 130) << ended.err;
  const Json said = parse_json(ended.out);
  EXPECT_FALSE(said.at("complete"));
  EXPECT_GT(said.at("frames"), 16);
  EXPECT_LT(said.at("frames"), 3000);
  ASSERT_EQ(said.at("pieces").size(), 1u);
  EXPECT_GT(said.at("pieces")[0].at("key_frames").size(), 2u);
  EXPECT_EQ(parse_json(slurp(folder_ / "out" / "map.json")), said);
  EXPECT_TRUE(fs::exists(folder_ / "out" / "map.npy"));
}

TEST_F(MapProgram, MapsWhatCameBeforeADamage) {
  record(strip(Relief(8)), slide(12, 0.5));
  const fs::path damaged = folder_ / "frames" / "000009.png";
  fs::resize_file(damaged, fs::file_size(damaged) / 3);
  const Ended ended = run(command({"--out", folder_ / "out", "--json"}));
  EXPECT_EQ(ended.exit_code, 3) << ended.err;
  EXPECT_TRUE(contains(ended.err, "000009.png")) << ended.err;
  const Json said = parse_json(ended.out);
  EXPECT_EQ(said.at("frames"), 9);
  EXPECT_FALSE(said.at("complete"));
  EXPECT_EQ(said.at("pieces").size(), 1u);
  EXPECT_TRUE(fs::exists(folder_ / "out" / "map.npy"));
}

}  // namespace
}  // namespace palpate
