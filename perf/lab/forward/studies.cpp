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
constexpr InclusionShape kShapes[] = {InclusionShape::Sphere, InclusionShape::Ellipsoid,
                                      InclusionShape::Cylinder, InclusionShape::LyingCylinder};
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
      lump.size_mm = {d, d, kShapes[i] == InclusionShape::Ellipsoid ? d / 2 : d};
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

std::string value_name(const SweepRow& row) {
  return row.input[0] == 's' ? to_string(kShapes[static_cast<size_t>(row.value)]) : plot_number(row.value);
}

/// The solved rows of one input.
std::vector<const SweepRow*> solved(const std::vector<SweepRow>& rows, const Input& input) {
  std::vector<const SweepRow*> found;
  for (const SweepRow& row : rows)
    if (std::string(row.input) == input.name && row.outcome.result.converged) found.push_back(&row);
  return found;
}

/// Amplitude and width of the bump by each input.
Plot bumps_plot(const std::vector<SweepRow>& rows) {
  Plot plot{.across = 3, .width_px = 1280, .height_px = 720};
  for (const Input& input : kInputs) {
    PlotPanel panel{.x_label = input.label,
                    .y_label = "Gaussian a, Pa",
                    .second_label = "full width at half height, mm",
                    .key = "top center"};
    panel.log_x = std::string(input.name) == "E_r";
    PlotCurve height{.title = "a", .style = PlotCurve::Style::LinesAndPoints};
    PlotCurve width{.title = "width",
                    .style = PlotCurve::Style::LinesAndPoints,
                    .colour = 1,
                    .dashed = true,
                    .second_axis = true};
    for (const SweepRow* row : solved(rows, input)) {
      if (!panel.log_x) panel.x_tics.emplace_back(value_name(*row), row->value);
      const lump::GaussianFit& fit = row->outcome.fit;
      if (!fit.found) continue;
      height.x.push_back(row->value);
      height.y.push_back(fit.amplitude);
      width.y.push_back(full_width_mm(fit));
    }
    width.x = height.x;
    if (!width.y.empty()) {
      // A width that does not change is not drawn as its rounding.
      const auto [narrowest, widest] = std::minmax_element(width.y.begin(), width.y.end());
      if (*widest < 1.01 * *narrowest) panel.second_range = {0.8 * *widest, 1.2 * *widest};
    }
    if (input.name[0] == 's') panel.x_range = {-0.3, std::size(kShapes) - 0.7};
    panel.curves = {height, width};
    plot.panels.push_back(std::move(panel));
  }
  return plot;
}

