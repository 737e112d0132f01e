#include "viz/report/match_plot.h"

#include <cstdio>
#include <limits>
#include <vector>

#include "engine/base/text.h"
#include "viz/report/plot.h"

namespace palpate {
namespace {

void add(PlotPanel& panel, const char* title, const PointSet& set, size_t colour, int mark) {
  PlotCurve& curve = panel.add(title, {}, {}, colour, PlotCurve::Style::Points);
  curve.mark = mark;
  curve.width = 1;
  for (size_t i = 0; i < set.size(); ++i) {
    curve.add(set.at(i)[0], set.at(i)[1]);
    if (set.axes == 3) curve.z.push_back(set.at(i)[2]);
  }
}

}  // namespace

void draw_match(const std::filesystem::path& folder, const PointSet& from, const PointSet& to,
                const MatchResult& result, std::string& written) {
  // Left: the two sets and their correspondences; right: the template on the target.
  PlotPanel sets{std::string(to_string(result.verdict)), "x", "y"};
  sets.z_label = "z";
  sets.equal = true;
  sets.key = "outside bottom center horizontal";
  PlotPanel warped = sets;
  PlotCurve& lines = sets.add("", {}, {}, kPlotGray);
  lines.width = 0.7;
  size_t pairs = 0;
  for (size_t i = 0; i < result.partners.size(); ++i) {
    if (!result.partners[i].target) continue;
    ++pairs;
    const auto a = from.at(i), b = to.at(*result.partners[i].target);
    const auto join = [&](std::vector<double>& column, uint32_t axis) {
      column.insert(column.end(), {a[axis], b[axis], kPlotAuto});
    };
    join(lines.x, 0);
    join(lines.y, 1);
    if (from.axes == 3) join(lines.z, 2);
  }
  add(sets, "target", to, 1, 7);
  add(sets, "template", from, 0, 6);
  warped.title = text("%zu pairs; noise %.3g, evidence %.3g nats a point", pairs, result.noise_sd,
                      result.log_likelihood_gain);
  add(warped, "target", to, 1, 7);
  add(warped, "warped template", result.warped, 0, 6);
  draw_plot({.panels = {sets, warped}, .across = 2, .width_px = 1200, .height_px = 620}, folder / "match",
            written);
}

}  // namespace palpate
