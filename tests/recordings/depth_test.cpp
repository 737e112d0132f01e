// Depth of real sensors, calibrated and judged as a user would: balls found in the pictures, errors on what
// the fit has not seen. The recordings are not part of the repository: the tests look for them next to it and
// say loudly when they are skipped.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "capture/calibrate/frame/markers.h"
#include "capture/calibrate/photometric/ball_verdict.h"
#include "capture/calibrate/photometric/presses.h"
#include "capture/open_source.h"
#include "engine/calibrate/ball/finder.h"
#include "engine/calibrate/light_stack.h"
#include "engine/calibrate/lookup_fit.h"
#include "engine/calibrate/photometric/fit.h"
#include "engine/pipeline/pipeline_access.h"
#include "palpate/pipeline.h"
#include "tests/support/pipelines.h"
#include "tests/support/recordings.h"
#include "tests/support/sphere.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

/// Errors of the depth over the faces of four shapes, each pressed to 0.25, 0.5, 0.75 and 1 mm.
struct ShapeErrors {
  double mean_rmse_mm = 0, worst_rmse_mm = 0;
  std::map<std::string, double> gain;  ///< read depth over commanded depth, 0.25 to 1 mm
};

class DepthRecordings : public RecordingsTest {
 protected:
  DepthRecordings() : RecordingsTest("DEPTH NOT CHECKED ON REAL SENSORS") {}

  static Frame frame_of(const fs::path& file, const Sensor& sensor) {
    Frame frame;
    const auto source = open_source(file.string(), sensor);
    EXPECT_TRUE(source->next(frame)) << file;
    return frame;
  }
  static Frame background_of(const fs::path& file, const Sensor& sensor) {
    const auto source = open_source(file.string(), sensor);
    return load_background(file.string(), sensor, *source);
  }
  static std::vector<fs::path> files(const fs::path& folder, const std::string& start) {
    std::vector<fs::path> list;
    for (const auto& entry : fs::directory_iterator(folder))
      if (entry.path().filename().string().rfind(start, 0) == 0) list.push_back(entry.path());
    std::sort(list.begin(), list.end());
    return list;
  }

  struct Depth {
    Touch touch;
    uint32_t width = 0;
    std::vector<float> mm;
    double at(int x, int y) const { return mm[static_cast<size_t>(y) * width + static_cast<size_t>(x)]; }
  };
  static Depth depth_of(const Frame& frame, const Frame& background, const Sensor& sensor) {
    PipelineOptions options;
    options.solver = SurfaceSolver::Best;
    Pipeline pipeline(context(), for_rectified_frames(sensor), frame.format, options);
    pipeline.set_background(background);
    EXPECT_TRUE(pipeline.submit(frame));
    const auto result = pipeline.wait();
    Depth depth{result->touch, frame.format.width, depth_map(*result)};
    return depth;
  }
  static ShapeErrors shape_errors(const fs::path& folder, const Sensor& sensor);
};

/// True depth of the face of a shape that was pressed to `commanded_mm`; none off the face.
std::optional<double> face_depth_mm(const std::string& shape, double commanded_mm, int x, int y,
                                    double pitch) {
  if (shape == "prism")
    return x < 172 || x > 242 || y < 114 || y > 220 ? std::nullopt : std::optional(commanded_mm);
  if (shape == "triangle") {
    const auto left_of = [&](int ax, int ay, int bx, int by) {
      return (bx - ax) * (y - ay) - (by - ay) * (x - ax) >= 0;
    };
    if (!left_of(161, 137, 212, 132) || !left_of(212, 132, 250, 193) || !left_of(250, 193, 161, 137))
      return {};
    return commanded_mm;
  }
  const bool small = shape == "sphere";
  const double ball = small ? 2.92 : 4.925, cap = ball - commanded_mm;
  const double r = std::hypot(x - (small ? 208 : 203), y - (small ? 166 : 167)) * pitch;
  if (r > 0.85 * std::sqrt(ball * ball - cap * cap)) return {};
  return std::sqrt(ball * ball - r * r) - cap;
}

/// A press whose ball was found, ready for the fit.
struct PressedBall {
  std::string name;
  Frame frame;
  FoundBall ball;
  std::vector<uint8_t> mask;
};

