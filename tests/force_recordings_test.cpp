// Force on recordings of a real gel sensor beside a gauge: calibrated on one press, judged by another. They
// are not part of the repository; the test says loudly when it is skipped.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "tests/gpu_fixture.h"
#include "viz/calibrate_force.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

const fs::path kRoot = PALPATE_SOURCE_DIR;
const fs::path kData = kRoot / "../shared/data/gelsight_wedge_press";

class ForceRecordings : public GpuTest {
 protected:
  void SetUp() override {
    if (!fs::is_directory(kData)) {
      std::fprintf(stderr, "\n*** FORCE NOT CHECKED AGAINST A REAL GAUGE: no folder %s ***\n\n",
                   fs::weakly_canonical(kData).c_str());
      GTEST_SKIP() << "no recordings of real sensors at " << kData;
    }
    GpuTest::SetUp();
  }
  void TearDown() override {
    if (!IsSkipped()) GpuTest::TearDown();
  }
  GaugedRecording measured(const std::string& clip) {
    Common common;
    common.quiet = true;
    MeasuredInput input{(kData / (clip + ".avi")).string(),
                        load_sensor(kRoot / "capture/sensors/gelsight_wedge.json"),
                        {},
                        Output::Force | Output::Surface};
    return measure_beside_gauge(context(), common, input, {(kData / (clip + ".csv")).string(), {}, {}, 0});
  }
};

TEST_F(ForceRecordings, SecondTrialOfTheSameObject) {
  double all_N = 0, all_share = 0;
  std::printf(
      "object                 model                          FS, N   mean error from 1 N on, N (%% FS)\n");
  int objects = 0;
  for (const char* object :
       {"golf_ball", "purple_ball_hardest", "green_ball_softer", "orange_ball_softest", "foam_brick"}) {
    const ForceOutcome o = calibrate_force({measured(std::string(object) + "_1")}, {});
    const ForceCheck check = check_force(o.choice.calibration, measured(std::string(object) + "_2"));
    const double full_N = o.choice.calibration.force_max_N, share = check.above_error_N / full_N;
    std::printf("%-22s %-30s %5.1f   %.3f (%.1f)  %zu readings, %zu flagged, interval held %.0f %%\n", object,
                to_string(o.choice.chosen.candidate).c_str(), full_N, check.above_error_N, 100 * share,
                check.above_readings, check.flagged, 100 * check.coverage);
    all_N += check.above_error_N;
    all_share += share;
    ++objects;
  }
  std::printf("mean over objects: %.3f N, %.2f %% of full scale\n", all_N / objects,
              100 * all_share / objects);
}

}  // namespace
}  // namespace palpate
