// Stiffness of real objects between a gel and a second finger: is their known order found? The recordings are
// not part of the repository; the test says loudly when it is skipped.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "engine/measure/force.h"
#include "tests/recordings/wedge_clips.h"
#include "tests/support/csv_table.h"
#include "tests/support/text_file.h"

namespace palpate {
namespace {

/// From the softest to the stiffest.
constexpr std::array kObjects = {"foam_brick", "orange_ball_softest", "green_ball_softer",
                                 "purple_ball_hardest", "golf_ball"};

class ModulusRecordings : public WedgeClips {
 protected:
  ModulusRecordings() : WedgeClips("MODULUS NOT CHECKED ON REAL OBJECTS") {}
  /// One column of a clip's table, by frame: 1 the gauge's force, N, 2 the gripper's width, mm.
  static std::vector<double> column(const std::string& clip, size_t wanted) {
    const Table table(slurp(folder() / (clip + ".csv")));
    return table.numbers(table.columns.at(wanted));
  }
  /// Force over the way that the gripper closes while it closes, between 2 and 20 N, N/mm. The contacts reach
  /// the gel's border and are wider than half of the balls' radius, where a modulus is refused; the order of
  /// stiffness needs none.
  static double stiffness(const std::vector<double>& force_N, const std::vector<double>& width_mm) {
    const auto peak = std::max_element(force_N.begin(), force_N.end()) - force_N.begin();
    double n = 0, sf = 0, sw = 0, sff = 0, sfw = 0;
    for (size_t i = 0; i <= static_cast<size_t>(peak) && i < width_mm.size(); ++i) {
      const double f = force_N[i];
      if (!(f > 2) || f > 20) continue;
      ++n;
      sf += f;
      sw += width_mm[i];
      sff += f * f;
      sfw += f * width_mm[i];
    }
    return -(n * sff - sf * sf) / (n * sfw - sf * sw);
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
  std::printf("object, trial              N/mm by the gauge   by the image alone\n");
  for (size_t i = 0; i < recordings.size(); ++i) {
    // The image's force is calibrated on the other objects' presses alone.
    std::vector<GaugedRecording> others;
    for (size_t k = 0; k < recordings.size(); ++k)
      if (k / 2 != i / 2) others.push_back(recordings[k]);
    const ForceCalibration calibration = calibrate_force(std::move(others), {}, true).choice.calibration;
    ForceHistory history;
    std::vector<double> image;
    for (const GaugedFrame& f : recordings[i].frames)
      image.push_back(std::max(0.0, history.update(calibration, force_features(f.touch)).value));
    const std::string clip = std::string(kObjects[i / 2]) + (i % 2 ? "_2" : "_1");
    // Gauge and gripper are read late by the same time; the picture is not.
    const std::vector<double> late_mm = column(clip, 2);
    std::vector<double> width_mm;
    const GaugedFrame& last = recordings[i].frames.back();
    const double lag = recordings[i].offset_s * static_cast<double>(last.touch.sequence) / last.time_s;
    for (size_t k = 0; k < recordings[i].frames.size(); ++k) {
      const double at =
          std::clamp(static_cast<double>(k) - lag, 0.0, static_cast<double>(late_mm.size()) - 1.001);
      const auto before = static_cast<size_t>(at);
      const double t = at - static_cast<double>(before);
      width_mm.push_back(late_mm[before] + t * (late_mm[before + 1] - late_mm[before]));
    }
    known.push_back(static_cast<double>(i / 2));
    by_gauge.push_back(stiffness(column(clip, 1), late_mm));
    by_image.push_back(stiffness(image, width_mm));
    std::printf("%-26s %17.2f %20.2f\n", clip.c_str(), by_gauge.back(), by_image.back());
  }
  const double gauge = spearman(known, by_gauge), image = spearman(known, by_image);
  std::printf("rank correlation over all ten: %.2f with the gauge, %.2f by the image alone\n", gauge, image);
  EXPECT_GT(gauge, 0.9);
  EXPECT_GT(image, 0.7);
}

}  // namespace
}  // namespace palpate
