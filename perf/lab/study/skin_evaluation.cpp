#include "perf/lab/study/skin_evaluation.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "engine/base/numbers.h"
#include "engine/base/statistics.h"
#include "engine/base/text.h"

namespace palpate::lump {
namespace {

using SkinKey = std::array<double, 3>;  // thickness in mm, ratio, and grip of the plate

constexpr double kSticks = 10;  // grip of a plate that does, more than any friction

constexpr size_t kMostSkins = 16;  // that each have a row of their own
constexpr double kThick_mm = 2;

double grip(const Example& e) {
  return e.plate_sticks ? kSticks : e.plate_friction;
}

SkinKey exact_key(const Example& e) {
  return e.skin ? SkinKey{e.skin->thickness_mm, e.skin->stiffness_ratio, grip(e)} : SkinKey{0, 1, grip(e)};
}

SkinKey rough_key(const Example& e) {
  if (!e.skin) return {0, 1, grip(e)};
  return {e.skin->thickness_mm > kThick_mm ? 2.0 : 1.0, e.skin->stiffness_ratio > 1 ? 2.0 : 0.5, grip(e)};
}

double middle(std::vector<double> values) {
  return values.empty() ? kNaN : median(std::move(values));
}

void count_verdict(const Judged& j, SkinRow& row) {
  if (!j.truth.lump) {
    ++row.plain;
    row.alarms += reports_numbers(j.estimate.verdict);
    return;
  }
  ++row.lumps;
  switch (j.estimate.verdict) {
    case Status::Found:
    case Status::StiffnessOpen:
      ++row.reported;
      break;
    case Status::OutsideTraining:
      ++row.outside;
      break;
    case Status::Inconsistent:
      ++row.inconsistent;
      break;
    case Status::NoLump:
      ++row.no_lump;
      break;
    default:
      ++row.other;
  }
}

SkinRow row_of(const std::vector<const Judged*>& judged) {
  SkinRow row;
  row.skin_mm = row.ratio = {HUGE_VAL, 0};
  std::array<std::vector<double>, 3> errors, moves, widths;
  std::array<size_t, 3> held{};
  std::vector<double> young;
  for (const Judged* j : judged) {
    const auto [skin_mm, ratio, grips] = exact_key(j->truth);
    row.plate = grips == kSticks ? "sticks" : grips > 0 ? text("%.3g", grips) : std::string("slides");
    row.skin_mm = {std::min(row.skin_mm[0], skin_mm), std::max(row.skin_mm[1], skin_mm)};
    row.ratio = {std::min(row.ratio[0], ratio), std::max(row.ratio[1], ratio)};
    count_verdict(*j, row);
    if (j->estimate.tissue) young.push_back(j->estimate.tissue->young_Pa.value / j->truth.young_Pa - 1);
    if (!j->truth.lump || !reports_numbers(j->estimate.verdict)) continue;
    const auto truth = truth_of(j->truth);
    const auto values = values_of(j->estimate);
    for (size_t p = 0; p < 3; ++p) {
      held[p] += truth[p] >= values[p].low && truth[p] <= values[p].high;
      moves[p].push_back(values[p].value / truth[p] - 1);
      errors[p].push_back(std::abs(moves[p].back()));
      widths[p].push_back(values[p].high / values[p].low);
    }
  }
  for (size_t p = 0; p < 3; ++p) {
    row.median[p] = middle(errors[p]);
    row.moved[p] = middle(moves[p]);
    row.width[p] = middle(widths[p]);
    row.held[p] = row.reported > 0 ? static_cast<double>(held[p]) / static_cast<double>(row.reported) : kNaN;
  }
  row.young_moved = middle(young);
  return row;
}

std::string range_text(const std::array<double, 2>& range) {
  return range[0] == range[1] ? text("%.3g", range[0]) : text("%.3g to %.3g", range[0], range[1]);
}

}  // namespace

std::vector<SkinRow> skin_rows(const std::vector<Judged>& judged) {
  std::set<SkinKey> skins;
  for (const Judged& j : judged) skins.insert(exact_key(j.truth));
  std::map<SkinKey, std::vector<const Judged*>> groups;
  for (const Judged& j : judged)
    groups[skins.size() <= kMostSkins ? exact_key(j.truth) : rough_key(j.truth)].push_back(&j);
  std::vector<SkinRow> rows;
  rows.reserve(groups.size());
  for (const auto& [key, group] : groups) rows.push_back(row_of(group));
  return rows;
}

std::string skin_text(const std::vector<SkinRow>& rows) {
  std::string out =
      "skin, mm      ratio         plate    lumps  reported  outside  inconsistent  no lump  other   "
      "d, h, ratio moved by, %    intervals hold, %\n";
  for (const SkinRow& r : rows) {
    out += text("%-13s %-13s %-6s %6zu %9zu %8zu %13zu %8zu %6zu   ", range_text(r.skin_mm).c_str(),
                range_text(r.ratio).c_str(), r.plate.c_str(), r.lumps, r.reported, r.outside, r.inconsistent,
                r.no_lump, r.other);
    out += text("%+6.1f %+6.1f %+6.1f       ", 100 * r.moved[0], 100 * r.moved[1], 100 * r.moved[2]);
    out += text("%4.0f %4.0f %4.0f", 100 * r.held[0], 100 * r.held[1], 100 * r.held[2]);
    if (std::isfinite(r.young_moved)) out += text("   modulus %+.1f %%", 100 * r.young_moved);
    if (r.plain > 0) out += text("   alarms %zu of %zu", r.alarms, r.plain);
    out += "\n";
  }
  return out;
}

std::string skin_csv(const std::vector<SkinRow>& rows) {
  std::string csv =
      "skin_low_mm,skin_high_mm,ratio_low,ratio_high,lumps,reported,outside,inconsistent,no_lump,other,"
      "size_error,depth_error,ratio_error,size_moved,depth_moved,ratio_moved,size_held,depth_held,ratio_held,"
      "size_width,depth_width,ratio_width,young_moved,plain,alarms,plate\n";
  for (const SkinRow& r : rows) {
    csv +=
        text("%.4g,%.4g,%.4g,%.4g,", r.skin_mm[0], r.skin_mm[1], r.ratio[0], r.ratio[1]) +
        text("%zu,%zu,%zu,%zu,%zu,%zu", r.lumps, r.reported, r.outside, r.inconsistent, r.no_lump, r.other);
    for (const auto& three : {r.median, r.moved, r.held, r.width})
      for (const double value : three)
        csv += "," + (std::isfinite(value) ? text("%.4g", value) : std::string());
    csv += "," + (std::isfinite(r.young_moved) ? text("%.4g", r.young_moved) : std::string()) +
           text(",%zu,%zu,", r.plain, r.alarms) + r.plate + "\n";
  }
  return csv;
}

json::Value skin_json(const std::vector<SkinRow>& rows) {
  json::Value all = json::Value::array();
  for (const SkinRow& r : rows)
    all.push_back({{"skin_mm", r.skin_mm},
                   {"ratio", r.ratio},
                   {"plate", r.plate},
                   {"lumps", r.lumps},
                   {"reported", r.reported},
                   {"outside", r.outside},
                   {"inconsistent", r.inconsistent},
                   {"no_lump", r.no_lump},
                   {"other", r.other},
                   {"median_error", r.median},
                   {"moved", r.moved},
                   {"held", r.held},
                   {"width", r.width},
                   {"young_moved", r.young_moved},
                   {"without_lump", r.plain},
                   {"alarms", r.alarms}});
  return {{"rows", all}};
}

}  // namespace palpate::lump
