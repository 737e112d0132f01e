// Series of forward scenes: sweeps of each input by itself, and the errors of the grid over the model's
// range.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "capture/files/output_file.h"
#include "engine/base/json.h"
#include "engine/base/text.h"
#include "engine/fem/solve.h"
#include "palpate/error.h"
#include "perf/lab/forward/forward.h"
#include "viz/report/plot_script.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;
using Json = json::Value;

struct Input {
  const char* name;
  const char* label;
};
constexpr Input kInputs[] = {{"d", "diameter d, mm"},        {"h", "depth h, mm"},
                             {"E_r", "stiffness ratio E_r"}, {"s", "shape s"},
                             {"t", "thickness t, mm"},       {"l", "press l, mm"}};
constexpr fem::InclusionShape kShapes[] = {fem::InclusionShape::Sphere, fem::InclusionShape::Ellipsoid,
                                           fem::InclusionShape::Cylinder, fem::InclusionShape::LyingCylinder};
constexpr const char* kColours[] = {"#440154", "#46327e", "#365c8d", "#277f8e",
                                    "#1fa187", "#4ac16d", "#a0da39"};

/// Full width at half the height of a Gaussian.
double full_width_mm(const lump::GaussianFit& fit) {
  return 2 * std::sqrt(2 * std::log(2.0)) * fit.width_mm;
}

struct Case {
  const char* input;
  double value;
  fem::Scene scene;
};

std::vector<Case> sweep_cases(const fem::Scene& base) {
  std::vector<Case> cases;
  const auto add = [&](const char* input, double value, auto change) {
    fem::Scene scene = base;
    change(scene, *scene.inclusion);
    try {
      check(scene);
    } catch (const Error&) {
      return;  // does not fit the block
    }
    cases.push_back({input, value, scene});
  };
  const double d = base.inclusion->size()[2], room = base.block_mm[2];
  for (const double f : {0.5, 0.75, 1.0, 1.25, 1.5, 1.75})
    add("d", f * d, [&](fem::Scene&, fem::Inclusion& lump) {
      for (double& side : lump.size_mm) side *= f;
    });
  for (const double f : {0.0, 0.05, 0.1, 0.175, 0.25, 0.375, 0.5})
    add("h", f * room, [&](fem::Scene&, fem::Inclusion& lump) { lump.depth_mm = f * room; });
  for (const double ratio : {0.1, 0.5, 2.0, 10.0, 100.0, 1000.0, 10000.0})
    add("E_r", ratio, [&](fem::Scene&, fem::Inclusion& lump) { lump.stiffness_ratio = ratio; });
  for (size_t i = 0; i < std::size(kShapes); ++i)
    add("s", static_cast<double>(i), [&](fem::Scene&, fem::Inclusion& lump) {
      lump.shape = kShapes[i];
      // The ellipsoid is half as high as wide, the others have the sphere's outer sizes.
      lump.size_mm = {d, d, kShapes[i] == fem::InclusionShape::Ellipsoid ? d / 2 : d};
    });
  for (const double f : {0.7, 0.85, 1.0, 1.25, 1.5, 2.0})
    add("t", f * room, [&](fem::Scene& scene, fem::Inclusion&) { scene.block_mm[2] = f * room; });
  for (const double f : {0.25, 0.5, 1.0, 1.5, 2.0})
    if (base.press_mm)
      add("l", f * *base.press_mm, [&](fem::Scene& scene, fem::Inclusion&) { *scene.press_mm *= f; });
    else
      add("l", f * *base.force_N, [&](fem::Scene& scene, fem::Inclusion&) { *scene.force_N *= f; });
  return cases;
}

std::string row_values(const ForwardOutcome& o) {
  const fem::Result& r = o.result;
  if (!r.converged) return "0,,,,,,,,";
  const lump::GaussianFit& f = o.fit;
  std::string row = "1," + plot_number(r.force_N) + "," + plot_number(r.press_mm) + "," +
                    plot_number(r.center_stress_Pa) + ",";
  if (!f.found) return row + ",,,,";
  return row + plot_number(f.amplitude) + "," + plot_number(f.sd[0]) + "," + plot_number(f.width_mm) + "," +
         plot_number(f.sd[2]) + "," + plot_number(f.offset);
}

}  // namespace

