// palpate-lab figures: the paper's Figures 17 to 22 from the forward model and the network.
#include <algorithm>
#include <cmath>

#include "capture/files/output_file.h"
#include "engine/base/json.h"
#include "engine/base/text.h"
#include "engine/lump/network/network.h"
#include "palpate/error.h"
#include "perf/lab/commands/commands.h"
#include "perf/lab/forward/forward.h"
#include "perf/lab/study/figures.h"
#include "perf/lab/study/lump_network_figure.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"
#include "viz/report/plot.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;
using Json = json::Value;

std::string fit_text(const lump::GaussianFit& f) {
  if (!f.found) return "no Gaussian";
  return palpate::text("a = %.4g +- %.2g Pa, s^2 = %.4g +- %.2g mm^2", f.amplitude, f.sd[0],
                       f.width_mm * f.width_mm, 2 * f.width_mm * f.sd[2]);
}

Json fit_json(const lump::GaussianFit& f) {
  if (!f.found) return nullptr;
  return {{"amplitude_Pa", f.amplitude},
          {"amplitude_sd_Pa", f.sd[0]},
          {"center_mm", f.center_mm},
          {"variance_mm2", f.width_mm * f.width_mm},
          {"variance_sd_mm2", 2 * f.width_mm * f.sd[2]},
          {"offset_Pa", f.offset},
          {"r_squared", f.r_squared}};
}

Json press_json(const lump::FigurePress& p) {
  Json value = {
      {"name", p.name}, {"scene", to_json(p.scene)}, {"force_wanted_N", p.wanted_N}, {"converged", p.good}};
  value["scene"].erase("press_mm");
  if (!p.good) {
    value["last_force_N"] = p.last_force_N;
    return value;
  }
  value["force_N"] = p.press.force_N;
  value["press_mm"] = p.press.press_mm;
  value["gaussian"] = fit_json(p.fit);
  value["gaussian_of_bump"] = fit_json(p.bump_fit);
  return value;
}

std::string table(const char* title, const std::vector<lump::FigureRow>& rows) {
  std::string text =
      palpate::text("%s\n%-10s %7s %8s %8s   %-42s   %-42s   %s\n", title, "inclusion", "E_r", "force N",
                    "press mm", "profile", "less the block without it", "paper: a (gray), sigma^2");
  for (const auto& [p, paper] : rows)
    if (p.good)
      text += palpate::text("%-10s %7.4g %8.3f %8.3f   %-42s   %-42s   %.5g, %.4g\n", p.name.c_str(),
                            p.scene.inclusion->stiffness_ratio, p.press.force_N, p.press.press_mm,
                            fit_text(p.fit).c_str(), fit_text(p.bump_fit).c_str(), paper.amplitude_gray,
                            paper.variance);
    else
      text += palpate::text("%-10s %7.4g  not converged: the press ended at %.3g of %.3g N\n", p.name.c_str(),
                            p.scene.inclusion->stiffness_ratio, p.last_force_N, p.wanted_N);
  return text;
}

/// Fig. 20 or 22: the profiles with their Gaussians, and the bumps alone.
Plot profiles_plot(const std::vector<lump::FigureRow>& rows, const std::string& title) {
  PlotPanel panels[2] = {{.title = "profile (points) and Gaussian (lines)",
                          .x_label = "x, mm",
                          .y_label = "pressure on the plate, Pa"},
                         {.title = "bump alone",
                          .x_label = "x, mm",
                          .y_label = "pressure above the block without inclusion, Pa"}};
  for (size_t i = 0; i < rows.size(); ++i) {
    const lump::FigurePress& p = rows[i].press;
    if (!p.good) continue;
    for (const bool bump : {false, true}) {
      const lump::Profile& profile = bump ? p.bump : p.profile;
      const lump::GaussianFit& fit = bump ? p.bump_fit : p.fit;
      panels[bump].curves.push_back({.title = p.name + ": " + fit_text(fit),
                                     .x = profile.x_mm,
                                     .y = profile.value,
                                     .style = PlotCurve::Style::Points,
                                     .colour = i});
      if (!fit.found) continue;
      panels[bump].curves.push_back(gaussian_curve(fit, 0.4 * p.scene.block_mm[0]));
      panels[bump].curves.back().colour = i;
    }
  }
  for (PlotPanel& panel : panels) {
    panel.key = "top left reverse Left";
    panel.room_above = 0.3;
  }
  return {.title = title, .panels = {panels[0], panels[1]}, .across = 2, .width_px = 1280};
}

