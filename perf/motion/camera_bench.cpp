#include "perf/motion/camera_bench.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

#include "capture/synthetic/object.h"
#include "capture/synthetic/object_shapes.h"
#include "engine/motion/pose_tracker.h"
#include "palpate/device.h"
#include "palpate/pipeline.h"
#include "perf/measure.h"

namespace palpate::perf {
namespace {

using scenes::kDegree;

struct Run {
  const char* name;
  const char* keys;     ///< of "synthetic:object?"
  const char* unknown;  ///< '-': what the surface does not determine, x, y, z, then turns; "": nothing
  double begin_s = 0;   ///< the tracker sees no frame before
};
constexpr Run kRuns[] = {
    {"textured, slides and turns", "shape=textured&turn_deg=35&tilt_deg=3", ""},
    {"textured, seen once pressed", "shape=textured&turn_deg=35&tilt_deg=3", "", 1},
    {"textured, by hand", "shape=textured&path=hand&turn_deg=20&tilt_deg=3", ""},
    {"coin, slides and turns", "shape=coin&turn_deg=35&tilt_deg=1&depth_mm=0.25", ""},
    {"key, slides and turns", "shape=key&turn_deg=35&tilt_deg=2", ""},
    {"seed, turns", "shape=seed&path=turn&turn_deg=35", ""},
    {"bead, rolls once round", "shape=bead&path=roll&depth_mm=0.7", ""},
    {"relief, 45 mm/s", "shape=relief&path=drag&speed_mm_s=45&reach_mm=60&x_mm=-30&depth_mm=0.4", ""},
    {"ball", "shape=ball&depth_mm=0.7&turn_deg=35", "+++---"},
    {"plane", "shape=plane&depth_mm=0.15&turn_deg=35&tilt_deg=0.5", "--+++-"},
    {"cylinder", "shape=cylinder&depth_mm=0.3&reach_mm=1&turn_deg=10", "--+--+"},
};

/// Where the object is pressed: what is deeper than a tenth of the deepest place, and than rest and its
/// noise.
std::vector<uint8_t> contact_of(std::span<const float> depth) {
  std::vector<uint8_t> mask(depth.size());
  const float least = std::max(0.02f, 0.1f * *std::ranges::max_element(depth));
  for (size_t i = 0; i < depth.size(); ++i) mask[i] = depth[i] > least ? 1 : 0;
  return mask;
}

RigidMotion motion_of(const TrueMotion& t) {
  return {turn_of({t.turn_rad[0], t.turn_rad[1], t.turn_rad[2]}),
          {t.shift_mm[0], t.shift_mm[1], t.shift_mm[2]}};
}

/// Errors of depth by pixel: what of them stays where it is while the object moves.
class DepthErrors {
 public:
  void add(std::span<const float> depth, const Truth& truth, std::span<const uint8_t> contact) {
    sum_.resize(depth.size());
    frames_.resize(depth.size());
    for (size_t i = 0; i < depth.size(); ++i) {
      if (contact[i] == 0) continue;
      const double error = double{depth[i]} - double{truth.depth_mm[i]};
      sum_[i] += error;
      ++frames_[i];
      squares_ += error * error;
      ++all_;
    }
  }
  double rms_mm() const { return std::sqrt(squares_ / std::max(all_, 1.0)); }
  /// RMS of the pixels' means over at least 100 frames, about their own mean.
  double fixed_mm() const {
    double sum = 0, squares = 0, pixels = 0;
    for (size_t i = 0; i < sum_.size(); ++i) {
      if (frames_[i] < 100) continue;
      const double mean = sum_[i] / frames_[i];
      sum += mean, squares += mean * mean, ++pixels;
    }
    return pixels > 0 ? std::sqrt(std::max(squares / pixels - sum * sum / pixels / pixels, 0.0)) : 0;
  }

 private:
  std::vector<double> sum_;
  std::vector<int> frames_;
  double squares_ = 0, all_ = 0;
};

/// What a run adds up to.
struct Sums {
  int tracked = 0, begun = 0, lost = 0, held = 0, asked = 0, named = 0, wrongly_told = 0;
  uint32_t keys = 0;
  double last_mm = 0, last_deg = 0, worst_mm = 0, worst_deg = 0;
  std::vector<double> cpu_ms;
  DepthErrors depth;

