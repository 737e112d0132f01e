#include "capture/run/compare/recording_curve.h"

#include <algorithm>
#include <cmath>

#include "capture/open_source.h"
#include "capture/run/largest.h"
#include "capture/run/run_recording.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "palpate/pipeline.h"

namespace palpate {
namespace {

CurvePoint point_of(const Touch& touch) {
  CurvePoint point;
  point.time_s = 1e-9 * static_cast<double>(touch.time_ns);
  point.contact = touch.contact;
  point.force_N = force_of_touch(touch);
  if (touch.surface)
    point.depth_mm = {touch.contact ? touch.surface->depth_max_mm : 0,
                      touch.contact ? touch.surface->depth_sd_mm : 0,
                      touch.contact ? touch.surface->validity : Validity::NoContact};
  point.area_mm2 = touch.contact ? touch.area_mm2 : 0;
  return point;
}

/// The middle of each cell of the picture.
void add_map(RecordingCurve& curve, const Result& result, const Frame& frame) {
  const FrameFormat& format = frame.format;
  const std::span<const float> depths = curve.has_depth ? result.depth_mm() : std::span<const float>{};
  const uint32_t shift = format.bit_depth - 8;
  for (uint32_t y = 0; y < curve.height; ++y)
    for (uint32_t x = 0; x < curve.width; ++x) {
      const uint32_t u = (2 * x + 1) * format.width / (2 * curve.width),
                     v = (2 * y + 1) * format.height / (2 * curve.height);
      if (!curve.has_depth) {
        curve.maps.push_back(static_cast<uint16_t>(frame.at(format.channels == 3 ? 1 : 0, u, v) >> shift));
        continue;
      }
      const double depth_mm = result.touch.contact ? static_cast<double>(depths[v * format.width + u]) : 0;
      const double units = std::clamp(depth_mm / RecordingCurve::kDepthUnit_mm, 0.0, 65535.0);
      curve.maps.push_back(static_cast<uint16_t>(std::lround(units)));
    }
}

}  // namespace

const uint16_t* RecordingCurve::map_of(size_t index) const {
  const size_t cells = size_t{width} * height, count = cells > 0 ? maps.size() / cells : 0;
  return count > 0 ? maps.data() + cells * std::min(index / map_every, count - 1) : nullptr;
}

size_t RecordingCurve::index_at(double time_s) const {
  const auto above = std::ranges::lower_bound(points, time_s, {}, &CurvePoint::time_s);
  if (above == points.begin()) return 0;
  const auto index = static_cast<size_t>(above - points.begin());
  return above == points.end() || time_s - points[index - 1].time_s <= above->time_s - time_s ? index - 1
                                                                                              : index;
}

RecordingCurve measure_curve(gpu::Context& context, const RunSettings& settings,
                             std::vector<viz::Event> events, const RunWatch& watch) {
  RunSettings run = settings;
  const MeasuredInput input = find_input(run);
  if (input.session) as_recorded(run, *input.session);
  const std::unique_ptr<Source> source = open_source(input.input, input.sensor);
  source->watch([&watch] { return watch.stopped(); });
  if (source->rate_Hz() <= 0 && run.rate_Hz <= 0)
    throw Error(Failure::Usage, "recordings whose frames have times",
                "'" + input.input + "', pictures without", "--rate with the frames a second");
  const Frame background = load_background(input.input, input.sensor, *source);
  const PipelineOptions options = pipeline_options(run, input.outputs, *source, SurfaceSolver::Best);
  Pipeline pipeline(context, for_rectified_frames(input.sensor), source->format(), options);
  pipeline.set_background(background);

  RecordingCurve curve;
  curve.input = settings.input;
  curve.sensor = input.sensor;
  curve.has_depth = wants(input.outputs, Output::Surface);
  curve.events = std::move(events);
  curve.rate_Hz = source->rate_Hz() > 0 ? source->rate_Hz() : run.rate_Hz;
  const FrameFormat format = source->format();
  curve.width = std::min(format.width, RecordingCurve::kMapWidth);
  curve.height = std::max(1u, curve.width * format.height / format.width);
  const uint64_t frames = source->frame_count().value_or(0);
  curve.map_every =
      std::max<uint64_t>(1, (frames + RecordingCurve::kMostMaps - 1) / RecordingCurve::kMostMaps);
  const RunWatch::Progress progress = watch.begin("measuring", frames);
  run_recording(*source, pipeline, run.max_frames, watch.stop, [&](const Result& result, const Frame& frame) {
    if (curve.points.size() % curve.map_every == 0) add_map(curve, result, frame);
    curve.points.push_back(point_of(result.touch));
    if (source->rate_Hz() <= 0)
      curve.points.back().time_s = static_cast<double>(result.touch.sequence) / curve.rate_Hz;
    progress(curve.points.size());
  });
  if (curve.points.empty())
    throw Error(Failure::Input, "frames in '" + settings.input + "'", "none", "another recording");
  curve.warning = source->warning();
  return curve;
}

}  // namespace palpate