/// Fig. 19 or 21: the maps on one scale.
Plot maps_plot(const std::vector<lump::FigureRow>& rows, const std::string& title) {
  Plot plot{.title = title, .height_px = 400};
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (const auto& [p, paper] : rows) {
    if (!p.good) continue;
    const PlotMap map = plot_map(p.press.pressure_Pa);
    const auto [least, most] = std::minmax_element(map.values.begin(), map.values.end());
    low = std::min(low, *least);
    high = std::max(high, *most);
    plot.panels.push_back({.title = palpate::text("%s, E_r %.3g, %.3g N", p.name.c_str(),
                                                  p.scene.inclusion->stiffness_ratio, p.press.force_N),
                           .x_label = "x, mm",
                           .y_label = "y, mm",
                           .map = map});
  }
  for (PlotPanel& panel : plot.panels) panel.map->range = {std::max(0.0, low), high};
  plot.across = static_cast<uint32_t>(plot.panels.size());
  plot.width_px = static_cast<int>(430 * plot.across);
  return plot;
}

/// Fig. 17: one panel for each input.
Plot inputs_plot(const std::vector<lump::InputRow>& rows) {
  constexpr std::pair<const char*, const char*> kPanels[] = {{"d", "diameter d"},
                                                             {"h", "depth h"},
                                                             {"E_r", "stiffness ratio E_r"},
                                                             {"s", "shape s"},
                                                             {"t", "thickness of the tissue t"},
                                                             {"l", "load l (dashed: small-strain theory)"}};
  Plot plot{
      .title = "Pressure on the plate through the lump at 2 N, large strain: 8 mm, 5 mm deep, unless said",
      .across = 3,
      .width_px = 1280,
      .height_px = 760};
  for (const auto& [input, title] : kPanels) {
    PlotPanel panel{
        .title = title, .x_label = "x, mm", .y_label = "pressure, Pa", .x_range = std::pair{-20.0, 20.0}};
    size_t colour = 0;
    for (const lump::InputRow& row : rows) {
      if (row.input != input || !row.press.good) continue;
      const lump::Profile& profile = row.press.profile;
      panel.curves.push_back(
          {.title = row.press.name, .x = profile.x_mm, .y = profile.value, .colour = colour, .width = 1.8});
      if (row.small_strain)
        panel.curves.push_back({.x = row.small_strain->x_mm,
                                .y = row.small_strain->value,
                                .colour = colour,
                                .dashed = true,
                                .width = 1.2});
      ++colour;
    }
    plot.panels.push_back(std::move(panel));
  }
  return plot;
}

std::string fits_csv(const lump::Figures& figures) {
  std::string csv =
      "figure,inclusion,size_mm,stiffness_ratio,force_N,press_mm,a_Pa,a_sd_Pa,variance_mm2,variance_sd_mm2,"
      "offset_Pa,"
      "r_squared,bump_a_Pa,bump_a_sd_Pa,bump_variance_mm2,bump_variance_sd_mm2,paper_a_gray,paper_variance\n";
  const auto fit = [](const lump::GaussianFit& f, bool offset) {
    if (!f.found) return std::string(offset ? ",,,,,," : ",,,,");
    std::string text = plot_number(f.amplitude) + "," + plot_number(f.sd[0]) + "," +
                       plot_number(f.width_mm * f.width_mm) + "," + plot_number(2 * f.width_mm * f.sd[2]) +
                       ",";
    if (offset) text += plot_number(f.offset) + "," + plot_number(f.r_squared) + ",";
    return text;
  };
  for (const bool material : {false, true})
    for (const auto& [p, paper] : material ? figures.by_material : figures.by_size)
      csv +=
          std::string(material ? "22," : "20,") + p.name + "," + plot_number(p.scene.inclusion->size_mm[0]) +
          "," + plot_number(p.scene.inclusion->stiffness_ratio) + "," +
          (p.good ? plot_number(p.press.force_N) + "," + plot_number(p.press.press_mm) : std::string(",")) +
          "," + fit(p.fit, true) + fit(p.bump_fit, false) + plot_number(paper.amplitude_gray) + "," +
          plot_number(paper.variance) + "\n";
  return csv;
}

