// Files of `palpate export`, opened as other programs would and compared with the pipeline's measurements:
// images by OpenCV, meshes and TIFF tags by the small readers here.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <sstream>

#include "capture/files/npy.h"
#include "capture/session/session.h"
#include "engine/gpu/context.h"
#include "palpate/pipeline.h"
#include "tests/support/eventually.h"
#include "tests/support/json.h"
#include "tests/support/pipelines.h"
#include "tests/support/program_fixture.h"

namespace palpate {
namespace {

constexpr uint32_t kWidth = 97, kHeight = 80;

struct Mesh {
  std::vector<std::array<float, 3>> vertices;
  std::vector<std::array<int64_t, 3>> faces;  ///< from 0
};

Mesh read_ply(const std::string& text) {
  const auto number_after = [&](const std::string& words) {
    return std::stoul(text.substr(text.find(words) + words.size()));
  };
  Mesh mesh;
  mesh.vertices.resize(number_after("element vertex "));
  mesh.faces.resize(number_after("element face "));
  const std::string end = "end_header\n";
  const char* at = text.data() + text.find(end) + end.size();
  EXPECT_EQ(at + mesh.vertices.size() * 12 + mesh.faces.size() * 13, text.data() + text.size());
  std::memcpy(mesh.vertices.data(), at, mesh.vertices.size() * 12);
  at += mesh.vertices.size() * 12;
  for (auto& face : mesh.faces) {
    EXPECT_EQ(*at, 3);
    int32_t corners[3];
    std::memcpy(corners, at + 1, sizeof corners);
    std::copy_n(corners, 3, face.begin());
    at += 13;
  }
  return mesh;
}

Mesh read_obj(const std::string& text) {
  Mesh mesh;
  std::istringstream lines(text);
  std::string line, kind;
  while (std::getline(lines, line)) {
    std::istringstream words(line);
    words >> kind;
    if (kind == "v") {
      auto& v = mesh.vertices.emplace_back();
      std::string number;
      for (float& coordinate : v) {
        words >> number;
        coordinate = std::strtof(number.c_str(), nullptr);
      }
    } else if (kind == "f") {
      auto& f = mesh.faces.emplace_back();
      for (int64_t& corner : f) words >> corner;
      for (int64_t& corner : f) --corner;
    }
  }
  return mesh;
}

/// One number of the first directory of a little-endian TIFF; rationals as their quotient.
double tiff_tag(const std::string& bytes, uint16_t wanted) {
  const auto number = [&]<typename T>(size_t at, T) {
    T value{};
    std::memcpy(&value, bytes.data() + at, sizeof value);
    return value;
  };
  const size_t directory = number(4, uint32_t{});
  const uint16_t entries = number(directory, uint16_t{});
  for (size_t i = 0; i < entries; ++i) {
    const size_t at = directory + 2 + 12 * i;
    if (number(at, uint16_t{}) != wanted) continue;
    const uint16_t type = number(at + 2, uint16_t{});
    const uint32_t value = number(at + 8, uint32_t{});
    if (type == 5) return double(number(value, uint32_t{})) / number(value + 4, uint32_t{});
    return type == 3 ? number(at + 8, uint16_t{}) : value;
  }
  ADD_FAILURE() << "no tag " << wanted;
  return 0;
}

class Export : public Program {
 protected:
  /// A session as `palpate record` leaves it.
  fs::path session(const std::string& scene, int frames, const std::string& size = "97x80") {
    const fs::path made = folder_ / "session";
    const Ended ended =
        run({"record", "synthetic:" + scene + (contains(scene, "?") ? "&" : "?") + "size=" + size, "--out",
             made, "--frames", std::to_string(frames), "--no-drop"});
    EXPECT_EQ(ended.exit_code, 0) << ended.err;
    return made;
  }

  Ended exported(const fs::path& input, const fs::path& out, std::vector<std::string> more) {
    more.insert(more.begin(), {"export", input, "--out", out});
    return run(more);
  }