PhotometricFitResult fit_without(const std::vector<PressedBall>& presses, size_t without,
                                 const Frame& background, const Sensor& sensor, double ball_mm,
                                 double rest_weight) {
  PhotometricFit fit(background.format, sensor.pitch_mm_per_px);
  for (size_t i = 0; i < presses.size(); ++i) {
    if (i == without) continue;
    const PressedBall& p = presses[i];
    fit.add_ball(p.frame, background, p.ball.center_x_px, p.ball.center_y_px, p.ball.radius_px, ball_mm,
                 p.name, p.mask);
  }
  return fit.solve(rest_weight, NormalModel::Best);
}

// As a folder of them is measured: one series.
ShapeErrors DepthRecordings::shape_errors(const fs::path& folder, const Sensor& sensor) {
  constexpr const char *kShapes[] = {"sphere", "large_sphere", "prism", "triangle"},
                       *kCommanded_mm[] = {"0.25", "0.5", "0.75", "1.0"};
  const auto file_of = [&](const std::string& shape, const char* commanded) {
    return folder / (shape + "_" + commanded + "_real.png");
  };
  const Frame background = background_of(file_of(kShapes[0], kCommanded_mm[0]), sensor);
  Pipeline pipeline(context(), for_rectified_frames(sensor), background.format,
                    {.solver = SurfaceSolver::Best, .separate = true});
  pipeline.set_background(background);
  for (const char* shape : kShapes)
    for (const char* commanded : kCommanded_mm)
      PipelineAccess::look_ahead(pipeline, frame_of(file_of(shape, commanded), sensor));
  ShapeErrors errors;
  for (const std::string shape : kShapes) {
    std::vector<double> means;
    for (const char* commanded : kCommanded_mm) {
      const Frame frame = frame_of(file_of(shape, commanded), sensor);
      const Result result = pipeline.process(frame);
      EXPECT_NE(result.touch.light->state, LightState::Unknown) << shape << " " << commanded;
      const Depth map{result.touch, frame.format.width, depth_map(result)};
      double square = 0, mean = 0;
      int n = 0;
      for (int y = 0; y < static_cast<int>(frame.format.height); ++y)
        for (int x = 0; x < static_cast<int>(frame.format.width); ++x) {
          const auto truth = face_depth_mm(shape, std::stod(commanded), x, y, sensor.pitch_mm_per_px);
          if (!truth) continue;
          const double error = map.at(x, y) - *truth;
          square += error * error;
          mean += error;
          ++n;
        }
      const double rmse = std::sqrt(square / n);
      std::printf("%-14s %4s mm: RMSE %.3f, mean %+.3f\n", shape.c_str(), commanded, rmse, mean / n);
      errors.mean_rmse_mm += rmse / 16;
      errors.worst_rmse_mm = std::max(errors.worst_rmse_mm, rmse);
      means.push_back(mean / n);
    }
    errors.gain[shape] = 1 + (means.back() - means.front()) / 0.75;
  }
  std::printf("mean RMSE %.4f mm, worst %.3f mm\n", errors.mean_rmse_mm, errors.worst_rmse_mm);
  return errors;
}

TEST_F(DepthRecordings, GelShapesAfterCalibrationOnFoundBalls) {
  const fs::path folder = recordings_folder() / "gelsight-sim2real";
  Sensor sensor = load_sensor(shipped_sensor("gelsight_sim2real"));
  sensor.background.image = (folder / "background_real.png").string();
  const double pitch = sensor.pitch_mm_per_px, ball_mm = 2.92;
  std::vector<PressedBall> presses;
  Frame background;
  for (const fs::path& file : files(folder, "calib_")) {
    if (file.extension() != ".png") continue;
    PressedBall p{file.filename().string(), frame_of(file, sensor), {}, {}};
    if (presses.empty()) background = background_of(file, sensor);
    p.ball = find_ball(p.frame, background, {}, {PressedShape::ball(ball_mm), pitch, sensor.threshold_gray});
    EXPECT_TRUE(p.ball.good()) << p.name << ": " << p.ball.refusal;
    presses.push_back(std::move(p));
  }
  ASSERT_EQ(presses.size(), 22u);
  const PhotometricFitResult fit = fit_without(presses, presses.size(), background, sensor, ball_mm, 10);
  std::printf("balls held out: depth %.4f mm RMS, normals %.2f deg, by %s\n", fit.depth_rmse_mm,
              fit.normal_angle_deg, fit.model().order.name);
  EXPECT_LT(fit.depth_rmse_mm, 0.04);
  EXPECT_LT(fit.normal_angle_deg, 4.9);
  sensor.photometric = fit.calibration;

  const ShapeErrors errors = shape_errors(folder, sensor);
  EXPECT_LT(errors.worst_rmse_mm, 0.075);
  EXPECT_LT(errors.mean_rmse_mm, 0.040);
}