std::string profiles_csv(const lump::Figures& figures, const std::vector<lump::InputRow>& inputs) {
  std::string csv = "figure,name,x_mm,pressure_Pa,gaussian_Pa,bump_Pa,bump_gaussian_Pa,small_strain_Pa\n";
  const auto add = [&csv](const std::string& head, const lump::FigurePress& p, const lump::Profile* slight) {
    if (!p.good) return;
    for (size_t i = 0; i < p.profile.x_mm.size(); ++i) {
      const double x = p.profile.x_mm[i];
      csv += head + "," + plot_number(x) + "," + plot_number(p.profile.value[i]) + "," +
             (p.fit.found ? plot_number(p.fit.at(x)) : "") + "," +
             (i < p.bump.value.size() ? plot_number(p.bump.value[i]) : "") + "," +
             (p.bump_fit.found ? plot_number(p.bump_fit.at(x)) : "") + "," +
             (slight && i < slight->value.size() ? plot_number(slight->value[i]) : "") + "\n";
    }
  };
  for (const lump::FigureRow& row : figures.by_size) add("20," + row.press.name, row.press, nullptr);
  for (const lump::FigureRow& row : figures.by_material) add("22," + row.press.name, row.press, nullptr);
  for (const lump::InputRow& row : inputs)
    add("17," + row.input + " " + row.press.name, row.press, row.small_strain ? &*row.small_strain : nullptr);
  return csv;
}

struct Options {
  lump::FigureOptions figures;
  std::vector<uint32_t> cells;
  fem::LargeStrainOptions solver;
  bool inputs = true;
};

