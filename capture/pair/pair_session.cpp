#include "capture/pair/pair_session.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "capture/files/measurements.h"
#include "capture/files/output_file.h"
#include "capture/log/session_logs.h"
#include "capture/pair/finger.h"
#include "capture/pair/pair_clock.h"
#include "capture/pair/pair_recording.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"

namespace fs = std::filesystem;

namespace palpate {
namespace {

using Fingers = std::array<OpenFinger, 2>;

/// Runs both to their end.
PairOutcome measure(gpu::Context& context, const Fingers& fingers, const PairRequest& request,
                    PairOptions options, const RunWatch& watch,
                    const std::function<void(PairOptions&)>& attach = {}) {
  options.on_state = request.on_state;
  options.on_device_lost = request.on_device_lost;
  uint64_t total = 0;
  for (const OpenFinger& finger : fingers)
    total += finger.live.max_frames != 0 ? finger.live.max_frames : finger.source->frame_count().value_or(0);
  options.on_progress = watch.begin("measuring both fingers", total);
  if (attach) attach(options);
  PairOutcome outcome;
  const std::array<PairFinger, 2> pair = {fingers[0].pair(), fingers[1].pair()};
  outcome.run = run_pair(context, pair, options);
  outcome.run.interrupted = watch.stopped();
  for (size_t i = 0; i < 2; ++i) {
    outcome.inputs[i] = fingers[i].found.input;
    outcome.sensors[i] = fingers[i].found.sensor.name;
  }
  return outcome;
}

void refuse_recorded(const fs::path& out) {
  if (fs::exists(out / kPairJson))
    throw Error(Failure::Output, "a folder without a session to record to",
                "'" + (out / kPairJson).string() + "'", "another --out folder");
}

}  // namespace

OpenPair open_pair(const PairRequest& request, const RunWatch& watch) {
  std::optional<KnownGrip> grip;
  if (!request.grip.empty()) grip = known_grip(load_grip(request.grip));
  OpenPair pair{{OpenFinger(request.fingers[0], false, watch), OpenFinger(request.fingers[1], false, watch)},
                std::move(grip),
                {}};
  if (!pair.grip) pair.grip = simulated_grip(pair.fingers[0].found.input, pair.fingers[1].found.input);
  pair.info = pair_info(pair.fingers);
  return pair;
}

OpenPair open_recorded_pair(const fs::path& folder, const RunWatch& watch, const RunSettings& given) {
  const PairInfo info = read_pair_info(folder);
  std::optional<KnownGrip> grip;
  if (info.grip) grip = known_grip(*info.grip);
  std::array<RunSettings, 2> settings = {given, given};
  for (const Side side : kSides) settings[index(side)].input = finger_folder(folder, side).string();
  return {{OpenFinger(settings[0], true, watch), OpenFinger(settings[1], true, watch)},
          std::move(grip),
          {.inputs = info.inputs, .period_s = info.period_s, .grip = {}, .skew = {}, .alone = {}}};
}

void PairOutcome::add(std::vector<PairRecording::Written> written) {
  for (PairRecording::Written& one : written) {
    rows += one.rows;
    folders.push_back(one.folder);
    logs.insert(logs.end(), one.logs.begin(), one.logs.end());
    recordings.push_back(std::move(one));
  }
}

std::vector<Recording::Written> PairOutcome::sessions(Side side) const {
  std::vector<Recording::Written> all;
  all.reserve(recordings.size());
  for (const PairRecording::Written& one : recordings) all.push_back(one.sessions[index(side)]);
  return all;
}

std::string PairOutcome::error() const {
  for (const PairRecording::Written& one : recordings)
    if (!one.error().empty()) return one.error();
  return {};
}

PairOutcome record_pair(const std::function<gpu::Context&()>& context, const PairRequest& request,
                        const RunWatch& watch) {
  if (!request.switched) refuse_recorded(request.out);
  OpenPair open = open_pair(request, watch);
  std::vector<std::unique_ptr<LogInput>> logs = open_logs(request.fingers[0].logs);
  Fingers& fingers = open.fingers;
  gpu::Context& device = context();
  const auto folder = [&request] {
    if (request.switched) return new_session_folder(request.out);
    refuse_recorded(request.out);
    return request.out;
  };
  std::optional<PairRecording> recording;
  if (!request.out.empty()) {
    recording.emplace(folder, fingers, device, open.grip, request.fingers[0].no_drop, watch);
    recording->take(std::move(logs));
  }
  if (recording && !request.switched) recording->start();
  for (const Side side : kSides) {
    LiveOptions& live = fingers[index(side)].live;
    if (recording) live.recording = &recording->of(side);
    if (request.paced && live.unpaced) live.unpaced = false;
  }
  PairOptions options;
  options.period_s = open.info.period_s;
  options.on_pair = [&](const Matched<FingerTouch>& pair) {
    const std::optional<GripFrame> row = recording ? recording->add(pair) : std::nullopt;
    if (row && request.on_row) request.on_row(*row);
  };
  options.interrupted = [&] {
    return watch.stopped() || (recording && !request.switched && !recording->latest().error().empty());
  };
  PairOutcome outcome = measure(device, fingers, request, std::move(options), watch, [&](PairOptions& run) {
    if (request.attach) request.attach({fingers, run, recording ? &*recording : nullptr, open.grip});
  });
  if (recording) outcome.add(recording->finish());
  return outcome;
}

PairOutcome process_pair(const std::function<gpu::Context&()>& context, const fs::path& folder,
                         const fs::path& out, const std::function<void(const GripFrame&)>& on_row,
                         const RunWatch& watch, const std::function<void(const PairParts&)>& attach) {
  std::error_code code;
  if (fs::equivalent(folder, out, code))
    throw Error(Failure::Output, "a folder of its own for the results",
                "'" + out.string() + "', which is measured", "another --out folder");
  OpenPair open = open_recorded_pair(folder, watch);
  make_output_folder(out);
  FingerTables measurements(out, open.fingers);
  PairRows rows(out, open.info, open.grip);
  std::optional<int64_t> zero_ns;
  std::vector<uint64_t> numbers;  // of the rows
  std::vector<double> times_s;
  PairOptions options;
  options.period_s = open.info.period_s;
  options.on_pair = [&](const Matched<FingerTouch>& pair) {
    if (!zero_ns) zero_ns = begin_of(pair);
    const GripFrame row = rows.add(pair, 1e-9 * static_cast<double>(begin_of(pair) - *zero_ns));
    numbers.push_back(numbers.size());
    times_s.push_back(1e-9 * static_cast<double>(row.time_ns));
    if (on_row) on_row(row);
  };
  options.interrupted = [&watch] { return watch.stopped(); };
  PairOutcome outcome =
      measure(context(), open.fingers, {}, std::move(options), watch, [&](PairOptions& run) {
        if (attach) attach({open.fingers, run, nullptr, open.grip});
      });
  rows.close();
  measurements.close();
  const FindClock clock = [&out](const fs::path& from) { return pair_clock(from, out / kPairRows); };
  for (const AlignedLog& log : session_logs(folder, outcome.logs, clock)) {
    write_log_at_frames(out / (log.table.name + "_log.csv"), log, numbers, times_s);
    outcome.logs.push_back(describe(log));
  }
  outcome.rows = rows.rows();
  outcome.folders = {out};
  return outcome;
}

}  // namespace palpate
