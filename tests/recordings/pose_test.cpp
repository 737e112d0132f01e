// Poses on real gels: what rests stays still, what is dragged goes as far as the pictures show, and presses
// of a smooth ball are no motion that its surface could show. The recordings are not part of the repository;
// the tests say loudly when they are skipped.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "capture/files/tables/gauge.h"
#include "capture/open_source.h"
#include "engine/motion/pose_tracker.h"
#include "engine/pipeline/object_follower.h"
#include "palpate/pipeline.h"
#include "tests/recordings/mini_pads.h"
#include "tests/recordings/wedge_clips.h"
#include "tests/support/pipelines.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;
constexpr double kDegree = M_PI / 180;

/// One frame's height map; the contact is what lies deepest, as much as the pipeline measures.
struct SeenMap {
  uint32_t width, height;
  double pitch_mm, time_s;
  std::vector<float> depth;
  std::vector<uint8_t> contact;
  double level_sd_mm, depth_max_mm;
  bool moves;

  SeenMap(const Result& result, const FrameFormat& format, double pitch)
      : width(format.width),
        height(format.height),
        pitch_mm(pitch),
        time_s(1e-9 * static_cast<double>(result.touch.time_ns)),
        depth(depth_map(result)),
        contact(depth.size()),
        level_sd_mm(result.touch.surface->depth_sd_mm),
        depth_max_mm(result.touch.surface->depth_max_mm),
        moves(result.touch.object.has_value()) {
    const size_t area = std::min<size_t>(result.touch.area_px, depth.size());
    if (area == 0) return;
    std::vector<float> sorted = depth;
    std::nth_element(sorted.begin(), sorted.end() - static_cast<std::ptrdiff_t>(area), sorted.end());
    const float least = sorted[sorted.size() - area];
    std::ranges::transform(depth, contact.begin(), [&](float d) { return d >= least ? 1 : 0; });
  }
  HeightMap map() const {
    return {.width = width,
            .height = height,
            .pitch_mm_per_px = pitch_mm,
            .depth_mm = depth,
            .level_sd_mm = level_sd_mm,
            .contact = contact};
  }
};

PoseOptions options_of(const Sensor& sensor) {
  PoseOptions options;
  options.registration.pad_slope_sd = sensor.photometric.normal_sd;
  return options;
}

class PoseRecordings : public WedgeClips {
 protected:
  PoseRecordings() : WedgeClips("POSES NOT CHECKED ON REAL GELS") {}

  /// Pictures of separate presses: there is no motion between them.
  static std::vector<SeenMap> maps_of(const fs::path& input, const Sensor& sensor) {
    const auto source = open_source(input.string(), sensor);
    Pipeline pipeline(context(), for_rectified_frames(sensor), source->format(),
                      {.outputs = Output::Force | Output::Surface | Output::Contacts | Output::Motion,
                       .solver = SurfaceSolver::Best,
                       .separate = separate_presses(*source, false)});
    pipeline.set_background(load_background(input.string(), sensor, *source));
    std::vector<SeenMap> maps;
    Frame frame;
    while (source->next(frame)) {
      maps.emplace_back(pipeline.process(frame), frame.format, sensor.pitch_mm_per_px);
      EXPECT_FALSE(maps.back().moves);
    }
    return maps;
  }
  /// Frames `first` to `end` of a clip as the program measures them, the object's motion counted from
  /// `first`.
  static std::vector<Touch> followed(const fs::path& clip, const Sensor& sensor, size_t first, size_t end) {
    const auto source = open_source(clip.string(), sensor);
    Pipeline pipeline(context(), for_rectified_frames(sensor), source->format(),
                      {.outputs = Output::Force | Output::Surface | Output::Contacts | Output::Motion,
                       .solver = SurfaceSolver::Best});
    pipeline.set_background(load_background(clip.string(), sensor, *source));
    std::vector<Touch> touches;
    Frame frame;
    for (size_t i = 0; i < end && source->next(frame); ++i) {
      if (i == first) pipeline.restart_motion();
      Touch touch = pipeline.process(frame).touch;
      if (i >= first) touches.push_back(std::move(touch));
    }
    return touches;
  }
  /// The longest run of frames in which the gauge stays within 4 % of a force of at least half the largest.
  static std::pair<size_t, size_t> held(const std::vector<double>& force_N) {
    const double most = *std::ranges::max_element(force_N);
    std::pair<size_t, size_t> best{0, 0};
    for (size_t first = 0; first < force_N.size(); ++first) {
      size_t end = first;
      while (end < force_N.size() && force_N[first] > most / 2 &&
             std::abs(force_N[end] / force_N[first] - 1) < 0.04)
        ++end;
      if (end - first > best.second - best.first) best = {first, end};
    }
    return best;
  }
};

