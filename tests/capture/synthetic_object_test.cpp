// The synthetic object: its path, its truth, what its frames show, and every file and option that is refused.
#include "capture/synthetic/object.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>

#include "capture/files/npy.h"
#include "capture/synthetic/object_mesh.h"
#include "capture/synthetic/object_path.h"
#include "palpate/error.h"
#include "tests/support/test_folder.h"

namespace palpate {
namespace {

constexpr double kDegree = M_PI / 180;

class SyntheticObject : public ::testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& bytes) {
    const std::filesystem::path file = folder_ / name;
    std::ofstream(file, std::ios::binary) << bytes;
    return file.string();
  }
  /// A path that is at these places at whole seconds: x, y, z, mm, and turns, degrees.
  std::string path(const std::vector<std::array<double, 6>>& places) {
    std::string text = "t_s,x_mm,y_mm,z_mm,rx_deg,ry_deg,rz_deg\n";
    for (size_t k = 0; k < places.size(); ++k) {
      text += std::to_string(k);
      for (const double value : places[k]) text += "," + std::to_string(value);
      text += "\n";
    }
    return "&path=" + write("path.csv", text);
  }
  static ObjectOptions options(const std::string& keys) { return parse_object("synthetic:object?" + keys); }
  static std::string refusal(const std::string& keys) {
    try {
      ObjectSensor sensor{options(keys)};
      return "";
    } catch (const Error& error) {
      EXPECT_EQ(error.failure(), Failure::Input) << keys;
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << keys;
      return error.what();
    }
  }
  ~SyntheticObject() override { std::filesystem::remove_all(folder_); }
  const std::filesystem::path folder_ = test_folder("synthetic_object");
};

TEST_F(SyntheticObject, OptionsComeBack) {
  const ObjectOptions o = options(
      "shape=coin&path=hand&speed_mm_s=7&depth_mm=0.3&creep=0.2&size=320x240&skin=markers&friction=0.8&seed="
      "4");
  EXPECT_EQ(o.camera.width, 320u);
  EXPECT_EQ(o.camera.mode, SyntheticMode::Gel);
  EXPECT_EQ(o.camera.friction, 0.8);
  EXPECT_EQ(o.speed_mm_s, 7);
  EXPECT_EQ(to_string(parse_object(to_string(o))), to_string(o));
  EXPECT_TRUE(is_object("synthetic:object"));
  EXPECT_FALSE(is_object("synthetic:objects"));
  EXPECT_EQ(options("").camera.rate_Hz, 60);
}

TEST_F(SyntheticObject, EachWrongOptionIsRefusedInOneLine) {
  for (const auto& [keys, word] :
       {std::pair{"shape=kee", "'key'"}, {"path=slyde", "'slide'"},       {"speed_mm_s=-1", "0 to 1000"},
        {"depth_mm=9", "0.01 to 5"},     {"tilt_deg=31", "0 to 30"},      {"turn_deg=x", "'x'"},
        {"creep=1", "0 to 0.9"},         {"reach_mm=0", "0.01 to 200"},   {"pitch_mm=0", "0.001 to 10"},
        {"seconds=0", "0.1 to 3600"},    {"friction=0", "0.01 to 10"},    {"smooth_mm=nan", "0 to 2"},
        {"mode=waveguide", "gel"},       {"depth=1", "depth_mm"},         {"size=0x0", "px"},
        {"file=key.obj", ".stl"},        {"file=nowhere.npy", "nowhere"}, {"file=nowhere.stl", "nowhere"},
        {"path=nowhere.csv", "nowhere"}, {"bits=12", "bits=12"}})
    EXPECT_NE(refusal(keys).find(word), std::string::npos) << keys << ": " << refusal(keys);
}

TEST_F(SyntheticObject, WrongPathsAreRefused) {
  const std::string header = "t_s,x_mm,y_mm,z_mm,rx_deg,ry_deg,rz_deg\n";
  for (const auto& [text, word] : {std::pair{header + "0,0,0,0,0,0,0\n", "two rows"},
                                   {header + "0,0,0,0,0,0,0\n0,1,0,0,0,0,0\n", "rise"},
                                   {header + "-1,0,0,0,0,0,0\n1,1,0,0,0,0,0\n", "rise"},
                                   {header + "0,0,0,0,0,0,0\n1,x,0,0,0,0,0\n", "x"},
                                   {header + "0,0,0,0,0,0,0\n1,2000,0,0,0,0,0\n", "1000 mm"},
                                   {header + "0,0,0,0,0,0,0\n4000,0,0,0,0,0,0\n", "hour"},
                                   {std::string("t_s,x_mm\n0,0\n"), "y_mm"}})
    EXPECT_NE(refusal("path=" + write("bad.csv", text)).find(word), std::string::npos) << text;
}