  void add(const Pose& pose, const RigidMotion& truth, const char* unknown) {
    ++tracked;
    keys = pose.keys;
    // Of a ball the middle is followed.
    const Eigen::Vector3d& at = pose.surface == Slippage::Ball ? pose.pivot_mm : pose.at_mm;
    const Vector6d error = twist_between(pose.motion, truth, at);
    const PoseComponents told = pose.components(at);
    double shift = 0, turn = 0;
    bool all_named = true;
    for (int c = 0; c < 6; ++c) {
      const double sd = c < 3 ? told.shift_sd_mm[c] : told.turn_sd_rad[c - 3];
      const bool missing = unknown[0] != '\0' && unknown[c] == '-';
      if (missing && !std::isnan(sd)) ++wrongly_told;
      all_named = all_named && missing == std::isnan(sd);
      if (std::isnan(sd)) continue;
      (c < 3 ? shift : turn) += error[c] * error[c];
      ++asked;
      held += std::abs(error[c]) < 1.96 * sd ? 1 : 0;
    }
    named += all_named ? 1 : 0;
    last_mm = std::sqrt(shift);
    last_deg = std::sqrt(turn) / kDegree;
    worst_mm = std::max(worst_mm, last_mm);
    worst_deg = std::max(worst_deg, last_deg);
  }
  void print(const char* name) const {
    const auto share = [](int part, int of) { return of > 0 ? 100.0 * part / of : 0.0; };
    std::printf("\"%s\",%d,%d,%d,%u,%.4f,%.3f,%.4f,%.3f,%.1f,%.1f,%d,%.4f,%.4f,%.1f\n", name, tracked, begun,
                lost, keys, last_mm, last_deg, worst_mm, worst_deg, share(held, asked), share(named, tracked),
                wrongly_told, depth.rms_mm(), depth.fixed_mm(),
                cpu_ms.empty() ? 0 : quartiles(cpu_ms).median);
    std::fflush(stdout);
  }
};

void follow(Device& device, const Run& run, double seconds) {
  const ObjectOptions options =
      parse_object("synthetic:object?size=320x240&seconds=" + std::to_string(seconds) + "&" + run.keys);
  ObjectSensor source(options);
  const Sensor sensor = object_sensor(options);
  Pipeline pipeline(device, sensor, source.format(), {.outputs = Output::Force | Output::Surface});
  pipeline.set_background(*source.own_background());
  PoseTracker tracker;
  Sums sums;
  RigidMotion begun;
  Frame frame;
  while (source.next(frame)) {
    const Result result = pipeline.process(frame);
    const Truth truth = *source.truth(frame.sequence);
    std::vector<float> depth(result.depth_mm().begin(), result.depth_mm().end());
    const std::vector<uint8_t> contact = contact_of(depth);
    sums.depth.add(depth, truth, contact);
    if (truth.time_s < run.begin_s) continue;
    Pose pose;
    const Sample time = time_runs(
        [&] {
          pose = tracker.update({.width = frame.format.width,
                                 .height = frame.format.height,
                                 .pitch_mm_per_px = sensor.pitch_mm_per_px,
                                 .depth_mm = depth,
                                 .contact = contact});
        },
        1);
    if (pose.state == PoseState::Begun) ++sums.begun;
    if (pose.state == PoseState::Begun && truth.motion) begun = motion_of(*truth.motion);
    if (pose.state == PoseState::Lost) ++sums.lost;
    if (pose.state != PoseState::Tracked || !truth.motion) continue;
    sums.cpu_ms.push_back(time.cpu_ms);
    sums.add(pose, motion_of(*truth.motion) * begun.inverse(), run.unknown);
  }
  sums.print(run.name);
}

}  // namespace

void follow_through_camera(double seconds, const char* only) {
  std::printf(
      "object,tracked,tracks,lost,keys,last_mm,last_deg,worst_mm,worst_deg,held_percent,named_percent,"
      "wrongly_told,depth_rms_mm,depth_fixed_mm,cpu_ms\n");
  Device device;
  for (const Run& run : kRuns)
    if (!only || std::strncmp(run.name, only, std::strlen(only)) == 0) follow(device, run, seconds);
}

}  // namespace palpate::perf
