// Poses on real gels: what rests stays still, what is pressed goes deeper, and different presses of a smooth
// ball are no motion that its surface could show. The recordings are not part of the repository; the tests
// say loudly when they are skipped.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "capture/files/tables/gauge.h"
#include "capture/open_source.h"
#include "engine/motion/pose_tracker.h"
#include "palpate/pipeline.h"
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

  SeenMap(const Result& result, const FrameFormat& format, double pitch)
      : width(format.width),
        height(format.height),
        pitch_mm(pitch),
        time_s(1e-9 * static_cast<double>(result.touch.time_ns)),
        depth(depth_map(result)),
        contact(depth.size()),
        level_sd_mm(result.touch.surface->depth_sd_mm),
        depth_max_mm(result.touch.surface->depth_max_mm) {
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

  static std::vector<SeenMap> maps_of(const fs::path& input, const Sensor& sensor) {
    const auto source = open_source(input.string(), sensor);
    Pipeline pipeline(context(), for_rectified_frames(sensor), source->format(),
                      {.outputs = Output::Force | Output::Surface | Output::Contacts,
                       .solver = SurfaceSolver::Best,
                       .separate = separate_presses(*source, false)});
    pipeline.set_background(load_background(input.string(), sensor, *source));
    std::vector<SeenMap> maps;
    Frame frame;
    while (source->next(frame))
      maps.emplace_back(pipeline.process(frame), frame.format, sensor.pitch_mm_per_px);
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

}  // namespace
}  // namespace palpate
