#include "perf/lab/judge/coverage_plot.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "capture/files/output_file.h"
#include "engine/base/text.h"
#include "perf/lab/judge/report.h"
#include "viz/report/gnuplot.h"

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

/// Tics of an axis at 0, 1, ...
std::string tics(const judge::Axis& axis) {
  std::string list;
  for (size_t i = 0; i < axis.labels.size(); ++i)
    list += (i > 0 ? "," : "") + gnuplot_quoted(axis.labels[i]) + " " + std::to_string(i);
  return list;
}

std::string panel_script(const judge::Judgement& j, const Panel& panel, size_t number) {
  const judge::Grid& grid = *panel.grid;
  std::vector<std::vector<double>> cells(7);
  std::string marks;
  for (size_t y = 0; y < grid.y.size(); ++y)
    for (size_t x = 0; x < grid.x.size(); ++x) {
      const Shown s = panel.show(grid.at(x, y));
      const auto at_x = static_cast<double>(x), at_y = static_cast<double>(y);
      const double shade = (s.percent - panel.least) / (panel.most - panel.least);
      if (s.too_few) {
        marks += text("set object rect from %g,%g to %g,%g fc rgb '#e4e4e4' fs solid noborder behind\n",
                      at_x - 0.5, at_y - 0.5, at_x + 0.5, at_y + 0.5);
      } else {
        const double row[] = {at_x, at_y, at_x - 0.5, at_x + 0.5, at_y - 0.5, at_y + 0.5, s.percent};
        for (size_t c = 0; c < cells.size(); ++c) cells[c].push_back(row[c]);
      }
      const std::string words =
          s.too_few ? text("(%zu)", s.count) : text("%.0f%s\\n%zu", s.percent, s.marked ? " *" : "", s.count);
      marks += text("set label \"%s\" at %g,%g center front tc rgb '%s' font ',9'\n", words.c_str(), at_x,
                    at_y + (s.too_few ? 0 : 0.12), s.too_few || shade > 0.55 ? "#000000" : "#ffffff");
    }
  if (panel.worst)
    marks += text("set object rect from %g,%g to %g,%g fs empty border rgb '%s' lw 4 front\n",
                  static_cast<double>(panel.worst->x) - 0.5, static_cast<double>(panel.worst->y) - 0.5,
                  static_cast<double>(panel.worst->x) + 0.5, static_cast<double>(panel.worst->y) + 0.5,
                  plot_colour(1));
  if (cells[0].empty())
    for (auto& column : cells) column.push_back(std::nan(""));
  const std::string name = "cells" + std::to_string(number);
  return plot_block(name, cells) + "unset label\nunset object\n" + marks + "set title " +
         gnuplot_quoted(panel.title) + "\nset xlabel " + gnuplot_quoted(j.conditions[grid.x.condition].name) +
         "\nset ylabel " + gnuplot_quoted(grid.single ? "" : j.conditions[grid.y.condition].name) +
         "\nset xtics (" + tics(grid.x) + ") rotate by 40 right\nset ytics (" + tics(grid.y) +
         text(")\nset xrange [-0.5:%g]\nset yrange [-0.5:%g]\nset cbrange [%g:%g]\n",
              static_cast<double>(grid.x.size()) - 0.5, static_cast<double>(grid.y.size()) - 0.5, panel.least,
              panel.most) +
         "plot $" + name + " using 1:2:3:4:5:6:7 with boxxyerror fs solid 1 lc palette notitle\n";
}

}  // namespace

std::string coverage_script(const judge::Judgement& j, PlotKind kind) {
  const std::vector<Panel> panels = panels_of(j);
  const size_t each = panels.size() / std::max<size_t>(j.grids.size(), 1),
               columns = each * std::max<size_t>(1, std::min(j.grids.size(), kMostColumns / each)),
               rows = (panels.size() + columns - 1) / columns;
  std::string script =
      plot_head(kind, kPanelWidth_px * static_cast<int>(columns), kPanelHeight_px * static_cast<int>(rows)) +
      plot_palette() + "unset key\nunset grid\nset format cb '%g %%'\n" +
      text("set multiplot layout %zu,%zu\n", rows, columns);
  for (size_t p = 0; p < panels.size(); ++p) script += panel_script(j, panels[p], p);
  return script + "unset multiplot\n";
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
  draw_plots([&](PlotKind kind) { return coverage_script(judgement, kind); }, folder / stem, written);
  return written;
}

}  // namespace palpate
