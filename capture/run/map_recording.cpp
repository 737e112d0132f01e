#include "capture/run/map_recording.h"

#include <algorithm>
#include <vector>

#include "capture/open_source.h"
#include "capture/run/run_recording.h"
#include "engine/gpu/context.h"
#include "engine/pipeline/object_follower.h"
#include "palpate/error.h"
#include "palpate/pipeline.h"

namespace palpate {
namespace {

/// A frame's depths below rest, and where the object touches.
class Depths {
 public:
  Depths(const FrameFormat& format, double pitch_mm, double share)
      : width_(format.width), height_(format.height), pitch_mm_(pitch_mm), share_(share) {}

  HeightMap of(const Result& result) {
    const std::span<const float> depths = result.depth_mm();
    depth_.assign(depths.begin(), depths.end());
    contact_.assign(depths.size(), 0);
    const Touch& touch = result.touch;
    if (touch.contact && touch.surface && !depth_.empty()) {
      sorted_ = depth_;
      // From the frame's own lowest places: where little of the pad is at rest, its level is not known.
      const auto fiftieth = static_cast<std::ptrdiff_t>(sorted_.size() / 50);
      const auto low = sorted_.begin() + fiftieth, deep = sorted_.end() - 1 - fiftieth;
      std::nth_element(sorted_.begin(), low, sorted_.end());
      std::nth_element(low, deep, sorted_.end());
      constexpr double kSure = 4, kLeast_mm = 0.01;  // clear of the depths' noise
      const double range = double{*deep} - double{*low};
      const auto level = static_cast<float>(
          double{*low} + std::max({share_ * range, kSure * touch.surface->depth_sd_mm, kLeast_mm}));
      std::transform(depth_.begin(), depth_.end(), contact_.begin(),
                     [&](float depth) { return depth > level ? 1 : 0; });
    }
    return {.width = width_,
            .height = height_,
            .pitch_mm_per_px = pitch_mm_,
            .depth_mm = depth_,
            .contact = contact_};
  }

 private:
  uint32_t width_, height_;
  double pitch_mm_, share_;
  std::vector<float> depth_, sorted_;
  std::vector<uint8_t> contact_;
};

void require_surface(const MapRequest& request, const MeasuredInput& input) {
  if (!wants(input.outputs, Output::Surface))
    throw Error(Failure::Usage, "a sensor that measures a surface, for '" + request.input + "'",
                "one without", "--sensor with a file that has \"reading\"");
  if (!has_scale(input.sensor))
    throw Error(Failure::Usage, "a sensor whose scale is known", "lengths in px", "palpate calibrate scale");
}

}  // namespace

RecordingMap map_recording(gpu::Context& context, const MapRequest& request, const RunWatch& watch) {
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
  Depths depths(source->format(), out.pitch_mm, request.contact_share);
  PoseTracker tracker(pose_options(input.sensor));
  ObjectMap map(request.map);
  const RunWatch::Progress progress = watch.begin("mapping", source->frame_count().value_or(0));
  run_recording(*source, pipeline, request.max_frames, watch.stop, [&](const Result& result, const Frame&) {
    const HeightMap seen = depths.of(result);
    const Pose& pose = tracker.update(seen);
    map.add(seen, pose, result.touch.sequence);
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
  });
  map.finish();
  if (out.frames == 0 && !watch.stopped())
    throw Error(Failure::Input, "frames in '" + request.input + "'", "none", "another recording");
  out.map = map.snapshot();
  out.complete = !watch.stopped();
  out.warning = source->warning();
  return out;
}

}  // namespace palpate