TEST_F(DepthRecordings, GelShapesHaveTheirDepthByTheShippedSensorFile) {
  const fs::path folder = recordings_folder() / "gelsight-sim2real";
  Sensor sensor = load_sensor(shipped_sensor("gelsight_sim2real"));
  sensor.background.image = (folder / "background_real.png").string();
  const ShapeErrors errors = shape_errors(folder, sensor);
  EXPECT_LT(errors.worst_rmse_mm, 0.08);
  EXPECT_LT(errors.mean_rmse_mm, 0.040);
  // Whatever the zero of the commanded depth: 0.75 mm more of it must be read as 0.75 mm more.
  for (const auto& [shape, gain] : errors.gain) {
    EXPECT_GT(gain, 0.9) << shape;
    EXPECT_LT(gain, 1.2) << shape;
  }
}

// The diameter where the radius belongs, by the shading alone; the right radius raises no doubt.
TEST_F(DepthRecordings, ADiameterForARadiusIsRefused) {
  for (const auto& [name, from, prefix, radius_mm] :
       {std::tuple{"gelslim_balls", "gelslim-balls", "sample_", 3.8},
        {"gelsight_sim2real", "gelsight-sim2real", "calib_", 2.92}}) {
    const fs::path data = recordings_folder() / from, only = fs::path(testing::TempDir()) / name;
    fs::remove_all(only);
    fs::create_directories(only);
    for (const fs::path& file : files(data, prefix))
      if (file.extension() != ".txt") fs::create_symlink(file, only / file.filename());
    Sensor sensor = load_sensor(shipped_sensor(name));
    sensor.background.image =
        (data / (name == std::string("gelslim_balls") ? "ref.jpg" : "background_real.png")).string();
    for (const double stated_mm : {radius_mm, 2 * radius_mm}) {
      PressSearch search;
      search.shape = PressedShape::ball(stated_mm);
      const BallPresses found = find_presses(only.string(), sensor, search, 4);
      const BallEvidence evidence = evidence_of(found, sensor);
      const BallDoubt doubt = doubt_of(evidence, {.unsaid_mm = stated_mm});
      std::printf("%s as %g mm: darkens %.2f +- %.2f times as stated, nine of ten more than %.2f\n", name,
                  stated_mm, evidence.shading, evidence.shading_sd, evidence.least_shading);
      EXPECT_EQ(doubt.refused, stated_mm > radius_mm) << name << " " << doubt.line;
      EXPECT_EQ(doubt.line.empty(), stated_mm == radius_mm) << name << " " << doubt.line;
    }
    fs::remove_all(only);
  }
}

