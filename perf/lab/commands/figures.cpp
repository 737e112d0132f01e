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
#include "viz/report/gnuplot.h"
#include "viz/report/plot_script.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;
using Json = json::Value;

std::string points(const lump::Profile& profile) {
  std::string lines;
  for (size_t i = 0; i < profile.x_mm.size(); ++i)
    lines += plot_number(profile.x_mm[i]) + " " + plot_number(profile.value[i]) + "\n";
  return lines;
}

std::string curve(const lump::GaussianFit& fit, double half_mm) {
  std::string lines;
  for (int i = -80; fit.found && i <= 80; ++i)
    lines += plot_number(half_mm * i / 80) + " " + plot_number(fit.at(half_mm * i / 80)) + "\n";
  return lines;
}

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
void draw_profiles(const std::vector<lump::FigureRow>& rows, const std::string& title, const fs::path& file,
                   std::string& written) {
  std::string blocks, plots[2];
  for (size_t i = 0; i < rows.size(); ++i) {
    const lump::FigurePress& p = rows[i].press;
    if (!p.good) continue;
    const double half_mm = 0.4 * p.scene.block_mm[0];
    for (const bool bump : {false, true}) {
      const std::string name = (bump ? "b" : "p") + std::to_string(i), fit = name + "f";
      blocks += data_block(name, points(bump ? p.bump : p.profile)) +
                data_block(fit, curve(bump ? p.bump_fit : p.fit, half_mm));
      const std::string colour = plot_colour(i);
      plots[bump] += (plots[bump].empty() ? "plot $" : ", $") + name + " with points pt 7 ps 0.5 lc rgb '" +
                     colour + "' title " +
                     gnuplot_quoted(p.name + ": " + fit_text(bump ? p.bump_fit : p.fit)) + ", $" + fit +
                     " with lines lw 2 lc rgb '" + colour + "' notitle";
    }
  }
  if (plots[0].empty()) return;
  draw_scripts(
      blocks + plot_look() + "set multiplot layout 1,2 title " + gnuplot_quoted(title) +
          "\nset xlabel 'x, mm'\nset key top left reverse Left samplen 1 font ',9'\nset ylabel "
          "'pressure on the "
          "plate, Pa'\nset offsets graph 0, 0, graph 0.3, 0\nset title 'profile (points) and Gaussian "
          "(lines)'\n" +
          plots[0] +
          "\nset ylabel 'pressure above the block without inclusion, Pa'\nset title 'bump alone'\n" +
          plots[1] + "\nunset multiplot\n",
      1280, 520, file, written);
}

/// Fig. 19 or 21: the maps on one scale.
void draw_maps(const std::vector<lump::FigureRow>& rows, const std::string& title, const fs::path& file,
               std::string& written) {
  std::string blocks, plots;
  double low = HUGE_VAL, high = -HUGE_VAL;
  size_t count = 0;
  for (const auto& [p, paper] : rows) {
    if (!p.good) continue;
    const fem::Map& map = p.press.pressure_Pa;
    std::string lines;
    for (uint32_t j = 0; j < map.height; ++j, lines += "\n")
      for (uint32_t i = 0; i < map.width; ++i) {
        const double value = static_cast<double>(map.at(i, j));
        low = std::min(low, value);
        high = std::max(high, value);
        lines += plot_number((i - (map.width - 1) / 2.0) * map.pitch_mm[0]) + " " +
                 plot_number((j - (map.height - 1) / 2.0) * map.pitch_mm[1]) + " " + plot_number(value) +
                 "\n";
      }
    const std::string name = "m" + std::to_string(count++);
    blocks += data_block(name, lines);
    plots += "set title " +
             gnuplot_quoted(palpate::text("%s, E_r %.3g, %.3g N", p.name.c_str(),
                                          p.scene.inclusion->stiffness_ratio, p.press.force_N)) +
             "\nplot $" + name + " using 1:2:3 with image\n";
  }
  if (count == 0) return;
  draw_scripts(blocks + plot_palette() +
                   "unset key\nset size ratio -1\nset rmargin 4\nset xlabel 'x, mm'\nset ylabel 'y, mm'\nset "
                   "tics out\n"
                   "set autoscale fix\nset cbrange [" +
                   plot_number(std::max(0.0, low)) + ":" + plot_number(high) + "]\nset multiplot layout 1," +
                   std::to_string(count) + " title " + gnuplot_quoted(title) + "\n" + plots +
                   "unset multiplot\n",
               static_cast<int>(430 * count), 400, file, written);
}

