#include "capture/calibrate/force/gauged_recording.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <iterator>
#include <limits>

#include "capture/camera/camera_options.h"
#include "capture/open_source.h"
#include "capture/run/run_recording.h"
#include "capture/series.h"
#include "engine/base/numbers.h"
#include "engine/base/text.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "palpate/pipeline.h"

namespace palpate {
namespace {

constexpr const char* kTruth = "truth";

std::string number(double value, const char* format = "%.4g") {
  return text(format, value);
}

std::string counted(size_t count, const char* what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

void take_truth(const Source& source, GaugedRecording& recording) {
  for (GaugedFrame& f : recording.frames) {
    const std::optional<Truth> truth = source.truth(f.touch.sequence);
    if (!truth)
      throw Error(Failure::Input, "a gauge's table for '" + recording.input + "'",
                  "'truth', which only synthetic recordings have", "--gauge FILE.csv");
    f.force_N = truth->force_N;
    f.fx_N = truth->shear_x_N;
    f.fy_N = truth->shear_y_N;
  }
}

/// The light of each frame, which rises with the force.
std::vector<double> light_of(const GaugedRecording& recording) {
  std::vector<double> light;
  for (const GaugedFrame& f : recording.frames)
    light.push_back(f.touch.gradient_sum.value_or(f.touch.contact ? f.touch.gray_sum : 0));
  return light;
}

/// A signal of the frames that may rise with the force.
struct ClockSignal {
  const char* name;
  std::vector<double> values;
};

/// All that were measured: which goes best with a force depends on pad and object, not on what the force will
/// be read by.
std::vector<ClockSignal> clock_signals(const GaugedRecording& recording, bool normal) {
  std::vector<ClockSignal> signals;
  const auto add = [&](const char* name, const auto& value) {
    ClockSignal signal{name, {}};
    for (const GaugedFrame& f : recording.frames) signal.values.push_back(value(f.touch));
    signals.push_back(std::move(signal));
  };
  if (!normal) {
    add("shift of the contact",
        [](const Touch& t) { return t.contact ? std::hypot(t.shift_x_mm, t.shift_y_mm) : 0; });
    return signals;
  }
  const Touch& first = recording.frames.front().touch;
  if (first.gradient_sum)  // before what presses counts as contact
    add("sum of gradients", [](const Touch& t) { return t.gradient_sum.value_or(0); });
  add("gray sum", [](const Touch& t) { return t.contact ? t.gray_sum : 0; });
  if (first.traction)
    add("layer's force", [](const Touch& t) {
      const double force_N = t.contact && t.traction ? t.traction->fz_N.value : 0;
      return std::isfinite(force_N) ? force_N : 0;
    });
  return signals;
}

/// The clocks by the signal that goes best with the gauge. Throws where none does, with the recording's name.
TimeAlignment align(GaugedRecording& recording, const Gauge& gauge) {
  const bool normal = !gauge.force_N.empty();
  std::vector<double> time_s, force;
  for (const GaugedFrame& f : recording.frames) time_s.push_back(f.time_s);
  for (size_t i = 0; i < gauge.size(); ++i)
    force.push_back(normal ? gauge.force_N[i] : std::hypot(gauge.fx_N[i], gauge.fy_N[i]));
  std::vector<std::pair<double, double>> breaks;
  for (const GaugeGap& gap : gauge.gaps) breaks.emplace_back(gap.from_s, gap.to_s);
  const std::string name = "'" + recording.input + "'";
  std::optional<TimeAlignment> best;
  std::optional<Error> refusal;
  for (const ClockSignal& signal : clock_signals(recording, normal)) try {
      const TimeAlignment found = find_in_time(time_s, signal.values, gauge.time_s, force, breaks, name);
      if (best && !(found.correlation > best->correlation)) continue;
      best = found;
      recording.clock_signal = signal.name;
    } catch (const Error& error) {
      if (!refusal) refusal = error;
    }
  if (!best) throw Error(*refusal);
  check_alignment(*best, name + ", by its " + recording.clock_signal);
  return *best;
}

/// Correlation of recording and gauge, which reads `late` frames late; NaN where either does not vary.
double correlation(const GaugedRecording& recording, const std::vector<double>& signal, const Gauge& gauge,
                   int64_t late) {
  double n = 0, x = 0, y = 0, xx = 0, yy = 0, xy = 0;
  for (size_t i = 0; i < signal.size(); ++i) {
    const int64_t frame = static_cast<int64_t>(recording.frames[i].touch.sequence) + late;
    if (frame < 0) continue;
    const auto force = gauge_at_frame(gauge, gauge.force_N, static_cast<uint64_t>(frame));
    if (!force) continue;
    n += 1, x += signal[i], y += *force;
    xx += signal[i] * signal[i], yy += *force * *force, xy += signal[i] * *force;
  }
  const double spread = (xx - x * x / n) * (yy - y * y / n);
  return spread > 0 ? (xy - x * y / n) / std::sqrt(spread) : kNaN;
}

/// A table that counts frames needs no clock; that it is another recording's shows in its length, and in a
/// force that does not rise and fall with the touch. Thresholds: own tables of 18 presses, 0.33 to 0.99; of
/// 306 wrong ones 256 are refused.
void refuse_another_gauge(GaugedRecording& recording, const Gauge& gauge) {
  constexpr double kLeast = 0.25, kBetter = 0.2, kOpposite = 0.7;
  constexpr int64_t kFarthest = 60, kStep = 4;
  const uint64_t last = recording.frames.back().touch.sequence, frames = last + 1;
  const uint64_t tolerated = std::max<uint64_t>(3, frames / 50);
  const auto refuse = [&](const std::string& found) {
    throw Error(Failure::Input, "the gauge's table of '" + recording.input + "'", found,
                "the table that was recorded with it, or --align auto where it starts elsewhere");
  };
  if (gauge.frames.back() > last + tolerated)
    refuse(gauge.file + ", which counts to frame " + std::to_string(gauge.frames.back()) +
           "; the recording ends at " + std::to_string(last));
  if (gauge.frames.back() != last)
    recording.notes.push_back("the gauge counts to frame " + std::to_string(gauge.frames.back()) +
                              ", the recording to " + std::to_string(last) + ": is it of this recording?");
  if (gauge.force_N.empty()) return;
  const std::vector<double> signal = light_of(recording);
  const double here = correlation(recording, signal, gauge, 0);
  if (std::isnan(here)) return;
  if (here < -kOpposite)
    refuse(gauge.file + ", whose force does not follow the touch (correlation " + number(here, "%.2f") +
           "): it falls where the touch grows, of the other sign or of another recording");
  if (here < kLeast)
    refuse(gauge.file + ", whose force does not follow the touch (correlation " + number(here, "%.2f") + ")");
  for (int64_t late = -kFarthest; late <= kFarthest; late += kStep) {
    const double there = correlation(recording, signal, gauge, late);
    if (std::abs(late) > kStep && there > here + kBetter)
      refuse(gauge.file + ", whose force follows the touch " + std::to_string(std::abs(late)) + " frames " +
             (late > 0 ? "late" : "early") + " (correlation " + number(there, "%.2f") + ", " +
             number(here, "%.2f") + " as it is)");
  }
}

/// Time of frame number `frame`: straight between the frames that are there, and on beyond them.
double time_of(const std::vector<GaugedFrame>& frames, uint64_t frame) {
  const GaugedFrame &first = frames.front(), &last = frames.back();
  const auto later =
      std::lower_bound(frames.begin(), frames.end(), frame,
                       [](const GaugedFrame& f, uint64_t number) { return f.touch.sequence < number; });
  if (later != frames.end() && later->touch.sequence == frame) return later->time_s;
  const bool within = later != frames.begin() && later != frames.end();
  const GaugedFrame &from = within ? *std::prev(later) : first, &to = within ? *later : last;
  if (to.touch.sequence == from.touch.sequence) return from.time_s;
  const double share = (static_cast<double>(frame) - static_cast<double>(from.touch.sequence)) /
                       (static_cast<double>(to.touch.sequence) - static_cast<double>(from.touch.sequence));
  return from.time_s + share * (to.time_s - from.time_s);
}

/// How many first frames stand for the untouched image; 0 where there is one.
uint32_t own_untouched_frames(const Sensor& sensor, const Source& source) {
  const BackgroundSource& from = sensor.background;
  if (from.kind != BackgroundKind::Untouched || !from.image.empty() || source.own_background()) return 0;
  return std::max(1u, from.first_frames);
}

/// Where a recording's first frames stand for the untouched image, the gauge shows whether they are.
void refuse_touched_background(const GaugedRecording& recording, uint32_t first_frames) {
  constexpr double kMost = 0.1;  // of the gauge's range
  double low = std::numeric_limits<double>::infinity(), high = -low, first = 0;
  size_t readings = 0;
  for (size_t i = 0; i < recording.frames.size(); ++i) {
    const double force_N = recording.frames[i].force_N;
    if (!std::isfinite(force_N)) continue;
    low = std::min(low, force_N);
    high = std::max(high, force_N);
    if (i < first_frames) first += force_N, ++readings;
  }
  if (readings == 0) return;
  first /= static_cast<double>(readings);
  if (first - low > kMost * (high - low))
    throw Error(
        Failure::Input, "an untouched image of '" + recording.input + "'",
        "a force of " + number(first) + " N in its first " + counted(first_frames, "frame") + ", of " +
            number(low) + " to " + number(high) + " N in all",
        "\"background\": {\"image\": \"FILE\"} in the sensor file, or a recording that begins untouched");
}

/// Offset of the clocks. A gauge that reads mostly negative forces is turned where its forces then go better
/// with the light.
void align_clocks(GaugedRecording& recording, Gauge& gauge) {
  if (gauge.reads_negative()) {
    Gauge turned = gauge;
    turned.turn();
    try {
      recording.alignment = align(recording, turned);
      gauge = std::move(turned);
    } catch (const Error&) {
      // As it is, then: one that was tared while something pressed.
    }
  }
  if (!recording.alignment) recording.alignment = align(recording, gauge);
  recording.offset_s = recording.alignment->offset_s;
}

/// The gauge's value at each frame.
void take_readings(const Gauge& gauge, GaugedRecording& recording) {
  for (GaugedFrame& f : recording.frames) {
    const auto at = [&](const std::vector<double>& column) {
      const std::optional<double> value = gauge.by_frame()
                                              ? gauge_at_frame(gauge, column, f.touch.sequence)
                                              : gauge_at(gauge, column, f.time_s - recording.offset_s);
      return value.value_or(kNaN);
    };
    f.force_N = at(gauge.force_N);
    f.fx_N = at(gauge.fx_N);
    f.fy_N = at(gauge.fy_N);
  }
}

bool has_times(const GaugedRecording& recording) {
  return recording.frames.back().time_s > 0 && recording.frames.back().touch.sequence > 0;
}

/// A table that counts frames, by their times.
Gauge with_times(Gauge gauge, const GaugedRecording& recording) {
  for (const uint64_t frame : gauge.frames) gauge.time_s.push_back(time_of(recording.frames, frame));
  return gauge;
}

/// A gauge that is read late counts the right frames and is late all the same: by how much is taken from the
/// clocks where that leaves little of what the correlation lacks. On 18 presses of a GelSight Wedge either
/// less than half is left, 1 to 3 frames late, or more than two thirds.
void follow_late_gauge(GaugedRecording& recording, const Gauge& gauge) {
  constexpr double kMost_frames = 6, kLeft = 0.6;
  if (gauge.force_N.empty() || !has_times(recording)) return;
  const Gauge timed = with_times(gauge, recording);
  GaugedRecording compared = recording;
  try {
    compared.alignment = align(compared, timed);
  } catch (const Error&) {
    return;  // nothing shows that it is late
  }
  const GaugedFrame& last = recording.frames.back();
  const double late = -compared.alignment->offset_s * static_cast<double>(last.touch.sequence) / last.time_s;
  double here = 1;
  for (const ClockSignal& signal : clock_signals(recording, true))
    if (signal.name == compared.clock_signal) here = correlation(recording, signal.values, gauge, 0);
  if (!(std::abs(late) <= kMost_frames) || !(1 - compared.alignment->correlation < kLeft * (1 - here)))
    return;
  recording.alignment = compared.alignment;
  recording.clock_signal = compared.clock_signal;
  recording.offset_s = compared.alignment->offset_s;
  recording.notes.push_back("the gauge is read " + number(std::abs(late), "%.1f") + " frames " +
                            (late > 0 ? "late" : "early") + " (correlation " + number(here) +
                            " as it is): followed; --align none takes the table as it is");
  take_readings(timed, recording);
}

/// Where the light falls with the force of a gauge that reads mostly negative ones, a press is negative to
/// it.
bool turn_where_opposite(Gauge& gauge, const GaugedRecording& recording) {
  if (!gauge.reads_negative()) return false;
  const std::vector<double> light = light_of(recording);
  double n = 0, x = 0, y = 0, xy = 0;
  for (size_t i = 0; i < light.size(); ++i) {
    const double force_N = recording.frames[i].force_N;
    if (!std::isfinite(force_N)) continue;
    n += 1, x += light[i], y += force_N, xy += light[i] * force_N;
  }
  if (!(n > 0) || xy - x * y / n >= 0) return false;
  gauge.turn();
  return true;
}

/// Takes what each of the gauge's columns reads untouched off.
void zero_readings(const GaugeRequest& request, GaugedRecording& recording) {
  struct Part {
    double GaugedFrame::*value;
    const char* name;
  };
  constexpr std::array kParts{Part{&GaugedFrame::force_N, "the normal force of "},
                              Part{&GaugedFrame::fx_N, "fx of "}, Part{&GaugedFrame::fy_N, "fy of "}};
  std::vector<bool> touched;
  std::array<std::vector<double>, kParts.size()> readings;
  double range_N = 0;
  for (const GaugedFrame& f : recording.frames) touched.push_back(f.touch.contact);
  for (size_t p = 0; p < kParts.size(); ++p) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const GaugedFrame& f : recording.frames) {
      const double reading = f.*kParts[p].value;
      readings[p].push_back(reading);
      if (std::isfinite(reading)) low = std::min(low, reading), high = std::max(high, reading);
    }
    if (low > high) readings[p].clear();  // the gauge has no such column
    if (low <= high) range_N = std::max(range_N, high - low);
  }
  for (size_t p = 0; p < kParts.size(); ++p) {
    if (readings[p].empty()) continue;
    // A pull along a single direction leaves the other at next to nothing.
    const std::string note = take_off_zero(readings[p], touched, kParts[p].name + request.gauge,
                                           p == 0 ? Pressed::Above : Pressed::Either, p == 0 ? 0 : range_N);
    if (!note.empty()) recording.notes.push_back(note);
    for (size_t i = 0; i < readings[p].size(); ++i) recording.frames[i].*kParts[p].value = readings[p][i];
  }
}

/// `untouched`: first frames that stand for the untouched image.
void take_gauge(const GaugeRequest& request, uint32_t untouched, GaugedRecording& recording) {
  Gauge gauge = read_gauge(request.gauge, request.columns);
  if (gauge.by_frame() && request.alignment.kind != Alignment::Kind::None && request.alignment.asked) {
    if (!has_times(recording))
      throw Error(Failure::Input, "times of the frames of '" + recording.input + "', for --align",
                  "images, which carry no times", "--rate HZ, or --align none");
    gauge = with_times(gauge, recording);
  }
  if (const std::string gaps = describe_gaps(gauge); !gaps.empty())
    recording.notes.push_back(gaps + ": frames there are left out");
  if (!gauge.by_frame()) {
    if (!std::isfinite(recording.frames.front().time_s))
      throw Error(Failure::Input, "times of the frames of '" + recording.input + "', as the gauge has times",
                  "images, which carry no times", "--rate HZ, or a gauge table with a column frame");
    if (request.alignment.kind == Alignment::Kind::Fixed) recording.offset_s = request.alignment.offset_s;
    if (request.alignment.kind == Alignment::Kind::Auto) align_clocks(recording, gauge);
  }
  take_readings(gauge, recording);
  if (!recording.alignment && turn_where_opposite(gauge, recording)) take_readings(gauge, recording);
  recording.notes.insert(recording.notes.end(), gauge.notes.begin(), gauge.notes.end());
  const auto without = static_cast<size_t>(
      std::count_if(recording.frames.begin(), recording.frames.end(),
                    [](const GaugedFrame& f) { return std::isnan(f.force_N) && std::isnan(f.fx_N); }));
  if (without == recording.frames.size())
    throw Error(Failure::Input, "gauge readings at the times of the frames of '" + recording.input + "'",
                gauge.file + ", which has none there",
                "--align auto, or the gauge's table of this recording");
  if (untouched > 0) refuse_touched_background(recording, untouched);
  if (gauge.by_frame() && !request.alignment.asked) {
    refuse_another_gauge(recording, gauge);
    follow_late_gauge(recording, gauge);
  }
  zero_readings(request, recording);
  if (without > 0)
    recording.notes.push_back(counted(without, "frame") + " of " + std::to_string(recording.frames.size()) +
                              " without a gauge reading");
}

}  // namespace

