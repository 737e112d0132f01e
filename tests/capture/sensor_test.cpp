// Sensor files: a saved sensor is loaded unchanged.
#include "palpate/sensor.h"

#include <gtest/gtest.h>
#include <filesystem>
#include <fstream>

#include "palpate/error.h"
#include "tests/capture/sensor_file.h"
#include "tests/support/json.h"
#include "tests/support/text_file.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

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
  EXPECT_EQ(s.reading, SurfaceReading::Photometric);
  EXPECT_EQ(s.max_slope, 3.5);
  EXPECT_EQ(s.shading.facing_gray, 181.5);
  EXPECT_EQ(s.shading.depth_gain, 1.25);
  EXPECT_EQ(s.photometric.wx[1][2], -3);
  EXPECT_EQ(s.photometric.wy[2][2], 1e-9);
  EXPECT_EQ(s.photometric.normal_sd, 0.03);
  EXPECT_EQ(s.photometric.noise_sd, 0.02);
  EXPECT_EQ(s.photometric.pad_reach_px, 12.5);
  ASSERT_EQ(s.photometric.presses.size(), 2u);
  EXPECT_EQ(s.photometric.presses[1].depth_error, 0.125);
  ASSERT_TRUE(s.photometric.colours);
  EXPECT_EQ(s.photometric.colours->bins[3], 0x0123456789abcdefu);
  EXPECT_EQ(s.force->c1_N_per_gray, 1.75e-8);
  EXPECT_EQ(s.force->covariance[2], 2e-22);
  EXPECT_EQ(s.force->gray_max, 92432000);
  EXPECT_EQ(s.shear->friction, 0.55);
}

TEST_F(SensorFile, WhatIsSavedComesBackWhole) {
  const Sensor everything = load_sensor(spill(kEverything));
  save_sensor(everything, folder_ / "copy.json");
  expect_same(load_sensor(folder_ / "copy.json"), everything);
  EXPECT_EQ(parse_json(slurp(folder_ / "copy.json")), parse_json(kEverything));

  // The least that a sensor can be, and each optional part by itself.
  Sensor least;
  least.name = "least";
  least.pitch_mm_per_px = 1.0 / 3;
  std::vector<Sensor> sensors(7, least);
  sensors[1].force = everything.force;
  sensors[2].shear = everything.shear;
  sensors[3].reading = SurfaceReading::Shading;
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

TEST_F(SensorFile, ForceByLayerAndBending) {
  Sensor sensor = load_sensor(spill(kEverything));
  sensor.layer = LayerCalibration{.young_MPa = 0.15, .thickness_mm = 5.5};
  sensor.force->signal = ForceSignal::LayerAndBending;
  sensor.force->model = ForceModel::Scale;
  sensor.force->bending_N_per_mm = 1.0 / 3;
  const std::filesystem::path file = folder_ / "both.json";
  save_sensor(sensor, file);
  const ForceCalibration force = load_sensor(file).force.value();
  EXPECT_EQ(force.signal, ForceSignal::LayerAndBending);
  EXPECT_EQ(force.model, ForceModel::Scale);
  EXPECT_EQ(force.bending_N_per_mm, sensor.force->bending_N_per_mm);
  const auto refused = [&](const Sensor& wrong, const std::string& word) {
    try {
      save_sensor(wrong, file);
      ADD_FAILURE() << "accepted without " << word;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
  };
  Sensor wrong = sensor;
  wrong.force->bending_N_per_mm = 0;
  refused(wrong, "force.bending_N_per_mm");
  wrong = sensor;
  wrong.layer.reset();
  refused(wrong, "section 'layer'");
  wrong = sensor;
  wrong.reading = SurfaceReading::Shading;
  wrong.filter = Filter::Binomial5;
  refused(wrong, "colour gel");
}

TEST_F(SensorFile, DefaultsOfAShortFile) {
  const Sensor s = load_sensor(spill(R"({"palpate_sensor": 1, "pitch_mm_per_px": 0.1, // a comment
                                        "frame": {"bit_depth": 12}})"));
  EXPECT_EQ(s.name, "pad");
  EXPECT_EQ(s.saturation_gray, 4095u);
  EXPECT_EQ(s.channels, 1u);
  EXPECT_EQ(s.reading, SurfaceReading::None);
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

// Keys that are left out must not be required elsewhere.
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
  fs::create_directories(folder_ / "taken" / "inside");
  expect_output_failure(folder_ / "taken");
  expect_output_failure(folder_ / "pad.json" / "inside.json");
  EXPECT_EQ(files().size(), 2u) << "temporary files are left";
  save_sensor(sensor, folder_ / "a new" / "folder" / "pad.json");
  expect_same(load_sensor(folder_ / "a new" / "folder" / "pad.json"), sensor);
  // Existing content stays as it was.
  expect_same(load_sensor(folder_ / "pad.json"), sensor);
}

TEST(UncalibratedSensor, HasNoScaleAndSaysSoInItsFile) {
  for (const uint32_t bits : {8u, 12u, 16u}) {
    Sensor sensor = uncalibrated_sensor({.width = 64, .height = 48, .bit_depth = bits});
    EXPECT_FALSE(has_scale(sensor));
    EXPECT_NO_THROW(validate(sensor, "camera"));
    const std::string file = sensor_text(sensor);
    EXPECT_NE(file.find("\"pitch_mm_per_px\": null"), std::string::npos) << file;
    EXPECT_FALSE(has_scale(sensor_from_text(file, "camera")));
    sensor.shear = ShearCalibration{.kx_N_per_mm = 1, .ky_N_per_mm = 1, .friction = 1};
    EXPECT_THROW(validate(sensor, "camera"), Error);
    sensor.shear.reset();
    sensor.threshold_gray = 1e9;
    EXPECT_THROW(validate(sensor, "camera"), Error);
  }
}

}  // namespace
}  // namespace palpate
