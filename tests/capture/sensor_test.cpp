// Sensor files: what is saved comes back whole, and whatever is wrong with a file is said in one line that
// names the file and the key.
#include "palpate/sensor.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "palpate/error.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

/// Every key that a sensor file knows.
const char* const kEverything = R"({
  "palpate_sensor": 1,
  "name": "everything",
  "pitch_mm_per_px": 0.0435,
  "frame": {"crop_px": [3, 4, 600, 400], "quad_px": [[10.5, 20], [590, 21], [588, 380], [12, 379.25]],
            "size_px": [320, 240], "channels": 3, "bit_depth": 8},
  "background": {"source": "untouched", "image": "rest.png", "first_frames": 7},
  "contact": {"signal": "either", "filter": "none", "threshold_gray": 5.5, "saturation_gray": 250},
  "surface": {"reading": "photometric", "max_slope": 3.5,
              "shading": {"facing_gray": 181.5, "depth_gain": 1.25},
              "photometric": {"wx": [[0.1, 0.2, 0.3], [-1, -2, -3], [4, 5, 6]],
                              "wy": [[1, 0, 0.1], [0, 0.001, 0], [7, 8, 1e-9]], "normal_sd": 0.03}},
  "force": {"c1_N_per_gray": 1.75e-8, "c0_N": -0.11456, "residual_sd_N": 0.004,
            "covariance": [1e-6, -1e-14, 2e-22], "gray_min": 37231000, "gray_max": 92432000},
  "shear": {"kx_N_per_mm": 1.5, "ky_N_per_mm": 1.6, "friction": 0.55, "relative_sd": 0.02}
})";

class SensorFile : public testing::Test {
 protected:
  SensorFile() {
    folder_ = fs::temp_directory_path() / ("palpate-sensor-" + std::to_string(getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~SensorFile() override { fs::remove_all(folder_); }

  fs::path spill(const std::string& text) const {
    const fs::path file = folder_ / "pad.json";
    std::ofstream(file, std::ios::binary) << text;
    return file;
  }

  /// The file must be refused in one line that names it and holds all the words.
  void expect_refused(const fs::path& file, const std::vector<std::string>& words,
                      const std::string& what) const {
    try {
      load_sensor(file);
      ADD_FAILURE() << "accepted: " << what;
    } catch (const Error& e) {
      EXPECT_EQ(e.failure(), Failure::Sensor) << what;
      const std::string line = e.what();
      EXPECT_EQ(line.find('\n'), std::string::npos) << line;
      EXPECT_LT(line.size(), 600u) << line;
      EXPECT_NE(line.find(file.filename().string()), std::string::npos) << line;
      for (const std::string& word : words)
        EXPECT_NE(line.find(word), std::string::npos) << "no '" << word << "' in: " << line;
    } catch (const std::exception& e) {
      ADD_FAILURE() << "not an Error: " << e.what() << " of " << what;
    }
  }
  void expect_refused(const std::string& text, const std::vector<std::string>& words) const {
    expect_refused(spill(text), words, text.substr(0, 200));
  }

  std::vector<std::string> files() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_))
      names.push_back(entry.path().filename().string());
    return names;
  }

  fs::path folder_;
};

