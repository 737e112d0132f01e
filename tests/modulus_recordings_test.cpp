// Stiffness of real objects between a gel and a second finger: is their known order found? The recordings are
// not part of the repository; the test says loudly when it is skipped.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "engine/mechanics/force.h"
#include "engine/mechanics/modulus.h"
#include "tests/gpu_fixture.h"
#include "viz/calibrate_force.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;
const fs::path kRoot = PALPATE_SOURCE_DIR;
const fs::path kData = kRoot / "../shared/data/gelsight_wedge_press";

/// From the softest to the stiffest.
constexpr std::array kObjects = {"foam_brick", "orange_ball_softest", "green_ball_softer",
                                 "purple_ball_hardest", "golf_ball"};

class ModulusRecordings : public GpuTest {
 protected:
  void SetUp() override {
    if (!fs::is_directory(kData)) {
      std::fprintf(stderr, "\n*** MODULUS NOT CHECKED ON REAL OBJECTS: no folder %s ***\n\n",
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
                        Output::Force | Output::Gradient};
    return measure_beside_gauge(context(), common, input,
                                {(kData / (clip + ".csv")).string(), {}, parse_alignment("none"), 0});
  }
  /// The gripper's width in each frame, mm.
  static std::vector<double> widths(const std::string& clip) {
    std::ifstream in(kData / (clip + ".csv"));
    std::vector<double> found;
    std::string line;
    std::getline(in, line);
    while (std::getline(in, line)) found.push_back(std::stod(line.substr(line.rfind(',') + 1)));
    return found;
  }
  /// An object's modulus as if it were a ball of 50 mm, from how far the gripper closes while its force
  /// rises.
  static ModulusEstimate estimate(const std::vector<double>& force_N, const std::vector<double>& width_mm) {
    const size_t peak =
        static_cast<size_t>(std::max_element(force_N.begin(), force_N.end()) - force_N.begin());
    std::vector<PressFrame> frames;
    for (size_t i = 0; i <= peak && i < width_mm.size(); ++i) {
      if (!(force_N[i] > 0.5) || force_N[i] > 8) continue;
      PressFrame f;
      f.force_N = force_N[i];
      f.approach_mm = {width_mm.front() - width_mm[i], 0};
      frames.push_back(f);
    }
    ModulusSetup s;
    s.pad = {{0.15, 0.485}, 5.5, Base::Bonded};
    s.sample = {SampleShape::Sphere, 50, 50, 0.45, 0.02, Support::Sliding};
    s.pad_relative_sd = 0.1;
    return estimate_modulus(frames, s).best();
  }
};

double spearman(const std::vector<double>& a, const std::vector<double>& b) {
  const auto ranks = [](const std::vector<double>& v) {
    std::vector<double> r;
    for (const double x : v) {
      double below = 0, same = 0;
      for (const double y : v) {
        below += y < x;
        same += y == x;
      }
      r.push_back(below + (same + 1) / 2);
    }
    return r;
  };
  const std::vector<double> x = ranks(a), y = ranks(b);
  double sxy = 0, sxx = 0, syy = 0;
  const double middle = (static_cast<double>(a.size()) + 1) / 2;
  for (size_t i = 0; i < a.size(); ++i) {
    sxy += (x[i] - middle) * (y[i] - middle);
    sxx += (x[i] - middle) * (x[i] - middle);
    syy += (y[i] - middle) * (y[i] - middle);
  }
  return sxy / std::sqrt(sxx * syy);
}

TEST_F(ModulusRecordings, OrderOfStiffness) {
  std::vector<GaugedRecording> recordings;
  for (const char* object : kObjects)
    for (const char* trial : {"_1", "_2"}) recordings.push_back(measured(std::string(object) + trial));
  std::vector<double> known, by_gauge, by_image;
  std::printf("object, trial              gauge: kPa, state          image: kPa, state\n");
  for (size_t i = 0; i < recordings.size(); ++i) {
    // The image's force is calibrated on the other objects' presses alone.
    std::vector<GaugedRecording> others;
    for (size_t k = 0; k < recordings.size(); ++k)
      if (k / 2 != i / 2) others.push_back(recordings[k]);
    const ForceCalibration calibration = calibrate_force(std::move(others), {}, true).choice.calibration;
    ForceHistory history;
    std::vector<double> gauge, image;
    for (const GaugedFrame& f : recordings[i].frames) {
      gauge.push_back(f.force_N);
      image.push_back(std::max(0.0, history.update(calibration, force_reading(f.touch)).value));
    }
    const std::string clip = std::string(kObjects[i / 2]) + (i % 2 ? "_2" : "_1");
    const std::vector<double> width_mm = widths(clip);
    const ModulusEstimate g = estimate(gauge, width_mm), m = estimate(image, width_mm);
    const auto value = [](const ModulusEstimate& e) { return e.young_MPa > 0 ? e.young_MPa : e.low_MPa; };
    std::printf("%-26s %8.1f %-16s %8.1f %-16s\n", clip.c_str(), 1e3 * value(g), to_string(g.state),
                1e3 * value(m), to_string(m.state));
    known.push_back(static_cast<double>(i / 2));
    by_gauge.push_back(value(g));
    by_image.push_back(value(m));
  }
  const double gauge = spearman(known, by_gauge), image = spearman(known, by_image);
  std::printf("rank correlation over all ten: %.2f with the gauge, %.2f by the image alone\n", gauge, image);
  EXPECT_GT(gauge, 0.6);
  EXPECT_GT(image, 0.6);
}

}  // namespace
}  // namespace palpate
