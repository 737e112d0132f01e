// palpate lump estimate: the lump behind pressure maps.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "capture/files/estimate_report.h"
#include "capture/files/lump_maps.h"
#include "capture/files/output_file.h"
#include "engine/base/stop.h"
#include "engine/base/text.h"
#include "engine/lump/estimator.h"
#include "engine/lump/observation/observe.h"
#include "engine/lump/press_effect/plate_check.h"
#include "engine/lump/tissue/relaxation.h"
#include "palpate/error.h"
#include "viz/commands/lump/error_options.h"
#include "viz/commands/lump/lump.h"
#include "viz/commands/support/lump_method.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"
#include "viz/commands/support/relaxation_options.h"
#include "viz/report/plot.h"

namespace palpate {
namespace {

struct Options {
  std::vector<std::string> maps;
  std::vector<double> force_N, press_mm, window_mm, block_mm;
  std::string young_Pa, thickness_mm = "20";
  double pitch_mm = 1.25, noise_Pa = -1, press_sd_mm = lump::Observation{}.press_sd_mm;
  double uneven_sd = lump::Observation{}.uneven_sd, place_sd_mm = lump::kPlaceSd_mm;
  lump::ErrorSources errors;
  SkinOptions skin;
  PlateOptions plate;
  bool check_plate = false;
  RelaxationOptions relaxation;
  std::string network, method = "refined";
};

/// Tissue as it is stated; its errors go to the sources of `o`.
void set_tissue(Options& o, lump::Observation& observation) {
  if (o.young_Pa.empty() && o.press_mm.empty())
    throw Error(Failure::Usage, "the tissue's modulus, or the way of the plate by which it is found",
                "neither", "--young-Pa 4000, or --press-mm P1,P2,... from where the plate touches");
  observation.young_Pa =
      o.young_Pa.empty() ? 0 : stated_value("--young-Pa", o.young_Pa, 1, 1e9, o.errors.young);
  observation.block_mm = {o.block_mm.empty() ? 40 : o.block_mm.front(),
                          o.block_mm.empty() ? 40 : o.block_mm.back(),
                          stated_value("--thickness-mm", o.thickness_mm, 1, 1000, o.errors.thickness)};
  observation.skin = skin_of(o.skin, observation.block_mm[2]);
  observation.plate = plate_of(o.plate);
  observation.relaxation = relaxation_of(o.relaxation);
  observation.press_mm = o.press_mm;
  observation.press_sd_mm = o.press_sd_mm;
}

lump::Observation reading_of(Options& o) {
  if (o.force_N.size() != o.maps.size())
    throw Error(Failure::Usage, "a force for each of " + std::to_string(o.maps.size()) + " maps",
                std::to_string(o.force_N.size()), "--force-N F1,F2,...");
  std::vector<PressureMap> maps;
  for (const std::string& file : o.maps) maps.push_back(read_pressure_map(file, o.pitch_mm));
  lump::Observation observation = lump::observe(std::move(maps), o.force_N);
  set_tissue(o, observation);
  if (o.window_mm.size() == 2) observation.window_mm = {o.window_mm[0], o.window_mm[1]};
  if (o.noise_Pa >= 0) observation.noise_Pa = o.noise_Pa;
  observation.uneven_sd = o.uneven_sd;
  observation.place_sd_mm = o.place_sd_mm;
  return observation;
}

std::string size_text(const lump::Estimate& e) {
  return palpate::text("%.3g mm wide, %.3g mm deep, ratio %.3g to %.3g", e.size_mm.value, e.depth_mm.value,
                       e.stiffness_ratio.low, e.stiffness_ratio.high);
}

Plot plot_of(const lump::Observation& observation, const lump::Estimate& e) {
  const PressureMap& top = observation.pressure_Pa.back();
  const PlotUnit unit = plot_unit(*std::max_element(top.values.begin(), top.values.end()), "Pa");
  PlotMap map{top.width, top.height, top.pitch_mm[0], top.pitch_mm[1]};
  map.values = plot_scaled({top.values.begin(), top.values.end()}, unit.factor);
  map.x = observation.window_mm[0];
  map.y = observation.window_mm[1];
  map.label = "pressure at the highest load, " + unit.name;
  PlotPanel panel{lump::status_text(e.verdict), "x, mm", "y, mm", "", {}, map};
  if (e.detection_statistic >= 1 && std::isfinite(e.size_mm.value) &&
      e.verdict != lump::Status::SeveralLumps && e.verdict != lump::Status::Inconsistent) {
    panel.title = std::string(to_string(e.shape)) + ": " + size_text(e);
    const auto [x, y] = plot_ellipse(e.x_mm.value, e.y_mm.value, e.size_mm.value, e.size_mm.value);
    panel.add("", x, y, kPlotWhite);
  }
  std::string words;
  for (size_t i = 0; i < e.lumps.size(); ++i) {
    const lump::Estimate& each = e.lumps[i];
    if (!std::isfinite(each.size_mm.value)) continue;
    const auto [x, y] =
        plot_ellipse(each.x_mm.value, each.y_mm.value, each.size_mm.value, each.size_mm.value);
    panel.add("", x, y, kPlotWhite);
    // Beside its circle, not on the peak.
    PlotCurve& number = panel.add("", {each.x_mm.value}, {each.y_mm.value + 0.65 * each.size_mm.value},
                                  kPlotWhite, PlotCurve::Style::Words);
    number.words = {std::to_string(i + 1)};
    number.size = 1;
    words += (words.empty() ? "" : "; ") + std::to_string(i + 1) + ": " + size_text(each);
  }
  if (!words.empty()) panel.title = words;
  return {.panels = {panel}, .width_px = 760, .height_px = 600};
}

Report estimate(const Common& common, Options& o) {
  const lump::Observation observation = reading_of(o);
  const auto network = lump::load_network(o.network);
  lump::Estimate estimate =
      lump::named_estimator(o.method, network, o.errors, {.stop = interrupted})(observation);
  if (o.check_plate) report_plate(*network, observation, estimate);
  Report report = facts_of(estimate);
  if (!common.out.empty()) {
    make_output_folder(common.out);
    write_observation(common.out, without_relaxation(observation));
    write_whole(common.out / "lump.json", std::string_view(report.json.dump(2, json::Utf8::Replace) + "\n"));
    std::string csv = "quantity,value,low,high,unit\n", written = (common.out / "lump.json").string();
    if (estimate.detection_statistic >= 1 && estimate.lumps.empty() &&
        estimate.verdict != lump::Status::Inconsistent)
      for (const EstimateQuantity& q : quantities_of(estimate))
        csv += std::string(q.name) + "," + plot_number(q.value.value) + "," + plot_number(q.value.low) + "," +
               plot_number(q.value.high) + "," + q.unit + "\n";
    write_whole(common.out / "lump.csv", std::string_view(csv));
    write_whole(common.out / "lumps.csv", std::string_view(lumps_csv(estimate)));
    written += ", lump.csv, lumps.csv, observation.json, pressure_Pa.npy";
    draw_plot(plot_of(observation, estimate), common.out / "lump", written);
    report.text += "wrote " + written + "\n";
  }
  return report;
}

Report run(const Common& common, Options& o) {
  try {
    return estimate(common, o);
  } catch (const Stopped&) {
    return interrupted_report("interrupted");
  }
}

}  // namespace

void add_lump_estimate(CommandLine& group, Common& common, Command& chosen) {
  CommandLine* command = group.add_subcommand("estimate",
                                              "Estimate the lump behind pressure maps, or each of two: size, "
                                              "depth, stiffness, shape, with intervals");
  auto o = std::make_shared<Options>();
  command->add_option("MAPS", o->maps, "Pressure in Pa, a file per load: .npy (height x width) or .csv")
      ->required();
  command->add_option("--force-N", o->force_N, "On the whole block, one per map")->delimiter(',')->required();
  command->add_option("--young-Pa", o->young_Pa,
                      "Of the tissue, from a place without a lump; 4000+-400: known to 400 Pa (sd)");
  command
      ->add_option("--press-mm", o->press_mm,
                   "Way of the plate at each load from where it touches; finds the modulus")
      ->delimiter(',');
  command->add_setting("--press-sd-mm", o->press_sd_mm, Check::range(0.0, 10.0), "Standard error of the way");
  command->add_setting("--pitch-mm", o->pitch_mm, Check::range(0.01, 10.0), "Between a map's nodes");
  command->add_option("--thickness-mm", o->thickness_mm, "Of the tissue; 20+-0.5: known to 0.5 mm (sd)")
      ->option_text("MM [20]");
  add_skin(*command, o->skin);
  add_plate(*command, o->plate);
  command
      ->add_flag("--check-plate", o->check_plate,
                 "Find out whether the plate slides: presses the block alone (1 s of a core)")
      ->group(kPressGroup);
  add_relaxation(*command, o->relaxation);
  command->add_option("--block-mm", o->block_mm, "Length and width of the tissue (default 40 40)")
      ->expected(1, 2);
  command
      ->add_option("--window-mm", o->window_mm,
                   "Centre of the maps from the centre of the block, mm, x y (default 0 0)")
      ->expected(2);
  command
      ->add_option("--noise-Pa", o->noise_Pa,
                   "Of a value, standard deviation (default: from the last map's roughness)")
      ->check(Check::range(0.0, 1e9));
  add_error_sources(*command, o->errors);
  command->add_setting("--uneven-sd", o->uneven_sd, Check::range(0.0, 0.5),
                       "Slow errors of pressure across the window, relative standard deviation; widens the "
                       "intervals");
  command->add_setting("--place-sd-mm", o->place_sd_mm, Check::range(0.0, 10.0),
                       "Standard error of the window's place in the block");
  command->add_option("--network", o->network, "A file of palpate-lab train (default: the built-in network)");
  command->add_option("--method", o->method, kLumpMethodHelp)->capture_default_str();
  command->add_option("--out", common.out,
                      "Folder for lump.json, lump.csv, lumps.csv (a row a lump), a plot, and the observation "
                      "for palpate lump compare");
  add_common(
      *command, common,
      "  palpate lump estimate a.npy b.npy c.npy d.npy --force-N 0.5,1,1.5,2 --young-Pa 4000 \\\n"
      "      --thickness-mm 20\n"
      "  palpate lump estimate a.npy b.npy c.npy d.npy --force-N 0.5,1,1.5,2 --press-mm 1,1.8,2.5,3.1\n"
      "  palpate lump estimate press.csv --pitch-mm 1 --force-N 2 --young-Pa 5200 --out out/lump\n");
  command->runs(chosen, [o, &common] { return run(common, *o); });
}

}  // namespace palpate