void expect_same(const Sensor& a, const Sensor& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.pitch_mm_per_px, b.pitch_mm_per_px);
  EXPECT_EQ(a.background.kind, b.background.kind);
  EXPECT_EQ(a.filter, b.filter);
  EXPECT_EQ(a.crop_px, b.crop_px);
  EXPECT_EQ(a.quad_px, b.quad_px);
  EXPECT_EQ(a.size_px, b.size_px);
  EXPECT_EQ(a.channels, b.channels);
  EXPECT_EQ(a.bit_depth, b.bit_depth);
  EXPECT_EQ(a.background.image, b.background.image);
  EXPECT_EQ(a.background.first_frames, b.background.first_frames);
  EXPECT_EQ(a.signal, b.signal);
  EXPECT_EQ(a.threshold_gray, b.threshold_gray);
  EXPECT_EQ(a.saturation_gray, b.saturation_gray);
  EXPECT_EQ(a.reconstruction, b.reconstruction);
  EXPECT_EQ(a.shading.facing_gray, b.shading.facing_gray);
  EXPECT_EQ(a.shading.depth_gain, b.shading.depth_gain);
  EXPECT_EQ(a.photometric.wx, b.photometric.wx);
  EXPECT_EQ(a.photometric.wy, b.photometric.wy);
  EXPECT_EQ(a.photometric.normal_sd, b.photometric.normal_sd);
  EXPECT_EQ(a.max_slope, b.max_slope);
  ASSERT_EQ(a.force.has_value(), b.force.has_value());
  if (a.force) {
    EXPECT_EQ(a.force->c1_N_per_gray, b.force->c1_N_per_gray);
    EXPECT_EQ(a.force->c0_N, b.force->c0_N);
    EXPECT_EQ(a.force->residual_sd_N, b.force->residual_sd_N);
    EXPECT_EQ(a.force->covariance, b.force->covariance);
    EXPECT_EQ(a.force->gray_min, b.force->gray_min);
    EXPECT_EQ(a.force->gray_max, b.force->gray_max);
  }
  ASSERT_EQ(a.shear.has_value(), b.shear.has_value());
  if (a.shear) {
    EXPECT_EQ(a.shear->kx_N_per_mm, b.shear->kx_N_per_mm);
    EXPECT_EQ(a.shear->ky_N_per_mm, b.shear->ky_N_per_mm);
    EXPECT_EQ(a.shear->friction, b.shear->friction);
    EXPECT_EQ(a.shear->relative_sd, b.shear->relative_sd);
  }
}

TEST_F(SensorFile, EveryKeyIsRead) {
  const Sensor s = load_sensor(spill(kEverything));
  EXPECT_EQ(s.name, "everything");
  EXPECT_EQ(s.pitch_mm_per_px, 0.0435);
  EXPECT_EQ(s.crop_px, (std::array<uint32_t, 4>{3, 4, 600, 400}));
  EXPECT_EQ((*s.quad_px)[3], (std::array<double, 2>{12, 379.25}));
  EXPECT_EQ(s.size_px, (std::array<uint32_t, 2>{320, 240}));
  EXPECT_EQ(s.channels, 3u);
  EXPECT_EQ(s.bit_depth, 8u);
  EXPECT_EQ(s.background.image, (folder_ / "rest.png").string());
  EXPECT_EQ(s.background.first_frames, 7u);
  EXPECT_EQ(s.background.kind, BackgroundKind::Untouched);
  EXPECT_EQ(s.signal, Signal::Either);
  EXPECT_EQ(s.filter, Filter::None);
  EXPECT_EQ(s.threshold_gray, 5.5);
  EXPECT_EQ(s.saturation_gray, 250u);
  EXPECT_EQ(s.reconstruction, Reconstruction::Photometric);
  EXPECT_EQ(s.max_slope, 3.5);
  EXPECT_EQ(s.shading.facing_gray, 181.5);
  EXPECT_EQ(s.shading.depth_gain, 1.25);
  EXPECT_EQ(s.photometric.wx[1][2], -3);
  EXPECT_EQ(s.photometric.wy[2][2], 1e-9);
  EXPECT_EQ(s.photometric.normal_sd, 0.03);
  EXPECT_EQ(s.force->c1_N_per_gray, 1.75e-8);
  EXPECT_EQ(s.force->covariance[2], 2e-22);
  EXPECT_EQ(s.force->gray_max, 92432000);
  EXPECT_EQ(s.shear->friction, 0.55);
}

