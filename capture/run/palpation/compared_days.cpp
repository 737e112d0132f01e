#include "capture/run/palpation/compared_days.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "capture/files/estimate_report.h"
#include "capture/files/lump_maps.h"
#include "engine/base/normal.h"
#include "engine/base/text.h"
#include "engine/lump/estimator.h"
#include "palpate/error.h"

namespace palpate {
namespace {

json::Value change_json(const lump::LumpChange& c) {
  json::Value v = {{"verdict", to_string(c.verdict)}, {"sentence", sentence_of(c)}, {"reasons", c.reasons}};
  if (!has_numbers(c)) return v;
  v["size_mm"] = interval_json(c.size_mm);
  v["depth_mm"] = interval_json(c.depth_mm);
  v["size_factor"] = interval_json(c.factor[0]);
  v["depth_factor"] = interval_json(c.factor[1]);
  v["ratio_factor"] = interval_json(c.factor[2]);
  v["ratio_changed"] = c.ratio_changed;
  v["least_growth_mm"] = c.least_mm;
  v["moved_mm"] = c.moved_mm;
  return v;
}

/// The mean of logarithms, each weighed by its interval; and half an interval as a share, that of the surest.
std::pair<double, double> mean_of(const std::vector<lump::Value>& values) {
  double weights = 0, sum = 0, surest = 0.5;
  for (const lump::Value& v : values) {
    const double share = std::log(v.high / v.value), weight = 1 / std::max(1e-9, share * share);
    weights += weight;
    sum += weight * std::log(v.value);
    surest = std::min(surest, share);
  }
  return {std::exp(sum / weights), surest};
}

/// A value lies more than three standard errors from another.
bool unlike(const lump::Value& value, double other) {
  const double half =
      other > value.value ? std::log(value.high / value.value) : std::log(value.value / value.low);
  return std::abs(std::log(other / value.value)) > 3 / kNormal90 * half;
}

/// The tissue is the same on all days: where one found it by the way of the plate, all days are told what
/// they say together, and `errors` how far that may be off.
void share_tissue(std::vector<ComparedDay>& days, lump::ErrorSources& errors) {
  std::vector<lump::Value> young, thickness;
  bool found = false;
  for (const ComparedDay& one : days) {
    const lump::Observation& o = one.day.observation;
    const auto stated = [](double value, double share) {
      return lump::Value{value, value * (1 - share), value * (1 + share)};
    };
    if (one.day.estimate.verdict == lump::Status::Inconsistent) continue;
    found = found || one.day.estimate.tissue;
    if (!one.day.estimate.tissue && !(o.young_Pa > 0)) continue;
    const lump::Tissue tissue = one.day.estimate.tissue.value_or(
        lump::Tissue{stated(o.young_Pa, errors.young), stated(o.block_mm[2], errors.thickness)});
    young.push_back(tissue.young_Pa);
    thickness.push_back(tissue.thickness_mm);
  }
  if (!found) return;
  const auto [young_Pa, young_share] = mean_of(young);
  const auto [thickness_mm, thickness_share] = mean_of(thickness);
  errors.young = young_share;
  errors.thickness = thickness_share;
  for (ComparedDay& one : days) {
    lump::Estimate& estimate = one.day.estimate;
    if (estimate.verdict == lump::Status::Inconsistent) continue;
    if (estimate.tissue && unlike(estimate.tissue->young_Pa, young_Pa)) {
      estimate.verdict = lump::Status::Inconsistent;
      estimate.reasons = {
          text("the tissue's modulus is %.3g Pa on this day, %.3g Pa on all days together: another "
               "block, or tissue that has aged, dried or warmed",
               estimate.tissue->young_Pa.value, young_Pa)};
      continue;
    }
    one.day.observation.young_Pa = young_Pa;
    one.day.observation.block_mm[2] = thickness_mm;
    one.day.observation.press_mm.clear();
  }
}

}  // namespace

std::vector<ComparedDay> compare_days(const std::vector<std::filesystem::path>& folders,
                                      lump::ErrorSources errors, const std::filesystem::path& network) {
  if (folders.size() < 2)
    throw Error(Failure::Usage, "two days or more", std::to_string(folders.size()),
                "palpate lump compare out/may out/june");
  const auto loaded = lump::load_network(network.string());
  std::vector<ComparedDay> days;
  days.reserve(folders.size());
  for (const std::filesystem::path& folder : folders)
    days.push_back({folder.string(), {read_observation(folder), {}}, {}});
  const auto estimate_all = [&](bool apart) {
    const lump::Estimator estimator = lump::named_estimator("refined", loaded, errors);
    for (ComparedDay& one : days)
      if (apart == !one.day.observation.press_mm.empty()) one.day.estimate = estimator(one.day.observation);
  };
  estimate_all(true);
  share_tissue(days, errors);
  estimate_all(false);
  for (size_t d = 1; d < days.size(); ++d)
    days[d].change = compare(*loaded, days.front().day, days[d].day, errors);
  return days;
}

bool has_numbers(const lump::LumpChange& change) {
  return std::isfinite(change.factor[0].value);
}

json::Value days_json(const std::vector<ComparedDay>& days) {
  json::Value all = json::Value::array();
  for (const ComparedDay& one : days) {
    json::Value v = {{"day", one.name}, {"estimate", facts_of(one.day.estimate).json}};
    if (&one != &days.front()) v["change"] = change_json(one.change);
    all.push_back(v);
  }
  return {{"days", all}};
}

}  // namespace palpate
