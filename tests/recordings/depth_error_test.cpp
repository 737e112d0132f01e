// Standard errors of depth on real gels: intervals of presses that calibration did not see, in four parts in
// turn.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "capture/calibrate/photometric/presses.h"
#include "capture/open_source.h"
#include "engine/calibrate/photometric/fit.h"
#include "palpate/pipeline.h"
#include "tests/support/recordings.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

/// Presses whose intervals hold the truth.
struct Held {
  int presses = 0, middle = 0, extrapolated = 0;
  double pixels = 0, pixels_held = 0, share = 0;

  void add(const Held& other) {
    presses += other.presses, middle += other.middle, extrapolated += other.extrapolated;
    pixels += other.pixels, pixels_held += other.pixels_held, share += other.share;
  }
};

class DepthErrorRecordings : public RecordingsTest {
 protected:
  DepthErrorRecordings() : RecordingsTest("ERRORS OF DEPTH NOT CHECKED ON REAL GELS") {}

  /// A colour gel as far as its pictures show it.
  static Sensor gel(const fs::path& background, double pitch_mm, bool markers) {
    Sensor s;
    s.channels = 3;
    s.signal = Signal::Either;
    s.threshold_gray = 8;
    s.background.image = background.string();
    s.pitch_mm_per_px = pitch_mm;
    if (markers) s.skin = SkinPattern{};
    return s;
  }

  /// Depth against the cap of the ball within 0.8 of the circle, where the pad is known to follow it.
  static Held judge(const Result& result, const BallPress& press, double pitch_mm) {
    const SurfaceSummary& s = *result.touch.surface;
    const double known_px = PhotometricFit::kJudgedShare * press.ball.radius_px;
    const auto cap_mm = [&](double r_px) {
      return std::sqrt(std::pow(press.shape.radius_mm, 2) - std::pow(r_px * pitch_mm, 2));
    };
    const std::span<const float> depth_mm = result.depth_mm();
    double middle = 0, in_middle = 0, rim = 0, on_rim = 0, mean = 0;
    std::vector<double> errors;
    const FrameFormat& f = press.frame.format;
    for (uint32_t y = 0; y < f.height; ++y)
      for (uint32_t x = 0; x < f.width; ++x) {
        const size_t i = size_t{y} * f.width + x;
        const double r_px = std::hypot(x - press.ball.center_x_px, y - press.ball.center_y_px);
        if (r_px > known_px || (!press.mask.empty() && press.mask[i] != 0)) continue;
        const double error = double{depth_mm[i]} - cap_mm(r_px);
        errors.push_back(error);
        mean += error;
        if (r_px < 0.3 * known_px) middle += error, ++in_middle;
        if (r_px > 0.85 * known_px) rim += error, ++on_rim;
      }
    mean /= static_cast<double>(errors.size());
    Held held{.presses = 1};
    const double interval_mm = 1.96 * s.depth_sd_mm;
    held.middle = in_middle == 0 || std::abs(middle / in_middle - rim / on_rim) <= interval_mm;
    held.extrapolated = s.validity == Validity::Extrapolated;
    held.share =
        static_cast<double>(s.extrapolated_px.value_or(0)) * pitch_mm * pitch_mm / s.dented_mm2.value_or(1);
    held.pixels = 1;
    held.pixels_held = static_cast<double>(std::ranges::count_if(
                           errors, [&](double e) { return std::abs(e - mean) <= interval_mm; })) /
                       static_cast<double>(errors.size());
    return held;
  }

  /// By the fit of the presses that `wanted` names.
  template <typename Wanted>
  static Pipeline calibrated(Sensor sensor, const BallPresses& presses, const Wanted& wanted) {
    PhotometricFit fit(presses.format, sensor.pitch_mm_per_px);
    for (size_t i = 0; i < presses.presses.size(); ++i) {
      const BallPress& p = presses.presses[i];
      if (wanted(i))
        fit.add_ball(p.frame, presses.backgrounds[i], p.ball.center_x_px, p.ball.center_y_px,
                     p.ball.radius_px, p.shape.radius_mm, p.label, p.mask);
    }
    sensor.reading = SurfaceReading::Photometric;
    sensor.photometric = fit.solve(1, NormalModel::Best).calibration;
    PipelineOptions options;
    options.outputs = Output::Force | Output::Contacts | Output::Surface;
    options.solver = SurfaceSolver::Best;
    options.separate = true;
    return {context(), for_rectified_frames(sensor), presses.format, options};
  }