TEST_F(SensorFile, WhatIsSavedComesBackWhole) {
  const Sensor everything = load_sensor(spill(kEverything));
  save_sensor(everything, folder_ / "copy.json");
  expect_same(load_sensor(folder_ / "copy.json"), everything);
  EXPECT_EQ(Json::parse(std::ifstream(folder_ / "copy.json")), Json::parse(kEverything));

  // The least that a sensor can be, and each optional part by itself.
  Sensor least;
  least.name = "least";
  least.pitch_mm_per_px = 1.0 / 3;
  std::vector<Sensor> sensors(7, least);
  sensors[1].force = everything.force;
  sensors[2].shear = everything.shear;
  sensors[3].reconstruction = Reconstruction::Shading;
  sensors[3].shading = {200.1, 0.7};
  sensors[4].bit_depth = 12;
  sensors[4].saturation_gray = 4095;
  sensors[4].signal = Signal::Darker;
  sensors[5].size_px = {640, 480};
  sensors[5].name = "pad \"7\"\n\xc3\xa4";
  sensors[6].background.kind = BackgroundKind::None;
  for (const Sensor& sensor : sensors) {
    save_sensor(sensor, folder_ / "copy.json");
    expect_same(load_sensor(folder_ / "copy.json"), sensor);
  }
  EXPECT_EQ(files().size(), 2u) << "temporary files are left";
}

TEST_F(SensorFile, DefaultsOfAShortFile) {
  const Sensor s = load_sensor(spill(R"({"palpate_sensor": 1, "pitch_mm_per_px": 0.1, // a comment
                                        "frame": {"bit_depth": 12}})"));
  EXPECT_EQ(s.name, "pad");
  EXPECT_EQ(s.saturation_gray, 4095u);
  EXPECT_EQ(s.channels, 1u);
  EXPECT_EQ(s.reconstruction, Reconstruction::None);
  EXPECT_FALSE(s.force || s.shear || s.crop_px || s.quad_px);
}

// The background's path is relative to the sensor file: both may move together.
TEST_F(SensorFile, BackgroundMovesWithItsFile) {
  Sensor sensor = load_sensor(spill(kEverything));
  fs::create_directories(folder_ / "a" / "b");
  sensor.background.image = (folder_ / "a" / "b" / "rest.png").string();
  save_sensor(sensor, folder_ / "a" / ".." / "a" / "pad.json");
  EXPECT_EQ(load_sensor(folder_ / "a" / "pad.json").background.image, sensor.background.image);
  fs::rename(folder_ / "a", folder_ / "c");
  EXPECT_EQ(load_sensor(folder_ / "c" / "pad.json").background.image,
            (folder_ / "c" / "b" / "rest.png").string());
  // An image elsewhere keeps its place.
  sensor.background.image = "/elsewhere/rest.png";
  save_sensor(sensor, folder_ / "pad.json");
  EXPECT_EQ(load_sensor(folder_ / "pad.json").background.image, "/elsewhere/rest.png");
}

TEST_F(SensorFile, EveryShippedFileLoads) {
  size_t count = 0;
  for (const auto& entry : fs::directory_iterator(fs::path(PALPATE_SOURCE_DIR) / "capture/sensors")) {
    if (entry.path().extension() != ".json") continue;
    ++count;
    SCOPED_TRACE(entry.path().filename().string());
    const Sensor sensor = load_sensor(entry.path());
    EXPECT_FALSE(sensor.name.empty());
    save_sensor(sensor, folder_ / "copy.json");
    expect_same(load_sensor(folder_ / "copy.json"), sensor);
  }
  EXPECT_GE(count, 5u);
}

TEST_F(SensorFile, WhatIsNoSensorFileIsRefused) {
  expect_refused(folder_ / "missing.json", {"No such file"}, "missing");
  expect_refused(folder_, {"sensor file"}, "a folder");
  expect_refused("", {"valid JSON"});
  expect_refused("pitch: 3", {"valid JSON", "line 1"});
  expect_refused(std::string("\0\0\0\0", 4), {"valid JSON"});
  expect_refused("{\"name\": \"\xff\xfe\"}", {"valid JSON"});
  expect_refused("[1, 2]", {"an object"});
  expect_refused("3", {"an object"});
  expect_refused("null", {"an object"});
  expect_refused(std::string((1 << 20) + 1, ' '), {"1 MiB", "1048577 bytes"});
  const std::string whole = kEverything;
  for (size_t length = 1; length < whole.size(); length += 29) expect_refused(whole.substr(0, length), {});
}