/// Slope of a component over time, by least squares.
struct Drift {
  double n = 0, t = 0, tt = 0, v = 0, tv = 0, worst = 0;
  int held = 0;
  void add(double time_s, double value, double sd) {
    if (std::isnan(value)) return;
    n += 1, t += time_s, tt += time_s * time_s, v += value, tv += time_s * value;
    worst = std::max(worst, std::abs(value));
    held += std::abs(value) < 1.96 * sd ? 1 : 0;
  }
  double per_s() const { return n > 2 ? (tv - t * v / n) / (tt - t * t / n) : NAN; }
};

TEST_F(PoseRecordings, WhatRestsStaysStill) {
  const Sensor sensor = load_sensor(shipped_sensor("gelsight_wedge"));
  int held_along = 0, told_along = 0, lost = 0;
  for (const fs::path& clip : both_days(2)) {
    fs::path table = clip;
    const Gauge gauge = read_gauge(table.replace_extension(".csv"), GaugeColumns::Normal);
    const auto [first, last] = held(gauge.force_N);
    constexpr size_t kLate = 3;  // frames by which the gauge may lag
    Drift drift[6];
    int frames = 0;
    for (const Touch& touch : followed(clip, sensor, first, last - std::min(last, kLate))) {
      const ObjectPose& pose = *touch.object;
      lost += pose.state == PoseState::Lost;
      if (pose.state != PoseState::Tracked) continue;
      ++frames;
      const double time_s = 1e-9 * static_cast<double>(touch.time_ns);
      for (size_t c = 0; c < 3; ++c) {
        const Estimate &shift = pose.shift_mm[c], &turn = pose.turn_rad[c];
        drift[c].add(time_s, shift.value, shift.standard_error);
        drift[c + 3].add(time_s, turn.value / kDegree, turn.standard_error / kDegree);
      }
    }
    std::printf("%-30s %2d frames at %.1f N:", clip.stem().c_str(), frames, gauge.force_N[first]);
    for (int c = 0; c < 6; ++c) {
      std::printf(" %.3f/s, worst %.3f, %d of %.0f |", drift[c].per_s(), drift[c].worst, drift[c].held,
                  drift[c].n);
      if (c == 2) continue;
      held_along += drift[c].held;
      told_along += static_cast<int>(drift[c].n);
    }
    std::printf("\n");
  }
  std::printf("intervals of all but depth held 0 in %d of %d, %d tracks lost\n", held_along, told_along,
              lost);
  EXPECT_EQ(lost, 0);
  EXPECT_GE(held_along, 0.9 * told_along);
}

TEST_F(PoseRecordings, DifferentPressesOfABallShowNoTurning) {
  const fs::path folder = recordings_folder() / "gelsight-sim2real";
  Sensor sensor = load_sensor(shipped_sensor("gelsight_sim2real"));
  sensor.background.image = (folder / "background_real.png").string();
  std::vector<ContactSurface> presses;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().filename().string().rfind("calib_", 0) != 0 || entry.path().extension() != ".png")
      continue;
    presses.emplace_back(maps_of(entry.path(), sensor)[0].map());
  }
  const RegistrationOptions told = options_of(sensor).registration;
  int pairs = 0, claims = 0, untold = 0;
  for (size_t i = 0; i < presses.size(); ++i)
    for (size_t j = 0; j < presses.size(); ++j) {
      if (i == j || (i + 3 * j) % 4 != 0) continue;
      const RigidMotion start{Eigen::Matrix3d::Identity(),
                              presses[j].centroid_mm() - presses[i].centroid_mm()};
      const Registration seen = register_surface(presses[i], presses[j], start, told);
      const Registration blind = register_surface(presses[i], presses[j], start);
      if (!seen.found || seen.fitting < 0.6) continue;
      ++pairs;
      for (const int c : {0, 1, 3, 4, 5}) {
        claims += seen.freedom.determined(c);
        untold += blind.freedom.determined(c);
      }
    }
  std::printf(
      "%d pairs of presses of a ball: %d of %d components called determined, %d without the pad's error\n",
      pairs, claims, 5 * pairs, untold);
  EXPECT_GT(pairs, 60);
  EXPECT_LE(claims, pairs / 20);
  EXPECT_GT(untold, pairs / 5);
}

