#include "capture/pair/pair_session.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "capture/files/measurements.h"
#include "capture/files/output_file.h"
#include "capture/open_source.h"
#include "capture/run/record_session.h"
#include "capture/synthetic/synthetic.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"

namespace fs = std::filesystem;

namespace palpate {
namespace {

/// One finger, opened.
struct OpenFinger {
  MeasuredInput found;
  std::shared_ptr<Source> source;
  Frame background;
  PipelineOptions pipeline;
  LiveOptions live;
  std::optional<Recording> recording;
  std::optional<Measurements> measurements;

  /// `again`: a recorded finger with the settings that it was recorded with.
  OpenFinger(RunSettings settings, bool again, const RunWatch& watch) : found(find_input(settings)) {
    if (again) {
      as_recorded(settings, found.session.value());
      found.outputs = found.session->outputs;
    }
    source = open_source(found.input, found.sensor);
    source->watch([&watch] { return watch.stopped(); });
    background = load_background(found.input, found.sensor, *source);
    pipeline = pipeline_options(settings, found.outputs, *source);
    if (pipeline.separate)
      throw Error(Failure::Usage, "frames with times, to be paired",
                  "'" + settings.input + "': pictures without a rate", "--rate, the rate they were taken at");
    static_cast<LoopSettings&>(live) = settings;
    live.input = found.input;
    live.unpaced = live.measure_all = !source->live() && live.rate_Hz <= 0;
  }
  double rate_Hz() const { return live.rate_Hz > 0 ? live.rate_Hz : source->rate_Hz(); }
  PairFinger pair() {
    return {
        [first = source]() mutable { return std::move(first); }, {found.sensor, background, pipeline}, live};
  }
};

/// Both are fingers of one simulated grip.
std::optional<SyntheticOptions> simulated_grip(const std::array<OpenFinger, 2>& fingers) {
  for (const OpenFinger& finger : fingers)
    if (!finger.found.input.starts_with("synthetic:grip?")) return std::nullopt;
  return parse_synthetic(fingers[0].found.input);
}

/// The poses of that scene's pads, and the gripper's opening from its truth.
GripFile grip_of(const SyntheticOptions& scene, const fs::path& out) {
  constexpr double kLogStep_s = 0.01, kEndless_s = 600;
  GripFile grip;
  grip.geometry.pads[0].rotation = {{{0, 0, -1}, {1, 0, 0}, {0, -1, 0}}};
  grip.geometry.pads[1].rotation = {{{0, 0, 1}, {1, 0, 0}, {0, 1, 0}}};
  grip.opening.log = kOpeningLog;
  std::vector<double> times_s, openings_mm;
  const std::optional<uint64_t> frames = SyntheticSensor(scene).frame_count();
  const double end_s = frames ? 1 + static_cast<double>(*frames) / scene.rate_Hz : kEndless_s;
  const GripScript script(scene);
  for (int k = 0; kLogStep_s * k < end_s; ++k) {
    times_s.push_back(kLogStep_s * k);
    openings_mm.push_back(script.at(times_s.back()).opening_mm);
  }
  write_opening_log(out / kOpeningLog, times_s, openings_mm);
  return grip;
}

/// Writer of pairs.csv.
class PairRows {
 public:
  PairRows(const fs::path& folder, const std::optional<GripFile>& grip,
           std::function<void(const GripFrame&)> on_row)
      : file_(folder / kPairRows), on_row_(std::move(on_row)) {
    // Without poses the forces along the normals are known, and nothing else.
    posed_ = grip.has_value();
    meter_.emplace(grip ? grip->geometry : GripGeometry{});
    if (grip) opening_ = OpeningSeries(grip->opening);
    file_.append(grip_header());
  }

  void add(const Matched<FingerTouch>& pair) {
    const auto &left = pair.left(), &right = pair.right();
    const int64_t time_ns = !left    ? right->time_ns
                            : !right ? left->time_ns
                                     : left->time_ns + (right->time_ns - left->time_ns) / 2;
    if (!zero_ns_) zero_ns_ = left && right ? left->time_ns : time_ns;
    GripFrame frame;
    frame.time_ns = time_ns - *zero_ns_;
    frame.opening_mm = opening_.at(1e-9 * static_cast<double>(frame.time_ns));
    if (left) frame.left = left->touch.sequence;
    if (right) frame.right = right->touch.sequence;
    if (left && right) {
      frame.skew_ms = 1e-6 * static_cast<double>(pair.skew_ns);
      frame.grip = meter_->add(left->touch, right->touch, frame.opening_mm);
      if (!posed_) {
        for (Estimate* unknown :
             {&frame.grip->load_x_N, &frame.grip->load_y_N, &frame.grip->load_z_N, &frame.grip->turn_rad})
          *unknown = {};
      }
    }
    file_.append(grip_row(frame));
    ++rows_;
    if (on_row_) on_row_(frame);
  }
  uint64_t rows() const { return rows_; }
  void close() { file_.close(); }

