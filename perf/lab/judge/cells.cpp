#include "perf/lab/judge/cells.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <span>

#include "engine/base/text.h"
#include "palpate/error.h"

namespace palpate::judge {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr size_t kDraws = 999;

/// To three digits, downwards or upwards.
double rounded(double value, bool up) {
  if (value == 0) return 0;
  const double digit = std::pow(10, std::floor(std::log10(std::abs(value))) - 2), steps = value / digit;
  const double whole = std::round(steps);
  if (std::abs(whole - steps) < 1e-9) return whole * digit;
  return (up ? std::ceil(steps) : std::floor(steps)) * digit;
}

std::string number(double value) {
  return text("%.4g", value);
}

/// Each of the numbers as a step of its own, [v, next v).
Axis axis_of_values(size_t condition, const std::set<double>& values,
                    const std::vector<std::string>& labels) {
  Axis axis;
  axis.condition = condition;
  for (const double v : values) {
    axis.edges.push_back(v);
    const auto i = static_cast<size_t>(std::max(v, 0.0));
    axis.labels.push_back(i < labels.size() ? labels[i] : number(v));
  }
  axis.edges.push_back(std::nextafter(*values.rbegin(), std::numeric_limits<double>::infinity()));
  return axis;
}

Axis axis_of(const Cases& cases, size_t condition, size_t bins) {
  std::vector<double> values;
  for (const JudgedCase& c : cases.cases)
    if (std::isfinite(c.conditions[condition])) values.push_back(c.conditions[condition]);
  const Condition& named = cases.conditions[condition];
  if (values.empty())
    throw Error(Failure::Usage, "a condition that at least one case has",
                "'" + named.name + "', which none has", "--by with another");
  std::sort(values.begin(), values.end());
  const std::set<double> different(values.begin(), values.end());
  if (!named.labels.empty() || different.size() <= bins + 2)
    return axis_of_values(condition, different, named.labels);
  Axis axis;
  axis.condition = condition;
  axis.edges = {rounded(values.front(), false)};
  for (size_t b = 1; b < bins; ++b) {
    const double edge = rounded(values[b * values.size() / bins], false);
    if (edge > axis.edges.back()) axis.edges.push_back(edge);
  }
  axis.edges.push_back(rounded(values.back(), true));
  for (size_t i = 0; i + 1 < axis.edges.size(); ++i)
    axis.labels.push_back(number(axis.edges[i]) + " to " + number(axis.edges[i + 1]));
  axis.edges.back() = std::nextafter(axis.edges.back(), std::numeric_limits<double>::infinity());
  return axis;
}

/// The conditions that are asked for, by their places.
std::vector<size_t> chosen(const Cases& cases, const CellOptions& options) {
  std::vector<std::string> names;
  names.reserve(cases.conditions.size());
  for (const Condition& c : cases.conditions) names.push_back(c.name);
  std::vector<size_t> places;
  for (const std::string& name : options.by.empty() ? names : options.by) {
    const auto at = std::find(names.begin(), names.end(), name);
    std::string all;
    for (const std::string& one : names) all += (all.empty() ? "" : ", ") + one;
    if (at == names.end())
      throw Error(Failure::Usage, "a condition of these cases", "'" + name + "'" + did_you_mean(name, names),
                  "--by with any of " + all);
    const auto place = static_cast<size_t>(at - names.begin());
    if (std::find(places.begin(), places.end(), place) != places.end())
      throw Error(Failure::Usage, "each condition once", "'" + name + "' twice", "--by with any of " + all);
    places.push_back(place);
  }
  if (places.empty()) throw Error(Failure::Usage, "a condition to judge by", "none", "--by NAME,NAME");
  return places;
}

bool is_judged(const JudgedCase& c, size_t quantity) {
  const JudgedValue& v = c.values[quantity];
  return c.reported && !std::isnan(v.truth) && !std::isnan(v.low) && !std::isnan(v.high);
}

bool is_inside(const JudgedValue& v) {
  return v.low <= v.truth && v.truth <= v.high;
}

/// Linear between the values; NaN of none.
double quantile(std::span<const double> sorted, double fraction) {
  if (sorted.empty()) return kNaN;
  const double at = fraction * static_cast<double>(sorted.size() - 1);
  const auto i = static_cast<size_t>(at);
  const double next = sorted[std::min(i + 1, sorted.size() - 1)];
  return sorted[i] + (at - static_cast<double>(i)) * (next - sorted[i]);
}

Cell cell_of(const Cases& cases, std::span<const size_t> members, const CellOptions& options) {
  Cell cell;
  cell.count = members.size();
  for (const size_t i : members) {
    cell.refused += !cases.cases[i].reported;
    cell.wrong += cases.cases[i].reported && cases.cases[i].wrong;
  }
  cell.refused_band = exact_band(cell.refused, cell.count, options.level);
  cell.wrong_band = exact_band(cell.wrong, cell.reported(), options.level);
  for (size_t q = 0; q < cases.quantities.size(); ++q) {
    Coverage coverage;
    std::vector<double> errors;
    for (const size_t i : members) {
      const JudgedCase& c = cases.cases[i];
      const JudgedValue& v = c.values[q];
      if (is_judged(c, q)) {
        ++coverage.judged;
        coverage.inside += is_inside(v);
      }
      const double error = std::abs(v.value / v.truth - 1);
      if (c.reported && v.truth != 0 && std::isfinite(error)) errors.push_back(error);
    }
    std::sort(errors.begin(), errors.end());
    coverage.median_error = quantile(errors, 0.5);
    coverage.ninetieth_error = quantile(errors, 0.9);
    coverage.band = exact_band(coverage.inside, coverage.judged, options.level);
    coverage.too_few = coverage.judged < options.fewest;
    cell.quantities.push_back(coverage);
  }
  return cell;
}

/// Grids and, of each case, its cell in each of them; `nowhere` where it has none.
struct Sorted {
  static constexpr size_t nowhere = static_cast<size_t>(-1);
  std::vector<std::vector<size_t>> cell_of;  // by grid, by case
};

Sorted fill(const Cases& cases, Judgement& judgement) {
  Sorted sorted;
  std::vector<size_t> everyone(cases.cases.size()), lacking;
  std::vector<bool> lacks(cases.cases.size());
  for (size_t i = 0; i < everyone.size(); ++i) everyone[i] = i;
  for (Grid& grid : judgement.grids) {
    const size_t count = grid.x.size() * (grid.single ? 1 : grid.y.size());
    std::vector<std::vector<size_t>> members(count);
    std::vector<size_t> places(cases.cases.size(), Sorted::nowhere);
    for (size_t i = 0; i < cases.cases.size(); ++i) {
      const auto& conditions = cases.cases[i].conditions;
      const std::optional<size_t> x = grid.x.step_of(conditions[grid.x.condition]);
      const std::optional<size_t> y = grid.single ? 0 : grid.y.step_of(conditions[grid.y.condition]);
      if (!x || !y) {
        lacks[i] = true;
        continue;
      }
      places[i] = *y * grid.x.size() + *x;
      members[places[i]].push_back(i);
    }
    for (const auto& one : members) grid.cells.push_back(cell_of(cases, one, judgement.options));
    sorted.cell_of.push_back(std::move(places));
  }
  for (size_t i = 0; i < lacks.size(); ++i)
    if (lacks[i]) lacking.push_back(i);
  judgement.all = cell_of(cases, everyone, judgement.options);
  judgement.outside = cell_of(cases, lacking, judgement.options);
  return sorted;
}

/// Probability of at most k inside of n, for each k.
std::vector<double> tails(size_t n, double promise) {
  std::vector<double> all(n + 1);
  double sum = 0;
  for (size_t k = 0; k <= n; ++k) {
    const auto of = static_cast<double>(n), in = static_cast<double>(k);
    sum += std::exp(std::lgamma(of + 1) - std::lgamma(in + 1) - std::lgamma(of - in + 1) +
                    in * std::log(promise) + (of - in) * std::log1p(-promise));
    all[k] = std::min(sum, 1.0);
  }
  return all;
}

/// For each cell the chance that any cell of the quantity has a tail as improbable as its own, were the
/// promise kept in all.
void judge_quantity(const Cases& cases, const Sorted& sorted, size_t q, Judgement& judgement) {
  const double promise = cases.quantities[q].promise;
  struct Counted {
    Coverage* coverage;
    std::vector<double> tail;
    size_t inside = 0;
  };
  std::vector<std::vector<Counted>> grids;
  for (Grid& grid : judgement.grids) {
    grids.emplace_back();
    for (Cell& cell : grid.cells) {
      Coverage& coverage = cell.quantities[q];
      grids.back().push_back({&coverage, {}, 0});
      if (!coverage.too_few) grids.back().back().tail = tails(coverage.judged, promise);
    }
  }
  std::vector<size_t> judged;
  for (size_t i = 0; i < cases.cases.size(); ++i)
    if (is_judged(cases.cases[i], q)) judged.push_back(i);
  std::stable_sort(judged.begin(), judged.end(),
                   [&](size_t a, size_t b) { return cases.cases[a].group < cases.cases[b].group; });
  std::mt19937_64 random(judgement.options.seed * 1000003 + q);
  std::vector<double> least;
  for (size_t draw = 0; draw < kDraws; ++draw) {
    for (auto& grid : grids)
      for (Counted& cell : grid) cell.inside = 0;
    bool inside = false;
    for (size_t n = 0; n < judged.size(); ++n) {
      const size_t i = judged[n], group = cases.cases[i].group;
      if (n == 0 || group == 0 || group != cases.cases[judged[n - 1]].group)
        inside = static_cast<double>(random() >> 11) * 0x1p-53 < promise;
      for (size_t g = 0; inside && g < grids.size(); ++g)
        if (const size_t c = sorted.cell_of[g][i]; c != Sorted::nowhere) ++grids[g][c].inside;
    }
    double lowest = 1;
    for (const auto& grid : grids)
      for (const Counted& cell : grid)
        if (!cell.tail.empty()) lowest = std::min(lowest, cell.tail[cell.inside]);
    least.push_back(lowest);
  }
  std::sort(least.begin(), least.end());
  for (auto& grid : grids)
    for (Counted& cell : grid) {
      if (cell.tail.empty()) continue;
      const double own = cell.tail[cell.coverage->inside] * (1 + 1e-12);
      const auto as_low = std::upper_bound(least.begin(), least.end(), own) - least.begin();
      cell.coverage->chance = static_cast<double>(1 + as_low) / static_cast<double>(1 + kDraws);
      cell.coverage->accused = cell.coverage->chance <= judgement.options.accuse_at;
    }
}

/// The place of the smallest `rank`, of cells that have one.
template <typename Rank>
std::optional<Place> least_place(const Judgement& judgement, const Rank& rank) {
  std::optional<Place> place;
  double least = std::numeric_limits<double>::infinity();
  for (size_t g = 0; g < judgement.grids.size(); ++g) {
    const Grid& grid = judgement.grids[g];
    for (size_t c = 0; c < grid.cells.size(); ++c) {
      const std::optional<double> here = rank(grid.cells[c]);
      if (!here || !(*here < least)) continue;
      least = *here;
      place = Place{g, c % grid.x.size(), c / grid.x.size()};
    }
  }
  return place;
}

void find_worst(Judgement& judgement) {
  for (size_t q = 0; q < judgement.quantities.size(); ++q) {
    const auto of = [q](bool accused) {
      return [q, accused](const Cell& cell) -> std::optional<double> {
        const Coverage& c = cell.quantities[q];
        if (c.too_few || (accused && !c.accused)) return std::nullopt;
        return c.band.high;
      };
    };
    std::optional<Place> place = least_place(judgement, of(true));
    if (!place) place = least_place(judgement, of(false));
    judgement.worst.push_back(place);
  }
  judgement.worst_wrong = least_place(judgement, [&](const Cell& cell) -> std::optional<double> {
    if (cell.reported() < judgement.options.fewest || cell.wrong == 0) return std::nullopt;
    return -cell.wrong_band.low;
  });
}

void check(const Cases& cases, const CellOptions& o) {
  if (cases.cases.empty())
    throw Error(Failure::Input, "judged cases", "none", "a table with a line for each case");
  if (o.bins < 1 || o.bins > 20)
    throw Error(Failure::Usage, "1 to 20 steps of a condition", std::to_string(o.bins), "--bins 4");
  if (o.fewest < 1) throw Error(Failure::Usage, "a case or more in a judged cell", "0", "--fewest 20");
  for (const double share : {o.level, o.accuse_at})
    if (!(share > 0 && share < 1))
      throw Error(Failure::Usage, "a fraction between 0 and 1", number(share), "0.9");
  for (const Quantity& q : cases.quantities)
    if (!(q.promise > 0 && q.promise < 1))
      throw Error(Failure::Usage, "a promised coverage between 0 and 1", number(q.promise), "--promise 0.9");
}

}  // namespace