// A ridged rod that is pressed and dragged. The pictures of balls that came with it are of another pad, and
// no calibration fits: slopes are what bends least of all that are linear in the colours, with flanks of 0.5.
// Depths have no scale, but ways along the pad do not need it.
class DraggedPose : public RecordingsTest {
 protected:
  DraggedPose() : RecordingsTest("POSES NOT CHECKED ON A DRAGGED OBJECT", "gelsight-driver") {}

  // Across the ridges, and along them.
  static constexpr double kAcross[2] = {0.953, -0.304}, kMiddle_px[2] = {490, 370};
  static constexpr int kHalf_px = 170;

  static Sensor sensor() {
    Sensor sensor = load_sensor(shipped_sensor("gelsight_driver_markers"));
    sensor.reading = SurfaceReading::Photometric;
    sensor.photometric.wx = {{-1.51}, {1.26}, {1.12}};
    sensor.photometric.wy = {{0.39}, {0.11}, {-0.66}};
    sensor.photometric.normal_sd = 0.06;  // as of pads whose calibration is judged
    sensor.max_slope = 3;
    return sensor;
  }
  static double across(double x, double y) { return kAcross[0] * x + kAcross[1] * y; }

  /// Mean gray of what is not marked, along the ridges, each half pixel across them; less that of 9 px about.
  static std::vector<double> ridges(const Frame& frame) {
    const int width = static_cast<int>(frame.format.width), height = static_cast<int>(frame.format.height);
    const auto colours = [&](int x, int y) {
      const auto column = static_cast<uint32_t>(x), row = static_cast<uint32_t>(y);
      return std::array{frame.at(0, column, row), frame.at(1, column, row), frame.at(2, column, row)};
    };
    std::vector<double> sum(4 * kHalf_px + 1), n(sum.size());
    constexpr int kRim = 6, kDark = 80;
    for (int y = kRim; y < height - kRim; ++y)
      for (int x = kRim; x < width - kRim; ++x) {
        const double dx = x - kMiddle_px[0], dy = y - kMiddle_px[1];
        const double u = across(dx, dy), v = kAcross[0] * dy - kAcross[1] * dx;
        if (std::abs(u) > kHalf_px || std::abs(v) > kHalf_px) continue;
        bool marked = false;
        for (int ay = -kRim; ay <= kRim; ay += kRim / 2)
          for (int ax = -kRim; ax <= kRim; ax += kRim / 2)
            marked |= std::ranges::max(colours(x + ax, y + ay)) < kDark;
        if (marked) continue;
        const auto bin = static_cast<size_t>(std::lround(2 * (u + kHalf_px)));
        const auto [red, green, blue] = colours(x, y);
        sum[bin] += (red + green + blue) / 3.0;
        ++n[bin];
      }
    for (size_t i = 0; i < sum.size(); ++i) sum[i] /= std::max(n[i], 1.0);
    std::vector<double> fine(sum.size());
    constexpr size_t kAbout = 18;
    for (size_t i = kAbout; i + kAbout < sum.size(); ++i) {
      double mean = 0;
      for (size_t j = i - kAbout; j <= i + kAbout; ++j) mean += sum[j] / (2 * kAbout + 1);
      fine[i] = sum[i] - mean;
    }
    return fine;
  }
  /// By how many px `now` lies further across than `then`, within 5 px of `about`.
  static double shift_px(const std::vector<double>& then, const std::vector<double>& now, double about) {
    constexpr int kReach = 10, kEdge = 90;
    const int start = std::clamp(static_cast<int>(std::lround(2 * about)), kReach - kEdge, kEdge - kReach);
    std::vector<double> fit;
    for (int shift = start - kReach; shift <= start + kReach; ++shift) {
      double ab = 0, aa = 0, bb = 0;
      for (int i = kEdge; i < static_cast<int>(then.size()) - kEdge; ++i) {
        const double a = then.data()[i], b = now.data()[i + shift];
        ab += a * b, aa += a * a, bb += b * b;
      }
      fit.push_back(ab / std::sqrt(aa * bb));
    }
    const auto best = std::ranges::max_element(fit) - fit.begin();
    double part = 0;
    if (best > 0 && best < 2 * kReach) {
      const double low = fit[static_cast<size_t>(best - 1)], high = fit[static_cast<size_t>(best + 1)];
      part = (low - high) / (2 * (low - 2 * fit[static_cast<size_t>(best)] + high));
    }
    return 0.5 * (start - kReach + static_cast<double>(best) + part);
  }
  /// Mean way across of the markers about the middle, px; from rest.
  static double markers_px(const Touch& touch) {
    double sum = 0, n = 0;
    for (const SkinPoint& point : touch.skin_points) {
      const double dx = double{point.rest_x_px} - kMiddle_px[0], dy = double{point.rest_y_px} - kMiddle_px[1];
      if (point.correlation <= 0 || std::max(std::abs(dx), std::abs(dy)) > kHalf_px) continue;
      sum += across(double{point.shift_x_px}, double{point.shift_y_px});
      ++n;
    }
    return sum / n;
  }