std::vector<SweepRow> sweep(const fem::Scene& scene, const fem::Options& options,
                            const std::function<void(uint64_t, uint64_t)>& progress) {
  if (!scene.inclusion)
    throw Error(Failure::Usage, "an inclusion to vary", "none", "the sweep without --no-inclusion");
  check(scene);
  const std::vector<Case> cases = sweep_cases(scene);
  std::vector<fem::Scene> scenes;
  scenes.reserve(cases.size());
  for (const Case& c : cases) scenes.push_back(c.scene);
  std::vector<fem::Result> results =
      fem::solve(scenes, options, [&](size_t done) { progress(done, scenes.size()); });
  std::vector<SweepRow> rows;
  for (size_t i = 0; i < cases.size(); ++i)
    rows.push_back({cases[i].input, cases[i].value, describe(cases[i].scene, std::move(results[i]))});
  return rows;
}

std::string sweep_text(const std::vector<SweepRow>& rows) {
  std::string text = "input      value   force N   centre Pa   Gaussian a Pa        s mm\n";
  for (const SweepRow& row : rows) {
    const fem::Result& r = row.outcome.result;
    const lump::GaussianFit& f = row.outcome.fit;
    std::string line;
    const std::string value =
        row.input[0] == 's' ? to_string(kShapes[static_cast<size_t>(row.value)]) : plot_number(row.value);
    if (!r.converged)
      line = palpate::text("%-5s %10s  not converged, residual %.2g\n", row.input, value.c_str(), r.residual);
    else if (f.found)
      line = palpate::text("%-5s %10s %9.5g %11.5g %8.4g +- %-6.2g %6.4g +- %.2g\n", row.input, value.c_str(),
                           r.force_N, r.center_stress_Pa, f.amplitude, f.sd[0], f.width_mm, f.sd[2]);
    else
      line = palpate::text("%-5s %10s %9.5g %11.5g  no bump\n", row.input, value.c_str(), r.force_N,
                           r.center_stress_Pa);
    text += line;
  }
  return text;
}

Json sweep_json(const std::vector<SweepRow>& rows) {
  Json value = Json::array();
  for (const SweepRow& row : rows) {
    Json entry = to_json(row.outcome);
    entry["input"] = row.input;
    entry["value"] = row.value;
    value.push_back(entry);
  }
  return value;
}

