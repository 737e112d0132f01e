// Maps of a relief of 60 x 20 mm: error against run time, over resolution, key frames and loops, as CSV.
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "perf/map/relief.h"

namespace palpate::scenes {
namespace {

struct Seen {
  PressedMap map;
  Pose pose;
};

/// A run of the pad over the relief, followed.
struct Run {
  PadView pad;
  std::vector<RigidMotion> path;
  std::vector<Seen> frames;
  double tracker_s = 0;
  int lost = 0;
};

double processor_s() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

Run follow(const Relief& relief, bool fine, DepthNoise noise) {
  Run run{wide_pad(fine), raster_path(), {}};
  const SolidObject object = relief.object();
  std::mt19937 random(1);
  PoseTracker tracker;
  for (const RigidMotion& motion : run.path) {
    PressedMap map = pressed(object, motion, run.pad, 0.002, noise, random);
    const double before = processor_s();
    const Pose& pose = tracker.update(map.map());
    run.tracker_s += processor_s() - before;
    run.lost += pose.state == PoseState::Lost ? 1 : 0;
    run.frames.push_back({std::move(map), pose});
  }
  return run;
}

void measure(const Relief& relief, const Run& run, const std::string& option, const MapOptions& options) {
  ObjectMap map(options);
  const double before = processor_s();
  for (size_t frame = 0; frame < run.frames.size(); ++frame) {
    map.add(run.frames[frame].map.map(), run.frames[frame].pose, frame);
    while (map.work(ObjectMap::Work::Places)) {
    }
  }
  const double places_s = processor_s() - before;
  map.finish();
  const double all_s = processor_s() - before;
  const std::shared_ptr<const MapSnapshot> made = map.snapshot();
  if (made->pieces.empty()) {
    std::printf("%u,%s,%u,0\n", run.pad.width, option.c_str(), made->keys);
    return;
  }
  const MapPiece& largest = made->pieces.front();
  const MapErrors off = errors_of(largest.map, relief, run.pad.skin_px * run.pad.pitch_mm,
                                  run.path[largest.keys.front().frame]);
  double back_mm = NAN;
  if (const auto place = map.place())
    back_mm = twist_between(place->motion, run.path.back() * run.path.front().inverse(),
                            run.frames.back().pose.at_mm)
                  .head<3>()
                  .norm();
  std::printf("%u,%s,%u,%zu,%u,%u,%.2f,%.2f,%.5f,%.5f,%.5f,%.3f,%.5f,%.3f,%.5f\n", run.pad.width,
              option.c_str(), made->keys, made->pieces.size(), made->loops, made->refused, places_s, all_s,
              off.rms_mm, off.relief_rms_mm, off.stated_mm, off.held, off.seam_mm, off.covered, back_mm);
  std::fflush(stdout);
}

/// The defaults first; each line differs from them in one option.
std::vector<std::pair<std::string, MapOptions>> variants(bool all) {
  std::vector<std::pair<std::string, MapOptions>> out = {{"default", {}}, {"no loops", {.loops = false}}};
  if (!all) return out;
  for (const double overlap : {0.4, 0.55, 0.8, 0.9})
    out.emplace_back("overlap " + std::to_string(overlap).substr(0, 4), MapOptions{.key_overlap = overlap});
  for (const uint32_t links : {2u, 3u, 12u})
    out.emplace_back("links " + std::to_string(links), MapOptions{.links = links});
  out.emplace_back("half the key frames' resolution", MapOptions{.most_frame_px = 5'000});
  MapOptions coarse;
  coarse.registration.finest_level = 1;
  out.emplace_back("finest level 1", coarse);
  return out;
}

}  // namespace
}  // namespace palpate::scenes

/// "fine": 320 x 240 px, the defaults alone.
int main(int count, char** arguments) {
  using namespace palpate::scenes;
  const bool fine = count > 1 && std::string_view(arguments[1]) == "fine";
  const Relief relief;
  std::printf(
      "width_px,option,keys,pieces,loops,refused,places_s,all_s,map_rms_mm,relief_rms_mm,stated_mm,held,seam_"
      "mm,"
      "covered,return_mm\n");
  const Run run = follow(relief, fine, palpate::scenes::DepthNoise::Integrated);
  std::fprintf(stderr, "%zu frames, tracker %.1f s, lost %d\n", run.frames.size(), run.tracker_s, run.lost);
  for (const auto& [option, options] : variants(!fine)) measure(relief, run, option, options);
  return 0;
}
