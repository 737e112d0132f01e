#include "perf/lab/judge/report.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "engine/base/text.h"

namespace palpate::judge {
namespace {

double share(size_t part, size_t whole) {
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : std::nan("");
}

std::string percent(double fraction) {
  return std::isfinite(fraction) ? text("%.3g", 100 * fraction) : "-";
}

std::string band_text(const Band& band) {
  return text("%.3g to %.3g %%", 100 * band.low, 100 * band.high);
}

std::string held_text(const Coverage& c) {
  return percent(c.rate()) + text(" %% of %zu (", c.judged) + band_text(c.band) + ")";
}

std::string error_text(const Coverage& c) {
  if (!std::isfinite(c.median_error)) return "";
  return "; median error " + percent(c.median_error) + " %, nine of ten below " + percent(c.ninetieth_error) +
         " %";
}

std::string quantity_line(const Judgement& j, size_t q) {
  const Coverage& mean = j.all.quantities[q];
  std::string line = j.quantities[q].name + ": " + percent(j.quantities[q].promise) +
                     " % intervals hold the truth in " + held_text(mean) + error_text(mean) +
                     "\n  worst cell: ";
  if (!j.worst[q]) return line + text("none has %zu cases\n", j.options.fewest);
  const Coverage& worst = j.cell(*j.worst[q]).quantities[q];
  line += name_of(j, *j.worst[q]) + ": " + held_text(worst) + error_text(worst) + "\n  ";
  if (worst.accused) return line + text("below its promise beyond chance (%.3g)\n", worst.chance);
  return line + text("no cell is below the promise beyond chance (here %.2g)\n", worst.chance);
}

std::string wrong_text(const Judgement& j, const Cell& cell) {
  return text("%zu of %zu wrong (", cell.wrong, cell.reported()) + band_text(cell.wrong_band) + "), " +
         percent(share(cell.refused, cell.count)) + text(" %% of %zu refused", cell.count) +
         (cell.reported() < j.options.fewest ? ", too few" : "");
}

std::string verdict_line(const Judgement& j) {
  if (j.wrong_means.empty())
    return "verdict: " + percent(share(j.all.refused, j.all.count)) +
           text(" %% of %zu refused\n", j.all.count);
  std::string line = "verdict (wrong: " + j.wrong_means + "): " + wrong_text(j, j.all) + "\n  worst cell: ";
  if (!j.worst_wrong)
    return line + text("none of %zu reported cases or more has a wrong one\n", j.options.fewest);
  return line + name_of(j, *j.worst_wrong) + ": " + wrong_text(j, j.cell(*j.worst_wrong)) + "\n";
}

/// A grid with one text a cell.
std::string table(const Judgement& j, const Grid& grid, const std::string& title,
                  const std::function<std::string(const Cell&)>& words) {
  size_t width = 0, first = 0;
  for (const std::string& label : grid.x.labels) width = std::max(width, label.size());
  for (const std::string& label : grid.y.labels) first = std::max(first, label.size());
  for (const Cell& cell : grid.cells) width = std::max(width, words(cell).size());
  const std::string across = j.conditions[grid.x.condition].name,
                    down = grid.single ? "" : j.conditions[grid.y.condition].name;
  first = std::max(first, down.size());
  const auto padded = [](const std::string& one, size_t columns) {
    return std::string(columns > one.size() ? columns - one.size() : 0, ' ') + one;
  };
  std::string out = "\n" + title + ", by " + across + (down.empty() ? "" : " (across) and " + down) + "\n" +
                    padded(down, first);
  for (const std::string& label : grid.x.labels) out += "  " + padded(label, width);
  for (size_t row = 0; row < grid.y.size(); ++row) {
    out += "\n" + padded(grid.y.labels[row], first);
    for (size_t i = 0; i < grid.x.size(); ++i) out += "  " + padded(words(grid.at(i, row)), width);
  }
  return out + "\n";
}

std::string coverage_words(const Coverage& c) {
  if (c.judged == 0) return "-";
  if (c.too_few) return text("too few: %zu", c.judged);
  return text("%.0f (%.0f-%.0f) %zu%s", 100 * c.rate(), 100 * c.band.low, 100 * c.band.high, c.judged,
              c.accused ? " *" : "  ");
}

std::string error_words(const Coverage& c) {
  return std::isfinite(c.median_error) ? percent(c.median_error) + " / " + percent(c.ninetieth_error) : "-";
}

std::string verdict_words(const Cell& c) {
  if (c.count == 0) return "-";
  return text("%.0f %% of %zu, %zu", 100 * share(c.refused, c.count), c.count, c.wrong);
}

std::string csv_number(double value) {
  return std::isfinite(value) ? text("%.6g", value) : "";
}

/// All of a number's digits; an open end as a number that tables can hold.
std::string exact_number(double value) {
  if (std::isnan(value)) return "";
  return text("%.17g", std::clamp(value, -1e308, 1e308));
}

std::string csv_text(const std::string& words) {
  return words.find_first_of(",\"") == std::string::npos ? words : "\"" + words + "\"";
}

void add_csv(const Judgement& j, const std::string& where, const Cell& cell, std::string& csv) {
  const std::string counts = text("%zu,%zu,", cell.count, cell.reported());
  for (size_t q = 0; q < j.quantities.size(); ++q) {
    const Coverage& c = cell.quantities[q];
    csv += where;
    csv += csv_text(j.quantities[q].name) + "," + counts + csv_number(j.quantities[q].promise) +
           text(",%zu,%zu,", c.judged, c.inside) + csv_number(c.rate()) + "," + csv_number(c.band.low) + "," +
           csv_number(c.band.high) + "," + csv_number(c.median_error) + "," + csv_number(c.ninetieth_error) +
           "," + (c.too_few ? "" : csv_number(c.chance)) + text(",%d,%d\n", c.too_few, c.accused);
  }
  const size_t right = cell.reported() - cell.wrong;
  csv += where + "verdict," + counts + text(",%zu,%zu,", cell.reported(), right) +
         csv_number(share(right, cell.reported())) + "," + csv_number(1 - cell.wrong_band.high) + "," +
         csv_number(1 - cell.wrong_band.low) + text(",,,,%d,\n", cell.reported() < j.options.fewest);
}

json::Value band_json(const Band& band) {
  return json::Value::array({band.low, band.high});
}

json::Value cell_json(const Judgement& j, const Cell& cell) {
  json::Value value = {{"count", cell.count},
                       {"refused", cell.refused},
                       {"refused_band", band_json(cell.refused_band)},
                       {"wrong", cell.wrong},
                       {"wrong_band", band_json(cell.wrong_band)}};
  value["quantities"] = json::Value::object();
  for (size_t q = 0; q < j.quantities.size(); ++q) {
    const Coverage& c = cell.quantities[q];
    value["quantities"][j.quantities[q].name] = {
        {"judged", c.judged},
        {"inside", c.inside},
        {"coverage", c.rate()},
        {"coverage_band", band_json(c.band)},
        {"median_error", c.median_error},
        {"p90_error", c.ninetieth_error},
        {"too_few", c.too_few},
        {"chance", c.too_few ? json::Value() : json::Value(c.chance)},
        {"below_promise", c.accused}};
  }
  return value;
}

json::Value place_json(const Judgement& j, const std::optional<Place>& place) {
  if (!place) return nullptr;
  json::Value value = cell_json(j, j.cell(*place));
  value["cell"] = name_of(j, *place);
  return value;
}

}  // namespace

std::string judgement_summary(const Judgement& j) {
  std::string out;
  for (size_t q = 0; q < j.quantities.size(); ++q) out += quantity_line(j, q);
  out += verdict_line(j);
  if (j.outside.count > 0) out += "  without these conditions: " + wrong_text(j, j.outside) + "\n";
  return out;
}

std::string judgement_text(const Judgement& j) {
  std::string out = judgement_summary(j);
  for (const Grid& grid : j.grids) {
    for (size_t q = 0; q < j.quantities.size(); ++q) {
      const std::string& name = j.quantities[q].name;
      out += table(j, grid, name + ": intervals that hold, % (band) of cases",
                   [q](const Cell& cell) { return coverage_words(cell.quantities[q]); });
      out += table(j, grid, name + ": relative error, %, median / nine of ten below",
                   [q](const Cell& cell) { return error_words(cell.quantities[q]); });
    }
    out += table(j, grid, j.wrong_means.empty() ? "refused" : "refused, and number reported but wrong",
                 [&](const Cell& cell) {
                   return j.wrong_means.empty() ? verdict_words(cell).substr(0, verdict_words(cell).find(','))
                                                : verdict_words(cell);
                 });
  }
  return out;
}

std::string judgement_csv(const Judgement& j) {
  std::string csv =
      "condition_x,x_from,x_to,x,condition_y,y_from,y_to,y,quantity,cases,reported,promise,judged,inside,"
      "coverage,coverage_low,coverage_high,median_error,p90_error,chance,too_few,below_promise\n";
  add_csv(j, ",,,all,,,,,", j.all, csv);
  if (j.outside.count > 0) add_csv(j, ",,,without these conditions,,,,,", j.outside, csv);
  for (const Grid& grid : j.grids)
    for (size_t y = 0; y < grid.y.size(); ++y)
      for (size_t x = 0; x < grid.x.size(); ++x) {
        const auto side = [&](const Axis& axis, size_t i) {
          return csv_text(j.conditions[axis.condition].name) + "," + csv_number(axis.edges[i]) + "," +
                 csv_number(axis.edges[i + 1]) + "," + csv_text(axis.labels[i]) + ",";
        };
        add_csv(j, side(grid.x, x) + (grid.single ? ",,,," : side(grid.y, y)), grid.at(x, y), csv);
      }
  return csv;
}

json::Value judgement_json(const Judgement& j) {
  json::Value value = {{"wrong_means", j.wrong_means},
                       {"fewest", j.options.fewest},
                       {"band_level", j.options.level},
                       {"accuse_at", j.options.accuse_at},
                       {"all", cell_json(j, j.all)}};
  if (j.outside.count > 0) value["without_conditions"] = cell_json(j, j.outside);
  value["worst"] = json::Value::object();
  for (size_t q = 0; q < j.quantities.size(); ++q) {
    value["worst"][j.quantities[q].name] = place_json(j, j.worst[q]);
    value["promise"][j.quantities[q].name] = j.quantities[q].promise;
  }
  value["worst_wrong"] = place_json(j, j.worst_wrong);
  value["grids"] = json::Value::array();
  for (const Grid& grid : j.grids) {
    json::Value one = {{"x", {{"name", j.conditions[grid.x.condition].name}, {"steps", grid.x.labels}}}};
    if (!grid.single) one["y"] = {{"name", j.conditions[grid.y.condition].name}, {"steps", grid.y.labels}};
    one["cells"] = json::Value::array();
    for (const Cell& cell : grid.cells) one["cells"].push_back(cell_json(j, cell));
    value["grids"].push_back(std::move(one));
  }
  return value;
}

std::string cases_csv(const Cases& cases) {
  std::string csv;
  for (const Condition& c : cases.conditions) {
    const bool also_estimated = std::any_of(cases.quantities.begin(), cases.quantities.end(),
                                            [&](const Quantity& q) { return q.name == c.name; });
    csv += csv_text((also_estimated ? "true_" : "") + c.name) + ",";
  }
  for (const Quantity& q : cases.quantities)
    csv += q.name + "_truth," + q.name + "," + q.name + "_low," + q.name + "_high,";
  const bool groups =
      std::any_of(cases.cases.begin(), cases.cases.end(), [](const JudgedCase& c) { return c.group > 0; });
  csv += std::string("verdict") + (cases.wrong_means.empty() ? "" : ",wrong") + (groups ? ",group\n" : "\n");
  for (const JudgedCase& one : cases.cases) {
    for (size_t c = 0; c < cases.conditions.size(); ++c) {
      const std::vector<std::string>& labels = cases.conditions[c].labels;
      const double value = one.conditions[c];
      const bool named = std::isfinite(value) && static_cast<size_t>(std::max(value, 0.0)) < labels.size();
      csv += (named ? csv_text(labels[static_cast<size_t>(value)]) : exact_number(value)) + ",";
    }
    for (const JudgedValue& v : one.values)
      for (const double number : {v.truth, v.value, v.low, v.high}) csv += exact_number(number) + ",";
    csv += one.reported ? "reported" : "refused";
    if (!cases.wrong_means.empty()) csv += text(",%d", one.wrong);
    csv += groups ? text(",%zu\n", one.group) : "\n";
  }
  return csv;
}

}  // namespace palpate::judge