Alignment parse_alignment(const std::string& text) {
  if (text.empty()) return {};
  if (text == "auto") return {Alignment::Kind::Auto, 0, true};
  if (text == "none") return {Alignment::Kind::None, 0, true};
  double seconds = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), seconds);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(seconds))
    throw Error(Failure::Usage, "--align auto, none or seconds to add to the gauge's times", "'" + text + "'",
                "--align auto");
  return {Alignment::Kind::Fixed, seconds, true};
}

GaugedRecording measure_with_gauge(gpu::Context& context, const MeasuredInput& input,
                                   const GaugeRequest& request, const RunWatch& watch) {
  if (is_camera(input.input))
    throw Error(Failure::Usage, "a recording with its gauge's table", "a camera",
                "palpate record first, then the session");
  GaugedRecording recording;
  recording.input = input.input;
  recording.gauge = request.gauge;
  recording.object = request.object;
  if (request.gauge != kTruth) read_gauge(request.gauge, request.columns);  // before minutes of measuring
  const std::unique_ptr<Source> source = open_source(input.input, input.sensor);
  source->watch([&watch] { return watch.stopped(); });
  recording.separate = separate_presses(*source, request.one_sequence, request.rate_Hz);
  if (recording.separate && request.columns == GaugeColumns::Tangential)
    throw Error(Failure::Usage, "a pull whose frames follow each other",
                "'" + input.input + "': pictures without a rate, each of them a press of its own",
                "--sequence where they do");
  const Frame background = load_background(input.input, input.sensor, *source);
  Pipeline pipeline(
      context, for_rectified_frames(input.sensor), source->format(),
      {.outputs = input.outputs, .solver = SurfaceSolver::Best, .separate = recording.separate});
  pipeline.set_background(background);
  if (recording.separate) look_ahead(input.input, input.sensor, pipeline, watch.stop);
  const double rate_Hz = source->rate_Hz() > 0 ? source->rate_Hz() : request.rate_Hz;
  const RunWatch::Progress progress = watch.begin("measuring", source->frame_count().value_or(0));
  size_t spoilt = 0;
  run_recording(*source, pipeline, 0, watch.stop, [&](const Result& result, const Frame& frame) {
    if (result.touch.picture != PictureFault::None) {
      ++spoilt;
      return;
    }
    GaugedFrame f{result.touch, kNaN, kNaN, kNaN, kNaN};
    f.touch.contacts.clear();
    f.touch.skin_points.clear();
    if (source->rate_Hz() > 0)
      f.time_s = static_cast<double>(frame.time_ns) * 1e-9;
    else if (rate_Hz > 0)
      f.time_s = static_cast<double>(frame.sequence) / rate_Hz;
    recording.frames.push_back(std::move(f));
    progress(recording.frames.size());
  });
  if (recording.frames.empty())
    throw Error(Failure::Input, "frames in '" + input.input + "'", "none", "another recording");
  if (const std::string warning = source->warning(); !warning.empty()) recording.notes.push_back(warning);
  if (const std::string unused = unused_rate(*source, request.rate_Hz); !unused.empty())
    recording.notes.push_back(unused);
  if (recording.separate && recording.frames.size() > 1)
    recording.notes.push_back(
        "pictures without a rate: each is a press of its own (--sequence: they follow each other)");
  if (spoilt > 0) recording.notes.push_back(counted(spoilt, "damaged picture") + " left out");
  if (request.gauge == kTruth)
    take_truth(*source, recording);
  else
    take_gauge(request, own_untouched_frames(input.sensor, *source), recording);
  return recording;
}

