#include "capture/run/modulus/modulus_recording.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <optional>

#include "capture/files/tables/gauge.h"
#include "capture/open_source.h"
#include "capture/run/separate_pictures.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr size_t kMostFitted = 80;    // that are fitted, evenly over their forces
constexpr double kLeastForce = 0.05;  // of the largest: below it a contact is only beginning

/// The gauge at a frame; NaN where it has no reading.
double force_at(const Gauge& gauge, const Frame& frame) {
  const std::optional<double> force =
      gauge.by_frame() ? gauge_at_frame(gauge, gauge.force_N, frame.sequence)
                       : gauge_at(gauge, gauge.force_N, static_cast<double>(frame.time_ns) * 1e-9);
  return force.value_or(std::numeric_limits<double>::quiet_NaN());
}

/// Presses in the order of their frames, until the gauge's zero is known.
struct Readings {
  std::vector<double> force_N;  ///< of the gauge at every frame; empty without a gauge
  std::vector<bool> touched;    ///< every frame
  std::vector<PressFrame> presses;
  std::vector<size_t> frame_of;    ///< of each press
  std::vector<uint64_t> sequence;  ///< of each press
};

/// The gauge's forces, less its zero, in place of the image's; presses without a reading go. Gives how many.
size_t take_gauge(const std::string& gauge, Readings& r, std::vector<std::string>& notes) {
  const std::string zero = take_off_zero(r.force_N, r.touched, "the force of " + gauge);
  if (!zero.empty()) notes.push_back(zero);
  Readings kept;
  for (size_t i = 0; i < r.presses.size(); ++i) {
    const double force_N = r.force_N[r.frame_of[i]];
    if (!std::isfinite(force_N)) continue;
    kept.presses.push_back(r.presses[i]);
    kept.presses.back().force_N = std::max(0.0, force_N);
    kept.presses.back().force_sd_N = 0;
    kept.sequence.push_back(r.sequence[i]);
  }
  const size_t without = r.presses.size() - kept.presses.size();
  r.presses = std::move(kept.presses);
  r.sequence = std::move(kept.sequence);
  return without;
}

/// Without the frames in which a press only begins, by force.
void keep_strong(std::vector<PressFrame>& all) {
  double largest = 0;
  for (const PressFrame& p : all) largest = std::max(largest, p.force_N);
  std::erase_if(all, [&](const PressFrame& p) { return p.force_N < kLeastForce * largest; });
  std::sort(all.begin(), all.end(), [](auto& a, auto& b) { return a.force_N < b.force_N; });
}

/// At most kMostFitted of them, evenly.
std::vector<PressFrame> chosen(const std::vector<PressFrame>& all) {
  std::vector<PressFrame> some;
  const double step = std::max(1.0, static_cast<double>(all.size()) / kMostFitted);
  for (double i = 0; i < static_cast<double>(all.size()); i += step)
    some.push_back(all[static_cast<size_t>(i)]);
  return some;
}

}  // namespace

void check(const PressRecording& recording) {
  const Sensor& sensor = recording.input.sensor;
  if (!has_scale(sensor))
    throw Error(Failure::Sensor, "a sensor with a scale", "none", "palpate calibrate scale");
  if (recording.gauge.empty() && !sensor.force)
    throw Error(Failure::Sensor, "a force: a sensor file with a force calibration, or a gauge's table",
                "neither", "palpate calibrate force");
}

SamplePresses read_press_frames(gpu::Context& context, const PressRecording& recording, const Sample& sample,
                                const RunWatch& watch) {
  check(recording);
  const MeasuredInput& input = recording.input;
  std::optional<Gauge> gauge;
  if (!recording.gauge.empty()) gauge = read_gauge(recording.gauge, GaugeColumns::Normal);
  if (gauge && gauge->reads_negative()) gauge->turn();
  const std::unique_ptr<Source> source = open_source(input.input, input.sensor);
  source->watch([&watch] { return watch.stopped(); });
  const Frame background = load_background(input.input, input.sensor, *source);
  const bool separate = separate_presses(*source, recording.one_sequence);
  SampleReader reader(context, input.sensor, background, sample, separate ? input.input : "");
  SamplePresses presses;
  presses.depth_by_pressure = reader.depth_by_pressure();
  std::map<std::string, size_t> left;
  if (gauge) presses.notes = gauge->notes;
  if (separate) presses.notes.emplace_back(kSeparatePictures);
  Readings readings;
  const RunWatch::Progress progress = watch.begin("measuring", source->frame_count().value_or(0));
  for (Frame frame; !watch.stopped() && source->next(frame);) {
    const std::optional<PressFrame> p = reader.read(frame);
    if (gauge) readings.force_N.push_back(force_at(*gauge, frame));
    readings.touched.push_back(p || reader.why_not() != SampleReader::kUntouched);
    progress(readings.touched.size());
    if (!p) {
      ++left[reader.why_not()];
      continue;
    }
    readings.presses.push_back(*p);
    readings.frame_of.push_back(readings.touched.size() - 1);
    readings.sequence.push_back(frame.sequence);
  }
  if (gauge)
    if (const size_t without = take_gauge(recording.gauge.string(), readings, presses.notes); without > 0)
      left["the gauge has no reading"] = without;
  std::vector<PressFrame>& all = readings.presses;
  if (!recording.approach.empty()) {
    const std::vector<double> approach =
        read_approach_table(recording.approach, readings.sequence, presses.notes);
    for (size_t i = 0; i < all.size(); ++i) all[i].approach_mm = {approach[i], recording.stage_sd_mm};
    turn_stage(all, presses.notes);
  }
  keep_strong(all);
  presses.frames = chosen(all);
  for (const auto& [why, count] : left)
    presses.notes.push_back(std::to_string(count) + " frames left out: " + why);
  if (presses.frames.size() < all.size())
    presses.notes.push_back(std::to_string(presses.frames.size()) + " of " + std::to_string(all.size()) +
                            " presses taken, evenly over their forces");
  if (presses.frames.empty() && !watch.stopped())
    throw Error(Failure::Input, "presses in '" + input.input + "'",
                "no frame with a contact that can be read", "a recording of the sample being pressed");
  return presses;
}

Pad pad_of(const Material& given, double thickness_mm, const Sensor* sensor) {
  const bool known = sensor && sensor->reading == SurfaceReading::Elastic;
  Material pad = given;
  if (known && !(pad.young_MPa > 0)) pad = {sensor->elastic.young_MPa, sensor->elastic.poisson};
  if (known && !(thickness_mm > 0)) thickness_mm = sensor->elastic.thickness_mm;
  if (!(pad.young_MPa > 0))
    throw Error(Failure::Usage, "the pad's modulus", "none",
                "--pad-kPa 200 --pad-thickness-mm 6, or a sensor file with surface.elastic");
  return {pad, thickness_mm > 0 ? thickness_mm : std::numeric_limits<double>::infinity(), Base::Bonded};
}

double scale_sd(const Sensor& sensor) {
  return sensor.pitch_sd_mm_per_px > 0 ? sensor.pitch_sd_mm_per_px / sensor.pitch_mm_per_px : 0;
}

}  // namespace palpate