  /// Each quarter of `presses` by the fit of the others.
  static Held in_quarters(const char* name, const Sensor& sensor, const BallPresses& presses) {
    constexpr size_t kParts = 4;
    Held held;
    for (size_t part = 0; part < kParts; ++part) {
      Pipeline pipeline = calibrated(sensor, presses, [&](size_t i) { return i % kParts != part; });
      for (size_t i = part; i < presses.presses.size(); i += kParts) {
        pipeline.set_background(presses.backgrounds[i]);
        held.add(
            judge(pipeline.process(presses.presses[i].frame), presses.presses[i], sensor.pitch_mm_per_px));
      }
    }
    std::printf("%-14s %2d presses: middles held %2d, pixels %.3f; extrapolated %d, of what is dented %.3f\n",
                name, held.presses, held.middle, held.pixels_held / held.pixels, held.extrapolated,
                held.share / held.presses);
    return held;
  }
  static BallPresses listed(const std::string& table, const std::string& folder, const Sensor& sensor) {
    return read_presses(fs::path(PALPATE_SOURCE_DIR) / "capture/sensors" / (table + "_presses.csv"),
                        recordings_folder() / folder, sensor, true);
  }
  static Sensor sim2real() {
    return gel(recordings_folder() / "gelsight-sim2real/background_real.png", 0.059259, false);
  }
};

TEST_F(DepthErrorRecordings, IntervalsHoldThePressesLeftOut) {
  const fs::path data = recordings_folder(), mini = data / "gelsight_mini";
  const auto found = [](const fs::path& folder, const Sensor& sensor, double ball_mm) {
    PressSearch search;
    search.shape = PressedShape::ball(ball_mm);
    return find_presses(folder.string(), sensor, search, 4);
  };
  Held without_markers, with_markers;
  const Sensor a = gel(mini / "pad_a/background.png", 0.0634, false);
  without_markers.add(in_quarters("Mini, 6.31 mm", a, found(mini / "pad_a/ball_6.31mm", a, 3.155)));
  without_markers.add(in_quarters("Mini, 9.5 mm", a, found(mini / "pad_a/ball_9.5mm", a, 4.75)));
  const Sensor s = sim2real();
  without_markers.add(in_quarters("Sim2real", s, listed("gelsight_sim2real", "gelsight-sim2real", s)));
  const Sensor b = gel(mini / "pad_b/background.png", 0.0634, true);
  with_markers.add(in_quarters("Mini, markers", b, found(mini / "pad_b/ball_5mm", b, 2.5)));
  const Sensor g = gel(data / "gelslim-balls/ref.jpg", 0.10577, true);
  with_markers.add(in_quarters("GelSlim", g, listed("gelslim_balls", "gelslim-balls", g)));
  for (const Held& held : {without_markers, with_markers}) {
    EXPECT_GE(held.middle, 0.9 * held.presses);
    EXPECT_GE(held.pixels_held, 0.9 * held.pixels);
    EXPECT_LE(held.extrapolated, 0.2 * held.presses) << "the outermost, of which the others saw too little";
  }
}

// Commanded depths, from rest, of the ball of the calibration and of one that it never saw. Sharper shapes
// are read too shallow by more than balls let expect.
TEST_F(DepthErrorRecordings, IntervalsHoldCommandedDepthsOfBalls) {
  const Sensor sensor = sim2real();
  const BallPresses presses = listed("gelsight_sim2real", "gelsight-sim2real", sensor);
  Pipeline pipeline = calibrated(sensor, presses, [](size_t) { return true; });
  pipeline.set_background(presses.backgrounds.front());
  for (const std::string shape : {"sphere", "large_sphere", "prism", "triangle"}) {
    int held = 0;
    for (const char* commanded : {"0.25", "0.5", "0.75", "1.0"}) {
      const fs::path file =
          recordings_folder() / "gelsight-sim2real" / (shape + "_" + commanded + "_real.png");
      Frame frame;
      EXPECT_TRUE(open_source(file.string(), sensor)->next(frame)) << file;
      const SurfaceSummary s = *pipeline.process(frame).touch.surface;
      const double error_mm = s.depth_max_mm - std::stod(commanded);
      held += std::abs(error_mm) <= 1.96 * s.depth_sd_mm;
      std::printf("%-12s %4s mm: %.3f +- %.3f mm, off by %+.1f standard errors\n", shape.c_str(), commanded,
                  s.depth_max_mm, s.depth_sd_mm, error_mm / s.depth_sd_mm);
      EXPECT_GT(s.depth_sd_mm, 0.02 * s.depth_max_mm);
      EXPECT_LT(s.depth_sd_mm, 0.08 * s.depth_max_mm);
    }
    EXPECT_TRUE(held == 4 || !shape.ends_with("sphere")) << shape << ": " << held << " of 4";
  }
}

}  // namespace
}  // namespace palpate
