#include "viz/commands/workflow/live_pair.h"

#include <spdlog/spdlog.h>

#include <optional>
#include <utility>
#include <vector>

#include "capture/files/measurements.h"
#include "capture/files/output_file.h"
#include "capture/open_source.h"
#include "capture/pair/finger.h"
#include "capture/pair/pair_recording.h"
#include "capture/run/input.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "viz/commands/option_groups/pair_options.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"
#include "viz/commands/workflow/serving.h"
#include "viz/display/pair_window.h"

namespace fs = std::filesystem;

namespace palpate {
namespace {

/// Tables of a run that nobody records: measurements.csv of both, and their pairs.
class PairTables {
 public:
  PairTables(const fs::path& folder, std::array<OpenFinger, 2>& fingers, const std::optional<KnownGrip>& grip)
      : meter_(grip), fingers_(folder, fingers), pairs_(folder / kPairRows) {
    for (const Side side : kSides)
      fingers[index(side)].live.latency_file = finger_folder(folder, side) / "latency.csv";
    pairs_.append(grip_header());
  }
  void add(const Matched<FingerTouch>& pair) {
    pairs_.append(grip_row(meter_.add(pair)));
    ++rows_;
  }
  uint64_t rows() const { return rows_; }
  void close() {
    pairs_.close();
    fingers_.close();
  }

 private:
  PairMeter meter_;
  FingerTables fingers_;
  LineFile pairs_;
  uint64_t rows_ = 0;
};

}  // namespace

Report live_pair(gpu::Context& context, const LivePairRequest& request) {
  const RunWatch watch{.stop = interrupted};
  OpenPair open = request.recorded.empty() ? open_pair(request, watch)
                                           : open_recorded_pair(request.recorded, watch, request.fingers[0]);
  auto& [fingers, grip, info] = open;
  viz::PairWindowRun shown;
  shown.window = request.shown;
  shown.grip = grip;
  std::optional<PairTables> tables;
  std::optional<PairRecording> recording;
  const fs::path folder = request.out.empty() ? request.recordings : request.out;
  if (!request.out.empty()) tables.emplace(request.out, fingers, grip);
  if (!folder.empty() && request.recorded.empty()) {
    recording.emplace([folder] { return new_session_folder(folder); }, fingers, context, grip,
                      request.fingers[0].no_drop, watch);
    recording->take(open_logs(request.fingers[0].logs));
    shown.recording = &*recording;
    if (request.record) recording->start();
  }
  for (const Side side : kSides) {
    OpenFinger& finger = fingers[index(side)];
    shown.sensors[index(side)] = finger.found.sensor;
    // As a camera would give them, and a recording that is slow to measure takes longer.
    finger.live.unpaced = false;
    finger.live.measure_all = is_recording(finger.found.input);
    if (recording) finger.live.recording = &recording->of(side);
  }
  shown.window.notes = folder;
  viz::PairWindow window(context, std::move(shown));
  PairOptions options;
  options.viewer = &window;
  options.period_s = info.period_s;
  options.interrupted = interrupted;
  PairMeter lines(grip);
  options.on_pair = [&, jsonl = request.jsonl](const Matched<FingerTouch>& pair) {
    if (recording) recording->add(pair);
    if (tables) tables->add(pair);
    window.add(pair);
    if (jsonl) print_line(grip_json_line(lines.add(pair)));
  };
  options.on_state = [&window](Side side, const std::string& state) {
    window.set_state(side, state);
    if (!state.empty()) spdlog::warn("{}: {}; the other finger goes on", to_string(side), state);
  };
  options.on_device_lost = [](const DeviceLost& lost) {
    spdlog::warn("{}; opened anew, the run goes on", lost.what());
  };
  std::optional<Serving> serving;
  if (request.serve.on) {
    serving.emplace(request.serve.options(),
                    PairParts{fingers, options, recording ? &*recording : nullptr, grip}, folder);
    spdlog::info("{}", serving->where());
  }
  PairOutcome outcome;
  outcome.run = run_pair(context, {fingers[0].pair(), fingers[1].pair()}, options);
  if (tables) {
    tables->close();
    outcome.rows = tables->rows();
  }
  for (size_t i = 0; i < 2; ++i) {
    outcome.inputs[i] = fingers[i].found.input;
    outcome.sensors[i] = fingers[i].found.sensor.name;
  }
  if (tables) outcome.folders.push_back(request.out);
  if (recording) outcome.add(recording->finish());
  Facts facts = facts_of(outcome);
  if (serving) facts.take(serving->finish());
  const std::string error = outcome.error();
  if (!error.empty()) spdlog::error("the recording ended early: {}", error);
  facts.json["device"] = context.report().name;
  return {facts.text, facts.json,
          outcome.run.interrupted     ? kInterrupted
          : !error.empty()            ? static_cast<int>(Failure::Output)
          : validation_clean(context) ? 0
                                      : kInternalError};
}

}  // namespace palpate
