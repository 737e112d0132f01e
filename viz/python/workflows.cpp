#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "capture/calibrate/force/wrench.h"
#include "capture/calibrate/workflow/check.h"
#include "capture/files/true_quantities.h"
#include "capture/open_source.h"
#include "capture/run/record_session.h"
#include "capture/run/tactile_shapes.h"
#include "engine/measure/compression.h"
#include "palpate/error.h"
#include "viz/python/arrays.h"
#include "viz/python/bindings.h"
#include "viz/python/device.h"
#include "viz/python/sensor.h"
#include "viz/python/stream.h"
#include "viz/python/touch.h"
#include "viz/python/waiting.h"

namespace palpate::python {
namespace {

py::dict record(const RunSettings& settings, const std::filesystem::path& folder,
                const std::filesystem::path& trace, const std::string& device) {
  const auto [status, refusal] = run_apart([=](const std::atomic<bool>& stop) {
    RecordRequest asked;
    static_cast<RunSettings&>(asked) = settings;
    asked.found = find_input(asked);
    asked.folder = folder;
    asked.outlive_device = false;  // others use it too
    PythonTrace traced(trace);
    const std::shared_ptr<gpu::Context> context = shared_device(device);
    SessionStatus ended =
        record_session([&]() -> gpu::Context& { return *context; }, asked, watch_of(stop)).session.status;
    if (!ended.error.empty())
      throw Error(Failure::Output, "a session in '" + folder.string() + "'", ended.error, "another folder");
    traced.close();
    return std::pair(ended, traced.refusal());
  });
  py::dict d;
  d["recorded"] = status.recorded;
  d["dropped"] = status.dropped;
  d["measured"] = status.measured;
  d["warning"] = refusal;
  return d;
}

/// Sentence, table and all as JSON.
py::dict check(const std::filesystem::path& sensor, const std::string& recording,
               const std::filesystem::path& background, double ball_radius_mm, double ball_diameter_mm,
               const std::vector<double>& weight_g, const std::filesystem::path& out,
               const std::string& device) {
  const CheckRequest asked{sensor,     recording,
                           background, {.radius_mm = ball_radius_mm, .diameter_mm = ball_diameter_mm},
                           weight_g,   out};
  const SensorCheck found = run_apart([=](const std::atomic<bool>& stop) {
    std::shared_ptr<gpu::Context> context;
    const auto opened = [&]() -> gpu::Context& { return *(context = shared_device(device)); };
    return check_sensor(asked, opened, watch_of(stop));
  });
  py::dict d;
  d["text"] = found.text;
  d["report"] = found.json.dump(2, json::Utf8::Replace);
  return d;
}

struct WrenchOutcome {
  WrenchSeries series;
  std::optional<WrenchCheck> check;
};

py::dict wrench(const RunSettings& request, const std::string& gauge, const std::string& align,
                double rate_Hz, bool one_sequence, const std::string& device) {
  const GaugeRequest asked{gauge, GaugeColumns::Normal, parse_alignment(align), rate_Hz, one_sequence};
  WrenchOutcome outcome = run_apart([=](const std::atomic<bool>& stop) {
    WrenchOutcome found;
    found.series = measure_wrench(*shared_device(device), find_input(request), asked, watch_of(stop));
    if (!gauge.empty()) found.check = check_wrench(found.series);
    return found;
  });
  WrenchSeries& s = outcome.series;
  py::dict d;
  d["csv"] = wrench_csv(s);
  d["notes"] = s.notes;
  d["peak"] = s.peak;
  const Shape cells = {s.at_peak.height, s.at_peak.width};
  d["cell_mm"] = s.at_peak.cell_mm;
  const bool shear = !s.at_peak.shear_x_kPa.empty();
  if (shear)
    s.at_peak.shear_x_kPa.insert(s.at_peak.shear_x_kPa.end(), s.at_peak.shear_y_kPa.begin(),
                                 s.at_peak.shear_y_kPa.end());
  d["shear_kPa"] =
      shear ? py::object(hand_out(std::move(s.at_peak.shear_x_kPa), {2, cells[0], cells[1]})) : py::none();
  d["pressure_kPa"] = s.peak ? py::object(hand_out(std::move(s.at_peak.pressure_kPa), cells)) : py::none();
  py::object check = py::none();
  if (outcome.check) {
    py::dict c;
    c["readings"] = outcome.check->readings;
    c["valid"] = outcome.check->valid;
    c["mean_error_N"] = outcome.check->mean_error_N;
    c["valid_mean_error_N"] = outcome.check->valid_mean_error_N;
    c["scale"] = outcome.check->scale;
    c["coverage"] = outcome.check->coverage;
    check = c;
  }
  d["check"] = check;
  return d;
}

struct StrainOutcome {
  Compression compression;
  uint64_t before = 0, after = 0;
  bool skin = false;
};

py::dict as_dict(const PlaneStrain& e) {
  py::dict d;
  d["xx"] = e.xx;
  d["yy"] = e.yy;
  d["xy"] = e.xy;
  d["first"] = e.first;
  d["second"] = e.second;
  d["direction_rad"] = e.direction_rad;
  d["area"] = e.area;
  return d;
}

py::dict strain(const RunSettings& request, std::optional<std::array<uint64_t, 2>> frames,
                std::optional<std::array<double, 2>> forces_N, bool by_shape, double poisson,
                std::optional<double> lambda, uint64_t seed, const std::string& device) {
  ShapeRequest asked;
  asked.frames = frames;
  asked.forces_N = forces_N;
  asked.control.seed = seed;
  asked.one_sequence = request.one_sequence;
  const StrainOutcome outcome = run_apart([=](const std::atomic<bool>& stop) {
    const MeasuredInput input = find_input(request);
    if (!has_scale(input.sensor))
      throw Error(Failure::Sensor, "pitch_mm_per_px", "a sensor without a scale", "palpate calibrate scale");
    const TactileShapes shapes = read_shapes(*shared_device(device), input, asked, watch_of(stop));
    StrainOutcome found;
    if (stop) return found;
    found.skin = shapes.skin && !by_shape;
    found.before = shapes.before.touch.sequence;
    found.after = shapes.after.touch.sequence;
    const CompressionOptions options{lambda, poisson, shapes.counted_growth()};
    found.compression = found.skin
                            ? strain_of_pairs(skin_pairs(shapes, input.sensor.pitch_mm_per_px), options)
                            : compare_draws(shapes.before.draws, shapes.after.draws, options);
    return found;
  });
  const Compression& c = outcome.compression;
  py::dict d;
  d["reason"] = c.reason;
  d["frames"] = py::make_tuple(outcome.before, outcome.after);
  d["by_skin"] = outcome.skin;
  const bool there = c.reason.empty();
  const double none = std::numeric_limits<double>::quiet_NaN();
  d["plane"] = there ? py::object(as_dict(c.plane.mean)) : py::none();
  d["plane_sd"] = there ? py::object(as_dict(c.plane.sd)) : py::none();
  d["axial"] = there ? c.axial : none;
  d["axial_sd"] = there ? c.axial_sd : none;
  d["deepening_mm"] = there ? c.deepening_mm : none;
  std::vector<double> rows;
  for (const MatchedPoint& p : c.pairs)
    rows.insert(rows.end(), {p.before.x_mm, p.before.y_mm, p.before.depth_mm, p.after.x_mm, p.after.y_mm,
                             p.after.depth_mm, p.probability});
  d["pairs"] = hand_out(std::move(rows), {static_cast<py::ssize_t>(c.pairs.size()), 7});
  return d;
}

struct Simulated {
  Sensor sensor;
  std::string input;
  FrameFormat format;
  double rate_Hz = 0;
  std::vector<uint8_t> images;
  Frame background;
  std::vector<float> depth;
  std::vector<Truth> truth;
};

/// Flags are 0 or 1.
double as_number(const QuantityValue& value) {
  if (const bool* flag = std::get_if<bool>(&value)) return *flag;
  return std::get<double>(value);
}

py::dict simulate(const RunSettings& request, uint64_t frames, bool depth) {
  const auto all = run_apart([=](const std::atomic<bool>& stop) {
    auto made = std::make_shared<Simulated>();
    const MeasuredInput input = find_input(request);
    made->sensor = input.sensor;
    made->input = input.input;
    const std::unique_ptr<Source> source = open_source(input.input, input.sensor);
    if (!source->truth(0))
      throw Refusal{"InputError", "a simulated scene", "'" + input.input + "'", "synthetic:press"};
    if (frames == 0 && !source->frame_count())
      throw bad_argument("an end of the scene", "repeat=0", "frames=100");
    made->format = source->format();
    made->rate_Hz = source->rate_Hz();
    if (std::optional<Frame> background = source->own_background()) made->background = std::move(*background);
    uint64_t count = 0;
    for (Frame frame; !stop && (frames == 0 || count < frames) && source->next(frame); ++count) {
      made->images.insert(made->images.end(), frame.pixels(), frame.pixels() + frame.format.frame_bytes());
      Truth truth = *source->truth(frame.sequence);
      if (depth) made->depth.insert(made->depth.end(), truth.depth_mm.begin(), truth.depth_mm.end());
      truth.depth_mm.clear();
      made->truth.push_back(std::move(truth));
    }
    return made;
  });
  const auto count = static_cast<py::ssize_t>(all->truth.size());
  py::dict truth;
  truth["time_s"] = column(all->truth, &Truth::time_s);
  for (const MeasuredQuantity<TrueFrame>& q : true_quantities())
    for (const char* name : {q.python, q.python_also})
      if (name && *name)
        truth[name] = column(all->truth, [&q](const Truth& t) { return as_number(q.value({&t})); });
  py::dict d;
  d["sensor"] = all->sensor;
  d["input"] = all->input;
  d["rate_Hz"] = all->rate_Hz;
  d["images"] = images_of(std::move(all->images), all->format, count);
  const bool background = !all->background.bytes.empty();
  d["background"] = background
                        ? py::object(images_of(std::move(all->background.bytes), all->format, 1)[py::int_(0)])
                        : py::none();
  d["truth"] = truth;
  const bool has_depth = !all->depth.empty();
  d["depth_mm"] =
      has_depth ? py::object(hand_out(std::move(all->depth), {count, all->format.height, all->format.width}))
                : py::none();
  return d;
}

}  // namespace

void bind_workflows(py::module_& module) {
  bind_function(module, "record", &record, "settings folder trace device");
  bind_function(module, "check", &check,
                "sensor recording background ball_radius_mm ball_diameter_mm weight_g out device");
  bind_function(module, "wrench", &wrench, "request gauge align rate_Hz sequence device");
  bind_function(module, "strain", &strain, "request frames forces_N by_shape poisson lam seed device");
  bind_function(module, "simulate", &simulate, "request frames depth");
}

}  // namespace palpate::python