TEST_F(SyntheticObject, PathIsExactAtItsTimes) {
  const ObjectPath rows(options("seed=1" + path({{0, 0, -1, 0, 0, 0}, {3, -2, 0.5, 0, 0, 90}})), 1);
  EXPECT_EQ(rows.duration_s(), 1);
  const RigidMotion half = rows.at(0.5), end = rows.at(7);
  EXPECT_LT((half.shift_mm - Eigen::Vector3d(1.5, -1, -0.25)).norm(), 1e-12);
  EXPECT_LT((turn_vector(half.turn) - Eigen::Vector3d(0, 0, 45 * kDegree)).norm(), 1e-12);
  EXPECT_LT((end * Eigen::Vector3d(1, 0, 0) - Eigen::Vector3d(3, -1, 0.5)).norm(), 1e-5);

  const ObjectPath slide(options("speed_mm_s=6&reach_mm=3&depth_mm=0.4&x_mm=1"), 1);
  EXPECT_NEAR(slide.duration_s(), 11.8, 1e-12);
  EXPECT_LT(slide.at(0).shift_mm[2], 0);
  EXPECT_NEAR(slide.at(1 + M_PI / 4).shift_mm[0], 1 + 3, 1e-9);  // a quarter of its way to and fro
  EXPECT_NEAR(slide.at(1 + M_PI / 4).shift_mm[2], 0.4, 1e-9);
  EXPECT_LT(slide.at(11.7).shift_mm[2], 0);
}

// Once round in half of its time, and what lies on the pad does not move along it.
TEST_F(SyntheticObject, ABeadRollsOnceRoundWithoutSliding) {
  const double radius_mm = 3, speed_mm_s = 4, round_mm = 2 * M_PI * radius_mm;
  const ObjectPath roll(options("shape=bead&path=roll&seconds=10"), radius_mm);
  const double half_way_s = 1 + M_PI * round_mm / (2 * speed_mm_s);
  const RigidMotion begin = roll.at(1), round = roll.at(half_way_s),
                    quarter = roll.at(1 + (half_way_s - 1) / 2);
  EXPECT_LT((round.turn - begin.turn).norm(), 1e-9);
  EXPECT_NEAR(round.shift_mm[0] - begin.shift_mm[0], round_mm, 1e-9);
  EXPECT_NEAR(turn_vector(quarter.turn).norm(), M_PI, 1e-9);
  for (const double time_s : {1.5, 3.0, 5.2}) {
    const double step_s = 1e-5;
    const RigidMotion now = roll.at(time_s), then = roll.at(time_s + step_s);
    const Eigen::Vector3d middle = now * Eigen::Vector3d(0, 0, -radius_mm);
    const Eigen::Vector3d lowest = middle + Eigen::Vector3d(0, 0, radius_mm);
    const Eigen::Vector3d way = then * now.inverse() * lowest - lowest;
    EXPECT_LT(way.norm() / step_s, 0.01) << time_s;
    EXPECT_GT((then * now.inverse() * middle - middle).norm() / step_s, 0.5) << time_s;
  }
}

// Depth is the ball's, the light's change is about its middle, and the truth's centre is there.
TEST_F(SyntheticObject, ABallIsWhereItsTruthSays) {
  const ObjectOptions o =
      options("shape=ball&size=320x240&rate=4&noise=off&smooth_mm=0" +
              path({{-3, 2, -0.2, 0, 0, 0}, {-3, 2, 0.6, 0, 0, 0}, {4, -1, 0.6, 0, 0, 0}}));
  ObjectSensor source(o);
  const Frame background = *source.own_background();
  const double pitch_mm = object_sensor(o).pitch_mm_per_px;
  Frame frame;
  int touching = 0;
  while (source.next(frame)) {
    const Truth truth = *source.truth(frame.sequence);
    const double time_s = truth.time_s, deep = std::min(-0.2 + 0.8 * time_s, 0.6),
                 x_mm = -3 + 7 * std::max(0.0, time_s - 1), y_mm = 2 - 3 * std::max(0.0, time_s - 1);
    EXPECT_EQ(truth.contact, deep > 1e-9) << time_s;
    if (!truth.contact) continue;
    ++touching;
    EXPECT_NEAR(truth.center_x_px, 159.5 + x_mm / pitch_mm, 0.6);
    EXPECT_NEAR(truth.center_y_px, 119.5 + y_mm / pitch_mm, 0.6);
    EXPECT_NEAR(truth.indentation_mm, deep, 0.002);
    double light = 0, light_x = 0, light_y = 0;
    for (uint32_t y = 0; y < 240; ++y)
      for (uint32_t x = 0; x < 320; ++x) {
        const double square =
            std::pow((x - 159.5) * pitch_mm - x_mm, 2) + std::pow((y - 119.5) * pitch_mm - y_mm, 2);
        const double depth = std::max(0.0, std::sqrt(std::max(0.0, 64 - square)) - 8 + deep);
        const double rim = 2 * pitch_mm * std::sqrt(2 * 8 * deep) / 8;
        EXPECT_NEAR(truth.depth_mm[y * 320 + x], depth, depth < rim ? rim : 0.001);
        for (uint32_t c = 0; c < 3; ++c) {
          const double change = std::abs(double(frame.at(c, x, y)) - double(background.at(c, x, y)));
          light += change, light_x += change * x, light_y += change * y;
        }
      }
    EXPECT_NEAR(light_x / light, truth.center_x_px, 0.7);
    EXPECT_NEAR(light_y / light, truth.center_y_px, 0.7);
  }
  EXPECT_EQ(touching, 6);
}

