#include "capture/run/record_session.h"

#include <memory>

#include "capture/live/live.h"
#include "capture/open_source.h"
#include "capture/session/info.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "palpate/version.h"

namespace palpate {

SessionInfo session_info(const MeasuredInput& input, const Source& source, const Frame& background,
                         const PipelineOptions& pipeline, const gpu::Context& context) {
  SessionInfo info;
  info.input = input.input;
  if (has_scale(input.sensor)) info.sensor = input.sensor;
  info.format = source.format();
  info.rate_Hz = source.rate_Hz();
  if (input.sensor.background.kind == BackgroundKind::Untouched) info.background = background;
  info.outputs = pipeline.outputs;
  info.solver = pipeline.solver;
  info.solve_by = pipeline.solve_by;
  info.fixed_light = pipeline.fixed_light;
  info.separate = pipeline.separate;
  info.program_version = PALPATE_VERSION_TEXT;
  info.device = context.report().name;
  info.details = source.details();
  return info;
}

namespace {

std::unique_ptr<McapSink> begin_mcap(const RecordRequest& request, const PipelineOptions& pipeline,
                                     const gpu::Context& device, bool wait, const RunWatch& watch) {
  McapOptions options;
  options.sensor = for_rectified_frames(request.found.sensor);
  options.outputs = pipeline.outputs;
  options.columns = MeasuredColumns::of(options.sensor, pipeline.outputs, pipeline.separate);
  options.facts = {{"input", request.found.input}, {"device", device.report().name}};
  options.session = session_json(request.folder);
  McapSinkOptions how;
  if (wait) how.wait_unless = [&watch] { return watch.stopped(); };
  return std::make_unique<McapSink>(request.folder, std::move(options), std::move(how));
}

}  // namespace

RecordOutcome record_session(const std::function<gpu::Context&()>& context, const RecordRequest& request,
                             const RunWatch& watch) {
  const MeasuredInput& input = request.found;
  std::shared_ptr<Source> source = open_source(input.input, input.sensor);
  source->watch([&watch] { return watch.stopped(); });
  const Frame background = load_background(input.input, input.sensor, *source);
  std::vector<std::unique_ptr<LogInput>> logs = open_logs(request.logs);
  const std::unique_ptr<PressMonitor> presses = request.watch ? request.watch(background) : nullptr;
  const PipelineOptions pipeline = pipeline_options(request, input.outputs, *source);
  LiveOptions live;
  static_cast<LoopSettings&>(live) = request;
  // A recording can wait; a camera, or what plays one at a rate, cannot.
  live.unpaced = live.measure_all = !source->live() && live.rate_Hz <= 0;
  gpu::Context& device = context();
  const bool wait = request.no_drop || live.measure_all;
  Recording recording([&] { return request.folder; },
                      session_info(input, *source, background, pipeline, device),
                      SessionOptions{.no_drop = wait});
  recording.take(std::move(logs));
  recording.watch([&watch] { return watch.stopped(); });
  recording.start();
  std::unique_ptr<McapSink> mcap;
  if (request.mcap) {
    mcap = begin_mcap(request, pipeline, device, wait, watch);
    live.on_frame = [&mcap](const Frame& frame, const Result& result) { mcap->add(frame, result); };
  }
  const uint64_t total = live.max_frames != 0 ? live.max_frames : source->frame_count().value_or(0);
  live.on_progress = watch.begin("recording", total);
  live.input = input.input;
  live.presses = presses.get();
  live.recording = &recording;
  live.outlive_device = request.outlive_device;
  live.on_device_lost = request.on_device_lost;
  live.interrupted = [&] {
    return watch.stopped() || !recording.latest().status.error.empty() ||
           (mcap && !mcap->status().error.empty());
  };
  if (request.attach) request.attach(live, recording, pipeline);
  RecordOutcome outcome;
  outcome.live = run_without_window(
      device, [&] { return std::move(source); }, {input.sensor, background, pipeline}, live);
  if (mcap) outcome.mcap = mcap->close();
  outcome.session = recording.finish().at(0);
  outcome.live.interrupted = watch.stopped();
  return outcome;
}

}  // namespace palpate