  /// Way across of the object's point that is now at the middle of the ridges, since its track began.
  static double across_mm(const RigidMotion& motion, double pitch_mm) {
    const Eigen::Vector3d at((kMiddle_px[0] - 479.5) * pitch_mm, (kMiddle_px[1] - 359.5) * pitch_mm, 0);
    const Eigen::Vector3d way = at - motion.inverse() * at;
    return across(way[0], way[1]);
  }
  /// Error of that way, as far as the surface determines it, and the part of it that it does not.
  static double sd_mm(const Pose& pose) {
    const Eigen::Vector2d along(kAcross[0], kAcross[1]);
    return std::sqrt(along.dot(pose.covariance.topLeftCorner<2, 2>() * along));
  }
  static double unknown_share(const Pose& pose) {
    const Eigen::Vector2d along(kAcross[0], kAcross[1]);
    return (along.transpose() * pose.freedom.unknown.topRows<2>()).norm();
  }
  static SeenMap half_as_deep(const Result& result, const FrameFormat& format, double pitch_mm) {
    SeenMap seen(result, format, pitch_mm);
    const auto level = static_cast<float>(seen.depth_max_mm / 2 - result.touch.surface->depth_offset_mm);
    std::ranges::transform(seen.depth, seen.contact.begin(), [level](float d) { return d > level ? 1 : 0; });
    return seen;
  }
};

/// How well a motion goes along with what is true.
struct Followed {
  double squares = 0, worst_mm = 0;
  int frames = 0, lost = 0, doubts = 0;

  void add(PoseState state, PoseDoubt doubt, double error_mm) {
    lost += state != PoseState::Tracked;
    doubts += doubt != PoseDoubt::None;
    squares += error_mm * error_mm;
    worst_mm = std::max(worst_mm, std::abs(error_mm));
    ++frames;
  }
  double rms_mm() const { return std::sqrt(squares / frames); }
  void print(const char* whose) const {
    std::printf("%s: %.3f mm RMS, %.3f at worst, %d lost, %d doubts\n", whose, rms_mm(), worst_mm, lost,
                doubts);
  }
};

RigidMotion motion_of(const ObjectPose& pose) {
  RigidMotion motion;
  for (Eigen::Index k = 0; k < 3; ++k) {
    motion.shift_mm[k] = pose.translation_mm[static_cast<size_t>(k)];
    for (Eigen::Index c = 0; c < 3; ++c) motion.turn(k, c) = pose.rotation[static_cast<size_t>(3 * k + c)];
  }
  return motion;
}

