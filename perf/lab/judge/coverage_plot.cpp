#include "perf/lab/judge/coverage_plot.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "capture/files/output_file.h"
#include "engine/base/text.h"
#include "perf/lab/judge/report.h"

namespace palpate {
namespace {

constexpr int kPanelWidth_px = 400, kPanelHeight_px = 300;
constexpr size_t kMostColumns = 4;

/// Value and colour of one cell.
struct Shown {
  double percent = 0;
  size_t count = 0;
  bool too_few = true, marked = false;
};

struct Panel {
  std::string title;
  const judge::Grid* grid;
  std::optional<judge::Place> worst;  // where it lies in this grid
  double least = 0, most = 100;       // of the colours
  std::function<Shown(const judge::Cell&)> show;
};

double percent(size_t part, size_t whole) {
  return whole > 0 ? 100 * static_cast<double>(part) / static_cast<double>(whole) : 0;
}

std::optional<judge::Place> if_here(const std::optional<judge::Place>& place, size_t grid) {
  return place && place->grid == grid ? place : std::nullopt;
}

Panel coverage_panel(const judge::Judgement& j, size_t g, size_t q) {
  const judge::Coverage& all = j.all.quantities[q];
  Panel panel;
  panel.title = text("%s: %.1f %% hold, promise %.3g %%", j.quantities[q].name.c_str(), 100 * all.rate(),
                     100 * j.quantities[q].promise);
  panel.grid = &j.grids[g];
  panel.worst = if_here(j.worst[q], g);
  panel.least = 100 * j.quantities[q].promise - 40;
  panel.show = [q](const judge::Cell& cell) {
    const judge::Coverage& c = cell.quantities[q];
    return Shown{100 * c.rate(), c.judged, c.too_few, c.accused};
  };
  return panel;
}

Panel wrong_panel(const judge::Judgement& j, size_t g) {
  Panel panel;
  panel.title = text("verdict: %.2g %% of the reported wrong", percent(j.all.wrong, j.all.reported()));
  panel.grid = &j.grids[g];
  panel.worst = if_here(j.worst_wrong, g);
  panel.most = 20;
  const size_t fewest = j.options.fewest;
  panel.show = [fewest](const judge::Cell& cell) {
    return Shown{percent(cell.wrong, cell.reported()), cell.reported(), cell.reported() < fewest, false};
  };
  return panel;
}

Panel refused_panel(const judge::Judgement& j, size_t g) {
  Panel panel;
  panel.title = text("verdict: %.2g %% refused", percent(j.all.refused, j.all.count));
  panel.grid = &j.grids[g];
  const size_t fewest = j.options.fewest;
  panel.show = [fewest](const judge::Cell& cell) {
    return Shown{percent(cell.refused, cell.count), cell.count, cell.count < fewest, false};
  };
  return panel;
}

std::vector<Panel> panels_of(const judge::Judgement& j) {
  std::vector<Panel> panels;
  for (size_t g = 0; g < j.grids.size(); ++g) {
    for (size_t q = 0; q < j.quantities.size(); ++q) panels.push_back(coverage_panel(j, g, q));
    if (!j.wrong_means.empty()) panels.push_back(wrong_panel(j, g));
    panels.push_back(refused_panel(j, g));
  }
  return panels;
}

/// Names of an axis at 0, 1, ...
PlotTics tics(const judge::Axis& axis) {
  PlotTics list;
  for (const std::string& label : axis.labels) list.emplace_back(label, list.size());
  return list;
}

PlotPanel panel_plot(const judge::Judgement& j, const Panel& panel) {
  const judge::Grid& grid = *panel.grid;
  PlotMap map{.columns = static_cast<uint32_t>(grid.x.size()), .rows = static_cast<uint32_t>(grid.y.size())};
  map.x = (map.columns - 1) / 2.0;
  map.y = (map.rows - 1) / 2.0;
  map.range = {{panel.least, panel.most}};
  map.label = "%";
  PlotCurve words[2];  // on dark cells, and on bright and gray ones
  for (size_t y = 0; y < grid.y.size(); ++y)
    for (size_t x = 0; x < grid.x.size(); ++x) {
      const Shown s = panel.show(grid.at(x, y));
      map.values.push_back(s.too_few ? kPlotAuto : s.percent);
      const double shade = (s.percent - panel.least) / (panel.most - panel.least);
      PlotCurve& curve = words[s.too_few || shade > 0.55];
      curve.add(static_cast<double>(x), static_cast<double>(y));
      curve.words.push_back(s.too_few ? text("(%zu)", s.count)
                                      : text("%.0f%s\\n%zu", s.percent, s.marked ? " *" : "", s.count));
    }
  for (PlotCurve& curve : words) curve.style = PlotCurve::Style::Words;
  words[0].colour = kPlotWhite;
  words[1].colour = kPlotBlack;
  PlotPanel plot{panel.title,
                 j.conditions[grid.x.condition].name,
                 grid.single ? "" : j.conditions[grid.y.condition].name,
                 "",
                 {words[0], words[1]},
                 map};
  plot.x_tics = tics(grid.x);
  plot.y_tics = tics(grid.y);
  if (panel.worst) {
    const double x = static_cast<double>(panel.worst->x), y = static_cast<double>(panel.worst->y);
    plot.add("", {x - 0.5, x + 0.5, x + 0.5, x - 0.5, x - 0.5}, {y - 0.5, y - 0.5, y + 0.5, y + 0.5, y - 0.5},
             1)
        .width = 4;
  }
  return plot;
}

}  // namespace

Plot coverage_plot(const judge::Judgement& j) {
  const std::vector<Panel> panels = panels_of(j);
  const size_t each = panels.size() / std::max<size_t>(j.grids.size(), 1),
               columns = each * std::max<size_t>(1, std::min(j.grids.size(), kMostColumns / each)),
               rows = (panels.size() + columns - 1) / columns;
  Plot plot{.across = static_cast<uint32_t>(columns),
            .width_px = kPanelWidth_px * static_cast<int>(columns),
            .height_px = kPanelHeight_px * static_cast<int>(rows)};
  for (const Panel& panel : panels) plot.panels.push_back(panel_plot(j, panel));
  return plot;
}

std::string write_judgement(const judge::Judgement& judgement, const judge::Cases& cases,
                            const std::filesystem::path& folder, const std::string& stem) {
  make_output_folder(folder);
  const auto file = [&](const char* ending) { return (folder / (stem + ending)).string(); };
  write_whole(file(".txt"), std::string_view(judge::judgement_text(judgement)));
  write_whole(file(".csv"), std::string_view(judge::judgement_csv(judgement)));
  write_whole(file(".json"), std::string_view(judge::judgement_json(judgement).dump(2) + "\n"));
  write_whole(file("_cases.csv"), std::string_view(judge::cases_csv(cases)));
  std::string written = file(".txt") + ", .csv, .json, " + stem + "_cases.csv";
  draw_plot(coverage_plot(judgement), folder / stem, written);
  return written;
}

}  // namespace palpate