/// The profile at each value of each input.
Plot profiles_plot(const std::vector<SweepRow>& rows) {
  Plot plot{.across = 3, .width_px = 1280, .height_px = 720};
  for (const Input& input : kInputs) {
    PlotPanel panel{.title = input.label, .x_label = "x, mm", .y_label = "stress, Pa"};
    for (const SweepRow* row : solved(rows, input))
      panel.curves.push_back({.title = value_name(*row),
                              .x = row->outcome.profile.x_mm,
                              .y = row->outcome.profile.value,
                              .colour = panel.curves.size(),
                              .width = 1.6});
    plot.panels.push_back(std::move(panel));
  }
  return plot;
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
    const std::string value = value_name(row);
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

  draw_plot(bumps_plot(rows), folder / "sweep", written);
  draw_plot(profiles_plot(rows), folder / "sweep_profiles", written);
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
      lump.shape = InclusionShape::Ellipsoid;
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

namespace {

/// Error against the finest grid by cells and by run time, and run time by unknowns.
Plot convergence_plot(const ConvergenceTables& t) {
  std::vector<double> cells, error_time, force, stress, all, times, law;
  const fem::Result& finest = t.grids.back().result;
  for (const ForwardOutcome& o : t.grids) {
    const fem::Result& r = o.result;
    if (!r.converged || !finest.converged) continue;
    all.push_back(unknowns(o.scene));
    times.push_back(r.wall_s);
    law.push_back(2e-7 * std::pow(all.back(), 1.1));
    if (&r == &finest) continue;
    cells.push_back(o.scene.cells[0]);
    error_time.push_back(r.wall_s);
    force.push_back(std::abs(relative_percent(r.force_N, finest.force_N)));
    stress.push_back(std::abs(relative_percent(r.center_stress_Pa, finest.center_stress_Pa)));
  }
  constexpr auto kBoth = PlotCurve::Style::LinesAndPoints;
  const auto errors = [&](const char* label, const std::vector<double>& x) {
    return PlotPanel{.x_label = label,
                     .y_label = "error against the finest grid, %",
                     .curves = {{.title = "force", .x = x, .y = force, .style = kBoth},
                                {.title = "centre stress", .x = x, .y = stress, .style = kBoth, .colour = 1}},
                     .log_x = true,
                     .log_y = true};
  };
  return {.panels = {errors("cells along x", cells),
                     errors("run time, s", error_time),
                     {.x_label = "unknowns",
                      .y_label = "run time, s",
                      .curves = {{.title = "solve", .x = all, .y = times, .style = kBoth, .colour = 2},
                                 {.title = "unknowns^1.1", .x = all, .y = law, .colour = 4, .dashed = true}},
                      .log_x = true,
                      .log_y = true,
                      .key = "top left"}},
          .across = 3,
          .width_px = 1280,
          .height_px = 420};
}

/// Iterations by Poisson's ratio, a curve for each stiffness ratio: the first fifteen of the ranges.
Plot iterations_plot(const ConvergenceTables& t) {
  PlotPanel panel{.x_label = "0.5 - Poisson ratio", .y_label = "iterations", .log_x = true, .log_y = true};
  constexpr const char* kRatios[] = {"E_r 0.1", "E_r 10", "E_r 10000"};
  for (size_t k = 0; k < std::size(kRatios); ++k) {
    PlotCurve curve{.title = kRatios[k], .style = PlotCurve::Style::LinesAndPoints, .colour = k};
    for (size_t i = k; i < 15 && i < t.ranges.size(); i += 3) {
      curve.x.push_back(0.5 - t.ranges[i].scene.poisson);
      curve.y.push_back(t.ranges[i].result.iterations);
    }
    panel.curves.push_back(std::move(curve));
  }
  return {.panels = {panel}, .width_px = 720, .height_px = 480};
}

}  // namespace

std::string write_convergence(const ConvergenceTables& t, const fs::path& folder) {
  make_output_folder(folder);
  std::string grids =
      "cells_x,cells_y,cells_z,unknowns,converged,force_N,center_stress_Pa,iterations,residual,wall_s,MB\n";
  for (const ForwardOutcome& o : t.grids) {
    const fem::Result& r = o.result;
    const auto& c = o.scene.cells;
    grids += std::to_string(c[0]) + "," + std::to_string(c[1]) + "," + std::to_string(c[2]) + "," +
             plot_number(unknowns(o.scene)) + "," + (r.converged ? "1," : "0,") + plot_number(r.force_N) +
             "," + plot_number(r.center_stress_Pa) + "," + std::to_string(r.iterations) + "," +
             plot_number(r.residual) + "," + plot_number(r.wall_s) + "," + plot_number(megabytes(r)) + "\n";
  }
  std::string ranges =
      "poisson,stiffness_ratio,depth_mm,shape,height_mm,converged,force_N,center_stress_Pa,iterations,"
      "residual\n";
  for (const ForwardOutcome& o : t.ranges) {
    const fem::Result& r = o.result;
    const fem::Inclusion& lump = *o.scene.inclusion;
    ranges += plot_number(o.scene.poisson) + "," + plot_number(lump.stiffness_ratio) + "," +
              plot_number(lump.depth_mm) + "," + to_string(lump.shape) + "," + plot_number(lump.size()[2]) +
              "," + (r.converged ? "1," : "0,") + plot_number(r.force_N) + "," +
              plot_number(r.center_stress_Pa) + "," + std::to_string(r.iterations) + "," +
              plot_number(r.residual) + "\n";
  }
  write_whole(folder / "convergence.csv", std::string_view(grids));
  write_whole(folder / "stability.csv", std::string_view(ranges));
  std::string written = (folder / "convergence.csv").string() + ", stability.csv";
  draw_plot(convergence_plot(t), folder / "convergence", written);
  draw_plot(iterations_plot(t), folder / "stability", written);
  return written;
}

}  // namespace palpate