 private:
  LineFile file_;
  std::function<void(const GripFrame&)> on_row_;
  bool posed_;
  std::optional<GripMeter> meter_;
  OpeningSeries opening_;
  std::optional<int64_t> zero_ns_;
  uint64_t rows_ = 0;
};

double period_s(const std::array<OpenFinger, 2>& fingers) {
  double slowest_Hz = 0;
  for (const OpenFinger& finger : fingers)
    if (const double Hz = finger.rate_Hz(); Hz > 0 && (slowest_Hz == 0 || Hz < slowest_Hz)) slowest_Hz = Hz;
  return 1 / (slowest_Hz > 0 ? slowest_Hz : 30);
}

/// Runs both and writes pairs.csv and pair.json.
PairOutcome measure(gpu::Context& context, std::array<OpenFinger, 2>& fingers, PairInfo info,
                    const PairRequest& request, const RunWatch& watch) {
  PairInfo shown = info;
  // The log lies in the folder, whatever folder it is moved to.
  if (info.grip && !info.grip->opening.log.empty()) {
    info.grip->opening.log = kOpeningLog;
    if (info.grip->opening.log != shown.grip->opening.log && !fs::exists(request.out / kOpeningLog))
      fs::copy_file(shown.grip->opening.log, request.out / kOpeningLog);
    shown.grip->opening.log = request.out / kOpeningLog;
  }
  write_pair_info(request.out, info);
  PairRows rows(request.out, shown.grip, request.on_row);
  PairOptions options;
  options.period_s = info.period_s;
  options.on_pair = [&rows](const Matched<FingerTouch>& pair) { rows.add(pair); };
  options.on_state = request.on_state;
  options.on_device_lost = request.on_device_lost;
  options.interrupted = [&] {
    return watch.stopped() || std::ranges::any_of(fingers, [](const OpenFinger& finger) {
             return finger.recording && !finger.recording->latest().status.error.empty();
           });
  };
  uint64_t total = 0;
  for (const OpenFinger& finger : fingers)
    total += finger.live.max_frames != 0 ? finger.live.max_frames : finger.source->frame_count().value_or(0);
  options.on_progress = watch.begin("measuring both fingers", total);
  PairOutcome outcome;
  const std::array<PairFinger, 2> pair = {fingers[0].pair(), fingers[1].pair()};
  outcome.run = run_pair(context, pair, options);
  outcome.run.interrupted = watch.stopped();
  rows.close();
  for (size_t i = 0; i < 2; ++i) {
    OpenFinger& finger = fingers[i];
    outcome.inputs[i] = finger.found.input;
    outcome.sensors[i] = finger.found.sensor.name;
    if (finger.recording) outcome.sessions[i] = finger.recording->finish().at(0);
    if (finger.measurements) finger.measurements->close();
  }
  outcome.rows = rows.rows();
  info.complete = true;
  info.skew = outcome.run.skew;
  info.alone = outcome.run.alone;
  write_pair_info(request.out, info);
  return outcome;
}

}  // namespace

PairOutcome record_pair(const std::function<gpu::Context&()>& context, const PairRequest& request,
                        const RunWatch& watch) {
  if (fs::exists(request.out / kPairJson))
    throw Error(Failure::Output, "a folder without a session to record to",
                "'" + (request.out / kPairJson).string() + "'", "another --out folder");
  std::optional<GripFile> grip;
  if (!request.grip.empty()) grip = load_grip(request.grip);
  if (grip) OpeningSeries{grip->opening};  // a log that cannot be read is refused before anything is made
  std::array<OpenFinger, 2> fingers = {OpenFinger(request.fingers[0], false, watch),
                                       OpenFinger(request.fingers[1], false, watch)};
  gpu::Context& device = context();
  make_output_folder(request.out);
  const std::optional<SyntheticOptions> scene = simulated_grip(fingers);
  if (!grip && scene) grip = grip_of(*scene, request.out);
  for (const Side side : kSides) {
    OpenFinger& finger = fingers[index(side)];
    finger.recording.emplace(
        [folder = finger_folder(request.out, side)] { return folder; },
        session_info(finger.found, *finger.source, finger.background, finger.pipeline, device),
        SessionOptions{.no_drop = request.fingers[index(side)].no_drop || finger.live.measure_all});
    finger.recording->watch([&watch] { return watch.stopped(); });
    finger.recording->start();
    finger.live.recording = &*finger.recording;
  }
  PairInfo info;
  info.inputs = {fingers[0].found.input, fingers[1].found.input};
  info.period_s = period_s(fingers);
  info.grip = std::move(grip);
  return measure(device, fingers, std::move(info), request, watch);
}

PairOutcome process_pair(const std::function<gpu::Context&()>& context, const fs::path& folder,
                         const fs::path& out, const std::function<void(const GripFrame&)>& on_row,
                         const RunWatch& watch) {
  std::error_code code;
  if (fs::equivalent(folder, out, code))
    throw Error(Failure::Output, "a folder of its own for the results",
                "'" + out.string() + "', which is measured", "another --out folder");
  const PairInfo info = read_pair_info(folder);
  PairRequest request;
  request.out = out;
  request.on_row = on_row;
  for (const Side side : kSides) request.fingers[index(side)].input = finger_folder(folder, side).string();
  std::array<OpenFinger, 2> fingers = {OpenFinger(request.fingers[0], true, watch),
                                       OpenFinger(request.fingers[1], true, watch)};
  make_output_folder(out);
  for (const Side side : kSides) {
    OpenFinger& finger = fingers[index(side)];
    make_output_folder(finger_folder(out, side));
    finger.measurements.emplace(finger_folder(out, side) / "measurements.csv",
                                MeasuredColumns::of(finger.found.sensor, finger.found.outputs));
    finger.live.on_result = [&finger](const Touch& touch) { finger.measurements->add(touch, nullptr); };
  }
  return measure(context(), fingers, info, request, watch);
}

}  // namespace palpate
