#include "capture/run/palpation/press_timeline.h"

#include <cmath>
#include <cstdio>
#include <memory>
#include <utility>

#include "capture/files/tables/gauge.h"
#include "capture/open_source.h"
#include "engine/base/numbers.h"
#include "engine/base/text.h"
#include "engine/calibrate/time_alignment.h"
#include "engine/sensor/fit.h"
#include "palpate/error.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

const Sensor& check_sensor(const Sensor& sensor, const std::string& recording) {
  if (!reads_pressure(sensor) || !(sensor.pitch_mm_per_px > 0))
    throw Error(
        Failure::Sensor,
        "a sensor that reads pressure (surface.reading elastic) with a scale, for '" + recording + "'",
        "'" + sensor.name + "'", "--sensor FILE of a calibrated sensor");
  return sensor;
}

/// Frames whose light is that of a touch.
std::vector<bool> touched_by(const std::vector<double>& light) {
  constexpr double kTouch = 0.03;  // of the most
  double most = 0;
  for (const double l : light)
    if (std::abs(l) > std::abs(most)) most = l;
  std::vector<bool> touched;
  for (const double l : light) touched.push_back(most != 0 && l / most > kTouch);
  return touched;
}

void take_gauge(const RecordedPress& press, PressTimeline& t, std::vector<std::string>& notes) {
  if (press.gauge == "truth") {
    const std::optional<TissueOptions> options = tissue_behind(t.input);
    if (!options)
      throw Error(Failure::Input, "a gauge's table for '" + press.recording + "'",
                  "'truth', which only recordings of the synthetic block have", "--gauge FILE.csv");
    const TissueSensor source(*options);
    for (const uint64_t sequence : t.sequence) t.force_N.push_back(source.block_force_N(sequence));
    return;
  }
  Gauge gauge = read_gauge(press.gauge, GaugeColumns::Normal);
  if (gauge.reads_negative()) gauge.turn();
  for (const std::string& note : gauge.notes) notes.push_back(press.recording + ": " + note);
  double offset_s = 0;
  if (!gauge.by_frame()) {
    std::vector<std::pair<double, double>> breaks;
    for (const GaugeGap& gap : gauge.gaps) breaks.emplace_back(gap.from_s, gap.to_s);
    const TimeAlignment a = align_in_time(t.time_s, t.light, gauge.time_s, gauge.force_N, breaks);
    offset_s = a.offset_s;
    notes.push_back(press.recording + ": gauge's clock " + text("%+.4f s +- %.2g s", a.offset_s, a.sd_s));
  }
  for (size_t i = 0; i < t.time_s.size(); ++i)
    t.force_N.push_back((gauge.by_frame() ? gauge_at_frame(gauge, gauge.force_N, t.sequence[i])
                                          : gauge_at(gauge, gauge.force_N, t.time_s[i] - offset_s))
                            .value_or(kNaN));
  const std::string zero = take_off_zero(t.force_N, touched_by(t.light), "the force of " + press.gauge);
  if (!zero.empty()) notes.push_back(press.recording + ": " + zero);
}

double mean_light(const Frame& frame, const Frame& background) {
  double sum = 0;
  const FrameFormat& f = frame.format;
  for (uint32_t y = 0; y < f.height; ++y)
    for (uint32_t x = 0; x < f.width; ++x)
      sum += static_cast<double>(frame.at(0, x, y)) - static_cast<double>(background.at(0, x, y));
  return sum / (static_cast<double>(f.width) * f.height);
}

}  // namespace

std::optional<TissueOptions> tissue_behind(const MeasuredInput& input) {
  const std::string& made_of = input.session ? input.session->input : input.input;
  return is_tissue(made_of) ? std::optional(parse_tissue(made_of)) : std::nullopt;
}

PressTimeline measure_press(uint64_t seed, const RecordedPress& press, const fs::path& sensor,
                            std::vector<std::string>& notes, const RunWatch& watch) {
  if (press.gauge.empty())
    throw Error(Failure::Usage, "a gauge's table for '" + press.recording + "'", "none",
                "--gauge FILE, or a column gauge in the table of places");
  return measure_press(press, find_input(seed, press.recording, sensor, {}), notes, watch);
}

PressTimeline measure_press(const RecordedPress& press, MeasuredInput input, std::vector<std::string>& notes,
                            const RunWatch& watch) {
  PressTimeline t;
  t.input = std::move(input);
  check_sensor(t.input.sensor, press.recording);
  const std::unique_ptr<Source> source = open_source(t.input.input, t.input.sensor);
  source->watch([&watch] { return watch.stopped(); });
  t.background = load_background(t.input.input, t.input.sensor, *source);
  Frame frame;
  while (!watch.stopped() && source->next(frame)) {
    t.time_s.push_back(static_cast<double>(frame.time_ns) * 1e-9);
    t.sequence.push_back(frame.sequence);
    t.light.push_back(mean_light(frame, t.background));
  }
  if (t.time_s.empty())
    throw Error(Failure::Input, "frames in '" + press.recording + "'", "none", "another recording");
  if (const std::string warning = source->warning(); !warning.empty())
    notes.push_back(press.recording + ": " + warning);
  take_gauge(press, t, notes);
  return t;
}

}  // namespace palpate
