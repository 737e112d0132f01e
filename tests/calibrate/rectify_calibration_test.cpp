// Scale, lens and flat field: fitted to pictures of known truth, and the result of rectifying with them.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <random>

#include "capture/calibrate/background.h"
#include "capture/calibrate/frame/flat.h"
#include "capture/calibrate/frame/scale.h"
#include "capture/files/images/images.h"
#include "capture/files/output_file.h"
#include "capture/open_source.h"
#include "engine/calibrate/grid_fit.h"
#include "palpate/error.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

class RectifyCalibration : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("palpate-rectify-" + std::to_string(getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path write(const Frame& frame, const std::string& name) const {
    write_whole(folder_ / name, encode_image(frame, ".png"));
    return folder_ / name;
  }
  fs::path folder_;
};

constexpr uint32_t kWidth = 480, kHeight = 360;
constexpr double kFocal = 480, kTruePitch_mm = 0.05, kSpacing_mm = 2;

/// A camera with barrel distortion that looks at a grid turned by 2 degrees and a little askew.
struct Lensed {
  double k1 = -0.25, k2 = 0.08;

  /// Place on the grid, mm from its middle, that pixel (x, y) shows.
  std::array<double, 2> on_grid(double x, double y) const {
    const double u = (x - 0.5 * (kWidth - 1)) / kFocal, v = (y - 0.5 * (kHeight - 1)) / kFocal;
    double p = u, q = v;
    for (int i = 0; i < 40; ++i) {
      const double r2 = p * p + q * q, radial = 1 + r2 * (k1 + r2 * k2);
      p = u / radial;
      q = v / radial;
    }
    const double turn = 0.035, w = 1 + 0.04 * p - 0.03 * q, scale = kFocal * kTruePitch_mm / w;
    return {scale * (p * std::cos(turn) - q * std::sin(turn)),
            scale * (p * std::sin(turn) + q * std::cos(turn))};
  }
  Frame picture(int columns, int rows, bool chessboard) const {
    Frame frame;
    frame.reshape({kWidth, kHeight, 1, 8});
    std::mt19937 random(7);
    std::normal_distribution<double> noise(0, 1.5);
    constexpr int kFine = 4;
    for (uint32_t y = 0; y < kHeight; ++y)
      for (uint32_t x = 0; x < kWidth; ++x) {
        double dark = 0;
        for (int j = 0; j < kFine; ++j)
          for (int i = 0; i < kFine; ++i) {
            const auto [gx, gy] = on_grid(x + (i + 0.5) / kFine - 0.5, y + (j + 0.5) / kFine - 0.5);
            // In spacings from the first point.
            const double a = gx / kSpacing_mm + 0.5 * (columns - 1), b = gy / kSpacing_mm + 0.5 * (rows - 1);
            if (chessboard) {
              const bool on = a > -1 && a < columns && b > -1 && b < rows;
              dark += on && (static_cast<int>(std::floor(a)) + static_cast<int>(std::floor(b))) % 2 == 0;
            } else {
              const double i0 = std::round(a), j0 = std::round(b);
              dark += i0 >= 0 && i0 < columns && j0 >= 0 && j0 < rows && std::hypot(a - i0, b - j0) < 0.25;
            }
          }
        const double light = 170 - 40 * std::pow((x - 240.0) / 240, 2);
        const double gray = light * (1 - 0.6 * dark / (kFine * kFine)) + noise(random);
        frame.set(0, x, y, static_cast<uint32_t>(std::clamp(std::lround(gray), 0l, 255l)));
      }
    return frame;
  }
};

TEST_F(RectifyCalibration, GridGivesLensAndScale) {
  const Lensed camera;
  for (const auto& [pattern, columns, rows] :
       {std::tuple{GridPattern::Dots, 9, 7}, {GridPattern::Chessboard, 9, 6}}) {
    const Frame picture = camera.picture(columns, rows, pattern == GridPattern::Chessboard);
    const auto view = find_grid(picture, nullptr, pattern, columns, rows, kSpacing_mm);
    ASSERT_TRUE(view.has_value()) << columns;
    const GridFit fit = fit_grid({*view}, kWidth, kHeight);
    const PadFrame pad = pad_frame(fit, *view, kWidth, kHeight, 0.002);
    const auto a = camera.on_grid(0.5 * (kWidth - 1) - 0.5, 0.5 * (kHeight - 1)),
               b = camera.on_grid(0.5 * (kWidth - 1) + 0.5, 0.5 * (kHeight - 1)),
               c = camera.on_grid(0.5 * (kWidth - 1), 0.5 * (kHeight - 1) - 0.5),
               d = camera.on_grid(0.5 * (kWidth - 1), 0.5 * (kHeight - 1) + 0.5);
    const double truth = std::sqrt(std::abs((b[0] - a[0]) * (d[1] - c[1]) - (b[1] - a[1]) * (d[0] - c[0])));
    std::printf(
        "%s: k1 %.4f k2 %.4f (true %.2f %.2f), %d terms, residual %.3f px, held out %.3f px, without lens "
        "%.3f px, pitch %.6f +- %.6f (true %.6f)\n",
        pattern == GridPattern::Dots ? "dots" : "chessboard", fit.lens.distortion[0], fit.lens.distortion[1],
        camera.k1, camera.k2, fit.terms, fit.lens.residual_px, fit.held_out_px, fit.plain_px,
        pad.pitch_mm_per_px, pad.pitch_sd_mm_per_px, truth);
    EXPECT_GE(fit.terms, 1);
    EXPECT_LT(fit.lens.residual_px, 0.15);
    EXPECT_GT(fit.plain_px, 3 * fit.held_out_px);
    EXPECT_NEAR(pad.pitch_mm_per_px, truth, 0.003 * truth);
    EXPECT_LT(std::abs(pad.pitch_mm_per_px - truth), 3 * pad.pitch_sd_mm_per_px);

    // Rectified, every point lies where it is on the grid, at the pitch.
    Sensor sensor;
    sensor.name = "lensed";
    sensor.pitch_mm_per_px = pad.pitch_mm_per_px;
    sensor.quad_px = pad.quad_px;
    sensor.size_px = pad.size_px;
    if (fit.terms > 0) sensor.lens = fit.lens;
    const fs::path file = write(picture, "grid.png");
    save_sensor(sensor, folder_ / "sensor.json");
    const auto source = open_source(file.string(), load_sensor(folder_ / "sensor.json"));
    Frame straight;
    ASSERT_TRUE(source->next(straight));
    EXPECT_EQ(straight.format.width, pad.size_px[0]);
    const auto again = find_grid(straight, nullptr, pattern, columns, rows, kSpacing_mm);
    ASSERT_TRUE(again.has_value());
    double square = 0;
    int n = 0;
    const auto distance = [&](size_t i, size_t j) {
      return std::hypot(again->seen_px[i][0] - again->seen_px[j][0],
                        again->seen_px[i][1] - again->seen_px[j][1]);
    };
    const auto across = static_cast<size_t>(columns);
    for (size_t i = 0; i < across * static_cast<size_t>(rows); ++i) {
      if (i % across + 1 < across)
        square += std::pow(distance(i, i + 1) * pad.pitch_mm_per_px - kSpacing_mm, 2), ++n;
      if (i / across + 1 < static_cast<size_t>(rows))
        square += std::pow(distance(i, i + across) * pad.pitch_mm_per_px - kSpacing_mm, 2), ++n;
    }
    std::printf("  rectified: neighbours %.4f mm RMS from their spacing\n", std::sqrt(square / n));
    EXPECT_LT(std::sqrt(square / n), 0.012);
  }
  // No grid, or another one.
  Frame even;
  even.reshape({kWidth, kHeight, 1, 8});
  EXPECT_FALSE(find_grid(even, nullptr, GridPattern::Dots, 9, 7, 2).has_value());
  EXPECT_FALSE(find_grid(camera.picture(9, 7, false), nullptr, GridPattern::Chessboard, 9, 7, 2).has_value());
  EXPECT_THROW(fit_grid({}, kWidth, kHeight), Error);
}

TEST_F(RectifyCalibration, LensAloneKeepsTheSize) {
  Lens none;
  none.fx_px = none.fy_px = 300;
  none.cx_px = 50;
  none.cy_px = 40;
  Sensor sensor;
  sensor.name = "lens";
  sensor.pitch_mm_per_px = 1;
  sensor.lens = none;
  Frame frame, read;
  frame.reshape({101, 81, 1, 8});
  for (uint32_t y = 0; y < 81; ++y)
    for (uint32_t x = 0; x < 101; ++x) frame.set(0, x, y, x + y);
  const fs::path file = write(frame, "plain.png");
  ASSERT_TRUE(open_source(file.string(), sensor)->next(read));
  EXPECT_EQ(read.bytes, frame.bytes) << "no distortion changes nothing";
  sensor.lens->distortion = {-2, 0, 0, 0, 0};
  ASSERT_TRUE(open_source(file.string(), sensor)->next(read));
  EXPECT_EQ(read.at(0, 50, 40), 90u) << "the middle stays";
  // Right of the middle by u focal lengths the picture comes from u (1 + k1 u^2).
  const double u = 50.0 / 300, from = 50 + 300 * u * (1 - 2 * u * u);
  EXPECT_NEAR(read.at(0, 100, 40), from + 40, 1.01);
}

TEST_F(RectifyCalibration, FlatFieldEvensTheLight) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 2);
  const auto light = [](double x, double y) {
    return 150 * (1 - 0.5 * (std::pow((x - 90) / 160, 2) + std::pow((y - 50) / 160, 2)));
  };
  std::vector<Frame> frames(12);
  for (size_t i = 0; i < frames.size(); ++i) {
    frames[i].reshape({160, 120, 1, 8});
    for (uint32_t y = 0; y < 120; ++y)
      for (uint32_t x = 0; x < 160; ++x)
        frames[i].set(
            0, x, y, static_cast<uint32_t>(std::lround(std::clamp(light(x, y) + noise(random), 0.0, 254.0))));
    frames[i].set(0, 30, 30, 255);
  }
  Sensor sensor;
  sensor.name = "uneven";
  sensor.pitch_mm_per_px = 0.1;
  const FlatFit fit = fit_flat(frames, nullptr, {}, sensor);
  std::printf("unevenness %.2f %% to %.2f %%, factors %.2f to %.2f\n", 100 * fit.uneven_before,
              100 * fit.uneven_after, fit.least, fit.most);
  EXPECT_GT(fit.uneven_before, 0.04);
  EXPECT_LT(fit.uneven_after, 0.01);
  sensor.flat = FlatField{write(fit.image, "flat.png").string(), fit.gain, {}};
  save_sensor(sensor, folder_ / "sensor.json");
  const Sensor loaded = load_sensor(folder_ / "sensor.json");
  Frame read;
  const fs::path file = write(frames[5], "frame.png");
  ASSERT_TRUE(open_source(file.string(), loaded)->next(read));
  EXPECT_EQ(read.at(0, 30, 30), 255u) << "saturated stays saturated";
  double sum = 0, square = 0;
  for (uint32_t y = 0; y < 120; ++y)
    for (uint32_t x = 0; x < 160; ++x) {
      if (x == 30 && y == 30) continue;
      const double expected = frames[5].at(0, x, y) * fit.gain * fit.image.at(0, x, y);
      ASSERT_NEAR(read.at(0, x, y), std::min(expected, 255.0), 0.51) << x << ", " << y;
      sum += read.at(0, x, y) / (160.0 * 120 - 1);
      square += std::pow(read.at(0, x, y), 2) / (160.0 * 120 - 1);
    }
  EXPECT_LT(std::sqrt(square - sum * sum), 4) << "noise only";
  // Another size of frame is another camera mode.
  Frame small;
  small.reshape({80, 60, 1, 8});
  EXPECT_THROW(open_source(write(small, "small.png").string(), loaded), Error);
  EXPECT_THROW(fit_flat({frames[0]}, nullptr, {}, sensor), Error);
  Frame black;
  black.reshape({160, 120, 1, 8});
  EXPECT_THROW(fit_flat({black, black}, nullptr, {}, sensor), Error);
}

