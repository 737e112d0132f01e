#include "viz/commands/workflow/live_run.h"

#include <spdlog/spdlog.h>

#include <cstdlib>
#include <utility>

#include "capture/files/event_log.h"
#include "capture/files/measurements.h"
#include "capture/files/output_file.h"
#include "capture/live/live.h"
#include "capture/live/live_report.h"
#include "capture/open_source.h"
#include "capture/run/record_session.h"
#include "capture/session/session.h"
#include "engine/gpu/context.h"
#include "viz/commands/support/progress.h"
#include "viz/commands/workflow/serving.h"
#include "viz/live/history.h"

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

namespace {

/// Time of a recording's first frame, s: a session may have begun in the middle of a stream.
double start_of(Source& session) {
  Frame frame;
  const bool any = session.next(frame) && session.seek(0);
  return any ? 1e-9 * static_cast<double>(frame.time_ns) : 0;
}

}  // namespace

OpenInput open_input(const LiveRunRequest& request, const std::function<bool()>& cancelled) {
  OpenInput open;
  open.measured = find_input(request);
  open.source = open_source(open.measured.input, open.measured.sensor);
  open.source->watch(cancelled);
  open.background = load_background(open.measured.input, open.measured.sensor, *open.source);
  if (request.replay && is_session(request.input)) open.start_s = start_of(*open.source);
  open.presses = monitor_presses(request.block, open.measured, open.background,
                                 request.loop ? open.source->frame_count().value_or(0) : 0);
  return open;
}

std::filesystem::path recordings_folder(const viz::Settings& settings) {
  if (!settings.folder.empty()) return settings.folder;
  const char* home = std::getenv("HOME");
  return home && *home ? std::filesystem::path(home) / "palpate" : std::filesystem::path();
}

namespace {

/// Folder of snapshots and events of one input.
std::filesystem::path notes_folder(const LiveRunRequest& request) {
  if (!request.notes.empty()) return request.notes;
  if (!request.out.empty()) return request.out;
  if (request.replay && is_session(request.input)) return session_folder(request.input);
  if (request.recordings.empty()) return {};
  if (!is_recording(request.input)) {
    std::string name = request.input.substr(0, request.input.find('?'));
    for (char& c : name)
      if (c == ':' || c == '/') c = '-';
    return request.recordings / name;
  }
  // With the name of its folder, since many recordings are called alike.
  std::error_code code;
  std::filesystem::path path = std::filesystem::absolute(request.input, code).lexically_normal();
  if (path.filename().empty()) path = path.parent_path();
  const std::string folder = path.parent_path().filename().string();
  return request.recordings / ((folder.empty() ? "" : folder + "-") + path.filename().string());
}

}  // namespace

std::vector<viz::Event> known_events(const LiveRunRequest& request) {
  std::vector<viz::Event> events;
  const std::filesystem::path notes = notes_folder(request);
  const bool session = is_session(request.input);
  if (session) events = viz::read_events(session_folder(request.input));
  if (!session || notes != session_folder(request.input))
    for (viz::Event& event : viz::read_events(notes)) events.push_back(std::move(event));
  return events;
}

LiveRunReport run_live_input(gpu::Context& context, LiveRunRequest request, OpenInput opened) {
  const MeasuredInput& input = opened.measured;
  std::unique_ptr<Source> first = std::move(opened.source);
  if (input.session) as_recorded(request, *input.session);
  const PipelineOptions pipeline = pipeline_options(request, input.outputs, *first);
  LiveRunReport report{.measured = input, .format = first->format(), .live = {}, .sessions = {}};
  LiveOptions live;
  static_cast<LoopSettings&>(live) = request;
  live.input = input.input;
  live.interrupted = interrupted;
  live.replay = request.replay;
  live.presses = opened.presses.get();
  // A recording that is slow to measure takes longer: only a camera's frames cannot wait.
  live.measure_all = is_recording(input.input);
  std::optional<Measurements> measurements;
  std::optional<ContactRows> contacts;
  std::optional<Recording> recording;
  const std::filesystem::path folder = request.out.empty() ? request.recordings : request.out;
  const MeasuredColumns columns = MeasuredColumns::of(input.sensor, input.outputs, pipeline.separate)
                                      .with(MeasuredColumns::Time, first->rate_Hz() > 0);
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
  request.shown.notes = notes_folder(request);
  if (!folder.empty() && !live.replay) {
    recording.emplace([folder] { return new_session_folder(folder); },
                      session_info(input, *first, opened.background, pipeline, context),
                      SessionOptions{.no_drop = request.no_drop});
    recording->take(open_logs(request.logs));
    recording->watch(interrupted);
    live.recording = &*recording;
    if (request.record) recording->start();
  }
  if (live.replay) {
    request.shown.known_events = known_events(request);
    request.shown.replay_start_s = opened.start_s;
  }
  live.on_device_lost = [](const DeviceLost& lost) {
    spdlog::warn("{}; opened anew, the run goes on", lost.what());
  };
  std::optional<Serving> serving;
  if (request.serve.on) {
    serving.emplace(request.serve.options(), LiveHub::Publisher{input.sensor, pipeline.outputs, columns, {}},
                    request.shown.notes);
    serving->attach(live, recording ? &*recording : nullptr);
    spdlog::info("{}", serving->where());
  }
  // The source that is open already is the first round's: a camera cannot be opened twice.
  const OpenSource open = [&] { return first ? std::move(first) : open_source(input.input, input.sensor); };
  const MeasuredRun measured{input.sensor, opened.background, pipeline};
  report.live = request.window ? viz::run_live(context, open, measured, live, request.shown)
                               : run_without_window(context, open, measured, live);
  if (serving) report.served = serving->finish();
  if (measurements) measurements->close();
  if (contacts) contacts->close();
  if (recording) report.sessions = recording->finish();
  return report;
}

Report report_of(const LiveRunReport& run, const gpu::Context& context, bool ends_by_ctrl_c,
                 const json::Value& more) {
  const std::string error = recording_error(run.sessions);
  if (!error.empty()) spdlog::error("{}", error);
  json::Value value = {
      {"input", run.measured.input}, {"sensor", run.measured.sensor.name}, {"device", context.report().name}};
  const Facts facts = facts_of(run.live, run.sessions);
  for (const json::Value& part : {more, facts.json, run.served.json}) value.update(part);
  const int ended = run.live.interrupted && !ends_by_ctrl_c ? kInterrupted
                    : !error.empty()                        ? static_cast<int>(Failure::Output)
                    : validation_clean(context)             ? 0
                                                            : kInternalError;
  return {facts.text + run.served.text, value, ended};
}

}  // namespace palpate
