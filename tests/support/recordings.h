// Recordings of real sensors. They are not part of the repository (their licences differ): tests skip,
// loudly, where they are absent.
#pragma once

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "tests/support/gpu_fixture.h"

namespace palpate {

/// The folder that PALPATE_DATA names, else ../shared/data next to the source tree.
inline std::filesystem::path recordings_folder() {
  const char* named = std::getenv("PALPATE_DATA");
  return named && *named ? std::filesystem::path(named)
                         : std::filesystem::path(PALPATE_SOURCE_DIR) / "../shared/data";
}

/// A sensor file that comes with the program, by its name without the ending.
inline std::filesystem::path shipped_sensor(const std::string& name) {
  return std::filesystem::path(PALPATE_SOURCE_DIR) / "capture/sensors" / (name + ".json");
}

class RecordingsTest : public GpuTest {
 protected:
  /// `unchecked`: what is not checked without them, in capitals. `part`: the folder of them that is needed.
  explicit RecordingsTest(const char* unchecked, const char* part = "")
      : unchecked_(unchecked), folder_(recordings_folder() / part) {}

  void SetUp() override {
    if (!std::filesystem::is_directory(folder_)) {
      std::fprintf(stderr, "\n*** %s: no folder %s ***\n\n", unchecked_,
                   std::filesystem::weakly_canonical(folder_).c_str());
      GTEST_SKIP() << "no recordings of real sensors at " << folder_;
    }
    GpuTest::SetUp();
  }
  void TearDown() override {
    if (!IsSkipped()) GpuTest::TearDown();
  }

 private:
  const char* unchecked_;
  std::filesystem::path folder_;
};

}  // namespace palpate