/// Depth at a place in mm from the picture's centre, between four pixels.
double depth_at(const Truth& truth, uint32_t width, double pitch_mm, double x_mm, double y_mm) {
  const auto height = static_cast<uint32_t>(truth.depth_mm.size() / width);
  const double x = x_mm / pitch_mm + (width - 1) / 2.0, y = y_mm / pitch_mm + (height - 1) / 2.0;
  const auto i = static_cast<uint32_t>(x), j = static_cast<uint32_t>(y);
  const double u = x - i, v = y - j;
  const auto d = [&](uint32_t row, uint32_t column) {
    return double{truth.depth_mm[size_t{row} * width + column]};
  };
  return (1 - v) * ((1 - u) * d(j, i) + u * d(j, i + 1)) + v * ((1 - u) * d(j + 1, i) + u * d(j + 1, i + 1));
}

// Each place of the surface in one frame lies, in another, where the truth's motion says.
TEST_F(SyntheticObject, TruthIsTheSurfacesMotion) {
  const ObjectOptions o =
      options("shape=textured&size=640x480&rate=1&smooth_mm=0.05" + path({{0, 0, -1, 0, 0, 0},
                                                                          {-1, 0.5, 0.5, 1, -1, 10},
                                                                          {1.5, -0.5, 0.45, -2, 1, -25},
                                                                          {1.5, -0.5, -0.45, -2, 1, -25}}));
  const ObjectSensor source(o);
  EXPECT_FALSE(source.truth(0)->motion);
  const Truth first = *source.truth(1), second = *source.truth(2);
  ASSERT_TRUE(first.motion && second.motion);
  EXPECT_LT(Eigen::Vector3d(first.motion->shift_mm.data()).norm(), 1e-12);
  EXPECT_GT(Eigen::Vector3d(second.motion->turn_rad.data()).norm(), 30 * kDegree);
  const RigidMotion moved{turn_of(Eigen::Vector3d(second.motion->turn_rad.data())),
                          Eigen::Vector3d(second.motion->shift_mm.data())};
  const double pitch_mm = object_sensor(o).pitch_mm_per_px;
  int places = 0;
  for (double y = -3; y <= 3; y += 0.31)
    for (double x = -3; x <= 3; x += 0.31) {
      const Eigen::Vector3d at(x - 1, y + 0.5, depth_at(first, 640, pitch_mm, x - 1, y + 0.5));
      const Eigen::Vector3d then = moved * at;
      if (at[2] < 0.2 || then[2] < 0.2) continue;
      ++places;
      EXPECT_NEAR(depth_at(second, 640, pitch_mm, then[0], then[1]), then[2], 0.004) << x << " " << y;
    }
  EXPECT_GT(places, 150);
}