Report run(const Common& common, const Options& o) {
  lump::FigureOptions options = o.figures;
  if (!o.cells.empty()) std::copy_n(o.cells.begin(), 3, options.cells.begin());
  fem::LargeStrainOptions solver_options = o.solver;
  solver_options.stop = interrupted;
  const fem::PressSolver solver = [&](const fem::Scene& scene, const std::vector<fem::PressLoad>& loads) {
    fem::LargeStrainResult result = solve_large_strain(scene, loads, solver_options);
    if (interrupted())
      throw Error(Failure::Usage, "to press the phantoms", "an interruption", "the command again");
    return result;
  };
  lump::Figures figures;
  std::vector<lump::InputRow> inputs;
  {
    ProgressBar bar(common, "pressing phantoms", 6);
    figures = make_figures(options, solver, [&](uint64_t done, uint64_t) { bar.update(done); });
  }
  if (o.inputs) {
    ProgressBar bar(common, "changing inputs", 25);
    inputs = vary_inputs(options, solver, [&](uint64_t done, uint64_t) { bar.update(done); });
  }
  const std::vector<std::string> broken = broken_orderings(figures);
  std::string text =
      table("Fig. 20: 5 mm deep in 20 mm of tissue, by size", figures.by_size) +
      table("Fig. 22: 8 mm, 5 mm deep, by material", figures.by_material) +
      "the paper's 2323 is beyond its camera's 8 bits; 232.3 would fit its figure. Its moduli are not "
      "printed: Play-Doh " +
      palpate::text("%g kPa, rubber %g kPa here\n", options.play_doh_Pa / 1000, options.rubber_Pa / 1000);
  text += broken.empty() ? "orderings by size and by material: as in the paper\n" : "";
  for (const std::string& why : broken) text += "warning: " + why + "\n";
  Json value = {{"figure_20", Json::array()}, {"figure_22", Json::array()}, {"figure_17", Json::array()}};
  for (const bool material : {false, true})
    for (const auto& [p, paper] : material ? figures.by_material : figures.by_size) {
      Json entry = press_json(p);
      entry["paper"] = {{"amplitude_gray", paper.amplitude_gray}, {"variance", paper.variance}};
      value[material ? "figure_22" : "figure_20"].push_back(entry);
    }
  for (const lump::InputRow& row : inputs) {
    Json entry = press_json(row.press);
    entry["input"] = row.input;
    entry["value"] = row.value;
    value["figure_17"].push_back(entry);
    if (!row.press.good)
      text += palpate::text("warning: %s = %s ended at %.3g N\n", row.input.c_str(), row.press.name.c_str(),
                            row.press.last_force_N);
  }
  value["broken_orderings"] = broken;
  if (!common.out.empty()) {
    make_output_folder(common.out);
    write_whole(common.out / "fits.csv", std::string_view(fits_csv(figures)));
    write_whole(common.out / "profiles.csv", std::string_view(profiles_csv(figures, inputs)));
    write_whole(common.out / "figures.json", std::string_view(value.dump(2) + "\n"));
    std::string written = (common.out / "fits.csv").string() + ", profiles.csv, figures.json";
    const auto draw = [&](const char* name, const Plot& plot) {
      if (!plot.panels.empty()) draw_plot(plot, common.out / name, written);
    };
    draw("fig19_sizes",
         maps_plot(figures.by_size, "Fig. 19: inclusions of three sizes at 2 N; pressure on the plate, Pa"));
    draw("fig20_sizes", profiles_plot(figures.by_size, "Fig. 20: by size, 2 N"));
    draw("fig21_materials",
         maps_plot(figures.by_material, "Fig. 21: two materials at 2.35 N; pressure on the plate, Pa"));
    draw("fig22_materials", profiles_plot(figures.by_material, "Fig. 22: by material, 2.35 N"));
    if (!inputs.empty()) draw("fig17_inputs", inputs_plot(inputs));
    const lump::Network& network = lump::Network::built_in();
    draw("fig18_network", network_figure(lump_stages(network.model()), network.made_from()));
    text += "written: " + written + "\n";
  }
  const bool all = std::all_of(figures.by_size.begin(), figures.by_size.end(),
                               [](const lump::FigureRow& r) { return r.press.good; }) &&
                   std::all_of(figures.by_material.begin(), figures.by_material.end(),
                               [](const lump::FigureRow& r) { return r.press.good; });
  return {text, value, all ? 0 : kInternalError};
}

}  // namespace

void add_figures(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command = program.add_subcommand(
      "figures", "The paper's Figures 17 to 22 from the forward model and the built-in network");
  auto o = std::make_shared<Options>();
  command->add_setting("--young-Pa", o->figures.tissue_Pa, Check::positive(),
                       "Young's modulus of the tissue");
  command->add_setting("--play-doh-Pa", o->figures.play_doh_Pa, Check::positive(),
                       "Young's modulus of Play-Doh");
  command->add_setting("--rubber-Pa", o->figures.rubber_Pa, Check::positive(), "Young's modulus of rubber");
  command->add_option("--cells", o->cells, "Cells of the tissue along x, y, z (default 32 32 16)")
      ->expected(3);
  command->add_setting("--threads", o->solver.threads, Check::range(0, 256), "Threads; 0: one per core");
  command->add_flag("!--no-inputs", o->inputs, "Leave out Fig. 17, which takes most of the time");
  command->add_option("--out", common.out, "Folder for plots and tables");
  add_common(*command, common,
             "  palpate-lab figures --out out/figures\n"
             "  palpate-lab figures --no-inputs --json\n");
  command->runs(chosen, [o, &common] { return run(common, *o); });
}

}  // namespace palpate
