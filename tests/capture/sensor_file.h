// Common parts of the tests of sensor files.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "palpate/error.h"
#include "palpate/sensor.h"

namespace palpate {

/// Every key that a sensor file knows.
inline constexpr const char* kEverything = R"({
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
                              "wy": [[1, 0, 0.1], [0, 0.001, 0], [7, 8, 1e-9]], "normal_sd": 0.03,
                              "noise_sd": 0.02, "pad_reach_px": 12.5,
                              "presses": [[-0.5, 0.25, 0.1875, -0.0625], [0.5, -0.25, 0.25, 0.125]],
                              "colours": {"low": [-0.25, -0.125, -0.5], "high": [0.25, 0.5, 0.125],
                                          "bins": ["0000000000000001", "00000000000000ff", "0000000000000000",
                                                   "0123456789abcdef", "ffffffffffffffff", "8000000000000000",
                                                   "0000000000000000", "0000000000000000"]}}},
  "force": {"c1_N_per_gray": 1.75e-8, "c0_N": -0.11456, "residual_sd_N": 0.004,
            "covariance": [1e-6, -1e-14, 2e-22], "gray_min": 37231000, "gray_max": 92432000},
  "shear": {"kx_N_per_mm": 1.5, "ky_N_per_mm": 1.6, "friction": 0.55, "relative_sd": 0.02}
})";

/// A folder of its own for the files of a test.
class SensorFile : public testing::Test {
 protected:
  SensorFile() {
    folder_ = std::filesystem::temp_directory_path() / ("palpate-sensor-" + std::to_string(getpid()));
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  ~SensorFile() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path spill(const std::string& text) const {
    const std::filesystem::path file = folder_ / "pad.json";
    std::ofstream(file, std::ios::binary) << text;
    return file;
  }

  /// The file must be refused in one line that names it and holds all the words.
  void expect_refused(const std::filesystem::path& file, const std::vector<std::string>& words,
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
    for (const auto& entry : std::filesystem::directory_iterator(folder_))
      names.push_back(entry.path().filename().string());
    return names;
  }

  std::filesystem::path folder_;
};

/// Field by field, to the last bit.
inline void expect_same(const Sensor& a, const Sensor& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(has_scale(a), has_scale(b));
  if (has_scale(a)) {
    EXPECT_EQ(a.pitch_mm_per_px, b.pitch_mm_per_px);
  }
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
  EXPECT_EQ(a.reading, b.reading);
  EXPECT_EQ(a.shading.facing_gray, b.shading.facing_gray);
  EXPECT_EQ(a.shading.depth_gain, b.shading.depth_gain);
  EXPECT_EQ(a.photometric.wx, b.photometric.wx);
  EXPECT_EQ(a.photometric.wy, b.photometric.wy);
  EXPECT_EQ(a.photometric.normal_sd, b.photometric.normal_sd);
  EXPECT_EQ(a.photometric.noise_sd, b.photometric.noise_sd);
  EXPECT_EQ(a.photometric.pad_reach_px, b.photometric.pad_reach_px);
  ASSERT_EQ(a.photometric.presses.size(), b.photometric.presses.size());
  for (size_t i = 0; i < a.photometric.presses.size(); ++i) {
    EXPECT_EQ(a.photometric.presses[i].across, b.photometric.presses[i].across);
    EXPECT_EQ(a.photometric.presses[i].down, b.photometric.presses[i].down);
    EXPECT_EQ(a.photometric.presses[i].radius, b.photometric.presses[i].radius);
    EXPECT_EQ(a.photometric.presses[i].depth_error, b.photometric.presses[i].depth_error);
  }
  ASSERT_EQ(a.photometric.colours.has_value(), b.photometric.colours.has_value());
  if (a.photometric.colours) {
    EXPECT_EQ(a.photometric.colours->low, b.photometric.colours->low);
    EXPECT_EQ(a.photometric.colours->high, b.photometric.colours->high);
    EXPECT_EQ(a.photometric.colours->bins, b.photometric.colours->bins);
  }
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

}  // namespace palpate
