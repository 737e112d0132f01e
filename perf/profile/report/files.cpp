#include "perf/profile/report/files.h"

#include "capture/files/output_file.h"
#include "perf/profile/report/plots.h"
#include "perf/profile/report/report.h"
#include "perf/profile/report/tables.h"
#include "viz/report/gnuplot.h"

namespace palpate::perf {
namespace {

/// Draws and writes all plots; `hindrance` is the first thing that went wrong.
std::vector<DrawnPlot> draw(const std::vector<NamedPlot>& plots, const std::filesystem::path& out,
                            std::string& hindrance) {
  std::vector<DrawnPlot> drawn;
  for (const NamedPlot& plot : plots) {
    const Picture svg = run_gnuplot(plot_script(plot.plot, PlotKind::Svg, plot.name));
    if (!svg.error.empty() && hindrance.empty()) hindrance = svg.error;
    if (svg.missing) break;
    const Picture png = run_gnuplot(plot_script(plot.plot, PlotKind::Png, plot.name));
    const Picture pdf = run_gnuplot(plot_script(plot.plot, PlotKind::Pdf, plot.name));
    if (!svg.bytes.empty()) write_whole(out / (plot.name + ".svg"), svg.bytes);
    if (!png.bytes.empty()) write_whole(out / (plot.name + ".png"), png.bytes);
    if (!pdf.bytes.empty()) write_whole(out / (plot.name + ".pdf"), pdf.bytes);
    drawn.push_back({plot, svg.bytes});
  }
  return drawn;
}

}  // namespace

void write_figures(const Profile& profile, const std::filesystem::path& out) {
  for (const auto& [name, text] : csv_files(profile)) write_whole(out / name, text);
  write_whole(out / "profile.json", file_text(profile));
}

std::string write_report(const Profile& profile, const std::filesystem::path& out) {
  std::string hindrance;
  const std::vector<DrawnPlot> plots = draw(plots_of(profile), out, hindrance);
  write_whole(out / "report.html", html_report(profile, plots));
  return hindrance;
}

std::string write_comparison(const MachineComparison& comparison, const std::filesystem::path& out) {
  write_whole(out / "compare.csv", to_csv(comparison));
  write_whole(out / "compare.json", to_json(comparison).dump(1, json::Utf8::Replace) + "\n");
  std::string hindrance;
  const std::vector<DrawnPlot> plots =
      draw(comparison_plots(comparison.profiles, comparison.names), out, hindrance);
  write_whole(out / "compare.html", html_report(comparison, plots));
  return hindrance;
}

}  // namespace palpate::perf