std::string write_sweep(const std::vector<SweepRow>& rows, const fs::path& folder) {
  make_output_folder(folder);
  std::string csv =
      "input,value,converged,force_N,press_mm,center_stress_Pa,gaussian_a_Pa,gaussian_a_sd_Pa,gaussian_s_mm,"
      "gaussian_s_sd_mm,offset_Pa\n";
  for (const SweepRow& row : rows)
    csv += std::string(row.input) + "," + plot_number(row.value) + "," + row_values(row.outcome) + "\n";
  write_whole(folder / "sweep.csv", std::string_view(csv));
  std::string written = (folder / "sweep.csv").string();

  std::string blocks, plots, profiles = plot_look();
  std::string bumps =
      std::string(plot_look()) + "set multiplot layout 2,3\nset ytics nomirror\nset key top center\n";
  profiles +=
      "set multiplot layout 2,3\nset xlabel 'x, mm'\nset ylabel 'stress, Pa'\nset key top right samplen 1\n";
  std::string profile_blocks;
  int panel = 0;
  for (const Input& input : kInputs) {
    std::string points, curves, tics;
    int curve = 0;
    double narrowest = HUGE_VAL, widest = 0;
    for (const SweepRow& row : rows) {
      if (std::string(row.input) != input.name || !row.outcome.result.converged) continue;
      const lump::GaussianFit& f = row.outcome.fit;
      tics += (tics.empty() ? "" : ", ") + plot_number(row.value);
      if (f.found) {
        narrowest = std::min(narrowest, full_width_mm(f));
        widest = std::max(widest, full_width_mm(f));
      }
      if (f.found)
        points += plot_number(row.value) + " " + plot_number(f.amplitude) + " " +
                  plot_number(full_width_mm(f)) + "\n";
      std::string lines;
      for (size_t i = 0; i < row.outcome.profile.x_mm.size(); ++i)
        lines +=
            plot_number(row.outcome.profile.x_mm[i]) + " " + plot_number(row.outcome.profile.value[i]) + "\n";
      const std::string name = "p" + std::to_string(panel) + "_" + std::to_string(curve);
      profile_blocks += data_block(name, lines);
      const std::string title =
          input.name[0] == 's' ? to_string(kShapes[static_cast<size_t>(row.value)]) : plot_number(row.value);
      curves += curve == 0 ? "plot $" : ", $";
      curves += name + " with lines lw 1.6 lc rgb '" + kColours[curve % 7];
      curves += "' title '" + title + "'";
      ++curve;
    }
    blocks += data_block("b" + std::to_string(panel), points);
    const bool log = std::string(input.name) == "E_r", shapes = input.name[0] == 's';
    bumps +=
        std::string(log ? "set logscale x\n" : "unset logscale x\n") +
        (shapes ? "set xtics ('sphere' 0, 'ellipsoid' 1, 'cylinder' 2, 'lying' 3)\nset xrange [-0.3:3.3]\n"
         : log  ? "set xtics auto\nset autoscale x\n"
                : "set xtics (" + tics + ")\nset autoscale x\n") +
        // A width that does not change is not drawn as its rounding.
        (widest < 1.01 * narrowest
             ? "set y2range [" + plot_number(0.8 * widest) + ":" + plot_number(1.2 * widest) + "]\n"
             : "set autoscale y2\n") +
        "set xlabel '" + input.label + "'\nset ylabel 'Gaussian a, Pa' textcolor rgb '#0072b2'\n" +
        "set y2tics\nset y2label 'full width at half height, mm' textcolor rgb '#d55e00'\nplot $b" +
        std::to_string(panel) + " using 1:2 with linespoints pt 7 ps 0.6 lc rgb '#0072b2' title 'a', $b" +
        std::to_string(panel) +
        " using 1:3 axes x1y2 with linespoints pt 6 ps 0.6 dt 2 lc rgb '#d55e00' title 'width'\n";
    profiles += std::string("set title '") + input.label + "'\n" +
                (curves.empty() ? "plot NaN notitle" : curves) + "\n";
    ++panel;
  }
  draw_scripts(blocks + bumps + "unset multiplot\n", 1280, 720, folder / "sweep", written);
  draw_scripts(profile_blocks + profiles + "unset multiplot\n", 1280, 720, folder / "sweep_profiles",
               written);
  return written;
}

ConvergenceTables converge(const fem::Scene& scene, const fem::Options& options) {
  check(scene);
  ConvergenceTables tables;
  for (const double f : {0.25, 0.375, 0.5, 0.75, 1.0, 1.5, 2.0}) {
    fem::Scene on = scene;
    bool whole = true;
    for (uint32_t& side : on.cells) {
      const double cells = f * side;
      whole = whole && cells == std::floor(cells) && cells >= 8 && cells <= 256;
      side = static_cast<uint32_t>(cells);
    }
    if (whole) tables.grids.push_back(describe(on, fem::solve(on, options)));
  }
  std::vector<fem::Scene> ranges;
  const auto add = [&](auto change) {
    fem::Scene in = scene;
    for (uint32_t& side : in.cells) side = std::max(8u, side / 2);
    if (!in.inclusion) in.inclusion = fem::Inclusion{};
    change(in, *in.inclusion);
    ranges.push_back(in);
  };
  for (const double nu : {0.3, 0.45, 0.495, 0.499, 0.4999})
    for (const double ratio : {0.1, 10.0, 1e4})
      add([&](fem::Scene& s, fem::Inclusion& lump) {
        s.poisson = nu;
        lump.stiffness_ratio = ratio;
      });
  add([](fem::Scene&, fem::Inclusion& lump) { lump.depth_mm = 0; });  // touches the surface
  for (const double aspect : {0.25, 0.5, 2.0})
    add([&](fem::Scene& s, fem::Inclusion& lump) {
      const double d = lump.size()[0];
      lump.shape = fem::InclusionShape::Ellipsoid;
      lump.size_mm = {d, d, std::min(aspect * d, 0.9 * (s.block_mm[2] - lump.depth_mm))};
    });
  for (fem::Result& result : fem::solve(ranges, options)) {
    const fem::Scene& in = ranges[tables.ranges.size()];
    tables.ranges.push_back(describe(in, std::move(result)));
  }
  return tables;
}

