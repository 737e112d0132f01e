#include "capture/run/map/map_recording.h"

#include <algorithm>

#include "capture/files/map_files.h"
#include "capture/files/output_file.h"
#include "capture/open_source.h"
#include "capture/run/map/touched_depths.h"
#include "capture/run/run_recording.h"
#include "engine/base/text.h"
#include "engine/gpu/context.h"
#include "engine/pipeline/object_follower.h"
#include "palpate/error.h"
#include "palpate/pipeline.h"

namespace palpate {
namespace {

void require_within(const char* option, double value, double least, double most) {
  if (!(value >= least && value <= most))
    throw Error(Failure::Usage, text("%s %g to %g", option, least, most), text("%g", value),
                text("%s %g", option, std::clamp(value, least, most)));
}

void require_options(const MapRequest& request) {
  const MapOptions& map = request.map;
  constexpr double kLargest_mm = 100;
  if (map.pitch_mm != 0) require_within("--pitch-mm", map.pitch_mm, 1e-4, kLargest_mm);
  require_within("--key-overlap", map.key_overlap, MapRequest::kLeastOverlap, MapRequest::kMostOverlap);
  require_within("--links", map.links, 1, MapRequest::kMostLinks);
  require_within("--most-keys", map.most_keys, 2, MapRequest::kMostKeys);
  require_within("--contact-share", request.contact_share, MapRequest::kLeastShare, MapRequest::kMostShare);
}

void require_surface(const MapRequest& request, const MeasuredInput& input) {
  if (!wants(input.outputs, Output::Surface))
    throw Error(Failure::Usage, "a sensor that measures a surface, for '" + request.input + "'",
                "one without", "--sensor with a file that has \"reading\"");
  if (!has_scale(input.sensor))
    throw Error(Failure::Usage, "a sensor whose scale is known", "lengths in px", "palpate calibrate scale");
}

}  // namespace

json::Value map_report(const RecordingMap& found) {
  json::Value report = map_json(*found.map);
  report["frames"] = found.frames;
  report["frames_tracked"] = found.tracked;
  report["frames_lost"] = found.lost;
  report["frames_without_contact"] = found.no_contact;
  report["tracks"] = found.tracks;
  json::Value surfaces = json::Value::object();
  for (const auto& [name, frames] : found.surfaces) surfaces[name] = frames;
  report["frames_by_surface"] = surfaces;
  report["complete"] = found.complete;
  return report;
}

std::vector<std::string> write_map(const std::filesystem::path& folder, const RecordingMap& found) {
  make_output_folder(folder);
  std::vector<std::string> names = write_map(folder, *found.map);
  write_whole(folder / "map.json", std::string_view(map_report(found).dump(2) + "\n"));
  names.emplace_back("map.json");
  return names;
}

RecordingMap map_recording(gpu::Context& context, const MapRequest& request, const RunWatch& watch) {
  require_options(request);
  const MeasuredInput input = find_input(request);
  require_surface(request, input);
  const std::unique_ptr<Source> source = open_source(input.input, input.sensor);
  source->watch([&watch] { return watch.stopped(); });
  const Frame background = load_background(input.input, input.sensor, *source);
  RunSettings run = request;
  run.one_sequence = true;
  const Outputs outputs = Output::Force | Output::Surface;
  Pipeline pipeline(context, for_rectified_frames(input.sensor), source->format(),
                    pipeline_options(run, outputs, *source, SurfaceSolver::Best));
  pipeline.set_background(background);

  RecordingMap out;
  out.pitch_mm = input.sensor.pitch_mm_per_px;
  TouchedDepths depths(source->format(), out.pitch_mm, request.contact_share);
  PoseTracker tracker(pose_options(input.sensor));
  ObjectMap map(request.map);
  const RunWatch::Progress progress = watch.begin("mapping", source->frame_count().value_or(0));
  const auto take = [&](const Result& result, const Frame&) {
    const Touch& touch = result.touch;
    const HeightMap seen = depths.of(result.depth_mm(), touch.contact && touch.surface,
                                     touch.surface.value_or(SurfaceSummary{}).depth_sd_mm);
    const Pose& pose = tracker.update(seen);
    map.add(seen, pose, touch.sequence);
    // Here, and not beside the frames: a recording gives the same map each time.
    while (map.work(ObjectMap::Work::Places)) {
    }
    ++out.frames;
    out.no_contact += pose.state == PoseState::NoContact ? 1 : 0;
    out.lost += pose.state == PoseState::Lost ? 1 : 0;
    out.tracks = pose.track;
    if (pose.state == PoseState::Tracked) ++out.surfaces[to_string(pose.surface)];
    if (pose.state == PoseState::Tracked || pose.state == PoseState::Begun) ++out.tracked;
    progress(out.frames);
  };
  try {
    run_recording(*source, pipeline, request.max_frames, watch.stop, take);
  } catch (const Error& error) {
    // What came before it is good.
    if (out.frames == 0) throw;
    out.error = error.what();
  }
  map.finish();
  if (out.frames == 0 && !watch.stopped())
    throw Error(Failure::Input, "frames in '" + request.input + "'", "none", "another recording");
  out.map = map.snapshot();
  out.complete = !watch.stopped() && out.error.empty();
  out.warning = source->warning();
  return out;
}

}  // namespace palpate
