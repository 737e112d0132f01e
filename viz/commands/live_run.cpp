#include "viz/commands/live_run.h"

#include <spdlog/spdlog.h>

#include <utility>

#include "capture/files/event_log.h"
#include "capture/files/measurements.h"
#include "capture/files/output_file.h"
#include "capture/open_source.h"
#include "engine/gpu/context.h"
#include "viz/commands/progress.h"
#include "viz/display/run_live.h"
#include "viz/live/history.h"
#include "viz/live/live_report.h"

namespace palpate {

Remembered::Remembered() : file_(viz::settings_file()) {
  viz::LoadedSettings loaded = viz::load_settings(file_);
  settings = std::move(loaded.settings);
  warning = std::move(loaded.warning);
  if (!warning.empty()) spdlog::warn("{}", warning);
}

Remembered::~Remembered() {
  save();
}

void Remembered::save() const {
  try {
    viz::save_settings(settings, file_);
  } catch (const std::exception& e) {
    spdlog::warn("the window's settings are not kept: {}", e.what());
  }
}

OpenInput open_input(const Common& common, const LiveRunRequest& request,
                     const std::function<bool()>& cancelled) {
  OpenInput open;
  open.measured = find_input(common.seed, request.input, request.sensor, request.background);
  open.source = open_source(open.measured.input, open.measured.sensor);
  open.source->watch(cancelled);
  open.background = load_background(open.measured.input, open.measured.sensor, *open.source);
  open.presses = monitor_presses(request.block, open.measured, open.background,
                                 request.live.loop ? open.source->frame_count().value_or(0) : 0);
  return open;
}

std::filesystem::path session_folder(const std::filesystem::path& session) {
  return std::filesystem::is_directory(session) ? session : session.parent_path();
}

LiveRunReport run_live_benchmark(gpu::Context& context, LiveRunRequest request, OpenInput opened) {
  const MeasuredInput& input = opened.measured;
  std::unique_ptr<Source> first = std::move(opened.source);
  const PipelineOptions pipeline{.outputs = input.outputs,
                                 .solver = request.solver,
                                 .skip_untouched = request.skip_untouched,
                                 .fixed_light = request.fixed_light};
  LiveRunReport report{.measured = input, .format = first->format(), .live = {}, .sessions = {}};
  viz::LiveOptions& live = request.live;
  live.presses = opened.presses.get();
  std::optional<Measurements> measurements;
  std::optional<ContactRows> contacts;
  std::optional<viz::Recording> recording;
  const std::filesystem::path folder = request.out.empty() ? request.recordings : request.out;
  const MeasuredColumns columns =
      MeasuredColumns::of(input.sensor, input.outputs).with(MeasuredColumns::Time, first->rate_Hz() > 0);
  if (!request.out.empty()) {
    make_output_folder(request.out);
    measurements.emplace(request.out / "measurements.csv", columns);
    if (wants(input.outputs, Output::Contacts)) contacts.emplace(request.out / "contacts.csv", columns);
    live.latency_file = request.out / "latency.csv";
  }
  if (measurements || request.on_row)
    live.on_result = [&](const Touch& touch) {
      if (measurements) measurements->add(touch, nullptr);
      if (contacts) contacts->add(touch);
      if (request.on_row) request.on_row(json_line(touch, columns));
    };
  if (!folder.empty()) {
    live.snapshots = live.events = folder;
    if (!live.replay) {
      recording.emplace([folder] { return viz::new_session_folder(folder); },
                        session_info(input, *first, opened.background, pipeline, context), request.session);
      recording->watch(interrupted);
      live.recording = &*recording;
      if (request.record) recording->start();
    }
  }
  if (live.replay) {
    // Events marked during the recording and those marked now are kept together.
    const std::filesystem::path session = session_folder(request.input);
    for (const viz::Event& event : viz::read_events(session))
      live.known_events.push_back({event.time_s, viz::label_of(event)});
    live.events = session;
  }
  // The source that is open already is the first round's: a camera cannot be opened twice.
  const auto open = [&] { return first ? std::move(first) : open_source(input.input, input.sensor); };
  report.live = viz::run_live(context, open, input.sensor, opened.background, pipeline, live);
  if (measurements) measurements->close();
  if (contacts) contacts->close();
  if (recording) report.sessions = recording->finish();
  return report;
}

}  // namespace palpate
