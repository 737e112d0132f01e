// READMEs stay true: the sensor file of the example loads, and the table names every key that there is. The
// table of columns: tests/capture/quantities_test.cpp.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "palpate/sensor.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

std::string readme(const char* file) {
  std::ifstream in(fs::path(PALPATE_SOURCE_DIR) / file);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(Readme, SensorExampleLoads) {
  const std::string text = readme("engine/sensor/README.md");
  const size_t start = text.find("```json\n") + 8;
  const size_t end = text.find("```", start);
  ASSERT_LT(end, text.size());
  const fs::path file = fs::temp_directory_path() / ("palpate-readme-" + std::to_string(getpid()) + ".json");
  std::ofstream(file) << text.substr(start, end - start);
  const Sensor sensor = load_sensor(file);
  fs::remove(file);
  EXPECT_EQ(sensor.name, "pad 3, camera 1");
  EXPECT_TRUE(sensor.crop_px && sensor.quad_px && sensor.force && sensor.shear);
}

TEST(Readme, NamesEveryKeyOfASensorFile) {
  const std::string text = readme("engine/sensor/README.md");
  for (const char* key : {"palpate_sensor",
                          "name",
                          "pitch_mm_per_px",
                          "frame.crop_px",
                          "frame.quad_px",
                          "frame.size_px",
                          "frame.lens",
                          "frame.flat",
                          "frame.channels",
                          "frame.bit_depth",
                          "background.image",
                          "background.first_frames",
                          "background.source",
                          "contact.filter",
                          "contact.signal",
                          "contact.threshold_gray",
                          "contact.saturation_gray",
                          "surface.reading",
                          "surface.max_slope",
                          "surface.shading",
                          "surface.elastic",
                          "surface.photometric",
                          "surface.lookup",
                          "surface.shadow_gray",
                          "pad",
                          "force",
                          "shear",
                          "facing_gray",
                          "depth_gain",
                          "wx",
                          "wy",
                          "normal_sd"}) {
    EXPECT_NE(text.find("`" + std::string(key) + "`"), std::string::npos) << key;
  }
}

}  // namespace
}  // namespace palpate
