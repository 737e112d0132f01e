// Kinds of sensors that people own: each file that is shipped, and what is made of it.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <functional>

#include "capture/sensors/nominal_sensors.h"
#include "palpate/error.h"
#include "tests/support/test_folder.h"

namespace palpate {
namespace {

FrameFormat colour(uint32_t width, uint32_t height) {
  return {.width = width, .height = height, .channels = 3, .bit_depth = 8};
}

std::string refusal(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(NominalSensors, EachShippedOneMakesAValidSensorWithoutDepth) {
  const std::vector<std::string> names = nominal_names();
  for (const char* name : {"digit", "gelsight_mini", "gelsight_mini_markers"})
    EXPECT_NE(std::ranges::find(names, name), names.end()) << name;
  for (const std::string& name : names) {
    SCOPED_TRACE(name);
    const NominalSensor kind = load_nominal(name);
    EXPECT_FALSE(kind.not_known.empty());
    EXPECT_FALSE(kind.source.empty());
    for (const NominalSensor::Mode& mode : kind.modes)
      for (const bool upright : {false, true}) {
        const FrameFormat format = colour(mode.size_px[upright], mode.size_px[!upright]);
        Sensor sensor = uncalibrated_sensor(format);
        apply_nominal(kind, format, sensor);
        sensor.name = name;
        validate(sensor, name);
        EXPECT_EQ(sensor.reading, SurfaceReading::None);
        // The whole field is seen, whatever the mode.
        const std::array<uint32_t, 2> px =
            sensor.quad_px ? sensor.size_px : std::array<uint32_t, 2>{format.width, format.height};
        EXPECT_NEAR(px[0] * sensor.pitch_mm_per_px, kind.field_mm[upright], 0.1);
        EXPECT_NEAR(px[1] * sensor.pitch_mm_per_px, kind.field_mm[!upright], 0.1);
        EXPECT_GE(sensor.pitch_sd_mm_per_px, 0.04 * sensor.pitch_mm_per_px);
        EXPECT_EQ(sensor.skin.has_value(), name.ends_with("markers"));
        EXPECT_TRUE(!sensor.layer || !sensor.layer->origin.note.empty());
      }
  }
}

TEST(NominalSensors, AMiniIsAsItsMakersStateIt) {
  const FrameFormat format = colour(320, 240);
  Sensor sensor = uncalibrated_sensor(format);
  apply_nominal(load_nominal("gelsight_mini_markers"), format, sensor);
  EXPECT_NEAR(sensor.pitch_mm_per_px, 0.0634, 1e-4);
  EXPECT_FALSE(sensor.quad_px);  // square pixels
  ASSERT_TRUE(sensor.layer && sensor.skin);
  EXPECT_EQ(sensor.layer->thickness_mm, 4.25);
  EXPECT_GE(sensor.layer->relative_sd, 0.5);  // nobody states its modulus
  EXPECT_NEAR(sensor.skin->spacing_px, 31.3, 0.2);
}

TEST(NominalSensors, WhatDoesNotFitIsRefused) {
  Sensor sensor;
  EXPECT_NE(refusal([&] { load_nominal("gelsight_mimi"); }).find("did you mean 'gelsight_mini'?"),
            std::string::npos);
  const NominalSensor kind = load_nominal("digit");
  EXPECT_NE(refusal([&] { apply_nominal(kind, colour(640, 360), sensor); }).find("640 x 360 px"),
            std::string::npos);
  const FrameFormat gray{.width = 640, .height = 480, .channels = 1, .bit_depth = 8};
  EXPECT_NE(refusal([&] { apply_nominal(kind, gray, sensor); }).find("gray"), std::string::npos);
  const std::filesystem::path folder = test_folder("nominal");
  std::ofstream(folder / "bad.json") << R"({"palpate_nominal": 1, "name": "x"})";
  EXPECT_NE(refusal([&] { load_nominal((folder / "bad.json").string()); }).find("bad.json"),
            std::string::npos);
  const auto says = [&](const char* camera, const char* field, const char* signal, const std::string& part) {
    std::ofstream(folder / "kind.json")
        << R"({"palpate_nominal": 1, "name": "x", "camera": {"channels": )" << camera
        << R"(, "modes": [{"size_px": [320, 240], "rate_Hz": 9}]}, "scale": {"relative_sd": 0.1, "source": "s", )"
        << R"("field_mm": )" << field << R"(}, "light": {"signal": ")" << signal << R"("}, "not_known": []})";
    const std::string said = refusal([&] { load_nominal((folder / "kind.json").string()); });
    EXPECT_NE(said.find(part), std::string::npos) << said;
  };
  says("3", "[20, 15]", "either", "");
  says("2", "[20, 15]", "either", "1 or 3 channels");
  says("1e300", "[20, 15]", "either", "whole number");
  says("3", "[20, 0]", "either", "field_mm above 0");
  says("3", "[20, 15]", "bright", "signal brighter, darker or either");
}

}  // namespace
}  // namespace palpate
