#include "capture/calibrate/force/wrench.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "capture/files/measurements.h"
#include "capture/open_source.h"
#include "capture/run/run_recording.h"
#include "capture/series.h"
#include "engine/base/numbers.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "palpate/pipeline.h"

namespace palpate {
namespace {

constexpr double kLeastReading = 0.04;  // of the gauge's largest, from which on force is compared

TractionPicture picture_of(const TractionMaps& maps, double pitch_mm) {
  const auto copy = [](std::span<const float> map) { return std::vector<float>(map.begin(), map.end()); };
  return {.width = maps.width,
          .height = maps.height,
          .cell_mm = maps.cell_px * pitch_mm,
          .pressure_kPa = copy(maps.pressure_kPa),
          .shear_x_kPa = copy(maps.shear_x_kPa),
          .shear_y_kPa = copy(maps.shear_y_kPa)};
}

}  // namespace

WrenchSeries measure_wrench(gpu::Context& context, const MeasuredInput& input, const GaugeRequest& gauge,
                            const RunWatch& watch) {
  MeasuredInput wanted = input;
  wanted.outputs |= Output::Force | Output::Contacts | Output::Surface | Output::Traction;
  const Sensor& sensor = wanted.sensor;
  const std::unique_ptr<Source> source = open_source(wanted.input, sensor);
  if (source->live()) throw Error(Failure::Usage, "a recording", "a camera", "palpate record first");
  source->watch([&watch] { return watch.stopped(); });
  const bool separate = separate_presses(*source, gauge.one_sequence, gauge.rate_Hz);
  Pipeline pipeline(context, for_rectified_frames(sensor), source->format(),
                    {.outputs = wanted.outputs, .solver = SurfaceSolver::Best, .separate = separate});
  pipeline.set_background(load_background(wanted.input, sensor, *source));
  if (separate) look_ahead(wanted.input, sensor, pipeline, watch.stop);
  WrenchSeries series;
  double most_N = 0;
  const bool times = source->rate_Hz() > 0;
  const RunWatch::Progress progress = watch.begin("measuring", source->frame_count().value_or(0));
  run_recording(*source, pipeline, 0, watch.stop, [&](const Result& result, const Frame&) {
    const Touch& touch = result.touch;
    if (touch.picture != PictureFault::None) return;
    series.frames.push_back({.frame = touch.sequence,
                             .time_s = times ? 1e-9 * static_cast<double>(touch.time_ns) : kNaN,
                             .contact = touch.contact,
                             .wrench = touch.traction.value_or(TractionSummary{}),
                             .gauge_N = kNaN});
    const double force_N = touch.contact ? touch.traction->fz_N.value : 0;
    if (force_N > most_N) {
      most_N = force_N;
      series.peak = series.frames.size() - 1;
      series.at_peak = picture_of(result.traction, sensor.pitch_mm_per_px);
    }
    progress(series.frames.size());
  });
  if (const std::string unused = unused_rate(*source, gauge.rate_Hz); !unused.empty())
    series.notes.push_back(unused);
  if (gauge.gauge.empty() || watch.stopped()) return series;
  // The gauge's clock is found by the light alone, which needs no surface.
  MeasuredInput plain = wanted;
  plain.outputs = Output::Force | Output::Contacts;
  if (sensor.bit_depth == 8 && sensor.signal == Signal::Either) plain.outputs |= Output::Gradient;
  const GaugedRecording plain_frames = measure_with_gauge(context, plain, gauge, watch);
  for (size_t i = 0; i < std::min(series.frames.size(), plain_frames.frames.size()); ++i)
    series.frames[i].gauge_N = plain_frames.frames[i].force_N;
  series.notes = plain_frames.notes;
  return series;
}

std::optional<WrenchCheck> check_wrench(const WrenchSeries& series) {
  WrenchCheck check;
  for (const WrenchFrame& frame : series.frames)
    if (std::isfinite(frame.gauge_N)) check.full_N = std::max(check.full_N, frame.gauge_N);
  double products = 0, squares = 0;
  size_t held = 0;
  for (const WrenchFrame& frame : series.frames) {
    if (!frame.contact || !(frame.gauge_N > kLeastReading * check.full_N)) continue;
    const Estimate& force = frame.wrench.fz_N;
    const double off = std::abs(force.value - frame.gauge_N);
    ++check.readings;
    check.mean_error_N += off;
    if (force.validity == Validity::Valid) {
      ++check.valid;
      check.valid_mean_error_N += off;
    }
    held += off <= 1.96 * force.standard_error;
    products += force.value * frame.gauge_N;
    squares += force.value * force.value;
  }
  if (check.readings == 0) return std::nullopt;
  const auto n = static_cast<double>(check.readings);
  check.mean_error_N /= n;
  check.valid_mean_error_N /= static_cast<double>(std::max<size_t>(check.valid, 1));
  check.scale = squares > 0 ? products / squares : kNaN;
  check.coverage = static_cast<double>(held) / n;
  return check;
}

std::vector<WrenchComponent> components(const TractionSummary& wrench) {
  Touch touch;
  touch.traction = wrench;
  std::vector<WrenchComponent> all;
  for (const MeasuredQuantity<Touch>& q : wrench_quantities())
    all.push_back(
        {std::string_view(q.name).substr(kWrenchPrefix.size()), q.unit, std::get<Estimate>(q.value(touch))});
  return all;
}

std::string wrench_csv(const WrenchSeries& series) {
  std::string text = "frame,time_s,contact";
  for (const WrenchComponent& c : components({}))
    text += "," + std::string(c.name) + "," + error_name(c.name, c.unit) + "," +
            std::string(c.name.substr(0, c.name.find('_'))) + "_state";
  text += ",pressure_max_kPa,shear_max_kPa,gauge_N\n";
  const auto cell = [](double value) { return std::isfinite(value) ? shortest(value) : std::string(); };
  for (const WrenchFrame& frame : series.frames) {
    text += std::to_string(frame.frame) + "," + cell(frame.time_s) + "," + (frame.contact ? "1" : "0");
    for (const auto& [name, unit, estimate] : components(frame.wrench))
      text += (has_value(estimate) ? "," + cell(estimate.value) + "," + cell(estimate.standard_error) + ","
                                   : ",,,") +
              to_string(estimate.validity);
    const bool shear = has_value(frame.wrench.fx_N);
    text += "," + (frame.contact ? cell(frame.wrench.pressure_max_kPa) : "") + "," +
            (shear ? cell(frame.wrench.shear_max_kPa) : "") + "," + cell(frame.gauge_N) + "\n";
  }
  return text;
}

}  // namespace palpate
