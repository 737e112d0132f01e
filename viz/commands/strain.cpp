// palpate strain: how an object's tactile shape changes from one compression to the next.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "capture/files/output_file.h"
#include "capture/run/separate_pictures.h"
#include "capture/run/tactile_shapes.h"
#include "engine/base/json.h"
#include "engine/base/text.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "viz/commands/command.h"
#include "viz/commands/option_groups/run_options.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"
#include "viz/report/plot.h"

namespace palpate {
namespace {

using Json = json::Value;

struct Options {
  std::string input;
  std::filesystem::path sensor, background;
  std::vector<uint64_t> frames;
  std::vector<double> forces_N;
  ShapeRequest request;
  CompressionOptions compression;
  double lambda = -1;
  bool by_shape = false;
};

std::string force_text(const Touch& touch) {
  const Estimate& f = touch.force_N;
  if (f.validity == Validity::NotCalibrated) return "force not calibrated";
  std::string text = palpate::text("%.4g +- %.2g N", f.value, f.standard_error);
  if (f.validity != Validity::Valid) text += std::string(" (") + to_string(f.validity) + ")";
  return text;
}

/// The answer in one sentence.
std::string headline(const Compression& c) {
  if (!c.reason.empty()) return "No strain: " + c.reason;
  return palpate::text("Axial strain %+.2f %% +- %.2f %%, area %+.2f %% +- %.2f %%", 100 * c.axial,
                       100 * c.axial_sd, 100 * c.plane.mean.area, 100 * c.plane.sd.area);
}

Json json_of(const TactileShape& s) {
  return {{"frame", s.touch.sequence},
          {"force_N", s.touch.force_N.value},
          {"force_sd_N", s.touch.force_N.standard_error},
          {"force_state", to_string(s.touch.force_N.validity)},
          {"points", s.control.points.size()},
          {"spacing_mm", s.control.spacing_mm},
          {"contact_mm2", s.contact_mm2}};
}

Json json_of(const PlaneStrain& e) {
  return {{"xx", e.xx}, {"yy", e.yy}, {"xy", e.xy}, {"area", e.area}};
}

/// The points that were compared, and how they were matched.
void add_points(const TactileShapes& shapes, const Compression& c, bool skin, Facts& facts) {
  facts.add("points", skin ? "skin, followed" : "shape, matched");
  facts.add(
      "pairs", c.pairs.size(),
      skin ? text("points        %zu of the skin, followed\n", c.pairs.size())
           : text("points        %zu and %zu, %.3f and %.3f mm apart, drawn %zu times, %zu pairs\n",
                  shapes.before.control.points.size(), shapes.after.control.points.size(),
                  shapes.before.control.spacing_mm, shapes.after.control.spacing_mm, kDraws, c.pairs.size()));
  facts.add("reason", c.reason.empty() ? Json(nullptr) : Json(c.reason));
  if (!c.match) return;
  facts.add(
      "match",
      {{"verdict", to_string(c.match->verdict)},
       {"scatter_mm", c.match->noise_sd},
       {"iterations", c.match->iterations},
       {"converged", c.match->converged}},
      skin ? ""
           : text("match         %s, scatter %.3f mm, %u iterations\n",
                  std::string(to_string(c.match->verdict)).c_str(), c.match->noise_sd, c.match->iterations));
}

Facts facts_of(const TactileShapes& shapes, const Compression& c, bool skin, double poisson) {
  Facts facts;
  facts.say(headline(c) + "\n" +
            text("compressions  frame %llu, %s; frame %llu, %s\n",
                 static_cast<unsigned long long>(shapes.before.touch.sequence),
                 force_text(shapes.before.touch).c_str(),
                 static_cast<unsigned long long>(shapes.after.touch.sequence),
                 force_text(shapes.after.touch).c_str()));
  if (shapes.separate) facts.add("separate_pictures", true, kSeparatePictures + std::string("\n"));
  facts.add("before", json_of(shapes.before));
  facts.add("after", json_of(shapes.after));
  add_points(shapes, c, skin, facts);
  if (!c.reason.empty()) {
    facts.say("NO STRAIN     " + c.reason);
    return facts;
  }
  const PlaneStrain &e = c.plane.mean, &s = c.plane.sd;
  Json mean = json_of(e);
  mean["first"] = e.first;
  mean["second"] = e.second;
  mean["direction_rad"] = e.direction_rad;
  facts.add("strain", mean,
            text("in the plane  xx %+.5f +- %.5f, yy %+.5f +- %.5f, xy %+.5f +- %.5f\n", e.xx, s.xx, e.yy,
                 s.yy, e.xy, s.xy));
  facts.add("strain_sd", json_of(s),
            text("principal     %+.5f and %+.5f, the first at %.1f deg; area %+.5f +- %.5f\n", e.first,
                 e.second, e.direction_rad * 180 / M_PI, e.area, s.area));
  facts.add("axial", c.axial,
            text("axial         %+.5f +- %.5f by the change of area, Poisson's ratio %g\n", c.axial,
                 c.axial_sd, poisson));
  facts.add("axial_sd", c.axial_sd);
  if (!skin) {
    const std::optional<double> counted = shapes.counted_growth();
    facts.add("area_counted", counted ? Json(*counted) : Json(nullptr),
              counted ? text("counted       area %+.5f by the touched places; what it lies apart is in the "
                             "errors\n",
                             *counted)
                      : "");
    facts.add("turn_rad", c.turn_rad,
              text("turn          %+.1f +- %.1f deg\n", c.turn_rad * 180 / M_PI, c.turn_sd_rad * 180 / M_PI));
    facts.add("turn_sd_rad", c.turn_sd_rad);
  }
  facts.add("deepening_mm", c.deepening_mm,
            skin ? "" : text("depth         %+.4f mm on the mean of the matched points\n", c.deepening_mm));
  const PlateStatistics& statistics = c.field->statistics();
  facts.add("spline", {{"lambda", statistics.lambda},
                       {"by_data", statistics.lambda_by_data},
                       {"residual_sd_mm", statistics.residual_sd}});
  facts.say(skin ? "meaning       strain of the pad's skin, whose points are followed"
                 : "meaning       growth of the contact: points are matched by the shape, not by material");
  return facts;
}

/// Figs. 14 and 15: the points of both compressions before registration and after.
Plot points_plot(const TactileShapes& shapes, const Compression& c) {
  std::vector<ShapePoint> warped;
  if (c.match && c.match->reliable())
    for (size_t i = 0; i < c.match->warped.size(); ++i) {
      const auto at = c.match->warped.at(i);
      warped.push_back({at[0], at[1], at[2]});
    }
  Plot plot{.across = 2, .width_px = 1200, .height_px = 520};
  const auto add = [&](const TactileShape& s, std::span<const ShapePoint> points, size_t colour) {
    const Estimate& f = s.touch.force_N;
    PlotCurve& curve = plot.panels.back().add(
        f.validity == Validity::NotCalibrated
            ? palpate::text("frame %llu", static_cast<unsigned long long>(s.touch.sequence))
            : palpate::text("%.3g N", f.value),
        {}, {}, colour, PlotCurve::Style::Points);
    for (const ShapePoint& p : points) {
      curve.add(p.x_mm, p.y_mm);
      curve.z.push_back(p.depth_mm);
    }
  };
  const auto panel = [&](const char* title, std::span<const ShapePoint> before) {
    plot.panels.push_back(
        {.title = title, .x_label = "x, mm", .y_label = "y, mm", .z_label = "depth, mm", .down = true});
    add(shapes.before, before, 1);
    add(shapes.after, shapes.after.draws[0], kPlotBlack);
  };
  panel("control points before registration", shapes.before.draws[0]);
  if (!warped.empty()) panel("and after it", warped);
  if (warped.empty()) plot.across = 1, plot.width_px = 640;
  return plot;
}

/// Where the points went, over the strain of the area between them.
Plot strain_plot(const Compression& c) {
  PlotCurve arrows{.style = PlotCurve::Style::Arrows, .colour = kPlotBlack, .width = 1};
  constexpr size_t kArrows = 250;
  const size_t step = 1 + c.pairs.size() / kArrows;
  for (size_t n = 0; n < c.pairs.size(); n += step) {
    const MatchedPoint& p = c.pairs[n];
    arrows.add(p.before.x_mm, p.before.y_mm, p.after.x_mm - p.before.x_mm, p.after.y_mm - p.before.y_mm);
  }
  const auto [left, right] = std::minmax_element(arrows.x.begin(), arrows.x.end());
  const auto [top, bottom] = std::minmax_element(arrows.y.begin(), arrows.y.end());
  constexpr uint32_t kAcross = 61;
  PlotMap map{kAcross, kAcross, (*right - *left) / (kAcross - 1), (*bottom - *top) / (kAcross - 1)};
  map.x = (*left + *right) / 2;
  map.y = (*top + *bottom) / 2;
  map.label = "change of area, %";
  map.signs = true;
  std::vector<std::array<double, 2>> places;
  for (uint32_t j = 0; j < kAcross; ++j)
    for (uint32_t i = 0; i < kAcross; ++i)
      places.push_back({*left + i * map.pitch_x, *top + j * map.pitch_y});
  for (const PlaneStrain& strain : c.field->at(places)) map.values.push_back(100 * strain.area);
  PlotPanel panel{headline(c), "x, mm", "y, mm", "", {arrows}, map};
  panel.down = true;
  return {.panels = {panel}, .width_px = 760, .height_px = 620};
}

std::string write_files(const std::filesystem::path& out, const TactileShapes& shapes, const Compression& c,
                        const Json& value) {
  make_output_folder(out);
  std::vector<std::vector<double>> columns(7);
  for (const MatchedPoint& p : c.pairs) {
    const double row[] = {p.before.x_mm, p.before.y_mm,    p.before.depth_mm, p.after.x_mm,
                          p.after.y_mm,  p.after.depth_mm, p.probability};
    for (size_t i = 0; i < 7; ++i) columns[i].push_back(row[i]);
  }
  write_whole(out / "pairs.csv",
              std::string_view(
                  csv_of("x_mm,y_mm,depth_mm,after_x_mm,after_y_mm,after_depth_mm,probability", columns)));
  write_whole(out / "strain.json", std::string_view(value.dump(2) + "\n"));
  std::string written = "pairs.csv, strain.json";
  if (!shapes.before.control.points.empty() && !shapes.after.control.points.empty())
    draw_plot(points_plot(shapes, c), out / "points", written);
  if (c.reason.empty()) draw_plot(strain_plot(c), out / "strain", written);
  return written;
}

Report run(const Common& common, Options o) {
  if (!o.frames.empty()) o.request.frames = {o.frames[0], o.frames[1]};
  if (!o.forces_N.empty()) o.request.forces_N = {o.forces_N[0], o.forces_N[1]};
  if (o.lambda >= 0) o.compression.lambda = o.lambda;
  o.request.control.seed = common.seed;
  const MeasuredInput input = find_input(common.seed, o.input, o.sensor, o.background);
  if (!has_scale(input.sensor))
    throw Error(Failure::Sensor, "pitch_mm_per_px", "a sensor without a scale", "palpate calibrate scale");
  const std::unique_ptr<gpu::Context> context = open_device(common);
  const TactileShapes shapes = read_shapes(*context, input, o.request, {.stop = interrupted});
  if (interrupted()) return interrupted_report();
  const bool skin = shapes.skin && !o.by_shape;
  o.compression.counted_growth = shapes.counted_growth();
  const Compression c = skin
                            ? strain_of_pairs(skin_pairs(shapes, input.sensor.pitch_mm_per_px), o.compression)
                            : compare_draws(shapes.before.draws, shapes.after.draws, o.compression);
  Report report = facts_of(shapes, c, skin, o.compression.poisson);
  if (!common.out.empty())
    report.say("\nwritten to " + common.out.string() + ": " +
               write_files(common.out, shapes, c, report.json));
  report.exit_code = validation_clean(*context) ? 0 : kInternalError;
  return report;
}

}  // namespace

void add_strain(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command = program.add_subcommand(
      "strain", "Measure how an object's shape changes from one compression to the next");
  auto o = std::make_shared<Options>();
  command->add_option("INPUT", o->input, "Session folder, video file, folder of images, or synthetic:SCENE")
      ->required();
  command->add_option("--sensor", o->sensor, "Sensor file (default: the session's own)");
  command
      ->add_option("--background", o->background,
                   "Untouched image (default: the session's, the sensor file's, or the first frames)")
      ->check(Check::existing_file());
  CommandOption* frames =
      command->add_option("--frames", o->frames, "The two frames, A,B")->delimiter(',')->expected(2);
  command
      ->add_option("--forces-N", o->forces_N,
                   "The two forces, A,B: the frames nearest to them while loading (default: half of the peak "
                   "and the peak)")
      ->delimiter(',')
      ->expected(2)
      ->check(Check::positive())
      ->excludes(frames);
  add_sequence(*command, o->request.one_sequence);
  command->add_setting("--points", o->request.control.count, Check::range(50, 2000),
                       "Control points of each shape, 50 to 2000");
  command->add_setting("--contact-mm", o->request.control.contact_mm, Check::positive(),
                       "Depth from which a place counts as touched, mm");
  command
      ->add_option("--lambda", o->lambda,
                   "Stiffness of the spline, 0: through all points (default: chosen by the data)")
      ->check(Check::non_negative());
  command->add_setting("--poisson", o->compression.poisson, Check::range(0.0, 0.5), "For the axial strain");
  command->add_flag("--by-shape", o->by_shape, "Match the shapes although the skin's points were followed");
  command->add_option("--out", common.out, "Folder for pairs.csv, strain.json and plots");
  add_common(
      *command, common,
      "  palpate strain synthetic:palpation --forces-N 0.8,1 --out out/strain\n"
      "  palpate strain out/press --frames 120,240 --points 400 --json\n"
      "A bare pad's points are matched by their shape: in the plane that is the growth of the contact.\n"
      "Where the pad shows a pattern its followed points are taken: that is the strain of its skin.\n");
  command->runs(chosen, [&common, o] { return run(common, *o); });
}

}  // namespace palpate