// A file made to break its reader: nested deeper than a stack is, in every place.
TEST_F(SensorFile, AbsurdNestingIsRefused) {
  const std::string deep = std::string(250000, '[') + std::string(250000, ']');
  expect_refused(deep, {"object"});
  for (const char* key : {"palpate_sensor", "name", "pitch_mm_per_px", "frame", "force", "unknown"}) {
    Json json = Json::parse(kEverything);
    json[key] = 424242;
    std::string text = json.dump();
    text.replace(text.find("424242"), 6, deep);
    expect_refused(text, {key});
  }
}

/// One key of the full file replaced; its name must be in the message. An empty value removes it.
struct Bad {
  const char* at;     ///< JSON pointer
  const char* value;  ///< JSON
  const char* named;  ///< what the message must hold
};

TEST_F(SensorFile, EveryBadValueNamesItsKey) {
  const std::vector<Bad> list{
      {"/palpate_sensor", "", "palpate_sensor"},
      {"/palpate_sensor", "2", "version 1; found 2"},
      {"/palpate_sensor", "0", "palpate_sensor"},
      {"/palpate_sensor", "1.5", "palpate_sensor"},
      {"/palpate_sensor", "\"1\"", "palpate_sensor"},
      {"/name", "7", "pad.json.name"},
      {"/name", "null", "pad.json.name"},
      {"/pitch_mm_per_px", "", "pitch_mm_per_px"},
      {"/pitch_mm_per_px", "0", "pitch_mm_per_px"},
      {"/pitch_mm_per_px", "-0.1", "pitch_mm_per_px"},
      {"/pitch_mm_per_px", "101", "1e-06 to 100 mm per px"},
      {"/pitch_mm_per_px", "1e300", "pitch_mm_per_px"},
      {"/pitch_mm_per_px", "\"0.1\"", "pitch_mm_per_px"},
      {"/pitch_mm_per_px", "\"NaN\"", "pitch_mm_per_px"},
      {"/pitch_mm_per_px", "null", "pitch_mm_per_px"},
      {"/pitch_mm_per_px", "[0.1]", "pitch_mm_per_px"},
      {"/pitch_mm_per_px", "true", "pitch_mm_per_px"},
      {"/frame", "[]", "pad.json.frame"},
      {"/frame", "null", "pad.json.frame"},
      {"/frame/channels", "2", "frame.channels"},
      {"/frame/channels", "4", "frame.channels"},
      {"/frame/channels", "1", "frame.channels"},  // photometric needs three
      {"/frame/channels", "\"rgb\"", "frame.channels"},
      {"/frame/bit_depth", "7", "frame.bit_depth"},
      {"/frame/bit_depth", "17", "frame.bit_depth"},
      {"/frame/bit_depth", "8.5", "frame.bit_depth"},
      {"/frame/bit_depth", "12", "frame.bit_depth"},  // colour has eight bits
      {"/frame/crop_px", "[0, 0, 10]", "frame.crop_px"},
      {"/frame/crop_px", "[0, 0, 10, 10, 10]", "frame.crop_px"},
      {"/frame/crop_px", "[0, 0, 0, 10]", "frame.crop_px"},
      {"/frame/crop_px", "[-1, 0, 10, 10]", "frame.crop_px"},
      {"/frame/crop_px", "[0, 0, 10, 99999]", "frame.crop_px"},
      {"/frame/crop_px", "[0, 0, 10, 10.5]", "frame.crop_px"},
      {"/frame/crop_px", "[0, 0, 10, null]", "frame.crop_px"},
      {"/frame/crop_px", "{\"x\": 3}", "frame.crop_px"},
      {"/frame/quad_px", "[[0, 0], [1, 0], [1, 1]]", "frame.quad_px"},
      {"/frame/quad_px", "[[0, 0], [1, 0], [1, 1], [0]]", "frame.quad_px"},
      {"/frame/quad_px", "[[0, 0], [1, 0], [1, 1], [0, \"1\"]]", "frame.quad_px"},
      {"/frame/quad_px", "[[0, 0], [1, 0], [1, 1], [0, 1e9]]", "frame.quad_px"},
      {"/frame/quad_px", "[0, 0, 1, 0]", "frame.quad_px"},
      {"/frame/size_px", "", "frame.size_px"},  // a quad needs it
      {"/frame/size_px", "[320]", "frame.size_px"},
      {"/frame/size_px", "[0, 240]", "frame.size_px"},
      {"/frame/size_px", "[320, 16385]", "frame.size_px"},
      {"/background", "\"rest.png\"", "pad.json.background"},
      {"/background/image", "3", "background.image"},
      {"/background/first_frames", "0", "background.first_frames"},
      {"/background/first_frames", "10001", "background.first_frames"},
      {"/background/first_frames", "2.5", "background.first_frames"},
      {"/contact", "5", "pad.json.contact"},
      {"/contact/signal", "\"bright\"", "brighter, darker, either"},
      {"/contact/signal", "1", "contact.signal"},
      {"/contact/threshold_gray", "-1", "contact.threshold_gray"},
      {"/contact/threshold_gray", "256", "contact.threshold_gray"},  // above 8 bits
      {"/contact/threshold_gray", "\"5\"", "contact.threshold_gray"},
      {"/contact/saturation_gray", "0", "contact.saturation_gray"},
      {"/contact/saturation_gray", "256", "contact.saturation_gray"},
      {"/contact/saturation_gray", "250.5", "contact.saturation_gray"},
      {"/surface", "\"photometric\"", "pad.json.surface"},
      {"/surface/reading", "\"stereo\"", "none, shading, photometric"},
      {"/surface/max_slope", "0", "surface.max_slope"},
      {"/surface/max_slope", "1e9", "surface.max_slope"},
      {"/surface/shading", "7", "surface.shading"},
      {"/surface/shading/facing_gray", "", "surface.shading.facing_gray"},
      {"/surface/shading/facing_gray", "0", "surface.shading.facing_gray"},
      {"/surface/shading/depth_gain", "0", "surface.shading.depth_gain"},
      {"/surface/photometric", "", "surface.photometric"},
      {"/surface/photometric/wx", "", "surface.photometric.wx"},
      {"/surface/photometric/wx", "[[1, 0, 0], [1, 0, 0]]", "surface.photometric.wx"},
      {"/surface/photometric/wx/1", "[1, 0]", "surface.photometric.wx[1]"},
      {"/surface/photometric/wx/2/0", "\"1\"", "surface.photometric.wx[2]"},
      {"/surface/photometric/wy/0/2", "1e7", "surface.photometric.wy[0]"},
      {"/surface/photometric/wy/0/2", "null", "surface.photometric.wy[0]"},
      {"/surface/photometric/normal_sd", "-0.1", "surface.photometric.normal_sd"},
      {"/force", "[]", "pad.json.force"},
      {"/force", "null", "pad.json.force"},
      {"/force/c1_N_per_gray", "", "force.c1_N_per_gray"},
      {"/force/c1_N_per_gray", "0", "force.c1_N_per_gray"},
      {"/force/c1_N_per_gray", "1e13", "force.c1_N_per_gray"},
      {"/force/c0_N", "", "force.c0_N"},
      {"/force/c0_N", "\"nan\"", "force.c0_N"},
      {"/force/residual_sd_N", "", "force.residual_sd_N"},
      {"/force/residual_sd_N", "-0.001", "force.residual_sd_N"},
      {"/force/covariance", "[1, 2]", "force.covariance"},
      {"/force/covariance", "[-1, 0, 1]", "force.covariance"},
      {"/force/covariance", "[1, \"0\", 1]", "force.covariance"},
      {"/force/gray_min", "-1", "force.gray_min"},
      {"/force/gray_max", "", "force.gray_max"},
      {"/force/gray_max", "1", "force.gray_max"},  // below gray_min
      {"/shear", "1.5", "pad.json.shear"},
      {"/shear/kx_N_per_mm", "", "shear.kx_N_per_mm"},
      {"/shear/kx_N_per_mm", "0", "shear.kx_N_per_mm"},
      {"/shear/ky_N_per_mm", "-1.6", "shear.ky_N_per_mm"},
      {"/shear/friction", "", "shear.friction"},
      {"/shear/friction", "101", "shear.friction"},
      {"/shear/relative_sd", "-1", "shear.relative_sd"},
  };
  for (const Bad& bad : list) {
    Json json = Json::parse(kEverything);
    const Json::json_pointer at(bad.at);
    if (*bad.value)
      json[at] = Json::parse(bad.value);
    else
      json[at.parent_pointer()].erase(at.back());
    SCOPED_TRACE(std::string(bad.at) + " = " + bad.value);
    expect_refused(json.dump(), {bad.named});
  }
}