// The skin goes along until friction holds no more, and a ball that rolls does not drag it.
TEST_F(SyntheticObject, SkinFollowsUntilItSlips) {
  const ObjectOptions o = options(
      "shape=plane&size=320x240&rate=10&noise=off&skin=markers&friction=1&seed=3" +
      path({{0, 0, -0.01, 0, 0, 0}, {0, 0, 0.4, 0, 0, 0}, {0.8, 0, 0.4, 0, 0, 0}, {0, 0, 0.4, 0, 0, 0}}));
  const ObjectSensor source(o);
  for (uint64_t k = 10; k < 30; ++k) {
    const Truth truth = *source.truth(k);
    const double stiffness = truth.force_N / truth.indentation_mm;
    const double out_mm = 0.08 * (static_cast<double>(k) - 10);
    // Out, it sticks to 0.4 mm and slips from there on; back, it sticks from -0.4 mm on.
    const double pulled_mm =
        k <= 20 ? std::min(out_mm, 0.4) : std::max(0.4 - 0.08 * (static_cast<double>(k) - 20), -0.4);
    EXPECT_NEAR(truth.shear_x_N / stiffness, pulled_mm, 1e-4) << k;
    EXPECT_EQ(truth.slipping, k > 15 && k <= 20) << k;
    EXPECT_LE(std::hypot(truth.shear_x_N, truth.shear_y_N), truth.force_N * (1 + 1e-9));
  }
  const ObjectSensor rolled(options("shape=bead&path=roll&size=320x240&rate=20&seconds=4&depth_mm=0.5"));
  double most_mm = 0;
  for (uint64_t k = 20; k < 100; k += 5) {
    const Truth truth = *rolled.truth(k);
    ASSERT_TRUE(truth.contact);
    most_mm = std::max(most_mm, std::abs(truth.shear_x_N) / (truth.force_N / truth.indentation_mm));
    EXPECT_FALSE(truth.slipping) << k;
  }
  EXPECT_LT(most_mm, 0.1);
}

// The pattern in the sticking middle of a frame is the untouched one, moved by what the truth says.
TEST_F(SyntheticObject, FramesShowTheSkinsWay) {
  const double pitch_mm = 27.84 / 320;
  ObjectSensor source(
      options("shape=plane&size=320x240&rate=2&noise=off&skin=texture&friction=10" +
              path({{0, 0, -0.01, 0, 0, 0}, {0, 0, 0.4, 0, 0, 0}, {8 * pitch_mm, 0, 0.4, 0, 0, 0}})));
  Frame still, moved;
  ASSERT_TRUE(source.seek(2));
  ASSERT_TRUE(source.next(still));
  ASSERT_TRUE(source.next(moved));
  EXPECT_FALSE(source.truth(3)->slipping);
  double moved_apart = 0, still_apart = 0;
  for (uint32_t y = 100; y < 140; ++y)
    for (uint32_t x = 140; x < 180; ++x) {
      moved_apart += std::abs(double(moved.at(1, x, y)) - double(still.at(1, x - 4, y)));
      still_apart += std::abs(double(moved.at(1, x, y)) - double(still.at(1, x, y)));
    }
  EXPECT_LT(moved_apart, 0.1 * still_apart);
}

// A share of the depth comes late, with its time constant, and goes late.
TEST_F(SyntheticObject, AGelThatCreepsFollowsLate) {
  const std::string way = path({{0, 0, -0.1, 0, 0, 0},
                                {0, 0, -0.001, 0, 0, 0},
                                {0, 0, 0.5, 0, 0, 0},
                                {0, 0, 0.5, 0, 0, 0},
                                {0, 0, 0.5, 0, 0, 0},
                                {0, 0, 0.5, 0, 0, 0},
                                {0, 0, 0.5, 0, 0, 0},
                                {0, 0, -0.5, 0, 0, 0},
                                {0, 0, -0.5, 0, 0, 0}});
  const auto deepest = [&](const std::string& keys, uint64_t k) {
    const Truth truth = *ObjectSensor(options("shape=plane&size=160x120&rate=10&" + keys + way)).truth(k);
    return double{*std::ranges::max_element(truth.depth_mm)};
  };
  EXPECT_NEAR(deepest("creep=0", 20), 0.5, 1e-4);
  double before = 0;
  for (const uint64_t k : {21, 25, 30, 40, 60}) {
    const double now = deepest("creep=0.4&creep_s=1", k);
    // After a ramp of a second that ended at 2 s.
    const double late = std::exp(-(static_cast<double>(k) / 10 - 2)) * (M_E - 1) / M_E;
    EXPECT_NEAR(now, 0.5 * (1 - 0.4 * late), 0.02) << k;
    EXPECT_GE(now, before);
    before = now;
  }
  EXPECT_EQ(deepest("creep=0", 75), 0);
  EXPECT_GT(deepest("creep=0.4&creep_s=1", 75), 0.02);
}