TEST_F(DepthRecordings, MarkedGelBallsHeldOut) {
  const fs::path folder = recordings_folder() / "gelslim-balls";
  Sensor sensor = load_sensor(shipped_sensor("gelslim_balls"));
  sensor.background.image = (folder / "ref.jpg").string();
  const double ball_mm = 3.8, pitch = sensor.pitch_mm_per_px;
  std::vector<PressedBall> presses;
  Frame background;
  std::vector<uint8_t> rest_mask;
  double widest_px = 0;
  for (const fs::path& file : files(folder, "sample_")) {
    PressedBall p{file.filename().string(), frame_of(file, sensor), {}, {}};
    if (presses.empty()) {
      background = background_of(file, sensor);
      rest_mask = find_markers(background, sensor);
      ASSERT_FALSE(rest_mask.empty());
    }
    p.mask = either(find_markers(p.frame, sensor), rest_mask);
    p.ball =
        find_ball(p.frame, background, p.mask, {PressedShape::ball(ball_mm), pitch, sensor.threshold_gray});
    EXPECT_TRUE(p.ball.good()) << p.name << ": " << p.ball.refusal;
    widest_px = std::max(widest_px, p.ball.radius_px);
    presses.push_back(std::move(p));
  }
  ASSERT_EQ(presses.size(), 10u);
  // Bound of the scale from the ball itself: no contact is wider than it.
  std::printf("widest contact %.1f px: pitch below %.4f mm/px (the authors' %.5f)\n", widest_px,
              ball_mm / widest_px, pitch);
  EXPECT_LT(pitch, ball_mm / widest_px);
  const PhotometricFitResult all = fit_without(presses, presses.size(), background, sensor, ball_mm, 1);
  std::printf("held out: depth %.4f mm RMS, gain %.3f, normals %.2f deg, by %s\n", all.depth_rmse_mm,
              all.depth_gain, all.normal_angle_deg, all.model().order.name);
  EXPECT_LT(all.depth_rmse_mm, 0.15);
  EXPECT_LT(all.normal_angle_deg, 9.5);

  // Curvature, each ball by the calibration of the nine others, outside of the markers.
  double mean = 0, square = 0;
  for (size_t i = 0; i < presses.size(); ++i) {
    const PressedBall& p = presses[i];
    const PhotometricFitResult fit = fit_without(presses, i, background, sensor, ball_mm, 1);
    Sensor held_out = sensor;
    held_out.photometric = fit.calibration;
    const Depth map = depth_of(p.frame, background, held_out);
    std::vector<double> depth;
    std::vector<std::array<double, 2>> at;
    for (int y = 0; y < 320; ++y)
      for (int x = 0; x < 427; ++x) {
        const double dx = x - p.ball.center_x_px, dy = y - p.ball.center_y_px;
        if (std::hypot(dx, dy) > 0.9 * p.ball.radius_px ||
            p.mask[static_cast<size_t>(y) * 427 + static_cast<size_t>(x)])
          continue;
        depth.push_back(map.at(x, y));
        at.push_back({dx * pitch, dy * pitch});
      }
    const double radius = sphere_radius_mm(depth, at);
    std::printf("%-14s sphere of %.2f mm, curvature error %+.3f per mm\n", p.name.c_str(), radius,
                1 / radius - 1 / ball_mm);
    mean += radius / 10;
    square += std::pow(1 / radius - 1 / ball_mm, 2) / 10;

    // Round: the depth half way out is the same on every side, compared with the depth of the dimple.
    const auto depth_at = [&](double way, double angle) {
      return map.at(static_cast<int>(std::round(p.ball.center_x_px + way * std::cos(angle))),
                    static_cast<int>(std::round(p.ball.center_y_px + way * std::sin(angle))));
    };
    double least = 1e9, most = -1e9;
    for (int k = 0; k < 16; ++k) {
      const double z = depth_at(0.6 * p.ball.radius_px, 2 * std::numbers::pi * k / 16);
      least = std::min(least, z);
      most = std::max(most, z);
    }
    EXPECT_GT(depth_at(0, 0), 0.3) << p.name;
    EXPECT_LT(most - least, 0.35 * depth_at(0, 0)) << p.name;
  }
  std::printf("mean radius %.2f mm (true %.1f), curvature error %.3f per mm RMS of %.3f\n", mean, ball_mm,
              std::sqrt(square), 1 / ball_mm);
  EXPECT_NEAR(mean, ball_mm, 0.4);
  EXPECT_LT(std::sqrt(square), 0.06);
}