// What is left out must not be asked for elsewhere.
TEST_F(SensorFile, NoBackgroundAndNoFilterFitTheRest) {
  const auto file = [&](const char* background, const char* contact, const char* surface) {
    return spill(std::string(R"({"palpate_sensor": 1, "pitch_mm_per_px": 0.1, "background": )") + background +
                 R"(, "contact": )" + contact + R"(, "surface": )" + surface + "}");
  };
  const char* const kNone = R"({"source": "none"})";
  const char* const kShading = R"({"reading": "shading", "shading": {"facing_gray": 200}})";
  const Sensor lean = load_sensor(file(kNone, R"({"filter": "none"})", "{}"));
  EXPECT_EQ(lean.background.kind, BackgroundKind::None);
  EXPECT_EQ(lean.filter, Filter::None);
  const Sensor shading = load_sensor(file(kNone, R"({"signal": "either"})", kShading));
  EXPECT_EQ(shading.filter, Filter::Binomial5);

  expect_refused(file(R"({"source": "no"})", "{}", "{}"), {"background.source", "untouched, none"}, "source");
  expect_refused(file("{}", R"({"filter": "box"})", "{}"), {"contact.filter", "binomial5, none"}, "filter");
  expect_refused(file(R"({"source": "none", "image": "a.png"})", "{}", "{}"), {"background.image"}, "image");
  expect_refused(file(R"({"source": "none", "first_frames": 3})", "{}", "{}"), {"background.first_frames"},
                 "first frames");
  expect_refused(file(kNone, R"({"signal": "darker"})", "{}"), {"contact.signal", "darker"}, "darker");
  expect_refused(file(kNone, "{}", R"({"shadow_gray": 3})"), {"surface.shadow_gray"}, "shadow");
  expect_refused(file("{}", R"({"filter": "none"})", kShading), {"contact.filter", "shading"}, "unfiltered");
  Sensor colour = load_sensor(spill(kEverything));
  EXPECT_EQ(colour.filter, Filter::None) << "colour slopes do not come from the filtered image";
  colour.background = {BackgroundKind::None, "", 1};
  EXPECT_THROW(validate(colour, "colour"), Error);
}