  /// Depth of each frame of a session, by the engine alone.
  static std::map<uint64_t, std::vector<float>> depths_mm(const fs::path& folder) {
    Session frames(folder);
    const SessionInfo& info = frames.info();
    gpu::Context context({});
    Pipeline pipeline(context, *info.sensor, info.format, {.outputs = info.outputs, .solver = info.solver});
    pipeline.set_background(*frames.own_background());
    std::map<uint64_t, std::vector<float>> depths;
    Frame frame;
    while (frames.next(frame)) {
      EXPECT_TRUE(pipeline.submit(frame));
      const Result result = *pipeline.wait();
      depths[frame.sequence] = depth_map(result);
    }
    return depths;
  }

  static std::vector<std::string> names_in(const fs::path& folder) {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder)) names.push_back(entry.path().filename());
    std::sort(names.begin(), names.end());
    return names;
  }
};

TEST_F(Export, DepthFilesHoldWhatThePipelineMeasures) {
  const fs::path recorded = session("press?mode=gel", 40), out = folder_ / "out";
  const Ended ended = exported(
      recorded, out, {"--npy", "--png16", "--tiff", "--ply", "--obj", "--csv", "--frames", "30:40:4"});
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  const auto wanted = depths_mm(recorded);
  const Sensor sensor = *Session(recorded).info().sensor;
  const double pitch_mm = sensor.pitch_mm_per_px;
  std::vector<std::string> names = {"depth.json"};
  for (const char* number : {"000030", "000034", "000038"})
    for (const char* ending : {".npy", ".obj", ".ply", ".png", ".tif"})
      names.push_back(std::string(number) + ending);
  std::sort(names.begin(), names.end());
  EXPECT_EQ(names_in(out / "depth"), names);
  float deepest = 0;
  for (const uint64_t k : {30u, 34u, 38u}) {
    SCOPED_TRACE(k);
    const std::vector<float>& depth_mm = wanted.at(k);
    for (const float depth : depth_mm) deepest = std::max(deepest, depth);
    const fs::path stem = out / "depth" / ("0000" + std::to_string(k));
    const auto file = [&](const char* ending) { return stem.string() + ending; };
    const NpyArray npy = read_npy(file(".npy"));
    EXPECT_EQ(npy.shape, (std::vector<size_t>{kHeight, kWidth}));
    EXPECT_EQ(npy.values, depth_mm);

    const cv::Mat tiff = cv::imread(file(".tif"), cv::IMREAD_UNCHANGED);
    ASSERT_EQ(tiff.size(), cv::Size(kWidth, kHeight));
    ASSERT_EQ(tiff.type(), CV_16SC1);
    const cv::Mat png = cv::imread(file(".png"), cv::IMREAD_UNCHANGED);
    ASSERT_EQ(png.type(), CV_16UC1);
    for (uint32_t i = 0; i < kWidth * kHeight; ++i) {
      const int x = static_cast<int>(i % kWidth), y = static_cast<int>(i / kWidth);
      ASSERT_NEAR(tiff.at<int16_t>(y, x), depth_mm[i] * 1000, 0.5001) << i;
      ASSERT_NEAR((png.at<uint16_t>(y, x) - 8192) * 0.0002, depth_mm[i], 0.000101) << i;
    }
    const std::string tags = slurp(file(".tif"));
    EXPECT_EQ(tags.substr(0, 4), std::string("II*\0", 4));
    EXPECT_NEAR(tiff_tag(tags, 282), 10 / pitch_mm, 1e-4 * 10 / pitch_mm) << "pixels to a centimetre";
    EXPECT_NEAR(tiff_tag(tags, 283), 10 / pitch_mm, 1e-4 * 10 / pitch_mm);
    EXPECT_EQ(tiff_tag(tags, 296), 3) << "centimetres";
    EXPECT_EQ(tiff_tag(tags, 339), 2) << "signed";
    EXPECT_TRUE(contains(tags, "unit um (1 count = 1 um, signed)"));

    const std::string ply_text = slurp(file(".ply")), obj_text = slurp(file(".obj"));
    EXPECT_TRUE(contains(ply_text.substr(0, 200), "comment unit mm, x right, y up, z depth"));
    EXPECT_TRUE(contains(obj_text.substr(0, 200), "unit mm, x right, y up, z depth"));
    const Mesh ply = read_ply(ply_text), obj = read_obj(obj_text);
    ASSERT_EQ(ply.vertices.size(), size_t{kWidth} * kHeight);
    ASSERT_EQ(ply.faces.size(), size_t{2} * (kWidth - 1) * (kHeight - 1));
    EXPECT_EQ(obj.vertices, ply.vertices) << "to the last bit";
    EXPECT_EQ(obj.faces, ply.faces);
    for (uint32_t i = 0; i < kWidth * kHeight; ++i) {
      const auto& [x, y, z] = ply.vertices[i];
      ASSERT_EQ(x, static_cast<float>(i % kWidth * pitch_mm));
      ASSERT_EQ(y, -static_cast<float>(i / kWidth * pitch_mm));
      ASSERT_EQ(z, depth_mm[i]);
    }
    // Every triangle faces the camera and is half a pixel wide.
    for (const auto& [a, b, c] : obj.faces) {
      ASSERT_TRUE(a >= 0 && b >= 0 && c >= 0 && std::max({a, b, c}) < int64_t{kWidth} * kHeight);
      const auto &p = obj.vertices[a], &q = obj.vertices[b], &r = obj.vertices[c];
      const float twice_area = (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
      ASSERT_NEAR(twice_area, pitch_mm * pitch_mm, 1e-3 * pitch_mm * pitch_mm);
    }
  }
  EXPECT_GT(deepest, 0.02f) << "the scene presses at all";
  const Json about = parse_json(slurp(out / "depth" / "depth.json"));
  EXPECT_EQ(about.at("tif").at("depth_um"), "count");
  EXPECT_EQ(about.at("tif").at("clipped_px"), 0);
  EXPECT_EQ(about.at("obj").at("unit"), "mm");
  EXPECT_EQ(about.at("ply").at("unit"), "mm");
  EXPECT_DOUBLE_EQ(about.at("pitch_mm_per_px").get<double>(), pitch_mm);
  EXPECT_EQ(parse_json(slurp(out / "summary.json")).at("range"), "30:40:4");
}

// Rows of a range are those of the whole: what is followed from frame to frame is followed from the first.
TEST_F(Export, RowsAreThoseOfTheWholeRecording) {
  const fs::path recorded = session("slide", 60);
  ASSERT_EQ(run({"process", recorded, "--as-recorded", "--out", folder_ / "whole"}).exit_code, 0);
  ASSERT_EQ(exported(recorded, folder_ / "all", {"--csv"}).exit_code, 0);
  const std::string whole = slurp(folder_ / "whole" / "measurements.csv");
  EXPECT_EQ(slurp(folder_ / "all" / "measurements.csv"), whole);
  const Table table(whole);
  ASSERT_EQ(table.rows.size(), 60u);
  ASSERT_EQ(exported(recorded, folder_ / "some", {"--csv", "--frames", "31:55", "--every", "3"}).exit_code,
            0);
  const Table some(slurp(folder_ / "some" / "measurements.csv"));
  ASSERT_EQ(some.rows.size(), 8u);
  size_t sheared = 0;
  for (size_t i = 0; i < some.rows.size(); ++i) {
    EXPECT_EQ(some.rows[i], table.rows[31 + 3 * i]);
    sheared += !some.at(i, "shear_x_N").empty();
  }
  EXPECT_GT(sheared, 0u);
}

// Frames as images, with the sensor and the background, are measured again to the same digits.
TEST_F(Export, ImagesAreMeasuredToTheSameDigits) {
  for (const std::string& scene : {std::string("press?mode=gel"), std::string("press?bits=12")}) {
    for (const std::string format : {"png", "tiff"}) {
      SCOPED_TRACE(scene + " " + format);
      const fs::path recorded = session(scene, 36), out = folder_ / "raw", again = folder_ / "again";
      ASSERT_EQ(exported(recorded, out, {"--images", format, "--csv"}).exit_code, 0);
      EXPECT_EQ(names_in(out / "images").size(), 36u);
      const Session frames(recorded);
      const std::string rate = Json(frames.rate_Hz()).dump();
      const Ended ended = run({"process", out / "images", "--sensor", out / "sensor.json", "--rate", rate,
                               "--solver", "live", "--out", again});
      ASSERT_EQ(ended.exit_code, 0) << ended.err;
      const Table first(slurp(out / "measurements.csv")), second(slurp(again / "measurements.csv"));
      ASSERT_EQ(first.rows.size(), 36u);
      std::vector<std::string> measured = second.columns;
      std::erase(measured, "source");  // images have names
      ASSERT_EQ(first.columns, measured);
      size_t touched = 0;
      for (size_t row = 0; row < first.rows.size(); ++row) {
        for (const std::string& column : first.columns) {
          if (column != "time_s") {
            EXPECT_EQ(first.at(row, column), second.at(row, column)) << row << " " << column;
          }
        }
        touched += first.at(row, "contact") == "1";
      }
      EXPECT_GT(touched, 5u);
      for (const fs::path& old : {recorded, out, again}) fs::remove_all(old);
    }
  }
}

TEST_F(Export, FilmHoldsTheChosenFrames) {
  const fs::path recorded = session("press?mode=gel", 30), out = folder_ / "out";
  const Ended ended = exported(recorded, out, {"--mp4", "--frames", "20:30:2", "--view", "20,50"});
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  EXPECT_EQ(names_in(out), (std::vector<std::string>{"recording.mp4", "summary.json"}));
  cv::VideoCapture film((out / "recording.mp4").string());
  ASSERT_TRUE(film.isOpened());
  EXPECT_NEAR(film.get(cv::CAP_PROP_FPS), Session(recorded).rate_Hz() / 2, 0.01);
  int pictures = 0;
  cv::Mat picture;
  while (film.read(picture)) {
    EXPECT_EQ(picture.size(), cv::Size(1280, 720));
    ++pictures;
  }
  EXPECT_EQ(pictures, 5);
}

// A gel is at rest around contacts that are followed from the first frame on; else depth needs nothing of the
// frames before, and the session is entered where the range begins.
TEST_F(Export, OneFrameAloneIsThatFrame) {
  for (const char* scene : {"press?mode=gel", "press?mode=waveguide"}) {
    SCOPED_TRACE(scene);
    const fs::path recorded = session(scene, 40);
    ASSERT_EQ(exported(recorded, folder_ / "one", {"--npy", "--frames", "35"}).exit_code, 0);
    EXPECT_EQ(names_in(folder_ / "one" / "depth"), (std::vector<std::string>{"000035.npy", "depth.json"}));
    EXPECT_EQ(read_npy(folder_ / "one" / "depth" / "000035.npy").values, depths_mm(recorded).at(35));
    fs::remove_all(folder_ / "one");
    fs::remove_all(recorded);
  }
}

TEST_F(Export, OtherRecordingsAreExportedToo) {
  const fs::path rec = recording(6), out = folder_ / "out";
  const Ended ended = run(
      {"export", rec / "frames", "--sensor", rec / "sensor.json", "--out", out, "--csv", "--tiff", "--json"});
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  EXPECT_EQ(parse_json(ended.out).at("frames"), 6);
  EXPECT_EQ(names_in(out / "depth").size(), 7u);
}

TEST_F(Export, NonsenseIsRefused) {
  const std::string input = "synthetic:press?size=64x48&mode=gel", out = folder_ / "out";
  const auto refused = [&](int code, std::vector<std::string> more, const std::vector<std::string>& words) {
    more.insert(more.begin(), {"export", input, "--out", out});
    SCOPED_TRACE(more.back());
    expect_refusal(more, code, words);
    EXPECT_FALSE(fs::exists(fs::path(out) / "summary.json"));
  };
  refused(2, {}, {"--csv", "--obj", "nothing asked for"});
  for (const char* range : {"a:b", "5:5", "9:3", "1:2:3:4", "0:10:0", "-3:4", "1.5:3", "18446744073709551615",
                            "99999999999999999999:"})
    refused(2, {"--csv", std::string("--frames=") + range}, {"FIRST:END"});
  refused(2, {"--csv", "--frames", "0:9:2", "--every", "2"}, {"one step"});
  refused(2, {"--csv", "--every", "0"}, {"--every"});
  refused(2, {"--images", "gif"}, {"--images"});
  refused(3, {"--csv", "--frames", "100000:"}, {"100000:", "none"});
  refused(3, {"--npy", "--frames", "100000:100002"}, {"100000:100002", "none"});
  expect_refusal({"export", folder_ / "nothing", "--out", out, "--csv"}, 3,
                 {"nothing at", "checking the path"});
  spill(folder_ / "file", "");
  expect_refusal({"export", input, "--csv", "--out", folder_ / "file" / "out"}, 7, {"file"});
  // A sensor without a reading of the surface has no depth.
  const fs::path rec = recording(2);
  Json sensor = parse_json(slurp(rec / "sensor.json"));
  sensor.erase("surface");
  spill(rec / "flat.json", sensor.dump());
  expect_refusal({"export", rec / "frames", "--sensor", rec / "flat.json", "--out", out, "--ply"}, 2,
                 {"surface"});
}

TEST_F(Export, FullDiskLeavesOnlyWholeFiles) {
  const fs::path recorded = session("press?mode=gel", 12), out = folder_ / "out";
  // The first array fits, a mesh of text does not.
  expect_refusal({"export", recorded, "--out", out, "--npy", "--obj"}, 7, {".obj"},
                 {.largest_file_bytes = 100000});
  for (const auto& entry : fs::recursive_directory_iterator(out))
    EXPECT_FALSE(contains(entry.path().filename(), "partial")) << entry.path();
  EXPECT_FALSE(fs::exists(out / "summary.json"));
  EXPECT_FALSE(fs::exists(out / "depth" / "000000.obj"));
  expect_refusal({"export", recorded, "--out", out, "--mp4"}, 7, {"recording.mp4"},
                 {.largest_file_bytes = 4096});
  EXPECT_FALSE(fs::exists(out / "recording.mp4"));
}

TEST_F(Export, InterruptKeepsWhatWasWritten) {
  const fs::path out = folder_ / "out";
  const pid_t child = start({"export", "synthetic:palpation?mode=gel&repeat=0&size=160x120", "--out", out,
                             "--csv", "--tiff", "--json"});
  ASSERT_TRUE(eventually([&] { return fs::exists(out / "depth" / "000003.tif"); }));
  ASSERT_EQ(kill(child, SIGINT), 0);
  const Ended ended = finish(child);
  EXPECT_EQ(ended.exit_code, 130) << ended.err;
  const Json summary = parse_json(ended.out);
  EXPECT_FALSE(summary.at("complete").get<bool>());
  const auto frames = summary.at("frames").get<size_t>();
  EXPECT_GE(frames, 4u);
  EXPECT_EQ(Table(slurp(out / "measurements.csv")).rows.size(), frames);
  EXPECT_EQ(names_in(out / "depth").size(), frames + 1);
  for (const std::string& name : names_in(out / "depth")) {
    if (contains(name, ".tif")) {
      EXPECT_EQ(cv::imread((out / "depth" / name).string(), cv::IMREAD_UNCHANGED).rows, 120) << name;
    }
  }
}

}  // namespace
}  // namespace palpate