/// Fig. 17: one panel for each input.
void draw_inputs(const std::vector<lump::InputRow>& rows, const fs::path& folder, std::string& written) {
  struct Panel {
    const char *input, *title;
  };
  constexpr Panel kPanels[] = {{"d", "diameter d"},
                               {"h", "depth h"},
                               {"E_r", "stiffness ratio E_r"},
                               {"s", "shape s"},
                               {"t", "thickness of the tissue t"},
                               {"l", "load l (dashed: small-strain theory)"}};
  std::string blocks, plots;
  size_t number = 0;
  for (const Panel& panel : kPanels) {
    std::string lines;
    size_t colour = 0;
    for (const lump::InputRow& row : rows) {
      if (row.input != panel.input || !row.press.good) continue;
      const std::string name = "c" + std::to_string(number++);
      blocks += data_block(name, points(row.press.profile));
      lines += (lines.empty() ? "plot $" : ", $") + name + " with lines lw 1.8 lc rgb '" +
               plot_colour(colour) + "' title " + gnuplot_quoted(row.press.name);
      if (row.small_strain) {
        blocks += data_block(name + "s", points(*row.small_strain));
        lines += ", $" + name + "s with lines lw 1.2 dt 2 lc rgb '" + plot_colour(colour) + "' notitle";
      }
      ++colour;
    }
    plots += std::string("set title '") + panel.title + "'\n" + (lines.empty() ? "plot NaN notitle" : lines) +
             "\n";
  }
  draw_scripts(blocks + plot_look() +
                   "set multiplot layout 2,3 title 'Pressure on the plate through the lump at 2 N, large "
                   "strain: 8 mm, "
                   "5 mm deep, unless said'\nset xlabel 'x, mm'\nset ylabel 'pressure, Pa'\nset xrange "
                   "[-20:20]\nset key top "
                   "right samplen 1 font ',9'\n" +
                   plots + "unset multiplot\n",
               1280, 760, folder / "fig17_inputs", written);
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
    draw_maps(figures.by_size, "Fig. 19: inclusions of three sizes at 2 N; pressure on the plate, Pa",
              common.out / "fig19_sizes", written);
    draw_profiles(figures.by_size, "Fig. 20: by size, 2 N", common.out / "fig20_sizes", written);
    draw_maps(figures.by_material, "Fig. 21: two materials at 2.35 N; pressure on the plate, Pa",
              common.out / "fig21_materials", written);
    draw_profiles(figures.by_material, "Fig. 22: by material, 2.35 N", common.out / "fig22_materials",
                  written);
    if (!inputs.empty()) draw_inputs(inputs, common.out, written);
    const lump::Network& network = lump::Network::built_in();
    draw_scripts(network_figure(lump_stages(network.model()), network.made_from()), 1280, 760,
                 common.out / "fig18_network", written);
    text += "written: " + written + "\n";
  }
  const bool all = std::all_of(figures.by_size.begin(), figures.by_size.end(),
                               [](const lump::FigureRow& r) { return r.press.good; }) &&
                   std::all_of(figures.by_material.begin(), figures.by_material.end(),
                               [](const lump::FigureRow& r) { return r.press.good; });
  return {text, value.dump(2), all ? 0 : kInternalError};
}

}  // namespace

void add_figures(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command = program.add_subcommand(
      "figures", "The paper's Figures 17 to 22 from the forward model and the built-in network");
  auto o = std::make_shared<Options>();
  command->add_option("--young-Pa", o->figures.tissue_Pa, "Young's modulus of the tissue")
      ->capture_default_str()
      ->check(Check::positive());
  command->add_option("--play-doh-Pa", o->figures.play_doh_Pa, "Young's modulus of Play-Doh")
      ->capture_default_str()
      ->check(Check::positive());
  command->add_option("--rubber-Pa", o->figures.rubber_Pa, "Young's modulus of rubber")
      ->capture_default_str()
      ->check(Check::positive());
  command->add_option("--cells", o->cells, "Cells of the tissue along x, y, z (default 32 32 16)")
      ->expected(3);
  command->add_option("--threads", o->solver.threads, "Threads; 0: one per core")
      ->capture_default_str()
      ->check(Check::range(0, 256));
  command->add_flag("!--no-inputs", o->inputs, "Leave out Fig. 17, which takes most of the time");
  command->add_option("--out", common.out, "Folder for plots and tables");
  add_common(*command, common,
             "  palpate-lab figures --out out/figures\n"
             "  palpate-lab figures --no-inputs --json\n");
  command->callback([o, &common, &chosen] { chosen = [o, &common] { return run(common, *o); }; });
}

}  // namespace palpate