std::optional<size_t> Axis::step_of(double value) const {
  if (!(value >= edges.front() && value < edges.back())) return std::nullopt;
  return static_cast<size_t>(std::upper_bound(edges.begin(), edges.end(), value) - edges.begin()) - 1;
}

double Coverage::rate() const {
  return judged > 0 ? static_cast<double>(inside) / static_cast<double>(judged) : kNaN;
}

Judgement judge_cells(const Cases& cases, const CellOptions& options) {
  check(cases, options);
  Judgement judgement;
  judgement.options = options;
  judgement.conditions = cases.conditions;
  judgement.quantities = cases.quantities;
  judgement.wrong_means = cases.wrong_means;
  std::vector<Axis> axes;
  for (const size_t condition : chosen(cases, options))
    axes.push_back(axis_of(cases, condition, options.bins));
  for (size_t a = 0; a < axes.size(); ++a)
    for (size_t b = a + 1; b < axes.size(); ++b) judgement.grids.push_back({axes[a], axes[b], false, {}});
  if (axes.size() == 1) judgement.grids.push_back({axes[0], {0, {}, {"all"}}, true, {}});
  const Sorted sorted = fill(cases, judgement);
  for (size_t q = 0; q < cases.quantities.size(); ++q) judge_quantity(cases, sorted, q, judgement);
  find_worst(judgement);
  return judgement;
}

std::string name_of(const Judgement& judgement, const Place& place) {
  const Grid& grid = judgement.grids[place.grid];
  std::string name = judgement.conditions[grid.x.condition].name + " " + grid.x.labels[place.x];
  if (!grid.single) name += ", " + judgement.conditions[grid.y.condition].name + " " + grid.y.labels[place.y];
  return name;
}

}  // namespace palpate::judge
