#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <limits>

#include "capture/run/modulus/modulus_recording.h"
#include "capture/run/process/processing.h"
#include "viz/python/arrays.h"
#include "viz/python/bindings.h"
#include "viz/python/device.h"
#include "viz/python/sensor.h"
#include "viz/python/stream.h"
#include "viz/python/touch.h"
#include "viz/python/waiting.h"

namespace palpate::python {
namespace {

/// One kind of map, frame after frame; frames without one are 0.
template <typename T>
class Stack {
 public:
  void add(std::span<const T> map) {
    if (!map.empty()) {
      size_ = map.size();
      values_.resize(frames_ * size_);
      values_.insert(values_.end(), map.begin(), map.end());
    }
    ++frames_;
  }
  /// All that was added.
  std::vector<T> take() {
    values_.resize(frames_ * size_);
    return std::move(values_);
  }
  py::object array(Shape shape) {
    shape.insert(shape.begin(), static_cast<py::ssize_t>(frames_));
    return hand_out(take(), shape);
  }
  py::ssize_t frames() const { return static_cast<py::ssize_t>(frames_); }

 private:
  size_t frames_ = 0, size_ = 0;
  std::vector<T> values_;
};

/// A recording in numbers.
struct Columns {
  ProcessSummary summary;
  std::string json;
  Sensor sensor;
  std::string input, trace_refusal;
  FrameFormat format;
  std::vector<std::string> rows;
  Stack<float> depth, pressure, shear;
  Stack<uint8_t> image, extrapolated;
  Stack<uint16_t> confidence;
  py::ssize_t cell_rows = 0, cell_columns = 0;
};

void collect(const Kept& kept, const Result& result, const Frame& frame, Columns& all) {
  all.format = frame.format;
  if (kept.depth && result.touch.surface) all.depth.add(result.depth_mm());
  if (kept.image) all.image.add({frame.pixels(), frame.format.frame_bytes()});
  if (kept.confidence && result.touch.confidence) all.confidence.add(result.confidence());
  if (kept.extrapolated) all.extrapolated.add(extrapolated_pixels(result.extrapolated, frame.format));
  if (!kept.traction) return;
  const TractionMaps& maps = result.traction;
  if (!maps.pressure_kPa.empty()) {
    all.cell_rows = maps.height;
    all.cell_columns = maps.width;
  }
  all.pressure.add(maps.pressure_kPa);
  std::vector<float> shear(maps.shear_x_kPa.begin(), maps.shear_x_kPa.end());
  shear.insert(shear.end(), maps.shear_y_kPa.begin(), maps.shear_y_kPa.end());
  all.shear.add(shear);
}

py::dict measure(const RunSettings& request, const std::filesystem::path& out,
                 const std::filesystem::path& trace, const std::string& device,
                 const std::vector<std::string>& keep) {
  const Kept kept = kept_of(keep);
  ProcessRequest process;
  static_cast<RunSettings&>(process) = request;
  process.rows = !out.empty();
  process.digits = Digits::All;
  const auto all = run_apart([=](const std::atomic<bool>& stop) mutable {
    auto measured = std::make_shared<Columns>();
    const MeasuredInput input = find_input(process);
    if (kept.depth && !wants(input.outputs, Output::Surface))
      throw Refusal{"SensorError", "depth_mm", "a sensor that measures no surface",
                    "a sensor file with \"surface\""};
    process.input = measured->input = input.input;
    process.outputs = input.outputs;
    if (kept.confidence) process.outputs |= Output::Confidence;
    measured->sensor = input.sensor;
    process.on_row = [&measured](const std::string& row) { measured->rows.push_back(row); };
    process.on_result = [&](const Pipeline&, const Result& result, const Frame& frame) {
      collect(kept, result, frame, *measured);
    };
    PythonTrace traced(trace);
    name_trace_thread("rows");
    const std::shared_ptr<gpu::Context> context = shared_device(device);
    measured->summary = process_recording(*context, input.sensor, process, out, watch_of(stop));
    traced.close();
    measured->trace_refusal = traced.refusal();
    measured->json =
        facts_of(measured->summary, process, input.sensor, *context).json.dump(2, json::Utf8::Replace);
    return measured;
  });
  const FrameFormat& f = all->format;
  const py::ssize_t height = f.height, width = f.width;
  py::dict maps;
  if (kept.depth) maps["depth_mm"] = all->depth.array({height, width});
  if (kept.image) maps["image"] = images_of(all->image.take(), f, all->image.frames());
  if (kept.confidence) maps["confidence"] = all->confidence.array({height, width});
  if (kept.extrapolated) maps["extrapolated"] = all->extrapolated.array({height, width}).attr("view")("bool");
  if (kept.traction) {
    maps["pressure_kPa"] = all->pressure.array({all->cell_rows, all->cell_columns});
    maps["shear_kPa"] = all->shear.array({2, all->cell_rows, all->cell_columns});
  }
  py::dict answer;
  answer["columns"] = all->summary.columns;
  answer["rows"] = all->rows;
  answer["maps"] = maps;
  answer["summary"] = all->json;
  answer["sensor"] = all->sensor;
  answer["input"] = all->input;
  answer["warnings"] = std::vector<std::string>{all->summary.warning, all->summary.untouched_warning,
                                                all->summary.flaws.describe(), all->trace_refusal};
  return answer;
}

/// Inputs of a modulus in addition to the presses.
struct ModulusInputs {
  std::optional<RunSettings> recording;
  std::filesystem::path table, gauge, approach;
  double stage_sd_mm = kStageSd_mm;
  double pad_kPa = 0, pad_thickness_mm = 0, pad_poisson = 0.5;
  ModulusSetup setup;
};

struct ModulusOutcome {
  ModulusAnswer answer;
  SamplePresses presses;
};

ModulusOutcome estimate(ModulusInputs in, const std::string& device, const std::atomic<bool>& stop) {
  ModulusOutcome outcome;
  const Material pad{in.pad_kPa * 1e-3, in.pad_poisson};
  if (!in.recording) {
    outcome.presses.frames = read_press_table(in.table, outcome.presses.notes);
    in.setup.pad = pad_of(pad, in.pad_thickness_mm, nullptr);
  } else {
    const MeasuredInput input = find_input(*in.recording);
    const PressRecording recording{input, in.gauge, in.approach, in.stage_sd_mm, in.recording->one_sequence};
    check(recording);
    in.setup.pad = pad_of(pad, in.pad_thickness_mm, &input.sensor);
    if (!(in.setup.length_relative_sd > 0)) in.setup.length_relative_sd = scale_sd(input.sensor);
    outcome.presses = read_press_frames(*shared_device(device), recording, in.setup.sample, watch_of(stop));
    in.setup.depth_by_pressure = outcome.presses.depth_by_pressure;
  }
  if (!stop) outcome.answer = estimate_modulus(outcome.presses.frames, in.setup);
  return outcome;
}

py::dict as_dict(const ModulusEstimate& e) {
  py::dict d;
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  d["method"] = to_string(e.way);
  d["state"] = to_string(e.state);
  d["reason"] = e.reason;
  d["young_kPa"] = e.has_value() ? 1e3 * e.young_MPa : kNaN;
  d["interval_kPa"] =
      e.has_bounds() ? py::make_tuple(1e3 * e.low_MPa, 1e3 * e.high_MPa) : py::make_tuple(kNaN, kNaN);
  d["residual"] = e.residual;
  d["strain_max"] = e.strain_max;
  d["readings"] = e.readings;
  return d;
}

py::dict modulus(const std::optional<RunSettings>& recording, const std::filesystem::path& table,
                 const std::filesystem::path& gauge, const std::filesystem::path& approach,
                 double stage_sd_mm, const std::string& sample, double poisson, double size_sd, bool bonded,
                 bool rubber, double pad_kPa, double pad_thickness_mm, double pad_poisson, double pad_sd,
                 double force_sd, double scale_sd, double zero_sd_mm, uint32_t replicates, uint64_t seed,
                 const std::string& device) {
  ModulusInputs in{recording,        table,       gauge, approach, stage_sd_mm, pad_kPa,
                   pad_thickness_mm, pad_poisson, {}};
  ModulusSetup& s = in.setup;
  s.sample = parse_sample(sample);
  s.sample.poisson = poisson;
  s.sample.relative_size_sd = size_sd;
  s.sample.table = bonded ? Support::Bonded : Support::Sliding;
  s.law = rubber ? MaterialLaw::Rubber : MaterialLaw::Linear;
  s.pad_relative_sd = pad_sd;
  s.force_relative_sd = force_sd;
  s.length_relative_sd = scale_sd;
  s.zero_sd_mm = zero_sd_mm;
  s.replicates = replicates;
  s.seed = seed;
  const ModulusOutcome outcome =
      run_apart([in, device](const std::atomic<bool>& stop) { return estimate(in, device, stop); });
  py::dict answer = as_dict(outcome.answer.best());
  answer["why"] = outcome.answer.why;
  py::list methods;
  for (const ModulusEstimate& e : outcome.answer.methods) methods.append(as_dict(e));
  answer["methods"] = methods;
  answer["notes"] = outcome.presses.notes;
  std::vector<double> rows;
  for (const PressFrame& p : outcome.presses.frames)
    rows.insert(rows.end(), {p.force_N, p.radius_mm.value, p.depth_mm.value, p.approach_mm.value});
  answer["presses"] = hand_out(std::move(rows), {static_cast<py::ssize_t>(outcome.presses.frames.size()), 4});
  return answer;
}

}  // namespace

void bind_recordings(py::module_& module) {
  bind_function(module, "measure", &measure, "settings out trace device keep");
  bind_function(module, "modulus", &modulus,
                "recording table gauge approach stage_sd_mm sample poisson size_sd bonded rubber pad_kPa "
                "pad_thickness_mm pad_poisson pad_sd force_sd scale_sd zero_sd_mm replicates seed device");
}

}  // namespace palpate::python