TEST_F(RectifyCalibration, BackgroundLeavesOutWhatTouches) {
  std::mt19937 random(9);
  std::normal_distribution<double> noise(0, 2);
  Sensor sensor;
  sensor.name = "pad";
  sensor.pitch_mm_per_px = 0.1;
  const auto frames_with = [&](int touched, double drift) {
    std::vector<Frame> frames(20);
    for (int i = 0; i < 20; ++i) {
      Frame& frame = frames[static_cast<size_t>(i)];
      frame.reshape({96, 64, 1, 8});
      for (uint32_t y = 0; y < 64; ++y)
        for (uint32_t x = 0; x < 96; ++x) {
          const bool press = i >= 20 - touched && std::hypot(x - 40.0, y - 30.0) < 10;
          frame.set(0, x, y,
                    static_cast<uint32_t>(
                        std::lround(60 + x * 0.3 + drift * i + (press ? 50 : 0) + noise(random))));
        }
    }
    return frames;
  };
  const UntouchedImage quiet = untouched_image(frames_with(0, 0), sensor);
  EXPECT_EQ(quiet.left_out, 0u);
  EXPECT_EQ(quiet.warning, "");
  EXPECT_NEAR(quiet.noise_gray, 2, 0.1);
  EXPECT_GT(quiet.threshold_gray, quiet.largest_change_gray);
  EXPECT_LT(quiet.threshold_gray, 8);
  for (uint32_t x = 0; x < 96; ++x) EXPECT_NEAR(quiet.mean.at(0, x, 20), 60 + x * 0.3, 2.5);

  const UntouchedImage touched = untouched_image(frames_with(6, 0), sensor);
  EXPECT_EQ(touched.left_out, 6u);
  EXPECT_NE(touched.warning.find("touches or moves"), std::string::npos) << touched.warning;
  EXPECT_NEAR(touched.mean.at(0, 40, 30), 72, 2.5) << "the press is not in it";
  const UntouchedImage drifting = untouched_image(frames_with(0, 0.25), sensor);
  EXPECT_NE(drifting.warning, "");
  EXPECT_THROW(untouched_image({frames_with(0, 0)[0]}, sensor), Error);
}