TEST_F(DraggedPose, GoesAcrossItsRidgesAsFarAsTheyDo) {
  const std::string film = (recordings_folder() / "gelsight-driver/marker_video.avi").string();
  const Sensor sensor = DraggedPose::sensor();
  const double pitch = sensor.pitch_mm_per_px;
  const auto source = open_source(film, sensor);
  Pipeline pipeline(
      context(), for_rectified_frames(sensor), source->format(),
      {.outputs = Output::Force | Output::Surface | Output::Contacts | Output::Motion | Output::Skin,
       .solver = SurfaceSolver::Best,
       .fixed_light = true});
  pipeline.set_background(load_background(film, sensor, *source));
  constexpr uint64_t kPressed = 28, kLifts = 46;  // its contact grows no more; first frame of it lifting
  // A third of the error that the pad may have: the ridges are known for the object's.
  PoseOptions ridged = pose_options(sensor);
  ridged.registration.pad_slope_sd /= 3;
  PoseTracker deep(ridged);
  std::vector<double> then;
  double ridges_px = 0, markers_then_px = 0, farthest_mm = 0, apart_mm = 0;
  Followed told, by_ridges;
  int shifts = 0, slips = 0, unknown = 0, rods = 0, determined = 0, held = 0;
  Frame frame;
  while (source->next(frame) && frame.sequence < kLifts) {
    if (frame.sequence == kPressed) pipeline.restart_motion();
    const Result result = pipeline.process(frame);
    if (frame.sequence < kPressed) continue;
    const ObjectPose& pose = *result.touch.object;
    const Pose& inside = deep.update(half_as_deep(result, frame.format, pitch).map());
    const std::vector<double> now = ridges(frame);
    const double markers = markers_px(result.touch);
    if (frame.sequence == kPressed) {
      then = now;
      markers_then_px = markers;
      continue;
    }
    ridges_px = shift_px(then, now, ridges_px);
    const double truth_mm = ridges_px * pitch;
    farthest_mm = std::max(farthest_mm, std::abs(truth_mm));
    apart_mm = std::max(apart_mm, std::abs(truth_mm - (markers - markers_then_px) * pitch));
    for (size_t k = 0; k < 2; ++k) shifts += pose.shift_mm[k].validity == Validity::Valid;
    slips += pose.on_skin == OnSkin::Slips || pose.on_skin == OnSkin::Disagrees;
    unknown += pose.on_skin == OnSkin::Unknown;
    rods += pose.surface == Slippage::Cylinder || pose.surface == Slippage::Other;
    told.add(pose.state, pose.doubt, across_mm(motion_of(pose), pitch) - truth_mm);
    const double error_mm = across_mm(inside.motion, pitch) - truth_mm, share = unknown_share(inside);
    by_ridges.add(inside.state, inside.doubt, error_mm);
    determined += share <= Freedom::kShare;
    held += std::abs(error_mm) < 1.96 * std::hypot(sd_mm(inside), share * inside.freedom.radius_mm);
    std::printf("%2d ridges %.3f mm, motion %.3f (%s), by the ridges %.3f +- %.3f, %.2f unknown (%s)\n",
                static_cast<int>(frame.sequence), truth_mm, across_mm(motion_of(pose), pitch),
                to_string(pose.surface), across_mm(inside.motion, pitch), sd_mm(inside), share,
                to_string(inside.surface));
  }
  std::printf("ridges go by %.3f mm, markers apart from them by %.3f mm at most\n", farthest_mm, apart_mm);
  told.print("the program's");
  by_ridges.print("by the ridges");
  std::printf("across: %d determined by the ridges, %d intervals hold; program: %d rods, %d shifts told\n",
              determined, held, rods, shifts);
  std::printf("object on skin: %d slipping, %d unknown of %d\n", slips, unknown, told.frames);
  EXPECT_LT(apart_mm, 0.02) << "it sticks across its ridges";
  EXPECT_NEAR(farthest_mm, 0.18, 0.02);
  EXPECT_EQ(slips, 0);
  EXPECT_EQ(told.lost + by_ridges.lost, 0);
  // Its way along the ridges is not determined, so neither x nor y is. By slopes that are more than the pad's
  // it is a rod that may roll about its axis: across its surface, too, nothing is determined, and the
  // motion that turns least is told for a state, not for a way.
  EXPECT_EQ(shifts, 0);
  EXPECT_EQ(rods, told.frames);
  EXPECT_LT(told.rms_mm(), 0.065);
  // The ridges show that it does.
  EXPECT_GT(determined, 12);
  EXPECT_LT(by_ridges.rms_mm(), 0.05);
}