TEST_F(DepthRecordings, GrayGelBallOnTheOtherHalf) {
  for (const auto& [unit, pitch] :
       {std::pair{"sensor_1", 0.0510151}, {"sensor_2", 0.049995}, {"sensor_123", 0.06378904}}) {
    const fs::path folder = recordings_folder() / "9dtact" / unit / "depth_calibration";
    Sensor sensor = load_sensor(shipped_sensor("9dtact"));
    sensor.pitch_mm_per_px = pitch;
    sensor.size_px = {};
    sensor.reading = SurfaceReading::None;
    sensor.background.image = (folder / "rectify_crop_ref.png").string();
    const fs::path file = folder / "rectify_crop_sample.png";
    const Frame frame = frame_of(file, sensor), background = background_of(file, sensor);
    const FoundBall ball =
        find_gray_ball(frame, background, {}, Signal::Darker, {PressedShape::ball(4.0), pitch, 3});
    ASSERT_TRUE(ball.good()) << unit << ": " << ball.refusal;
    LookupFit fit(pitch);
    fit.add_ball(frame, background, Signal::Darker, ball.center_x_px, ball.center_y_px, ball.radius_px, 4.0,
                 unit);
    const LookupFitResult result = fit.solve();
    std::printf("%-11s contact %.1f px, %.3f mm deep: depth %.4f mm RMS on sectors not used\n", unit,
                ball.radius_px, result.presses[0].largest_depth_mm, result.depth_rmse_mm);
    EXPECT_LT(result.depth_rmse_mm, 0.09) << unit;

    // The engine says the same of the whole ball as the table does.
    sensor.reading = SurfaceReading::Lookup;
    sensor.lookup = result.calibration;
    const Depth map = depth_of(frame, background, sensor);
    double square = 0;
    int n = 0;
    const double rim_mm = ball.radius_px * pitch, rim = std::sqrt(16 - rim_mm * rim_mm);
    for (int y = 0; y < static_cast<int>(frame.format.height); ++y)
      for (int x = 0; x < static_cast<int>(frame.format.width); ++x) {
        const double r = std::hypot(x - ball.center_x_px, y - ball.center_y_px) * pitch;
        if (r > rim_mm) continue;
        square += std::pow(map.at(x, y) - (std::sqrt(16 - r * r) - rim), 2);
        ++n;
      }
    std::printf("%-11s engine: %.4f mm RMS over the ball, deepest %.3f mm\n", unit, std::sqrt(square / n),
                map.touch.surface->depth_max_mm);
    EXPECT_LT(std::sqrt(square / n), 0.09) << unit;
  }
}

/// The vendor's height map: a text line, a comment, columns and rows, four lengths, then heights in mm.
std::vector<float> read_height_map(const fs::path& file, uint32_t& width, uint32_t& height) {
  std::ifstream in(file, std::ios::binary);
  in.seekg(32);
  for (char c = 1; c != 0 && in.get(c);) {
  }
  in.read(reinterpret_cast<char*>(&width), 4);
  in.read(reinterpret_cast<char*>(&height), 4);
  in.seekg(16, std::ios::cur);
  std::vector<float> heights(size_t{width} * height);
  in.read(reinterpret_cast<char*>(heights.data()),
          static_cast<std::streamsize>(heights.size() * sizeof(float)));
  EXPECT_TRUE(in.good()) << file;
  return heights;
}

constexpr double kGroovePitch_mm = 0.027458113509339;

/// RMS of the difference of two height maps in mm over the held-out pixels, their best plane removed.
template <typename Held>
double levelled_error_um(const std::vector<float>& z, const std::vector<float>& truth, uint32_t width,
                         uint32_t height, const Held& held) {
  std::array<std::array<double, 4>, 3> m{};
  double square = 0, n = 0;
  for (uint32_t y = 0; y < height; ++y)
    for (uint32_t x = 0; x < width; ++x) {
      if (!held(x, y)) continue;
      const std::array<double, 3> v = {1, static_cast<double>(x) / width - 0.5,
                                       static_cast<double>(y) / height - 0.5};
      const double e =
          static_cast<double>(z[size_t{y} * width + x]) - static_cast<double>(truth[size_t{y} * width + x]);
      for (size_t i = 0; i < 3; ++i) {
        for (size_t j = 0; j < 3; ++j) m[i][j] += v[i] * v[j];
        m[i][3] += v[i] * e;
      }
      square += e * e;
      n += 1;
    }
  const auto before = m;
  for (size_t i = 0; i < 3; ++i)
    for (size_t j = 0; j < 3; ++j) {
      if (i == j) continue;
      const double f = m[j][i] / m[i][i];
      for (size_t k = 0; k < 4; ++k) m[j][k] -= f * m[i][k];
    }
  for (size_t i = 0; i < 3; ++i) square -= before[i][3] * m[i][3] / m[i][i];
  return 1e3 * std::sqrt(std::max(0.0, square) / n);
}