TEST_F(RectifyCalibration, RingAndBallGiveAScaleWithItsError) {
  Frame rest, picture;
  rest.reshape({200, 160, 1, 8});
  std::fill(rest.bytes.begin(), rest.bytes.end(), uint8_t{40});
  picture = rest;
  for (uint32_t y = 0; y < 160; ++y)
    for (uint32_t x = 0; x < 200; ++x) {
      const double r = std::hypot(x - 95.4, y - 80.7);
      const double on = std::clamp(50 - r + 0.5, 0.0, 1.0) * std::clamp(r - 40 + 0.5, 0.0, 1.0);
      picture.set(0, x, y, static_cast<uint32_t>(std::lround(40 + 120 * on)));
    }
  const Scale ring = scale_from_ring(picture, rest, 10);
  EXPECT_NEAR(ring.pitch_mm_per_px, 0.1, 0.001);
  EXPECT_LT(std::abs(ring.pitch_mm_per_px - 0.1), 2 * ring.pitch_sd_mm_per_px);
  EXPECT_THROW(scale_from_ring(rest, rest, 10), Error);

  // A half space and a rigid cut are the two ends of what a pad does: both lie within the error.
  for (const double fraction : {1.0, 2.0}) {
    std::vector<double> radii, travel = {0.2, 0.4, 0.6, 0.8};
    for (const double d : travel)
      radii.push_back(std::sqrt(fraction == 1 ? 4.0 * d : 8.0 * d - d * d) / 0.06);
    const Scale ball = scale_from_ball(radii, travel, 4);
    EXPECT_LT(std::abs(ball.pitch_mm_per_px - 0.06), 1.2 * ball.pitch_sd_mm_per_px) << ball.note;
    EXPECT_GT(ball.pitch_sd_mm_per_px, 0.05 * ball.pitch_mm_per_px);
  }
  EXPECT_THROW(scale_from_ball({20, 30}, {0.1, 0.2}, 4), Error);
  EXPECT_THROW(scale_from_ball({30, 20, 10}, {0.1, 0.2, 0.3}, 4), Error);
}

}  // namespace
}  // namespace palpate
