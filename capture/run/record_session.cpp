#include "capture/run/record_session.h"

#include <memory>

#include "capture/open_source.h"
#include "capture/run/run_recording.h"
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
  info.skip_untouched = pipeline.skip_untouched;
  info.warm_start = pipeline.warm_start;
  info.fixed_light = pipeline.fixed_light;
  info.separate = pipeline.separate;
  info.program_version = PALPATE_VERSION_TEXT;
  info.device = context.report().name;
  info.details = source.details();
  return info;
}

SessionStatus record_session(gpu::Context& context, const MeasuredInput& input, PipelineOptions options,
                             bool one_sequence, uint64_t frames, const std::filesystem::path& folder,
                             const RunWatch& watch) {
  const std::unique_ptr<Source> source = open_source(input.input, input.sensor);
  source->watch([&watch] { return watch.stopped(); });
  const Frame background = load_background(input.input, input.sensor, *source);
  options.separate = separate_presses(*source, one_sequence);
  Pipeline pipeline(context, for_rectified_frames(input.sensor), source->format(), options);
  pipeline.set_background(background);
  SessionOptions session;
  session.no_drop = !source->live();
  SessionWriter writer(folder, session_info(input, *source, background, options, context), session);
  writer.watch([&watch] { return watch.stopped(); });
  const RunWatch::Progress progress = watch.begin("recording", source->frame_count().value_or(0));
  uint64_t done = 0;
  run_recording(*source, pipeline, frames, watch.stop, [&](const Result& result, const Frame& frame) {
    if (writer.record(frame)) writer.measured(result.touch);
    progress(++done);
  });
  SessionStatus status = writer.close();
  if (!status.error.empty())
    throw Error(Failure::Output, "a session in '" + folder.string() + "'", status.error, "another folder");
  return status;
}

}  // namespace palpate
