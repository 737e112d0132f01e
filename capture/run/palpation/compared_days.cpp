#include "capture/run/palpation/compared_days.h"

#include <cmath>

#include "capture/files/estimate_report.h"
#include "capture/files/lump_maps.h"
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

}  // namespace

std::vector<ComparedDay> compare_days(const std::vector<std::filesystem::path>& folders,
                                      const lump::ErrorSources& errors,
                                      const std::filesystem::path& network) {
  if (folders.size() < 2)
    throw Error(Failure::Usage, "two days or more", std::to_string(folders.size()),
                "palpate lump compare out/may out/june");
  const auto loaded = lump::load_network(network.string());
  const lump::Estimator estimator = lump::named_estimator("refined", loaded, errors);
  std::vector<ComparedDay> days;
  for (const std::filesystem::path& folder : folders) {
    ComparedDay one{folder.string(), {read_observation(folder), {}}, {}};
    one.day.estimate = estimator(one.day.observation);
    if (!days.empty()) one.change = compare(*loaded, days.front().day, one.day, errors);
    days.push_back(std::move(one));
  }
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