TEST_F(SensorFile, UnknownKeysAreRefusedAtEveryLevel) {
  for (const char* level : {"", "/frame", "/background", "/contact", "/surface", "/surface/shading",
                            "/surface/photometric", "/force", "/shear"}) {
    Json json = Json::parse(kEverything);
    json[Json::json_pointer(level)]["tresh"] = 1;
    std::string path = level;
    for (char& c : path)
      if (c == '/') c = '.';
    SCOPED_TRACE(path);
    expect_refused(json.dump(), {"pad.json" + path + ":", "tresh", "known keys"});
  }
}

// A key written twice holds two numbers of which one would be dropped without a word.
TEST_F(SensorFile, KeysWrittenTwiceAreRefused) {
  std::string text = kEverything;
  text.insert(text.find("\"force\""), "\"pitch_mm_per_px\": 0.05, ");
  expect_refused(text, {"pitch_mm_per_px"});
  text = kEverything;
  text.insert(text.find("\"c0_N\""), "\"c0_N\": 0.5, ");
  expect_refused(text, {"c0_N"});
}

// What JSON itself has no number for.
TEST_F(SensorFile, NumbersThatAreNoneAreRefused) {
  for (const char* number : {"NaN", "nan", "Infinity", "-Infinity", "1e999", "-1e999", "0x10", "1,5", ""}) {
    std::string text = kEverything;
    text.replace(text.find("-0.11456"), 8, number);
    SCOPED_TRACE(number);
    expect_refused(text, {"JSON"});
  }
}