/// Depth of the groove along the vendor's own line, levelled beside it as the vendor does.
double groove_um(const std::vector<float>& z, uint32_t width) {
  const double x0 = 219.25, y0 = 257.75, x1 = 367, y1 = 256.25,
               length = std::hypot(x1 - x0, y1 - y0) * kGroovePitch_mm;
  double n = 0, st = 0, sz = 0, stt = 0, stz = 0;
  std::vector<std::array<double, 2>> line;
  for (int i = 0; i <= 600; ++i) {
    const double a = i / 600.0;
    const auto x = static_cast<size_t>(std::lround(x0 + a * (x1 - x0))),
               y = static_cast<size_t>(std::lround(y0 + a * (y1 - y0)));
    line.push_back({a * length, static_cast<double>(z[y * width + x])});
    const double t = line.back()[0];
    if (!((t > 0.3 && t < 0.9) || (t > 3.1 && t < 3.6))) continue;
    n += 1, st += t, sz += line.back()[1], stt += t * t, stz += t * line.back()[1];
  }
  const double slope = (n * stz - st * sz) / (n * stt - st * st), offset = (sz - slope * st) / n;
  double lowest = 0;
  for (const auto& [t, h] : line) lowest = std::min(lowest, h - offset - slope * t);
  return -1e3 * lowest;
}

TEST_F(DepthRecordings, SixLightsGiveTheGrooveOnHeldOutPixels) {
  const fs::path folder = recordings_folder() / "gelsight-groove";
  Sensor gray;
  gray.name = "one light";
  gray.pitch_mm_per_px = kGroovePitch_mm;
  LightImages images;
  for (int k = 1; k <= 6; ++k) {
    const Frame frame = frame_of(folder / ("image0" + std::to_string(k) + ".png"), gray);
    images.width = frame.format.width;
    images.height = frame.format.height;
    images.images.emplace_back(frame.bytes.begin(), frame.bytes.end());
  }
  uint32_t width = 0, height = 0;
  const std::vector<float> truth = read_height_map(folder / "heightmap.tmd", width, height);
  ASSERT_EQ(width, images.width);
  ASSERT_EQ(height, images.height);
  // RMS of the heights over what the fit did not use, a plane removed.
  const auto error_um = [&](const auto& held, int order, std::vector<float>* heights = nullptr) {
    std::vector<uint8_t> use(truth.size());
    for (uint32_t y = 0; y < height; ++y)
      for (uint32_t x = 0; x < width; ++x) use[size_t{y} * width + x] = !held(x, y);
    const LightStack stack = fit_light_stack(images, truth, use, kGroovePitch_mm, order);
    const std::vector<float> z = integrate_slopes(slopes_of(stack, images), width, height, kGroovePitch_mm);
    if (heights) *heights = z;
    return levelled_error_um(z, truth, width, height, held);
  };
  std::vector<float> heights;
  for (const uint32_t odd : {0u, 1u}) {
    const double bands = error_um([&](uint32_t, uint32_t y) { return y / 64 % 2 == odd; }, 2, &heights);
    const double half = error_um([&](uint32_t, uint32_t y) { return (y < height / 2) == (odd == 0); }, 1);
    std::printf("held out every other 64 rows: %.1f um RMS; the %s half: %.1f um\n", bands,
                odd == 0 ? "upper" : "lower", half);
    EXPECT_LT(bands, 6);
    EXPECT_LT(half, 25.5);
  }
  std::printf("groove %.1f um deep, in the vendor's heights %.1f um\n", groove_um(heights, width),
              groove_um(truth, width));
  EXPECT_NEAR(groove_um(heights, width), groove_um(truth, width), 10);
}

}  // namespace
}  // namespace palpate