std::string describe(const GaugedRecording& recording) {
  std::string text =
      recording.input + " with " + recording.gauge + ": " + counted(recording.frames.size(), "frame");
  if (const std::optional<TimeAlignment>& a = recording.alignment)
    text += ", gauge's clock " + number(a->offset_s, "%+.4f") + " s +- " + number(a->sd_s, "%.2g") +
            " s (correlation " + number(a->correlation, "%.4f") + " with the " + recording.clock_signal + ")";
  else if (recording.offset_s != 0)
    text += ", gauge's clock " + number(recording.offset_s, "%+.4f") + " s as given";
  text += "\n";
  for (const std::string& note : recording.notes) text += "  " + note + "\n";
  return text;
}

json::Value to_json(const std::vector<GaugedRecording>& recordings) {
  json::Value all = json::Value::array();
  for (const GaugedRecording& r : recordings) {
    json::Value value = {
        {"input", r.input}, {"gauge", r.gauge}, {"frames", r.frames.size()}, {"offset_s", r.offset_s}};
    if (r.alignment) {
      value["offset_sd_s"] = r.alignment->sd_s;
      value["correlation"] = r.alignment->correlation;
      value["clock_signal"] = r.clock_signal;
    }
    value["object"] = r.object.empty() ? json::Value(nullptr) : json::Value(r.object);
    value["notes"] = r.notes;
    all.push_back(value);
  }
  return all;
}

Origin origin_of(const std::vector<GaugedRecording>& recordings, const std::string& note) {
  Origin origin;
  for (const GaugedRecording& r : recordings)
    origin.from += (origin.from.empty() ? "" : "; ") + r.input + " with " + r.gauge;
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char made[32];
  std::strftime(made, sizeof made, "%Y-%m-%dT%H:%M:%SZ", &utc);
  origin.made = made;
  origin.note = note;
  return origin;
}

}  // namespace palpate
