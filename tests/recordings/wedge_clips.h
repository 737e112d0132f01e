// Ten presses of real objects on a gel sensor beside a gauge. They are not part of the repository; tests that
// want them say loudly when they are skipped.
#pragma once

#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <string>

#include "capture/calibrate/force.h"
#include "tests/support/gpu_fixture.h"

namespace palpate {

class WedgeClips : public GpuTest {
 protected:
  /// `unchecked`: what is not checked without them, in capitals.
  explicit WedgeClips(const char* unchecked) : unchecked_(unchecked) {}

  void SetUp() override {
    if (!std::filesystem::is_directory(folder())) {
      std::fprintf(stderr, "\n*** %s: no folder %s ***\n\n", unchecked_,
                   std::filesystem::weakly_canonical(folder()).c_str());
      GTEST_SKIP() << "no recordings of real sensors at " << folder();
    }
    GpuTest::SetUp();
  }
  void TearDown() override {
    if (!IsSkipped()) GpuTest::TearDown();
  }

  static std::filesystem::path folder() {
    return std::filesystem::path(PALPATE_SOURCE_DIR) / "../shared/data/gelsight_wedge_press";
  }
  static GaugedRecording measured(const std::string& clip) {
    MeasuredInput input{
        (folder() / (clip + ".avi")).string(),
        load_sensor(std::filesystem::path(PALPATE_SOURCE_DIR) / "capture/sensors/gelsight_wedge.json"),
        {},
        Output::Force | Output::Gradient};
    // The gauge is read a frame or two late.
    return measure_beside_gauge(context(), input,
                                {(folder() / (clip + ".csv")).string(), {}, parse_alignment("auto"), 0}, {});
  }

 private:
  const char* unchecked_;
};

}  // namespace palpate
