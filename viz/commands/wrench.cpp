// palpate wrench: force and moment on the pad over a recording, and the pressure at its peak.
#include <algorithm>
#include <cmath>
#include <limits>

#include "capture/calibrate/force/wrench.h"
#include "capture/files/measurements.h"
#include "capture/files/output_file.h"
#include "engine/base/json.h"
#include "engine/base/text.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "viz/commands/command.h"
#include "viz/commands/option_groups/run_options.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"
#include "viz/commands/support/run_watch.h"
#include "viz/report/plot.h"

namespace palpate {
namespace {

using Json = json::Value;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

struct Options {
  std::string input, gauge, align;
  std::filesystem::path sensor, background;
  double young_kPa = 0, poisson = 0, thickness_mm = 0;
  double rate_Hz = 0;
  bool one_sequence = false;
};

/// The sensor's layer, with what the command line says of it.
void apply_layer(const Options& options, Sensor& sensor) {
  if (options.young_kPa > 0 || options.thickness_mm > 0 || options.poisson > 0) {
    LayerCalibration layer = layer_of(sensor).value_or(LayerCalibration{});
    if (options.young_kPa > 0) layer.young_MPa = 1e-3 * options.young_kPa;
    if (options.thickness_mm > 0) layer.thickness_mm = options.thickness_mm;
    if (options.poisson > 0) layer.poisson = options.poisson;
    if (!(layer.young_MPa > 0) || !(layer.thickness_mm > 0))
      throw Error(Failure::Usage, "the layer's modulus and its thickness", "one of them",
                  "--young-kPa and --thickness-mm, or \"layer\" in the sensor file");
    sensor.layer = layer;
  }
  if (!layer_of(sensor))
    throw Error(
        Failure::Sensor, "a sensor with an elastic layer", "sensor '" + sensor.name + "' without one",
        "\"layer\": {\"young_MPa\": 0.15, \"poisson\": 0.485, \"thickness_mm\": 4} in the sensor file, or "
        "--young-kPa and --thickness-mm");
}

std::string with_error(const Estimate& e, const char* unit) {
  if (!has_value(e)) return e.validity == Validity::NotCalibrated ? "not known" : "none";
  const int places = deserved_places(e.standard_error > 0 ? e.standard_error : 1e-4);
  return with_places(e.value, places) + " ± " + with_places(e.standard_error, places) + " " + unit;
}

std::string headline(const WrenchSeries& series) {
  if (!series.peak) return "Nothing touches the pad in this recording";
  const WrenchFrame& peak = series.frames[*series.peak];
  std::string text =
      "Largest normal force " + with_error(peak.wrench.fz_N, "N") + " in frame " + std::to_string(peak.frame);
  const Validity validity = peak.wrench.fz_N.validity;
  if (validity == Validity::AtBorder) return text + ", with what is taken to press beyond the border";
  if (validity != Validity::Valid) text += std::string(", ") + to_string(validity);
  return text;
}

void add_check(const WrenchCheck& check, Facts& facts) {
  facts.add("gauge",
            {{"readings", check.readings},
             {"valid", check.valid},
             {"full_N", check.full_N},
             {"mean_error_N", check.mean_error_N},
             {"valid_mean_error_N", check.valid_mean_error_N},
             {"scale", check.scale},
             {"coverage_95", check.coverage}},
            text("\nagainst the gauge: mean error %.3g N, %.1f %% of its largest reading, over %zu frames; "
                 "%.3g N over the %zu that are valid; the 95 %% interval held %.0f %%; the gauge is %.3g "
                 "times the force\n",
                 check.mean_error_N, 100 * check.mean_error_N / check.full_N, check.readings,
                 check.valid_mean_error_N, check.valid, 100 * check.coverage, check.scale));
}

/// The peak of each time that something touches.
std::vector<size_t> peaks_of(const WrenchSeries& series) {
  std::vector<size_t> peaks;
  bool touching = false;
  for (size_t i = 0; i < series.frames.size(); ++i) {
    const WrenchFrame& frame = series.frames[i];
    if (frame.contact && !touching) peaks.push_back(i);
    if (frame.contact && frame.wrench.fz_N.value > series.frames[peaks.back()].wrench.fz_N.value)
      peaks.back() = i;
    touching = frame.contact;
  }
  return peaks;
}

Json json_of(const Estimate& e) {
  Json value = {{"state", to_string(e.validity)}};
  if (!has_value(e)) return value;
  value["value"] = e.value;
  value["sd"] = e.standard_error;
  return value;
}

Facts facts_of(const WrenchFrame& frame) {
  const TractionSummary& t = frame.wrench;
  const bool timed = std::isfinite(frame.time_s);
  Facts facts;
  facts.add("frame", frame.frame, text("frame %llu", static_cast<unsigned long long>(frame.frame)));
  facts.add("time_s", timed ? Json(frame.time_s) : Json(nullptr),
            timed ? text(", %.3f s", frame.time_s) : "");
  facts.say(text(": %s, pressure up to %.3g kPa on %.3g mm²\n", to_string(t.fz_N.validity),
                 t.pressure_max_kPa, t.area_mm2));
  for (const WrenchComponent& c : components(t)) facts.add(std::string(c.name), json_of(c.estimate));
  facts.say("  Fx " + with_error(t.fx_N, "N") + "   Fy " + with_error(t.fy_N, "N") + "   Fz " +
            with_error(t.fz_N, "N") + "\n  Mx " + with_error(t.mx_Nmm, "N mm") + "   My " +
            with_error(t.my_Nmm, "N mm") + "   Mz " + with_error(t.mz_Nmm, "N mm") + "\n");
  facts.add("pressure_max_kPa", t.pressure_max_kPa);
  facts.add("pressed_area_mm2", t.area_mm2);
  return facts;
}

/// `separate`: pictures whose skin could be followed if they were one sequence.
Facts facts_of(const WrenchSeries& series, const std::optional<WrenchCheck>& check, bool separate) {
  Facts facts;
  facts.add("frames", series.frames.size(), headline(series) + "\n\n");
  Json touches = Json::array();
  for (const size_t i : peaks_of(series)) {
    if (touches.empty())
      facts.say("peak of each touch (x right, y down, z into the pad; moments about the frame's middle)\n");
    const Facts peak = facts_of(series.frames[i]);
    touches.push_back(peak.json);
    facts.say(peak.text);
  }
  facts.add("touches", touches);
  if (series.peak && !has_value(series.frames[*series.peak].wrench.fx_N))
    facts.say(
        separate
            ? "Fx, Fy and Mz need frames that follow each other (--rate, or --sequence)\n"
            : "Fx, Fy and Mz need a pattern on the skin that is followed (\"skin\" in the sensor file)\n");
  for (const std::string& note : series.notes) facts.say("note: " + note + "\n");
  if (check) add_check(*check, facts);
  return facts;
}

/// Forces and moments over time with their 95 % bands, and the gauge.
Plot series_plot(const WrenchSeries& series, bool gauge) {
  std::vector<double> at, gauge_N;
  const bool times = !series.frames.empty() && std::isfinite(series.frames.front().time_s);
  bool shear = false;
  for (const WrenchFrame& frame : series.frames) {
    at.push_back(times ? frame.time_s : static_cast<double>(frame.frame));
    gauge_N.push_back(frame.gauge_N);
    shear = shear || has_value(frame.wrench.fx_N);
  }
  const char* x_label = times ? "time, s" : "frame";
  PlotPanel forces{"", x_label, "force, N"}, moments{"", x_label, "moment, N mm"};
  forces.key = moments.key = "outside right top";
  const auto add = [&](PlotPanel& panel, const char* name, const Estimate TractionSummary::*which,
                       size_t colour) {
    // A normal force presses.
    const double least = which == &TractionSummary::fz_N ? 0 : -std::numeric_limits<double>::infinity();
    PlotCurve& curve = panel.add(name, at, {}, colour);
    for (const WrenchFrame& frame : series.frames) {
      const Estimate& e = frame.wrench.*which;
      const double value = has_value(e) ? e.value : kNaN;
      curve.y.push_back(value);
      curve.low.push_back(std::isnan(value) ? kNaN : std::max(least, value - 1.96 * e.standard_error));
      curve.high.push_back(value + 1.96 * e.standard_error);
    }
  };
  add(forces, "normal, 95 %", &TractionSummary::fz_N, 0);
  if (gauge) forces.add("gauge", at, gauge_N, kPlotBlack).dashed = true;
  if (shear) add(forces, "along x", &TractionSummary::fx_N, 1);
  if (shear) add(forces, "along y", &TractionSummary::fy_N, 2);
  add(moments, "about x", &TractionSummary::mx_Nmm, 1);
  add(moments, "about y", &TractionSummary::my_Nmm, 2);
  if (shear) add(moments, "about z", &TractionSummary::mz_Nmm, 3);
  return {headline(series), {forces, moments}, 1, 1000, 760};
}

/// Pressure as colour, shear as arrows.
Plot map_plot(const WrenchSeries& series) {
  const TractionPicture& peak = series.at_peak;
  const double cell_mm = peak.cell_mm;
  PlotMap map{peak.width, peak.height, cell_mm, cell_mm};
  map.values.assign(peak.pressure_kPa.begin(), peak.pressure_kPa.end());
  map.x = peak.width * cell_mm / 2;
  map.y = peak.height * cell_mm / 2;
  map.label = "pressure, kPa";
  PlotPanel panel{text("Pressure in frame %llu: up to %.3g kPa",
                       static_cast<unsigned long long>(series.frames[*series.peak].frame),
                       series.frames[*series.peak].wrench.pressure_max_kPa),
                  "x, mm", "y, mm"};
  panel.map = map;
  panel.down = true;
  double longest = 0;
  for (size_t i = 0; i < peak.shear_x_kPa.size(); ++i)
    longest = std::max(longest, std::hypot(double{peak.shear_x_kPa[i]}, double{peak.shear_y_kPa[i]}));
  if (longest <= 0) return {.panels = {panel}, .width_px = 860, .height_px = 620};
  panel.title += text("; arrows: shear, up to %.3g kPa", longest);
  const uint32_t step = std::max(1u, peak.width / 24);
  const double scale = step * cell_mm / longest;
  PlotCurve& arrows = panel.add("", {}, {}, kPlotWhite, PlotCurve::Style::Arrows);
  for (uint32_t y = 0; y < peak.height; y += step)
    for (uint32_t x = 0; x < peak.width; x += step) {
      const size_t i = size_t{y} * peak.width + x;
      const double along_x = double{peak.shear_x_kPa[i]}, along_y = double{peak.shear_y_kPa[i]};
      if (std::hypot(along_x, along_y) < 0.05 * longest) continue;
      arrows.add((x + 0.5) * cell_mm, (y + 0.5) * cell_mm, scale * along_x, scale * along_y);
    }
  return {.panels = {panel}, .width_px = 860, .height_px = 620};
}

Report run(const Common& common, const Options& options) {
  MeasuredInput input = find_input(common.seed, options.input, options.sensor, options.background);
  apply_layer(options, input.sensor);
  const std::unique_ptr<gpu::Context> context = open_device(common);
  const WrenchSeries series =
      measure_wrench(*context, input,
                     {options.gauge, GaugeColumns::Normal, parse_alignment(options.align), options.rate_Hz,
                      options.one_sequence},
                     run_watch(common));
  if (interrupted()) return interrupted_report();
  const std::optional<WrenchCheck> check = check_wrench(series);
  const bool separate = input.sensor.skin && !options.one_sequence && series.peak &&
                        !std::isfinite(series.frames[*series.peak].time_s);
  Report report = facts_of(series, check, separate);
  if (!common.out.empty()) {
    make_output_folder(common.out);
    write_whole(common.out / "wrench.csv", std::string_view(wrench_csv(series)));
    std::string written = "\nwritten: " + (common.out / "wrench.csv").string();
    if (series.peak) {
      draw_plot(series_plot(series, check.has_value()), common.out / "wrench", written);
      draw_plot(map_plot(series), common.out / "pressure", written);
    }
    report.text += written;
  }
  report.exit_code = validation_clean(*context) ? 0 : kInternalError;
  return report;
}

}  // namespace

void add_wrench(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command = program.add_subcommand(
      "wrench",
      "Force and moment on the pad over a recording, with pressure and shear, from its elastic layer");
  auto options = std::make_shared<Options>();
  command
      ->add_option("INPUT", options->input,
                   "Session folder, video file, folder of images, or synthetic:SCENE")
      ->required();
  command->add_option("--sensor", options->sensor,
                      "Sensor file with a layer (JSON, see engine/sensor/README.md)");
  command
      ->add_option("--background", options->background,
                   "Untouched image (default: the sensor file's, or the recording's first frames)")
      ->check(Check::existing_file());
  command->add_option(
      "--gauge", options->gauge,
      "CSV with time_s or frame, and force_N, to compare with; truth: a synthetic recording's own");
  command->add_option("--align", options->align,
                      "Clocks of gauge and recording: auto (found by the light), none, or seconds");
  command
      ->add_option("--young-kPa", options->young_kPa,
                   "Young's modulus of the layer (default: the sensor file's)")
      ->check(Check::positive());
  command->add_option("--poisson", options->poisson, "Poisson's ratio of the layer, up to 0.5")
      ->check(Check::range(0.0, 0.5));
  command->add_option("--thickness-mm", options->thickness_mm, "Thickness of the layer")
      ->check(Check::positive());
  command
      ->add_option("--rate", options->rate_Hz, "Frames a second of images, which carry no times of their own")
      ->check(Check::positive());
  add_sequence(*command, options->one_sequence);
  command->add_option("--out", common.out,
                      "Folder for wrench.csv, the plot over time and the map of pressure at the peak");
  add_common(*command, common,
             "  palpate wrench press.avi --sensor gel.json --out out/wrench\n"
             "  palpate wrench press.avi --sensor gel.json --gauge press.csv --out out/wrench\n"
             "  palpate wrench synthetic:press --gauge truth\n"
             "Pressure is what explains the slopes of the surface on a layer that is bonded to its window; "
             "one number,\n"
             "its modulus, is calibrated: palpate calibrate force --model layer.\n");
  command->runs(chosen, [&common, options] { return run(common, *options); });
}

}  // namespace palpate
