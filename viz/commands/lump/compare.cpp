// palpate lump compare: the change of one lump from day to day.
#include <cmath>
#include <utility>

#include "capture/files/output_file.h"
#include "capture/run/palpation/compared_days.h"
#include "engine/base/text.h"
#include "engine/palpation/scan.h"
#include "palpate/error.h"
#include "palpate/version.h"
#include "viz/commands/lump/error_options.h"
#include "viz/commands/lump/lump.h"
#include "viz/commands/support/options.h"
#include "viz/report/html.h"
#include "viz/report/plot.h"
#include "viz/report/scan_report.h"

namespace palpate {
namespace {

using Rows = std::vector<std::pair<std::string, std::string>>;

struct Options {
  std::vector<std::string> days;
  lump::ErrorSources errors;
  std::string network;
};

std::string ratio_words(const lump::LumpChange& c) {
  return palpate::text("%.3g to %.3g times the first day's%s", c.factor[2].low, c.factor[2].high,
                       c.ratio_changed ? "" : ", which may be no change");
}

Rows change_rows(const lump::LumpChange& c) {
  Rows rows = {{"lump", sentence_of(c)}};
  if (has_numbers(c)) {
    rows.emplace_back("change of the size", interval_text(c.size_mm, "mm"));
    rows.emplace_back("change of the depth of its top", interval_text(c.depth_mm, "mm"));
    rows.emplace_back("stiffness ratio", ratio_words(c));
    constexpr double kSeen_mm = 1e-3;
    if (std::hypot(c.moved_mm[0], c.moved_mm[1]) > kSeen_mm)
      rows.emplace_back(
          "window against the first day's",
          palpate::text("%+.2g, %+.2g mm beside where it was told", c.moved_mm[0], c.moved_mm[1]));
  }
  // The first reason of days that cannot be compared is in the sentence.
  for (size_t i = c.verdict == lump::ChangeVerdict::NotComparable ? 1 : 0; i < c.reasons.size(); ++i)
    rows.emplace_back("note", c.reasons[i]);
  return rows;
}

std::string table(const std::string& title, const Rows& rows) {
  std::string text = title + "\n";
  for (const auto& [name, value] : rows) text += palpate::text("  %-30s ", name.c_str()) + value + "\n";
  return text;
}

/// Changes from the first day, with their intervals; what has none is left out.
Plot plot_of(const std::vector<ComparedDay>& days) {
  PlotTics names;
  for (size_t d = 0; d < days.size(); ++d) names.emplace_back(days[d].name, static_cast<double>(d + 1));
  const auto panel_of = [&](const char* title, const char* label, const auto& value, double first) {
    PlotPanel panel{title, "", label};
    panel.x_range = {0.5, static_cast<double>(days.size()) + 0.5};
    panel.x_tics = names;
    PlotCurve curve{.title = "90 % interval", .style = PlotCurve::Style::LinesAndPoints};
    curve.add(1, first, first, first);
    for (size_t d = 1; d < days.size(); ++d) {
      if (!has_numbers(days[d].change)) continue;
      const lump::Value& v = value(days[d].change);
      curve.add(static_cast<double>(d + 1), v.value, v.low, v.high);
    }
    panel.curves.push_back(curve);
    panel.room_above = 0.2;
    return panel;
  };
  return {.title = "changes from the first day",
          .panels = {panel_of(
                         "diameter", "mm more", [](const auto& c) { return c.size_mm; }, 0.0),
                     panel_of(
                         "depth of its top", "mm more", [](const auto& c) { return c.depth_mm; }, 0.0),
                     panel_of(
                         "stiffness ratio", "times the first day's",
                         [](const auto& c) { return c.factor[2]; }, 1.0)},
          .across = 3,
          .width_px = 1080,
          .height_px = 400};
}

std::string html_of(const std::vector<ComparedDay>& days, const Options& o,
                    const std::filesystem::path& folder) {
  std::string body =
      "<h1>A lump from day to day</h1>\n<p class=\"notice\">" + std::string(kNotice) + "</p>\n";
  for (size_t d = 1; d < days.size(); ++d)
    body +=
        "<p class=\"answer\">" + html_escaped(days[d].name + ": " + sentence_of(days[d].change)) + "</p>\n";
  body += html_figure(folder / "change.svg");
  for (size_t d = 1; d < days.size(); ++d)
    body += "<h2>" + html_escaped("From " + days[0].name + " to " + days[d].name) + "</h2>\n" +
            html_rows(change_rows(days[d].change));
  body += "<h2>Each day by itself</h2>\n";
  for (const ComparedDay& one : days)
    body += "<h3>" + html_escaped(one.name) + "</h3>\n" + html_rows(estimate_rows(one.day.estimate));
  body += "<h2>Inputs</h2>\n" +
          html_rows(
              {{"errors covered by the intervals",
                palpate::text("modulus %g %%, thickness %g %%, pitch %g %%, alike on all days; light, place",
                              100 * o.errors.young, 100 * o.errors.thickness, 100 * o.errors.pitch)},
               {"program", "palpate " PALPATE_VERSION_TEXT}});
  body +=
      "<p class=\"small\">A change's interval holds nine of ten truths where one block is pressed by one "
      "sensor, "
      "and the lump keeps its shape and its place in the tissue. " +
      std::string(kNotice) + "</p>\n";
  return html_page("A lump from day to day", body);
}

std::string csv_of(const std::vector<ComparedDay>& days) {
  std::string csv =
      "day,verdict,size_mm,size_low_mm,size_high_mm,depth_mm,depth_low_mm,depth_high_mm,"
      "ratio_factor,ratio_factor_low,ratio_factor_high,least_growth_mm\n";
  for (size_t d = 1; d < days.size(); ++d) {
    const lump::LumpChange& c = days[d].change;
    csv += "\"" + days[d].name + "\"," + to_string(c.verdict);
    for (const lump::Value& v : {c.size_mm, c.depth_mm, c.factor[2]})
      for (const double number : {v.value, v.low, v.high})
        csv += "," + (has_numbers(c) ? plot_number(number) : "");
    csv += "," + (has_numbers(c) ? plot_number(c.least_mm) : "") + "\n";
  }
  return csv;
}

Report run(const Common& common, const Options& o) {
  const std::vector<ComparedDay> days = compare_days({o.days.begin(), o.days.end()}, o.errors, o.network);
  Report report;
  report.json = days_json(days);
  for (const ComparedDay& one : days) report.text += table(one.name, estimate_rows(one.day.estimate));
  for (size_t d = 1; d < days.size(); ++d)
    report.text += table("from " + days[0].name + " to " + days[d].name, change_rows(days[d].change));
  report.text += std::string(kNotice) + "\n";
  if (!common.out.empty()) {
    make_output_folder(common.out);
    write_whole(common.out / "change.json",
                std::string_view(report.json.dump(2, json::Utf8::Replace) + "\n"));
    write_whole(common.out / "change.csv", std::string_view(csv_of(days)));
    std::string written = (common.out / "report.html").string() + ", change.json, change.csv";
    draw_plot(plot_of(days), common.out / "change", written);
    write_whole(common.out / "report.html", std::string_view(html_of(days, o, common.out)));
    report.text += "wrote " + written + "\n";
  }
  return report;
}

}  // namespace

void add_lump_compare(CommandLine& group, Common& common, Command& chosen) {
  CommandLine* command = group.add_subcommand(
      "compare", "Whether a lump has grown from one day to another, with the change's interval");
  auto o = std::make_shared<Options>();
  command
      ->add_option("DAY", o->days,
                   "Folders that palpate lump estimate or scan wrote with --out, the first day first")
      ->required();
  add_error_sources(*command, o->errors);
  command->add_option("--network", o->network, "A file of palpate-lab train (default: the built-in network)");
  command->add_option("--out", common.out, "Folder for report.html, change.csv, change.json and a chart");
  add_common(*command, common,
             "  palpate lump scan --simulate --size-mm 10 --out out/may\n"
             "  palpate lump scan --simulate --size-mm 11 --depth-mm 2.5 --seed 2 --out out/june\n"
             "  palpate lump compare out/may out/june --out out/compared\n"
             "Both days: the same place of the same tissue, pressed about as hard by the same sensor.\n"
             "Research use, not a diagnosis.\n");
  command->runs(chosen, [o, &common] { return run(common, *o); });
}

}  // namespace palpate
