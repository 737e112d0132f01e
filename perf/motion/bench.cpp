// Motion bench: an object slides and turns for ten seconds; error and time of the pose tracker and of plain
// point-to-plane registration, on the same frames.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>
#include <vector>

#include "engine/motion/pose_tracker.h"
#include "perf/measure.h"
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

}  // namespace
}  // namespace palpate::perf

// Seconds of motion, 10 by default.
int main(int argc, char** argv) {
  using namespace palpate;
  using scenes::DepthNoise;
  try {
    const double seconds = argc > 1 ? std::strtod(argv[1], nullptr) : 10;
    if (!(seconds > 0)) {
      std::fprintf(stderr, "wanted seconds > 0; found '%s'; try 10\n", argv[1]);
      return 2;
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