TEST_F(SensorFile, UnwritablePlacesLeaveNothingBehind) {
  const Sensor sensor = load_sensor(spill(kEverything));
  const auto expect_output_failure = [&](const fs::path& file) {
    try {
      save_sensor(sensor, file);
      ADD_FAILURE() << "written: " << file;
    } catch (const Error& e) {
      EXPECT_EQ(e.failure(), Failure::Output);
      EXPECT_NE(std::string(e.what()).find(file.string()), std::string::npos) << e.what();
    }
  };
  expect_output_failure(folder_ / "no such folder" / "pad.json");
  fs::create_directories(folder_ / "taken" / "inside");
  expect_output_failure(folder_ / "taken");
  expect_output_failure(folder_ / "pad.json" / "inside.json");
  EXPECT_EQ(files().size(), 2u) << "temporary files are left";
  // What was there stays as it was.
  expect_same(load_sensor(folder_ / "pad.json"), sensor);
}

// A sensor made in code is held to the same ranges: nothing is written that cannot be read again.
TEST_F(SensorFile, WhatCouldNotBeReadAgainIsNotWritten) {
  const Sensor good = load_sensor(spill(kEverything));
  const auto refused = [&](const char* key, const auto& spoil) {
    Sensor bad = good;
    spoil(bad);
    for (const bool save : {false, true}) {
      try {
        if (save)
          save_sensor(bad, folder_ / "bad.json");
        else
          validate(bad, "pad");
        ADD_FAILURE() << "accepted: " << key;
      } catch (const Error& e) {
        EXPECT_EQ(e.failure(), Failure::Sensor) << key;
        EXPECT_NE(std::string(e.what()).find(key), std::string::npos) << e.what();
      }
    }
  };
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  refused("pitch_mm_per_px", [&](Sensor& s) { s.pitch_mm_per_px = kNaN; });
  refused("threshold_gray", [&](Sensor& s) { s.threshold_gray = kNaN; });
  refused("max_slope", [&](Sensor& s) { s.max_slope = kInfinity; });
  refused("channels", [&](Sensor& s) { s.channels = 2; });
  refused("photometric.wx[0]", [&](Sensor& s) { s.photometric.wx[0][1] = kNaN; });
  refused("photometric", [&](Sensor& s) { s.photometric.wx = s.photometric.wy = {}; });
  refused("force.c1_N_per_gray", [&](Sensor& s) { s.force->c1_N_per_gray = kNaN; });
  refused("force.c0_N", [&](Sensor& s) { s.force->c0_N = kInfinity; });
  refused("force.covariance", [&](Sensor& s) { s.force->covariance[1] = kNaN; });
  refused("force.gray_max", [&](Sensor& s) { s.force->gray_max = kNaN; });
  refused("shear.friction", [&](Sensor& s) { s.shear->friction = kNaN; });
  refused("shear.kx_N_per_mm", [&](Sensor& s) { s.shear->kx_N_per_mm = 0; });
  EXPECT_EQ(files().size(), 1u);
}

TEST(UncalibratedSensor, HasNoScaleAndIsNoFile) {
  for (const uint32_t bits : {8u, 12u, 16u}) {
    Sensor sensor = uncalibrated_sensor({.width = 64, .height = 48, .bit_depth = bits});
    EXPECT_FALSE(has_scale(sensor));
    EXPECT_NO_THROW(validate(sensor, "camera"));
    EXPECT_THROW(sensor_text(sensor), Error);
    sensor.shear = ShearCalibration{.kx_N_per_mm = 1, .ky_N_per_mm = 1, .friction = 1};
    EXPECT_THROW(validate(sensor, "camera"), Error);
    sensor.shear.reset();
    sensor.threshold_gray = 1e9;
    EXPECT_THROW(validate(sensor, "camera"), Error);
  }
}

}  // namespace
}  // namespace palpate