/// A pyramid of 4 x 4 x 1 mm, its point towards the pad.
std::string pyramid(bool binary) {
  const std::array<std::array<float, 3>, 5> v = {{{-2, -2, 0}, {2, -2, 0}, {2, 2, 0}, {-2, 2, 0}, {0, 0, 1}}};
  const std::array<std::array<int, 3>, 4> faces = {{{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}}};
  std::string text = "solid pyramid\n", bytes(84, '\0');
  const auto count = static_cast<uint32_t>(faces.size());
  std::memcpy(bytes.data() + 80, &count, 4);
  for (const auto& face : faces) {
    text += "facet normal 0 0 0\nouter loop\n";
    bytes.append(12, '\0');
    for (const int corner : face) {
      text += "vertex";
      for (const float value : v[static_cast<size_t>(corner)]) {
        text += " " + std::to_string(value);
        bytes.append(reinterpret_cast<const char*>(&value), 4);
      }
      text += "\n";
    }
    bytes.append(2, '\0');
    text += "endloop\nendfacet\n";
  }
  return binary ? bytes : text + "endsolid\n";
}

TEST_F(SyntheticObject, FilesOfOneObjectShowTheSame) {
  std::vector<float> heights;
  for (int y = -20; y <= 20; ++y)
    for (int x = -20; x <= 20; ++x)
      heights.push_back(5 - 0.05f * static_cast<float>(std::max(std::abs(x), std::abs(y))));
  write_npy(folder_ / "pyramid.npy", heights, {41, 41});
  std::vector<std::vector<float>> depths;
  for (const std::string& file : {write("text.stl", pyramid(false)), write("binary.stl", pyramid(true)),
                                  (folder_ / "pyramid.npy").string()}) {
    const ObjectSensor source(options("file=" + file + "&pitch_mm=0.1&size=160x120&path=slide&depth_mm=0.6"));
    depths.push_back(source.truth(90)->depth_mm);
    EXPECT_NEAR(source.truth(90)->indentation_mm, 0.6, 0.06) << file;
  }
  for (size_t i = 0; i < depths[0].size(); ++i) {
    EXPECT_NEAR(depths[0][i], depths[1][i], 1e-6);
    EXPECT_NEAR(depths[0][i], depths[2][i], 0.003);
  }
}

TEST_F(SyntheticObject, NonsenseFilesAreRefused) {
  std::string cut = pyramid(true), far = cut, none(84, '\0'), nan = cut;
  cut.pop_back();
  const float large = 2e4f, no_number = std::numeric_limits<float>::quiet_NaN();
  std::memcpy(far.data() + 96, &large, 4);
  std::memcpy(nan.data() + 100, &no_number, 4);
  std::string huge(84, '\xff');
  for (const auto& [bytes, word] :
       {std::pair{cut, "4 triangles stated"},
        {far, "10000 mm"},
        {nan, "10000 mm"},
        {none, "no triangle"},
        {huge, "triangles stated"},
        {std::string("solid\nvertex 1 2"), "three numbers"},
        {std::string("solid\nvertex 1 2 3 vertex 1 2 3"), "cut short"},
        {std::string("solid"), "no triangle"},
        {std::string("solid vertex nan 0 0 vertex 0 0 0 vertex 1 1 1"), "10000 mm"},
        {std::string(), "0 bytes"}})
    EXPECT_NE(refusal("file=" + write("bad.stl", bytes)).find(word), std::string::npos)
        << word << ": " << refusal("file=" + write("bad.stl", bytes));
  const float hole = std::numeric_limits<float>::quiet_NaN();
  const auto npy = [&](const std::vector<float>& values, const std::vector<size_t>& shape) {
    write_npy(folder_ / "bad.npy", values, shape);
    return refusal("file=" + (folder_ / "bad.npy").string());
  };
  EXPECT_NE(npy({1, 2, 3}, {3}).find("array of 3"), std::string::npos);
  EXPECT_NE(npy({1, 2}, {1, 2}).find("1 x 2"), std::string::npos);
  EXPECT_NE(npy({hole, 1, 1, 1}, {2, 2}).find("holes alone"), std::string::npos);
  EXPECT_NE(npy({1, 1, 1e6f, 1}, {2, 2}).find("10000 mm"), std::string::npos);
  EXPECT_NE(refusal("file=" + write("bad.npy", "no array")).find("bad.npy"), std::string::npos);
}

TEST_F(SyntheticObject, FramesAreRepeatable) {
  const ObjectOptions o = options("shape=key&size=160x120&creep=0.3");
  ObjectSensor a(o), b(o);
  Frame first, again;
  ASSERT_TRUE(a.seek(150));
  ASSERT_TRUE(a.next(first));
  ASSERT_TRUE(b.next(again));
  ASSERT_TRUE(b.seek(150));
  ASSERT_TRUE(b.next(again));
  EXPECT_EQ(first.bytes, again.bytes);
  EXPECT_FALSE(a.seek(100000));
}

}  // namespace
}  // namespace palpate