namespace {

double relative_percent(double value, double truth) {
  return 100 * (value / truth - 1);
}
double unknowns(const fem::Scene& s) {
  return 3.0 * (s.cells[0] + 1) * (s.cells[1] + 1) * (s.cells[2] + 1);
}

}  // namespace

std::string convergence_text(const ConvergenceTables& t) {
  std::string text =
      "cells           unknowns   force N     centre Pa  against finest   iterations   wall s     MB\n";
  std::string line;
  for (const ForwardOutcome& o : t.grids) {
    const fem::Result &r = o.result, &finest = t.grids.back().result;
    if (!r.converged || !finest.converged)
      line = palpate::text("%3u x %3u x %3u  not converged, residual %.2g\n", o.scene.cells[0],
                           o.scene.cells[1], o.scene.cells[2], r.residual);
    else
      line = palpate::text("%3u x %3u x %3u %9.0f %9.6g %10.5g  %+6.2f %+6.2f %% %9u %12.3f %6.1f\n",
                           o.scene.cells[0], o.scene.cells[1], o.scene.cells[2], unknowns(o.scene), r.force_N,
                           r.center_stress_Pa, relative_percent(r.force_N, finest.force_N),
                           relative_percent(r.center_stress_Pa, finest.center_stress_Pa), r.iterations,
                           r.wall_s, megabytes(r));
    text += line;
  }
  text += "\nnu       E_r      depth  shape      height  force N   centre Pa   iterations   residual\n";
  for (const ForwardOutcome& o : t.ranges) {
    const fem::Result& r = o.result;
    const fem::Inclusion& lump = *o.scene.inclusion;
    line =
        palpate::text("%-7g %7g %7g  %-10s %6g %9.5g %11.5g %9u %14.2g%s\n", o.scene.poisson,
                      lump.stiffness_ratio, lump.depth_mm, to_string(lump.shape), lump.size()[2], r.force_N,
                      r.center_stress_Pa, r.iterations, r.residual, r.converged ? "" : "  NOT CONVERGED");
    text += line;
  }
  return text;
}

Json convergence_json(const ConvergenceTables& t) {
  Json value = {{"grids", Json::array()}, {"ranges", Json::array()}};
  for (const ForwardOutcome& o : t.grids) value["grids"].push_back(to_json(o));
  for (const ForwardOutcome& o : t.ranges) value["ranges"].push_back(to_json(o));
  return value;
}

