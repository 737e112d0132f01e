// palpate lump limit: the smallest lump that a sensor would show.
#include <algorithm>
#include <cmath>
#include <utility>

#include "capture/files/estimate_report.h"
#include "capture/files/output_file.h"
#include "engine/base/text.h"
#include "engine/lump/estimator.h"
#include "engine/lump/network/detection_limit.h"
#include "palpate/error.h"
#include "viz/commands/lump/lump.h"
#include "viz/commands/support/options.h"
#include "viz/report/plot.h"

namespace palpate {
namespace {

struct Options {
  std::vector<double> force_N, noise_Pa, window_mm;
  double young_Pa = 0, thickness_mm = 20, pattern_Pa = 0;
  std::string network;
};

/// Limits of one noise.
struct Row {
  double noise_Pa = 0;
  std::vector<lump::DetectionLimit> limits;
};

std::string size_text(const lump::DetectionLimit& limit) {
  if (std::isnan(limit.size_mm)) return "none";
  return (limit.size_mm <= lump::kLeastSeen_mm ? "<= " : "") + text("%.2g", limit.size_mm);
}

/// The places of one stiffness ratio's limits.
template <typename Each>
void for_ratio(const std::vector<lump::DetectionLimit>& limits, double ratio, const Each& each) {
  for (const lump::DetectionLimit& limit : limits)
    if (limit.stiffness_ratio == ratio) each(limit);
}

std::vector<double> ratios_of(const std::vector<lump::DetectionLimit>& limits) {
  std::vector<double> ratios;
  for (const lump::DetectionLimit& limit : limits)
    if (ratios.empty() || ratios.back() != limit.stiffness_ratio) ratios.push_back(limit.stiffness_ratio);
  return ratios;
}

std::string table_of(const std::vector<Row>& rows) {
  std::string table =
      "smallest ball that is seen nine times in ten, diameter in mm, by depth of its top\n"
      "noise, Pa  ratio";
  for_ratio(rows.front().limits, ratios_of(rows.front().limits).front(),
            [&](const lump::DetectionLimit& limit) { table += text("%8.3g mm", limit.depth_mm); });
  table += "\n";
  for (const Row& row : rows)
    for (const double ratio : ratios_of(row.limits)) {
      table += text("%9.3g  %5.3g", row.noise_Pa, ratio);
      for_ratio(row.limits, ratio,
                [&](const lump::DetectionLimit& limit) { table += text("%11s", size_text(limit).c_str()); });
      table += "\n";
    }
  return table;
}

Plot plot_of(const std::vector<Row>& rows) {
  Plot plot{.title = "smallest ball that is seen nine times in ten",
            .across = static_cast<uint32_t>(std::min<size_t>(rows.size(), 3)),
            .width_px = static_cast<int>(60 + 400 * std::min<size_t>(rows.size(), 3)),
            .height_px = static_cast<int>(60 + 360 * ((rows.size() + 2) / 3))};
  double highest = 0;
  for (const Row& row : rows)
    for (const lump::DetectionLimit& limit : row.limits)
      if (limit.size_mm > highest) highest = limit.size_mm;
  for (const Row& row : rows) {
    PlotPanel panel{text("noise of %.3g Pa", row.noise_Pa), "depth of its top, mm", "diameter, mm"};
    panel.y_range = {0.0, 1.5 * std::max(highest, lump::kLeastSeen_mm)};
    panel.key = "top left";
    size_t colour = 0;
    for (const double ratio : ratios_of(row.limits)) {
      PlotCurve curve{.title = text("%.3g times as stiff", ratio), .style = PlotCurve::Style::LinesAndPoints};
      curve.colour = colour++;
      for_ratio(row.limits, ratio, [&](const lump::DetectionLimit& limit) {
        if (!std::isnan(limit.size_mm)) curve.add(limit.depth_mm, limit.size_mm);
      });
      if (!curve.x.empty()) panel.curves.push_back(curve);
    }
    plot.panels.push_back(std::move(panel));
  }
  return plot;
}

Report run(const Common& common, const Options& o) {
  const auto network = lump::load_network(o.network);
  std::vector<Row> rows;
  for (const double noise_Pa : o.noise_Pa)
    rows.push_back({noise_Pa, detection_limits(*network, {.force_N = o.force_N,
                                                          .young_Pa = o.young_Pa,
                                                          .thickness_mm = o.thickness_mm,
                                                          .window_mm = {o.window_mm[0], o.window_mm[1]},
                                                          .noise_Pa = noise_Pa,
                                                          .pattern_Pa = o.pattern_Pa,
                                                          .seed = common.seed})});
  if (rows.front().limits.empty())
    throw Error(Failure::Usage, "tissue with room for a lump", text("%.3g mm", o.thickness_mm),
                "--thickness-mm of more");
  Report report;
  report.text = table_of(rows);
  report.json = {{"limits", json::Value::array()}};
  std::string csv = "noise_Pa,stiffness_ratio,depth_mm,size_mm\n";
  for (const Row& row : rows)
    for (const lump::DetectionLimit& limit : row.limits) {
      json::Value told = {{"noise_Pa", row.noise_Pa}};
      told.update(limit_json(limit));
      report.json["limits"].push_back(std::move(told));
      csv += plot_number(row.noise_Pa) + "," + plot_number(limit.stiffness_ratio) + "," +
             plot_number(limit.depth_mm) + "," +
             (std::isnan(limit.size_mm) ? "" : plot_number(limit.size_mm)) + "\n";
    }
  if (!common.out.empty()) {
    make_output_folder(common.out);
    write_whole(common.out / "limit.csv", std::string_view(csv));
    std::string written = (common.out / "limit.csv").string();
    draw_plot(plot_of(rows), common.out / "limit", written);
    report.text += "wrote " + written + "\n";
  }
  return report;
}

}  // namespace

void add_lump_limit(CommandLine& group, Common& common, Command& chosen) {
  CommandLine* command =
      group.add_subcommand("limit", "The smallest lump that would be seen, by depth, stiffness and noise");
  auto o = std::make_shared<Options>();
  o->window_mm = {40, 30};
  command->add_option("--force-N", o->force_N, "On the whole block, the loads of a press, rising")
      ->delimiter(',')
      ->required();
  command->add_option("--young-Pa", o->young_Pa, "Of the tissue")->required()->check(Check::range(1.0, 1e9));
  command
      ->add_option("--noise-Pa", o->noise_Pa,
                   "Of a value over 1.25 mm, standard deviation; several: each of them")
      ->delimiter(',')
      ->required()
      ->check(Check::range(0.0, 1e9));
  command->add_setting("--pattern-Pa", o->pattern_Pa, Check::range(0.0, 1e9),
                       "What calibration leaves of the sensor's own pattern, alike at all loads");
  command->add_setting("--thickness-mm", o->thickness_mm, Check::range(1.0, 1000.0), "Of the tissue");
  command
      ->add_option("--window-mm", o->window_mm, "What the sensor sees of it, in its middle (default 40 30)")
      ->expected(2);
  command->add_option("--network", o->network, "A file of palpate-lab train (default: the built-in network)");
  command->add_option("--out", common.out, "Folder for limit.csv and a plot");
  add_common(*command, common,
             "  palpate lump limit --force-N 0.5,1,1.5,2 --young-Pa 4000 --noise-Pa 5,20 --out out/limit\n"
             "A ball counts as seen where lump estimate --method refined would call it a lump nine times in\n"
             "ten, and tissue alone once in a hundred.\n"
             "Research use, not a diagnosis.\n");
  command->runs(chosen, [o, &common] { return run(common, *o); });
}

}  // namespace palpate
