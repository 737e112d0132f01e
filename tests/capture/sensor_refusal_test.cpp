// Refusal of sensor files: each error is one line that names the file and the key.
#include "palpate/sensor.h"

#include <gtest/gtest.h>
#include <limits>

#include "palpate/error.h"
#include "tests/capture/sensor_file.h"
#include "tests/support/json.h"

namespace palpate {
namespace {

TEST_F(SensorFile, WhatIsNoSensorFileIsRefused) {
  expect_refused(folder_ / "missing.json", {"no such file"}, "missing");
  expect_refused(folder_, {"sensor file"}, "a folder");
  expect_refused("", {"an empty file (0 bytes)"});
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
    Json json = parse_json(kEverything);
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

constexpr Bad kBadValues[] = {
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
    {"/surface/photometric/noise_sd", "0.04", "surface.photometric.noise_sd"},
    {"/surface/photometric/pad_reach_px", "-1", "surface.photometric.pad_reach_px"},
    {"/surface/photometric/presses", "{}", "surface.photometric.presses"},
    {"/surface/photometric/presses/0", "[1, 2, 3]", "surface.photometric.presses"},
    {"/surface/photometric/presses/1/3", "11", "surface.photometric.presses"},
    {"/surface/photometric/colours", "7", "surface.photometric.colours"},
    {"/surface/photometric/colours/low", "[0, 0]", "surface.photometric.colours.low"},
    {"/surface/photometric/colours/high/1", "-0.125", "surface.photometric.colours.high"},
    {"/surface/photometric/colours/bins", "[]", "surface.photometric.colours.bins"},
    {"/surface/photometric/colours/bins/7", "\"00ff\"", "surface.photometric.colours.bins"},
    {"/surface/photometric/colours/bins/0", "\"000000000000000g\"", "surface.photometric.colours.bins"},
    {"/surface/photometric/colours/bins/0", "0", "surface.photometric.colours.bins"},
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

TEST_F(SensorFile, EveryBadValueNamesItsKey) {
  for (const Bad& bad : kBadValues) {
    Json json = parse_json(kEverything);
    const Json::json_pointer at(bad.at);
    if (*bad.value)
      json[at] = parse_json(bad.value);
    else
      json[at.parent_pointer()].erase(at.back());
    SCOPED_TRACE(std::string(bad.at) + " = " + bad.value);
    expect_refused(json.dump(), {bad.named});
  }
}

TEST_F(SensorFile, UnknownKeysAreRefusedAtEveryLevel) {
  for (const char* level : {"", "/frame", "/background", "/contact", "/surface", "/surface/shading",
                            "/surface/photometric", "/force", "/shear"}) {
    Json json = parse_json(kEverything);
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

// Values for which JSON has no number.
TEST_F(SensorFile, NumbersThatAreNoneAreRefused) {
  for (const char* number : {"NaN", "nan", "Infinity", "-Infinity", "1e999", "-1e999", "0x10", "1,5", ""}) {
    std::string text = kEverything;
    text.replace(text.find("-0.11456"), 8, number);
    SCOPED_TRACE(number);
    expect_refused(text, {"JSON"});
  }
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

}  // namespace
}  // namespace palpate
