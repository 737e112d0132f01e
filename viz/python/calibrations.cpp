#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <tuple>

#include "capture/calibrate/force/force.h"
#include "capture/calibrate/force/shear.h"
#include "capture/calibrate/workflow/workflow.h"
#include "palpate/error.h"
#include "viz/python/arrays.h"
#include "viz/python/bindings.h"
#include "viz/python/device.h"
#include "viz/python/sensor.h"
#include "viz/python/waiting.h"

namespace palpate::python {
namespace {

/// Recordings, each with the table of a gauge that ran with it.
struct Gauged {
  std::vector<RunSettings> inputs;
  std::vector<std::string> gauges;
};

void check_pairs(const Gauged& gauged, const char* what) {
  if (gauged.inputs.size() != gauged.gauges.size())
    throw bad_argument(std::string("a gauge for each ") + what,
                       std::to_string(gauged.inputs.size()) + " recordings and " +
                           std::to_string(gauged.gauges.size()) + " gauges",
                       "a list of as many tables, in the same order");
}

struct ForceAsked {
  Gauged fit, checks;
  std::vector<std::string> objects;
  GaugeRequest gauge;
  ForceChoiceOptions choice;
  bool keep_border = false;
  std::string device;
};

struct Outcome {
  Sensor sensor;
  std::string text, json, csv, verdict;
};

Outcome calibrate(const ForceAsked& asked, const std::atomic<bool>& stop) {
  const std::shared_ptr<gpu::Context> context = shared_device(asked.device);
  const auto measure = [&](const Gauged& gauged, size_t i, double thickness, const std::string& object = {}) {
    MeasuredInput input = find_input(gauged.inputs[i]);
    input.outputs = force_outputs(input, asked.choice.signal);
    if (input.sensor.layer) input.sensor.layer->thickness_mm *= thickness;
    GaugeRequest request = asked.gauge;
    request.gauge = gauged.gauges[i];
    request.object = object;
    return measure_with_gauge(*context, input, request, watch_of(stop));
  };
  Sensor sensor = find_input(asked.fit.inputs.front()).sensor;
  ForceChoiceOptions choosing = asked.choice;
  choosing.stopped = [&stop] { return stop.load(); };
  LayerPresses presses = measure_presses(
      asked.fit.inputs.size(), choosing, sensor, asked.keep_border,
      [&](size_t i, double thickness) { return measure(asked.fit, i, thickness, asked.objects[i]); });
  if (stop) return {};
  const double thickness = presses.factor();
  ForceOutcome outcome = calibrate_force(std::move(presses), choosing, asked.keep_border);
  if (outcome.choice.stopped) return {};
  for (size_t i = 0; i < asked.checks.inputs.size() && !stop; ++i)
    outcome.checks.push_back(
        check_force(outcome.choice.calibration, measure(asked.checks, i, thickness), asked.keep_border));
  set_force(sensor, outcome.choice.calibration, thickness);
  return {sensor, describe(outcome), to_json(outcome, "").dump(2, json::Utf8::Replace), samples_csv(outcome),
          verdict_of(outcome).line};
}

py::dict force(const std::vector<RunSettings>& inputs, const std::vector<std::string>& gauges,
               const std::vector<std::string>& objects, const std::vector<RunSettings>& checks,
               const std::vector<std::string>& check_gauges, const std::string& align, double rate_Hz,
               bool one_sequence, const std::string& signal, const std::string& model,
               std::optional<bool> branches, bool keep_border, const std::string& device) {
  ForceAsked asked{{inputs, gauges},
                   {checks, check_gauges},
                   named_objects(objects, inputs.size()),
                   {},
                   {},
                   keep_border,
                   device};
  check_pairs(asked.fit, "recording");
  check_pairs(asked.checks, "recording to check");
  if (inputs.empty())
    throw bad_argument("a recording", "none", "calibrate.force(\"press/\", gauge=\"gauge.csv\")");
  asked.gauge = {"", GaugeColumns::Normal, parse_alignment(align), rate_Hz, one_sequence};
  if (!signal.empty()) asked.choice.signal = by_name(kForceSignalNames, signal, "a signal");
  if (!model.empty()) asked.choice.model = by_name(kForceModelNames, model, "a model");
  asked.choice.branches = branches;
  const Outcome outcome =
      run_apart([asked](const std::atomic<bool>& stop) { return calibrate(asked, stop); });
  py::dict d;
  d["sensor"] = outcome.sensor;
  d["text"] = outcome.text;
  d["report"] = outcome.json;
  d["samples"] = outcome.csv;
  d["verdict"] = outcome.verdict;
  d["fit_for_use"] = outcome.sensor.force && outcome.sensor.force->fit_for_use;
  return d;
}

struct ShearAsked {
  Gauged fit;
  GaugeRequest gauge;
  ShearRequest request;
  std::string device;
};

Outcome calibrate_pulls(const ShearAsked& asked, const std::atomic<bool>& stop) {
  const std::shared_ptr<gpu::Context> context = shared_device(asked.device);
  Sensor sensor;
  std::vector<GaugedRecording> recordings;
  for (size_t i = 0; i < asked.fit.inputs.size() && !stop; ++i) {
    MeasuredInput input = find_input(asked.fit.inputs[i]);
    if (!has_scale(input.sensor))
      throw Error(Failure::Sensor, "a sensor with a scale", "an uncalibrated camera", "a sensor file");
    input.outputs = shear_outputs(input, asked.request.signal);
    if (i == 0) sensor = input.sensor;
    GaugeRequest request = asked.gauge;
    request.gauge = asked.fit.gauges[i];
    recordings.push_back(measure_with_gauge(*context, input, request, watch_of(stop)));
  }
  if (stop) return {};
  const ShearOutcome outcome = calibrate_shear(std::move(recordings), sensor, asked.request);
  sensor.shear = outcome.calibration;
  const std::string text = describe(outcome);
  return {sensor, text, to_json(outcome, "").dump(2, json::Utf8::Replace), "",
          text.substr(0, text.find('\n'))};
}

py::dict shear(const std::vector<RunSettings>& inputs, const std::vector<std::string>& gauges,
               const std::string& align, double rate_Hz, bool one_sequence, const std::string& signal,
               std::optional<double> friction, const std::string& device) {
  ShearAsked asked{{inputs, gauges},
                   {"", GaugeColumns::Tangential, parse_alignment(align), rate_Hz, one_sequence},
                   {},
                   device};
  check_pairs(asked.fit, "recording");
  if (inputs.empty())
    throw bad_argument("a recording", "none", "calibrate.shear(\"pull/\", gauge=\"gauge.csv\")");
  if (!signal.empty()) asked.request.signal = by_name(kShearSignalNames, signal, "a signal");
  asked.request.friction = friction;
  const Outcome outcome =
      run_apart([asked](const std::atomic<bool>& stop) { return calibrate_pulls(asked, stop); });
  py::dict d;
  d["sensor"] = outcome.sensor;
  d["text"] = outcome.text;
  d["report"] = outcome.json;
  d["verdict"] = outcome.verdict;
  d["fit_for_use"] = true;
  return d;
}

/// Runs a calibration that writes its files.
template <typename Request>
py::dict written(CalibrationReport (*calibrate)(const Request&, const CalibrationRun&),
                 const Request& request, const std::filesystem::path& out) {
  const CalibrationReport report = run_apart([calibrate, request, out](const std::atomic<bool>& stop) {
    const RunWatch watch = watch_of(stop);
    return calibrate(request, {out, watch});
  });
  py::dict d;
  d["text"] = report.text;
  d["report"] = report.json.dump(2, json::Utf8::Replace);
  d["sensor"] = report.sensor;
  return d;
}

/// Radius, diameter, and the older way of saying.
using Ball = std::tuple<double, double, double>;
BallSize size_of(const Ball& ball) {
  return {std::get<0>(ball), std::get<1>(ball), std::get<2>(ball)};
}

using Path = std::filesystem::path;

void bind_written(py::module_& module) {
  bind_function(
      module, "calibrate_background",
      [](const std::string& input, const Path& sensor, const Path& out, uint32_t frames, uint32_t every,
         std::optional<uint64_t> like, bool set_threshold) {
        return written(&calibrate_background, {input, sensor, frames, every, like, set_threshold}, out);
      },
      "input sensor out frames every like set_threshold");
  bind_function(
      module, "calibrate_flat",
      [](const std::string& input, const Path& sensor, const Path& out, uint32_t frames, uint32_t every,
         bool change) {
        return written(&calibrate_flat, {input, sensor, frames, every, change}, out);
      },
      "input sensor out frames every change");
  bind_function(
      module, "calibrate_scale",
      [](const std::string& input, const Path& sensor, const Path& background, const Path& out,
         const std::string& grid, bool dots, double spacing_mm, double spacing_sd, double ring_mm,
         const Ball& ball, const std::vector<double>& travel_mm) {
        const GridPattern pattern = dots ? GridPattern::Dots : GridPattern::Chessboard;
        return written(&calibrate_scale,
                       {input, sensor, background, grid, pattern, spacing_mm, spacing_sd, ring_mm,
                        size_of(ball), travel_mm},
                       out);
      },
      "input sensor background out grid dots spacing_mm spacing_sd ring_mm ball travel_mm");
  bind_function(
      module, "calibrate_lookup",
      [](const std::string& input, const Path& sensor, const Path& balls, const Path& background,
         const Path& out, const Ball& ball, double pitch_mm_per_px, uint64_t every) {
        return written(&calibrate_lookup,
                       {input, sensor, balls, background, size_of(ball), pitch_mm_per_px, every}, out);
      },
      "input sensor balls background out ball pitch_mm_per_px every");
  bind_function(
      module, "calibrate_photometric",
      [](const std::string& input, const Path& sensor, const Path& balls, const Path& background,
         const Path& out, const Ball& ball, const std::vector<std::string>& shapes, double pitch_mm_per_px,
         uint64_t every, double rest_weight, const std::string& model, bool keep_markers, bool keep_contact) {
        PhotometricRequest request;
        static_cast<BallRequest&>(request) = {input,         sensor,          balls, background,
                                              size_of(ball), pitch_mm_per_px, every};
        request.shapes = shapes;
        request.rest_weight = rest_weight;
        request.model = by_name(kNormalModelNames, model, "a model");
        request.keep_markers = keep_markers;
        request.keep_contact = keep_contact;
        return written(&calibrate_photometric, request, out);
      },
      "input sensor balls background out ball shapes pitch_mm_per_px every rest_weight model keep_markers "
      "keep_contact");
  bind_function(
      module, "calibrate_lights",
      [](const std::vector<Path>& images, const Path& height, const Path& out, double pitch_mm_per_px,
         std::optional<int> order) {
        return written(&calibrate_lights, {images, height, pitch_mm_per_px, order}, out);
      },
      "images height out pitch_mm_per_px order");
}

}  // namespace

void bind_calibrations(py::module_& module) {
  bind_written(module);
  bind_function(module, "calibrate_force", &force,
                "inputs gauges objects checks check_gauges align rate_Hz sequence signal model branches "
                "keep_border device");
  bind_function(module, "calibrate_shear", &shear,
                "inputs gauges align rate_Hz sequence signal friction device");
}

}  // namespace palpate::python