/// Balls that stay as they are: one picture, again and again, with a camera's noise.
class StillPose : public RecordingsTest {
 protected:
  StillPose() : RecordingsTest("POSES NOT CHECKED ON STILLS OF A GELSIGHT MINI", "gelsight_mini") {}

  struct Seen {
    int turns = 0, lost = 0, tracked = 0, held = 0, told = 0;
    double fastest = 0, worst_mm = 0;  ///< mm/s, mm
  };
  static Seen judge(const fs::path& presses, const fs::path& background, double ball_mm,
                    const fs::path& judged) {
    const Sensor sensor = calibrated_mini(presses, background, ball_mm).sensor;
    std::vector<fs::path> stills;
    for (const auto& entry : fs::directory_iterator(judged)) stills.push_back(entry.path());
    std::ranges::sort(stills);
    std::mt19937 random(7);
    std::normal_distribution<double> noise(0, 1.5);
    Seen seen;
    for (size_t i = 0; i < stills.size(); i += (stills.size() + 2) / 3) {
      const auto source = open_source(stills[i].string(), sensor);
      Pipeline pipeline(context(), for_rectified_frames(sensor), source->format(),
                        {.outputs = Output::Force | Output::Surface | Output::Contacts | Output::Motion,
                         .solver = SurfaceSolver::Best});
      pipeline.set_background(load_background(stills[i].string(), sensor, *source));
      Frame still;
      EXPECT_TRUE(source->next(still));
      Drift drift[3];
      constexpr int kFrames = 60;
      for (int k = 0; k < kFrames; ++k) {
        Frame frame = still;
        frame.sequence = static_cast<uint64_t>(k);
        frame.time_ns = int64_t{k} * 1'000'000'000 / kFrames;
        for (uint8_t& byte : frame.bytes)
          byte = static_cast<uint8_t>(std::clamp(std::lround(byte + noise(random)), 0L, 255L));
        const ObjectPose pose = *pipeline.process(frame).touch.object;
        seen.lost += pose.state == PoseState::Lost;
        if (pose.state != PoseState::Tracked) continue;
        ++seen.tracked;
        for (size_t c = 0; c < 3; ++c) {
          seen.turns += pose.turn_rad[c].validity == Validity::Valid;
          drift[c].add(1e-9 * static_cast<double>(frame.time_ns), pose.shift_mm[c].value,
                       pose.shift_mm[c].standard_error);
        }
      }
      for (const Drift& of : drift) {
        seen.held += of.held;
        seen.told += static_cast<int>(of.n);
        if (of.n > 2) seen.fastest = std::max(seen.fastest, std::abs(of.per_s()));
        seen.worst_mm = std::max(seen.worst_mm, of.worst);
      }
      std::printf("%-14s drift %.4f, %.4f, %.4f mm/s, worst %.4f, %.4f, %.4f mm, told %.0f, %.0f, %.0f\n",
                  stills[i].filename().c_str(), drift[0].per_s(), drift[1].per_s(), drift[2].per_s(),
                  drift[0].worst, drift[1].worst, drift[2].worst, drift[0].n, drift[1].n, drift[2].n);
    }
    std::printf(
        "%d frames tracked, %d lost, %d turns told; drift to %.4f mm/s, %.4f mm at worst, held %d of %d\n",
        seen.tracked, seen.lost, seen.turns, seen.fastest, seen.worst_mm, seen.held, seen.told);
    EXPECT_EQ(seen.lost, 0);
    EXPECT_GT(seen.tracked, 170);
    EXPECT_LT(seen.fastest, 0.01);
    EXPECT_GE(seen.held, 0.95 * seen.told);
    return seen;
  }
};

TEST_F(StillPose, BallsStayAndShowNoTurn) {
  const fs::path folder = recordings_folder() / "gelsight_mini", plain = folder / "pad_a",
                 marked = folder / "pad_b";
  const Seen other = judge(plain / "ball_6.31mm", plain / "background.png", 3.155, plain / "ball_9.5mm");
  EXPECT_EQ(other.turns, 0);
  const Seen own = judge(marked / "ball_5mm", marked / "background.png", 2.5, marked / "ball_5mm");
  EXPECT_EQ(own.turns, 0);
}

}  // namespace
}  // namespace palpate