std::string write_convergence(const ConvergenceTables& t, const fs::path& folder) {
  make_output_folder(folder);
  std::string grids =
      "cells_x,cells_y,cells_z,unknowns,converged,force_N,center_stress_Pa,iterations,residual,wall_s,MB\n";
  std::string error, time;
  for (const ForwardOutcome& o : t.grids) {
    const fem::Result& r = o.result;
    const auto& c = o.scene.cells;
    grids += std::to_string(c[0]) + "," + std::to_string(c[1]) + "," + std::to_string(c[2]) + "," +
             plot_number(unknowns(o.scene)) + "," + (r.converged ? "1," : "0,") + plot_number(r.force_N) +
             "," + plot_number(r.center_stress_Pa) + "," + std::to_string(r.iterations) + "," +
             plot_number(r.residual) + "," + plot_number(r.wall_s) + "," + plot_number(megabytes(r)) + "\n";
    const fem::Result& finest = t.grids.back().result;
    if (!r.converged || !finest.converged) continue;
    if (&r != &finest)
      error += std::to_string(c[0]) + " " + plot_number(r.wall_s) + " " +
               plot_number(std::abs(relative_percent(r.force_N, finest.force_N))) + " " +
               plot_number(std::abs(relative_percent(r.center_stress_Pa, finest.center_stress_Pa))) + "\n";
    time += plot_number(unknowns(o.scene)) + " " + plot_number(r.wall_s) + "\n";
  }
  std::string ranges =
      "poisson,stiffness_ratio,depth_mm,shape,height_mm,converged,force_N,center_stress_Pa,iterations,"
      "residual\n";
  std::string by_ratio[3];
  for (const ForwardOutcome& o : t.ranges) {
    const fem::Result& r = o.result;
    const fem::Inclusion& lump = *o.scene.inclusion;
    ranges += plot_number(o.scene.poisson) + "," + plot_number(lump.stiffness_ratio) + "," +
              plot_number(lump.depth_mm) + "," + to_string(lump.shape) + "," + plot_number(lump.size()[2]) +
              "," + (r.converged ? "1," : "0,") + plot_number(r.force_N) + "," +
              plot_number(r.center_stress_Pa) + "," + std::to_string(r.iterations) + "," +
              plot_number(r.residual) + "\n";
  }
  for (size_t i = 0; i < 15 && i < t.ranges.size(); ++i)
    by_ratio[i % 3] += plot_number(0.5 - t.ranges[i].scene.poisson) + " " +
                       std::to_string(t.ranges[i].result.iterations) + "\n";
  write_whole(folder / "convergence.csv", std::string_view(grids));
  write_whole(folder / "stability.csv", std::string_view(ranges));
  std::string written = (folder / "convergence.csv").string() + ", stability.csv";
  const auto lines = [](const char* what, const char* colour, const char* title) {
    return std::string("$error using ") + what + " with linespoints pt 7 ps 0.7 lc rgb '" + colour +
           "' title '" + title + "'";
  };
  draw_scripts(
      data_block("error", error) + data_block("time", time) + plot_look() +
          "set logscale xy\nset multiplot layout 1,3\nset ylabel 'error against the finest grid, %'\n"
          "set xlabel 'cells along x'\nplot " +
          lines("1:3", "#0072b2", "force") + ", " + lines("1:4", "#d55e00", "centre stress") +
          "\nset xlabel 'run time, s'\nplot " + lines("2:3", "#0072b2", "force") + ", " +
          lines("2:4", "#d55e00", "centre stress") +
          "\nset xlabel 'unknowns'\nset ylabel 'run time, s'\nset key top left\n"
          "plot $time with linespoints pt 7 ps 0.7 lc rgb '#009e73' title 'solve', $time using "
          "1:($1**1.1*2e-7) "
          "with lines dt 2 lc rgb '#888888' title 'unknowns^1.1'\nunset multiplot\n",
      1280, 420, folder / "convergence", written);
  draw_scripts(
      data_block("soft", by_ratio[0]) + data_block("stiff", by_ratio[1]) + data_block("rigid", by_ratio[2]) +
          plot_look() +
          "set logscale xy\nset xlabel '0.5 - Poisson ratio'\nset ylabel 'iterations'\nset key top right\n"
          "plot $soft with linespoints pt 7 lc rgb '#009e73' title 'E_r 0.1', "
          "$stiff with linespoints pt 7 lc rgb '#0072b2' title 'E_r 10', "
          "$rigid with linespoints pt 7 lc rgb '#d55e00' title 'E_r 10000'\n",
      720, 480, folder / "stability", written);
  return written;
}

}  // namespace palpate
