#include "capture/run/modulus_recording.h"

#include <algorithm>
#include <limits>
#include <map>
#include <memory>
#include <optional>

#include "capture/files/gauge.h"
#include "capture/open_source.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr size_t kMostPresses = 80;   // that are fitted, evenly over their forces
constexpr double kLeastForce = 0.05;  // of the largest: below it a contact is only beginning

/// The gauge's force in place of the image's; false where it has no reading.
bool set_force(const Gauge& gauge, const Frame& frame, PressFrame& press) {
  const std::optional<double> force =
      gauge.by_frame() ? gauge_at_frame(gauge, gauge.force_N, frame.sequence)
                       : gauge_at(gauge, gauge.force_N, static_cast<double>(frame.time_ns) * 1e-9);
  if (!force) return false;
  press.force_N = std::max(0.0, *force);
  press.force_sd_N = 0;
  return true;
}

/// Without the frames in which a press only begins, by force.
void keep_strong(std::vector<PressFrame>& all) {
  double largest = 0;
  for (const PressFrame& p : all) largest = std::max(largest, p.force_N);
  std::erase_if(all, [&](const PressFrame& p) { return p.force_N < kLeastForce * largest; });
  std::sort(all.begin(), all.end(), [](auto& a, auto& b) { return a.force_N < b.force_N; });
}

/// At most kMostPresses of them, evenly.
std::vector<PressFrame> chosen(const std::vector<PressFrame>& all) {
  std::vector<PressFrame> some;
  const double step = std::max(1.0, static_cast<double>(all.size()) / kMostPresses);
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
  const std::unique_ptr<Source> source = open_source(input.input, input.sensor);
  source->watch([&watch] { return watch.stopped(); });
  const Frame background = load_background(input.input, input.sensor, *source);
  PressReader reader(context, input.sensor, background, sample);
  SamplePresses presses;
  presses.depth_by_pressure = reader.depth_by_pressure();
  std::map<std::string, size_t> left;
  std::vector<uint64_t> numbers;
  std::vector<PressFrame> all;
  const RunWatch::Progress progress = watch.begin("measuring", source->frame_count().value_or(0));
  uint64_t done = 0;
  for (Frame frame; !watch.stopped() && source->next(frame);) {
    progress(++done);
    std::optional<PressFrame> p = reader.read(frame);
    if (!p) {
      ++left[reader.why_not()];
    } else if (gauge && !set_force(*gauge, frame, *p)) {
      ++left["the gauge has no reading"];
    } else {
      all.push_back(*p);
      numbers.push_back(frame.sequence);
    }
  }
  if (!recording.approach.empty()) {
    const std::vector<double> approach = read_approach_table(recording.approach, numbers);
    for (size_t i = 0; i < all.size(); ++i) all[i].approach_mm = {approach[i], recording.stage_sd_mm};
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

PadBody pad_of(const Material& given, double thickness_mm, const Sensor* sensor) {
  const bool known = sensor && sensor->reconstruction == Reconstruction::Elastic;
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
