// Motion bench: an object slides and turns for ten seconds; error and time of the pose tracker and of plain
// point-to-plane registration, on the same frames. Or the tracker's alone over its options and the frame's
// pixels.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>
#include <utility>
#include <vector>

#include "engine/motion/pose_tracker.h"
#include "perf/measure.h"
#include "perf/motion/camera_bench.h"
#include "perf/motion/moved_object.h"
#include "perf/motion/point_to_plane.h"

namespace palpate::perf {
namespace {

using scenes::kDegree;

/// Point-to-plane with the same key frames' rule.
class PlainTracker {
 public:
  const RigidMotion& update(const HeightMap& map) {
    ContactSurface surface(map);
    if (key_.count() == 0) {
      key_ = std::move(surface);
      return motion_;
    }
    const PointToPlane found = point_to_plane(key_, surface, from_key_);
    from_key_ = found.motion;
    motion_ = from_key_ * to_key_;
    if (found.overlap < 0.6 || turn_vector(from_key_.turn).norm() > 10 * kDegree) {
      key_ = std::move(surface);
      to_key_ = motion_;
      from_key_ = {};
    }
    return motion_;
  }

 private:
  ContactSurface key_;
  RigidMotion to_key_, from_key_, motion_;
};

struct Errors {
  std::vector<double> wall_ms, cpu_ms;
  double last_mm = 0, last_deg = 0, worst_mm = 0, worst_deg = 0;
  void add(const RigidMotion& got, const RigidMotion& truth, const Eigen::Vector3d& at, const Sample& time) {
    const Vector6d error = twist_between(got, truth, at);
    last_mm = error.head<3>().norm();
    last_deg = error.tail<3>().norm() / kDegree;
    worst_mm = std::max(worst_mm, last_mm);
    worst_deg = std::max(worst_deg, last_deg);
    wall_ms.push_back(time.wall_ms);
    cpu_ms.push_back(time.cpu_ms);
  }
  void print(const std::string& object, const char* noise, const char* method, int lost) {
    std::printf("%s,%s,%s,%.4f,%.3f,%.4f,%.3f,%.1f,%.1f,%d\n", object.c_str(), noise, method, last_mm,
                last_deg, worst_mm, worst_deg, quartiles(wall_ms).median, quartiles(cpu_ms).median, lost);
    std::fflush(stdout);
  }
};

void run(const scenes::SolidObject& object, scenes::DepthNoise kind, const char* noise, double seconds) {
  const scenes::PadView pad{.width = 320, .height = 240, .pitch_mm = 0.05, .skin_px = 3};
  std::mt19937 random(1);
  PoseTracker tracker;
  PlainTracker plain;
  Errors ours, rival;
  int lost = 0;
  for (int frame = 0; frame <= seconds * 60; ++frame) {
    const RigidMotion truth = scenes::on_path(frame / 60.0);
    const scenes::PressedMap map = scenes::pressed(object, truth, pad, 0.002, kind, random);
    Pose pose;
    RigidMotion moved;
    const Sample our_time = time_runs([&] { pose = tracker.update(map.map()); }, 1);
    const Sample rival_time = time_runs([&] { moved = plain.update(map.map()); }, 1);
    if (pose.state == PoseState::Lost) ++lost;
    if (pose.state != PoseState::Tracked) continue;
    ours.add(pose.motion, truth, pose.at_mm, our_time);
    rival.add(moved, truth, pose.at_mm, rival_time);
  }
  ours.print(object.name, noise, "palpate", lost);
  rival.print(object.name, noise, "point to plane", 0);
}

/// One option at a time differs from what is the default.
std::vector<std::pair<std::string, PoseOptions>> sweep_options() {
  std::vector<std::pair<std::string, PoseOptions>> all = {{"default", {}}};
  const auto add = [&](const std::string& name, const auto& value, auto set) {
    all.emplace_back(name + " " + std::to_string(value), PoseOptions());
    set(all.back().second);
  };
  for (const uint32_t level : {1u, 2u})
    add("finest_level", level, [=](PoseOptions& o) { o.registration.finest_level = level; });
  for (const int steps : {2, 4, 30})
    add("most_steps", steps, [=](PoseOptions& o) { o.registration.most_steps = steps; });
  for (const uint32_t levels : {1u, 2u, 3u})
    add("levels", levels, [=](PoseOptions& o) { o.surface.levels = levels; });
  for (const uint32_t border : {1u, 2u, 8u, 12u})
    add("border_px", border, [=](PoseOptions& o) { o.surface.border_px = border; });
  for (const int percent : {40, 80, 95})
    add("key_overlap_percent", percent, [=](PoseOptions& o) { o.key_overlap = percent / 100.0; });
  for (const int degrees : {3, 25})
    add("key_turn_deg", degrees, [=](PoseOptions& o) { o.key_turn_deg = degrees; });
  return all;
}

void sweep(const scenes::SolidObject& object, uint32_t width, double seconds) {
  const scenes::PadView pad{
      .width = width, .height = width * 3 / 4, .pitch_mm = 16.0 / width, .skin_px = 0.15 * width / 16};
  std::mt19937 random(1);
  std::vector<scenes::PressedMap> maps;
  for (int frame = 0; frame <= seconds * 60; ++frame)
    maps.push_back(
        pressed(object, scenes::on_path(frame / 60.0), pad, 0.002, scenes::DepthNoise::Integrated, random));
  for (const auto& [name, options] : sweep_options()) {
    if (width != 320 && name != "default") continue;
    PoseTracker tracker(options);
    Errors errors;
    int lost = 0, held = 0, asked = 0;
    uint32_t keys = 0;
    for (size_t frame = 0; frame < maps.size(); ++frame) {
      Pose pose;
      const Sample time = time_runs([&] { pose = tracker.update(maps[frame].map()); }, 1);
      lost += pose.state == PoseState::Lost;
      keys = std::max(keys, pose.keys);
      if (pose.state != PoseState::Tracked || pose.track != 1) continue;
      const RigidMotion truth = scenes::on_path(static_cast<double>(frame) / 60);
      const Vector6d error = twist_between(pose.motion, truth, pose.at_mm);
      for (int c = 0; c < 6; ++c)
        held += std::abs(error[c]) < 1.96 * std::sqrt(pose.covariance(c, c)) ? 1 : 0;
      asked += 6;
      errors.add(pose.motion, truth, pose.at_mm, time);
    }
    std::printf("%s,%ux%u,%s,%.4f,%.3f,%.1f,%.1f,%u,%.3f,%d\n", object.name.c_str(), pad.width, pad.height,
                name.c_str(), errors.worst_mm, errors.worst_deg, quartiles(errors.wall_ms).median,
                quartiles(errors.cpu_ms).median, keys, double(held) / std::max(asked, 1), lost);
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace palpate::perf

// Seconds of motion, 10 by default; then `sweep` for the options. `--camera [SECONDS [RUN]]`: through
// simulated pictures and the pipeline, all runs, or those whose name begins with RUN.
int main(int argc, char** argv) {
  using namespace palpate;
  using scenes::DepthNoise;
  try {
    const bool camera = argc > 1 && std::string(argv[1]) == "--camera";
    const int given = camera ? 2 : 1;
    const double seconds = argc > given ? std::strtod(argv[given], nullptr) : 10;
    const char* const word = argc > given + 1 ? argv[given + 1] : nullptr;
    const bool sweep = !camera && word && std::string(word) == "sweep";
    if (!(seconds > 0) || argc > given + 2 || (!camera && word && !sweep)) {
      std::fprintf(stderr,
                   "wanted [--camera] and seconds > 0, then a run or sweep; found '%s'; try 3 sweep\n",
                   argv[word ? given + 1 : given]);
      return 2;
    }
    if (camera) {
      perf::follow_through_camera(seconds, word);
      return 0;
    }
    if (sweep) {
      std::printf("object,frame,option,worst_mm,worst_deg,wall_ms,cpu_ms,keys,held,lost\n");
      for (const auto& object : {scenes::textured_dome(), scenes::coin()})
        for (const uint32_t width : {80u, 160u, 320u, 640u}) perf::sweep(object, width, seconds);
      return 0;
    }
    std::printf("object,noise,method,last_mm,last_deg,worst_mm,worst_deg,wall_ms,cpu_ms,lost\n");
    for (const auto& [kind, noise] :
         {std::pair{DepthNoise::White, "white"}, {DepthNoise::Integrated, "integrated"}})
      for (const auto& object : {scenes::textured_dome(), scenes::coin()})
        perf::run(object, kind, noise, seconds);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 1;
  }
}
