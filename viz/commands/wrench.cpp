// palpate wrench: force and moment on the pad over a recording, and the pressure at its peak.
#include <algorithm>
#include <cmath>
#include <limits>

#include "capture/calibrate/wrench.h"
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
#include "viz/report/plot_script.h"

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
  if (validity == Validity::AtBorder) return text + ", at least: the contact reaches the border";
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

/// A force or moment over time, its 95 % band, and the gauge.
std::string curve(const WrenchSeries& series, const Estimate TractionSummary::*which, const char* block,
                  bool gauge) {
  // A normal force presses.
  const double least = which == &TractionSummary::fz_N ? 0 : -std::numeric_limits<double>::infinity();
  std::vector<std::vector<double>> columns(5);
  for (const WrenchFrame& frame : series.frames) {
    const Estimate& e = frame.wrench.*which;
    const bool known = has_value(e);
    const double row[] = {std::isfinite(frame.time_s) ? frame.time_s : static_cast<double>(frame.frame),
                          known ? e.value : kNaN,
                          known ? std::max(least, e.value - 1.96 * e.standard_error) : kNaN,
                          known ? e.value + 1.96 * e.standard_error : kNaN, gauge ? frame.gauge_N : kNaN};
    for (size_t i = 0; i < 5; ++i) columns[i].push_back(row[i]);
  }
  return plot_block(block, columns);
}

std::string series_script(const WrenchSeries& series, bool gauge, PlotKind kind) {
  const bool times = !series.frames.empty() && std::isfinite(series.frames.front().time_s);
  const bool shear = std::any_of(series.frames.begin(), series.frames.end(),
                                 [](const WrenchFrame& f) { return has_value(f.wrench.fx_N); });
  std::string s = plot_head(kind, 1000, 760) + curve(series, &TractionSummary::fz_N, "fz", gauge);
  s += curve(series, &TractionSummary::mx_Nmm, "mx", false) +
       curve(series, &TractionSummary::my_Nmm, "my", false);
  if (shear)
    s += curve(series, &TractionSummary::fx_N, "fx", false) +
         curve(series, &TractionSummary::fy_N, "fy", false) +
         curve(series, &TractionSummary::mz_Nmm, "mz", false);
  const auto band = [](const char* name, const char* title, size_t colour) {
    return text(
        "$%s using 1:3:4 with filledcurves fs transparent solid 0.2 noborder lc rgb '%s' notitle, $%s using "
        "1:2 with lines lw 2 lc rgb '%s' title '%s'",
        name, plot_colour(colour), name, plot_colour(colour), title);
  };
  s += "set key outside right top\nset multiplot layout 2,1 title " + plot_words(headline(series)) + "\n";
  s += "set ylabel 'force, N'\nset lmargin 10\nset rmargin 18\nplot " + band("fz", "normal, 95 %", 0);
  if (gauge) s += ", $fz using 1:5 with lines lw 2 dt 2 lc rgb '#222222' title 'gauge'";
  if (shear) s += ", " + band("fx", "along x", 1) + ", " + band("fy", "along y", 2);
  s += std::string("\nset xlabel '") + (times ? "time, s" : "frame") + "'\nset ylabel 'moment, N mm'\nplot " +
       band("mx", "about x", 1) + ", " + band("my", "about y", 2);
  if (shear) s += ", " + band("mz", "about z", 3);
  return s + "\nunset multiplot\n";
}

/// Pressure as colour, shear as arrows.
std::string map_script(const WrenchSeries& series, PlotKind kind) {
  const TractionPicture& map = series.at_peak;
  const WrenchFrame& peak = series.frames[*series.peak];
  std::string s = plot_head(kind, 860, 620) + "$map << EOD\n";
  std::vector<std::vector<double>> arrows(4);
  double longest = 0;
  for (size_t i = 0; i < map.shear_x_kPa.size(); ++i)
    longest = std::max(longest, std::hypot(double{map.shear_x_kPa[i]}, double{map.shear_y_kPa[i]}));
  const uint32_t step = std::max(1u, map.width / 24);
  for (uint32_t y = 0; y < map.height; ++y) {
    for (uint32_t x = 0; x < map.width; ++x) {
      const size_t i = size_t{y} * map.width + x;
      const double at_x = (x + 0.5) * map.cell_mm, at_y = (y + 0.5) * map.cell_mm;
      s +=
          plot_number(at_x) + " " + plot_number(at_y) + " " + plot_number(double{map.pressure_kPa[i]}) + "\n";
      if (longest <= 0 || x % step != 0 || y % step != 0) continue;
      const double scale = step * map.cell_mm / longest;
      if (std::hypot(double{map.shear_x_kPa[i]}, double{map.shear_y_kPa[i]}) < 0.05 * longest) continue;
      arrows[0].push_back(at_x);
      arrows[1].push_back(at_y);
      arrows[2].push_back(scale * double{map.shear_x_kPa[i]});
      arrows[3].push_back(scale * double{map.shear_y_kPa[i]});
    }
    s += "\n";
  }
  s += "EOD\n" + plot_block("arrows", arrows) + plot_palette();
  s += plot_colour_bar(0, peak.wrench.pressure_max_kPa);
  std::string title = text("Pressure in frame %llu: up to %.3g kPa",
                           static_cast<unsigned long long>(peak.frame), peak.wrench.pressure_max_kPa);
  if (longest > 0) title += text("; arrows: shear, up to %.3g kPa", longest);
  s += "set size ratio -1\nset xrange [0:" + plot_number(map.width * map.cell_mm) +
       "]\nset xlabel 'x, mm'\nset ylabel 'y, mm'\nset cblabel 'pressure, kPa'\nset yrange [" +
       plot_number(map.height * map.cell_mm) + ":0]\nset title " + plot_words(title) +
       "\nplot $map using 1:2:3 with image notitle";
  if (!arrows[0].empty())
    s += ", $arrows using 1:2:3:4 with vectors filled head size screen 0.008,20 lw 1.5 lc rgb '#ffffff' "
         "notitle";
  return s + "\n";
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
      draw_plots([&](PlotKind kind) { return series_script(series, check.has_value(), kind); },
                 common.out / "wrench", written);
      draw_plots([&](PlotKind kind) { return map_script(series, kind); }, common.out / "pressure", written);
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
  command->callback(
      [&common, &chosen, options] { chosen = [&common, options] { return run(common, *options); }; });
}

}  // namespace palpate
