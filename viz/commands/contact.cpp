// palpate contact: contact of an indenter with the pad by each formula, and the error of each.
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <numbers>
#include <optional>

#include "capture/files/output_file.h"
#include "engine/base/json.h"
#include "engine/base/text.h"
#include "palpate/error.h"
#include "viz/commands/command.h"
#include "viz/commands/support/options.h"
#include "viz/report/contact_answers.h"
#include "viz/report/contact_figures.h"
#include "viz/report/plot.h"

namespace palpate {
namespace {

using Json = json::Value;
constexpr double kInfinite = std::numeric_limits<double>::infinity();

struct Options {
  std::string shape = "sphere", series = "thickness";
  double radius_mm = 0, radius2_mm = kInfinite, half_angle_deg = 0;
  std::optional<double> force_N, depth_mm;
  std::vector<double> young_kPa, thickness_mm;
  double poisson = 0.5, indenter_young_MPa = kInfinite, indenter_poisson = 0.3;
  bool bonded = false, sliding = false, example = false;
  int figure = 0;
};

ContactProblem problem_of(const Options& o) {
  ContactProblem p;
  if (o.young_kPa.empty())
    throw Error(Failure::Usage, "--young-kPa of the pad", "none", "--young-kPa 60, or of each layer");
  if (!o.force_N && !o.depth_mm)
    throw Error(Failure::Usage, "--force-N or --depth-mm", "neither", "--force-N 0.02");
  if (!o.thickness_mm.empty() && o.thickness_mm.size() != o.young_kPa.size())
    throw Error(Failure::Usage, "one --thickness-mm for each of --young-kPa",
                std::to_string(o.young_kPa.size()) + " moduli and " + std::to_string(o.thickness_mm.size()) +
                    " thicknesses",
                "lists of equal length");
  if (o.young_kPa.size() > 1 && o.thickness_mm.empty() && o.series == "thickness")
    throw Error(Failure::Usage, "--thickness-mm of each layer", "none",
                "--thickness-mm, or --series paper for 1 / sum(1/E)");
  p.by_force = o.force_N.has_value();
  p.wanted = p.by_force ? *o.force_N : *o.depth_mm;
  std::vector<double> young_MPa = o.young_kPa;
  for (double& e : young_MPa) e *= 1e-3;
  p.pad = layered_pad(young_MPa, o.poisson, o.thickness_mm, o.series == "paper",
                      o.sliding ? Base::Frictionless : Base::Bonded);
  if (!o.thickness_mm.empty()) p.layers_weighted_MPa = series_modulus_MPa(young_MPa, o.thickness_mm);
  if (young_MPa.size() > 1) p.layers_paper_MPa = paper_series_modulus_MPa(young_MPa);
  static const std::map<std::string, IndenterShape> kShapes = {
      {"sphere", IndenterShape::Sphere}, {"cone", IndenterShape::Cone}, {"flat", IndenterShape::FlatPunch}};
  p.indenter.shape = kShapes.at(o.shape);
  const bool cone = p.indenter.shape == IndenterShape::Cone;
  if (cone ? o.half_angle_deg == 0 : o.radius_mm == 0)
    throw Error(Failure::Usage, cone ? "--half-angle-deg of the cone" : "--radius-mm", "none",
                cone ? "--half-angle-deg 70" : "--radius-mm 5");
  if (!cone) p.indenter.radius_mm = effective_radius_mm(o.radius_mm, o.radius2_mm);
  p.indenter.half_angle_rad = o.half_angle_deg * std::numbers::pi / 180;
  p.indenter.material = {o.indenter_young_MPa, o.indenter_poisson};
  return p;
}

Json contact_json(const Indentation& c) {
  return {{"force_N", c.force_N},
          {"depth_mm", c.depth_mm},
          {"contact_radius_mm", c.radius_mm},
          {"pressure_max_MPa", c.pressure_max_MPa}};
}

/// Heading of the report: indenter, pad and load.
std::string heading(const ContactProblem& p, const Options& options, double modulus) {
  std::string text = options.shape == "cone"
                         ? palpate::text("cone of half angle %g deg", options.half_angle_deg)
                         : palpate::text("%s of radius %g mm", options.shape.c_str(), p.indenter.radius_mm);
  text += palpate::text(" on a pad of E = %.6g kPa, Poisson %g (E* = %.6g kPa)",
                        1e3 * p.pad.material.young_MPa, p.pad.material.poisson, 1e3 * modulus);
  if (std::isfinite(p.pad.thickness_mm))
    text += palpate::text(", %g mm thick, %s", p.pad.thickness_mm,
                          options.sliding ? "sliding on its base" : "bonded");
  text +=
      palpate::text("\n%s given: %g %s\n", p.by_force ? "force" : "depth", p.wanted, p.by_force ? "N" : "mm");
  if (p.layers_paper_MPa > 0)
    text += palpate::text("layers: 1 / sum(1/E) = %.6g kPa as the paper has it", 1e3 * p.layers_paper_MPa) +
            (p.layers_weighted_MPa > 0
                 ? palpate::text(", sum(t) / sum(t/E) = %.6g kPa", 1e3 * p.layers_weighted_MPa)
                 : std::string()) +
            "; taken: " + (options.series == "paper" ? "the paper's\n" : "the second\n");
  return text;
}

/// Adds the line of one formula; gives its values.
Json add_way(const ContactAnswer& a, bool has_reference, Facts& facts) {
  const Indentation& c = a.contact;
  const std::string pressure = std::isfinite(c.pressure_max_MPa)
                                   ? palpate::text("%.6g", 1e3 * c.pressure_max_MPa)
                               : std::isinf(c.pressure_max_MPa) ? "infinite"
                                                                : "-";
  const bool compared = has_reference && a.key != "exact";
  facts.say(palpate::text("%-32s %12.6g %12.6g %20.6g %23s   %s%s%s\n", a.name.c_str(), c.force_N, c.depth_mm,
                          c.radius_mm, pressure.c_str(),
                          compared ? palpate::text("%+.2f %%", 100 * a.off).c_str() : "-",
                          a.note.empty() ? "" : "; ", a.note.c_str()));
  Json way = contact_json(c);
  way["by"] = a.key;
  way["force_error"] = compared ? Json(a.off) : Json(nullptr);
  way["note"] = a.note.empty() ? Json(nullptr) : Json(a.note);
  return way;
}

/// Pressure from the axis to beyond the rim, exact and on a half space at the same force: table and plots.
/// Says which were written.
std::string write_profile(const Common& common, const ContactProblem& p, const Options& options,
                          const Indentation& reference) {
  make_output_folder(common.out);
  const PadIndenter exact(p.pad, p.indenter);
  Pad deep = p.pad;
  deep.thickness_mm = kInfinite;
  Indenter plain = p.indenter;
  if (plain.shape == IndenterShape::Sphere) plain.shape = IndenterShape::Paraboloid;
  const PadIndenter hertz(deep, plain);
  const Indentation other = hertz.at_force(reference.force_N);
  const double reach = 1.1 * std::max(reference.radius_mm, other.radius_mm);
  std::vector<std::vector<double>> profile(3);
  for (int i = 0; i <= 220; ++i) {
    const double r = reach * i / 220;
    profile[0].push_back(r);
    profile[1].push_back(exact.pressure_MPa(reference, r));
    profile[2].push_back(hertz.pressure_MPa(other, r));
  }
  PlotPanel panel{
      palpate::text("%s, %.3g N: %.3g kPa in the middle, within %.3g mm of the axis", options.shape.c_str(),
                    reference.force_N, 1e3 * profile[1][0], reference.radius_mm),
      "distance from the axis, mm", "pressure, kPa"};
  panel.key = "outside top center horizontal";
  panel.y_range = {{0, kPlotAuto}};
  panel.add("exact", profile[0], plot_scaled(profile[1], 1e3));
  const bool ball = p.indenter.shape == IndenterShape::Sphere;
  panel
      .add(ball ? "Hertz, same force" : "half space, same force", profile[0], plot_scaled(profile[2], 1e3), 1)
      .dashed = true;
  const std::string stem = (common.out / "contact").string();
  write_whole(stem + ".csv", std::string_view(csv_of("r_mm,pressure_MPa,half_space_pressure_MPa", profile)));
  std::string written = "written: " + stem + ".csv";
  draw_plot({.panels = {panel}, .width_px = 860}, stem, written);
  return written;
}

std::string lines_of(const std::vector<std::string>& warnings, const char* indent) {
  std::string lines;
  for (const std::string& warning : warnings) lines += indent + ("warning: " + warning + "\n");
  return lines;
}

Report solve(const Common& common, const Options& options) {
  const ContactProblem p = problem_of(options);
  const ContactAnswers found = contact_answers(p);
  const std::optional<Indentation>& reference = found.exact;
  const double modulus = PadIndenter(p.pad, p.indenter).effective_modulus_MPa();
  const bool thin = std::isfinite(p.pad.thickness_mm);
  Report report;
  report.add("shape", options.shape, heading(p, options, modulus));
  report.add("effective_modulus_MPa", modulus);
  report.add("young_MPa", p.pad.material.young_MPa);
  report.add("series_paper_MPa", p.layers_paper_MPa > 0 ? Json(p.layers_paper_MPa) : Json(nullptr));
  report.add("series_thickness_MPa", p.layers_weighted_MPa > 0 ? Json(p.layers_weighted_MPa) : Json(nullptr));
  report.add("poisson", p.pad.material.poisson);
  report.add("thickness_mm", p.pad.thickness_mm);
  report.add("base", thin ? Json(options.sliding ? "sliding" : "bonded") : Json(nullptr));
  report.add("exact", reference ? contact_json(*reference) : Json(nullptr));
  report.say(
      "\nby                                   force, N    depth, mm   contact radius, mm   largest pressure, "
      "kPa   force at the exact depth\n");
  Json ways = Json::array();
  for (const ContactAnswer& a : found.ways) ways.push_back(add_way(a, reference.has_value(), report));
  report.add("ways", ways,
             thin && p.pad.material.poisson < kIncompressiblePoisson
                 ? "(published corrections for thin pads are for Poisson 0.5 and left out)\n"
                 : "");
  report.add("warnings", found.warnings, lines_of(found.warnings, ""));
  if (!common.out.empty() && reference && reference->force_N > 0)
    report.say(write_profile(common, p, options, *reference));
  return report;
}

Report example() {
  const PaperExample e = paper_example();
  Report report;
  report.say("the paper's Eq. 45-52: a steel ball, 2 N, on PDMS layers of 140, 80 and 34 kPa, Poisson 0.4\n");
  report.add("series_paper_MPa", e.paper_modulus_MPa,
             palpate::text("E* by 1 / sum(1/E) (the paper): %.7f MPa; ", e.paper_modulus_MPa));
  report.add("series_thickness_MPa", e.weighted_modulus_MPa,
             palpate::text("by sum(t) / sum(t/E), equal thicknesses: %.7f MPa\n", e.weighted_modulus_MPa));
  report.add("paper_contact_radius_mm", 0.1029,
             "the paper took x/3 for the cube root of x: a = 0.1029 mm and p_max = 90.2256. It is, with its "
             "E* = 0.0243 MPa:\n\n");
  report.add("paper_pressure_max", 90.2256,
             "force, N   R, mm   contact radius, mm   largest pressure, MPa   depth, mm\n");
  Json cases = Json::array();
  for (const PaperExample::Case& c : e.cases) {
    report.say(palpate::text("%8g %7g %20.5f %23.7f %11.5f\n", c.force_N, c.radius_mm, c.contact_mm,
                             c.pressure_max_MPa, c.depth_mm));
    if (c.force_error > 0.04)
      report.say(palpate::text(
          "         warning: Hertz makes the force at this depth %.0f %% too high against the sphere's own\n",
          100 * c.force_error));
    report.say(lines_of(c.warnings, "         "));
    cases.push_back({{"force_N", c.force_N},
                     {"radius_mm", c.radius_mm},
                     {"effective_modulus_MPa", c.modulus_MPa},
                     {"contact_radius_mm", c.contact_mm},
                     {"pressure_max_MPa", c.pressure_max_MPa},
                     {"depth_mm", c.depth_mm},
                     {"force_error", c.force_error},
                     {"warnings", c.warnings}});
  }
  report.add("cases", cases,
             "a ball of 5 mm diameter has R = 2.5 mm (the paper takes 5); the last row is a force at which "
             "Hertz holds\n");
  return report;
}

Report figure(const Common& common, int number) {
  const Figure f = number == 7 ? figure7() : figure8();
  Json columns = Json::object();
  size_t start = 0;
  for (const auto& column : f.columns) {
    const size_t comma = std::min(f.header.find(',', start), f.header.size());
    columns[f.header.substr(start, comma - start)] = column;
    start = comma + 1;
  }
  const Json value = {{"figure", number}, {"notes", f.notes}, {"columns", columns}};
  std::string text =
      palpate::text("Figure %d: %zu points; ", number, f.columns.front().size()) + f.notes + "\n";
  if (common.out.empty()) {
    text += "--out FOLDER writes it\n";
    return {text, value};
  }
  make_output_folder(common.out);
  const std::string stem = (common.out / ("fig" + std::to_string(number))).string();
  write_whole(stem + ".csv", std::string_view(csv_of(f.header, f.columns)));
  std::string written = "written: " + stem + ".csv";
  draw_plot(number == 7 ? figure7_plot(f) : figure8_plot(f), stem, written);
  return {text + written, value};
}

}  // namespace

void add_contact(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command = program.add_subcommand(
      "contact",
      "Force, depth and pressure of a ball, cone or punch on the pad, by each formula with its error");
  auto options = std::make_shared<Options>();
  command->add_setting("--shape", options->shape, Check::one_of({"sphere", "cone", "flat"}),
                       "sphere, cone or flat (a cylinder's end)");
  command->add_option("--radius-mm", options->radius_mm, "Radius of sphere or punch, mm");
  command->add_option("--radius2-mm", options->radius2_mm, "Radius of a domed pad, mm (default: flat)");
  command->add_option("--half-angle-deg", options->half_angle_deg, "A cone's angle from axis to side, deg");
  CommandOption* force =
      command->add_option("--force-N", options->force_N, "Normal force, N; the depth is computed");
  command->add_option("--depth-mm", options->depth_mm, "Depth, mm; the force is computed")->excludes(force);
  command->add_option("--young-kPa", options->young_kPa, "Young's modulus of the pad, kPa, or of each layer")
      ->delimiter(',');
  command
      ->add_option("--thickness-mm", options->thickness_mm,
                   "Thickness of the pad, mm, or of each layer (default: a half space)")
      ->delimiter(',');
  command->add_option("--poisson", options->poisson, "Poisson's ratio of the pad, 0 to 0.5")
      ->capture_default_str();
  command->add_setting("--series", options->series, Check::one_of({"thickness", "paper"}),
                       "Several layers as one: thickness, sum(t)/sum(t/E), or paper, 1/sum(1/E)");
  command->add_option("--indenter-young-MPa", options->indenter_young_MPa,
                      "Young's modulus of the indenter, MPa (default: rigid)");
  command->add_option("--indenter-poisson", options->indenter_poisson, "Its Poisson's ratio")
      ->capture_default_str();
  CommandOption* bonded =
      command->add_flag("--bonded", options->bonded, "The pad is glued to its base (default)");
  command->add_flag("--sliding", options->sliding, "The pad slides on its base")->excludes(bonded);
  command->add_flag("--example", options->example, "The paper's worked example, with its arithmetic mended");
  command->add_option("--figure", options->figure, "7 or 8: the paper's figure as data and plot")
      ->check(Check::one_of({7, 8}));
  command->add_option("--out", common.out,
                      "Folder for contact.csv, .png, .svg, .pdf (the pressure), or the figure");
  add_common(*command, common,
             "  palpate contact --shape sphere --radius-mm 5 --force-N 0.02 --young-kPa 60 --thickness-mm 6\n"
             "  palpate contact --shape cone --half-angle-deg 70 --depth-mm 0.5 --young-kPa 60 --json\n"
             "  palpate contact --radius-mm 5 --force-N 0.02 --young-kPa 140,80,34 --thickness-mm 2,2,2 \\\n"
             "      --out out/c\n"
             "  palpate contact --example\n"
             "  palpate contact --figure 8 --out out/figures\n");
  command->callback([&common, &chosen, options] {
    chosen = [&common, options] {
      if (options->example) return example();
      return options->figure ? figure(common, options->figure) : solve(common, *options);
    };
  });
}

}  // namespace palpate
