#include "capture/files/estimate_report.h"

#include <cmath>

#include "engine/base/text.h"
#include "engine/lump/error_sources.h"

namespace palpate {
namespace {

using Json = json::Value;

Json to_json(const lump::Value& v) {
  const bool known =
      std::isfinite(v.value) && v.high > 0 - 1e300 && (v.value != 0 || v.low != 0 || v.high != 0);
  return known ? interval_json(v) : Json(nullptr);
}

Json to_json(const lump::InputEffect& effect) {
  const auto changes = [](const std::array<double, 3>& c) {
    return std::isfinite(c[0]) ? Json{{"size", c[0]}, {"depth", c[1]}, {"stiffness_ratio", c[2]}}
                               : Json(nullptr);
  };
  return {{"input", effect.input},
          {"error", effect.error},
          {"lower", changes(effect.lower)},
          {"higher", changes(effect.higher)}};
}

/// "size_mm".
std::string key_of(const EstimateQuantity& q) {
  return std::string(q.name) + (*q.unit ? "_" : "") + q.unit;
}

/// One lump of several by itself.
Json lump_json(const lump::Estimate& e) {
  Json one = {{"verdict", to_string(e.verdict)}, {"shape", to_string(e.shape)}, {"reasons", e.reasons}};
  for (const EstimateQuantity& q : quantities_of(e)) one[key_of(q)] = to_json(q.value);
  Json chances = Json::object(), effects = Json::array();
  for (size_t s = 0; s < 4; ++s) chances[to_string(static_cast<InclusionShape>(s))] = e.shape_probability[s];
  one["shape_probability"] = chances;
  for (const lump::InputEffect& effect : e.input_effects) effects.push_back(to_json(effect));
  one["input_effects"] = effects;
  return one;
}

std::string lump_text(const lump::Estimate& e, size_t number) {
  std::string block = text("lump %zu: %s\n", number, to_string(e.verdict));
  if (std::isfinite(e.size_mm.value)) {
    for (const EstimateQuantity& q : quantities_of(e))
      block += text("  %-18s %7.3g    %.3g to %.3g %s\n", q.label, q.value.value, q.value.low, q.value.high,
                    q.of_what);
    block += text("  shape: %s %.0f %%\n", to_string(e.shape),
                  100 * e.shape_probability[static_cast<size_t>(e.shape)]);
  }
  for (const std::string& reason : e.reasons) block += "  note: " + reason + "\n";
  return block;
}

/// Each lump that has numbers; one alone is there too, in words it is what the whole report says.
void add_lumps(const lump::Estimate& e, Facts& facts) {
  Json lumps = Json::array();
  std::string blocks;
  for (const lump::Estimate& each : lumps_of(e)) {
    lumps.push_back(lump_json(each));
    if (!e.lumps.empty()) blocks += lump_text(each, lumps.size());
  }
  facts.add("lumps", lumps, blocks.empty() ? "" : "each lump              value    90 % interval\n" + blocks);
}

void add_shape(const lump::Estimate& e, bool shown, Facts& facts) {
  facts.add("shape", to_string(e.shape));
  Json chances = Json::object();
  std::string line;
  for (size_t s = 0; s < 4; ++s) {
    const char* shape = to_string(static_cast<InclusionShape>(s));
    chances[shape] = e.shape_probability[s];
    line += text("%s %s %.0f %%", s > 0 ? "," : "shape:", shape, 100 * e.shape_probability[s]);
  }
  facts.add("shape_probability", chances, shown ? line + "\n" : "");
}

}  // namespace

Json interval_json(const lump::Value& v) {
  return {{"value", v.value}, {"low", v.low}, {"high", v.high}};
}

Json limit_json(const lump::DetectionLimit& limit) {
  return {{"depth_mm", limit.depth_mm},
          {"stiffness_ratio", limit.stiffness_ratio},
          {"size_mm", std::isnan(limit.size_mm) ? Json(nullptr) : Json(limit.size_mm)}};
}

std::array<EstimateQuantity, 5> quantities_of(const lump::Estimate& e) {
  constexpr const char* kFromMiddle = "mm from the block's middle";
  return {{{"size", "size", e.size_mm, "mm", "mm"},
           {"depth", "depth of its top", e.depth_mm, "mm", "mm"},
           {"stiffness_ratio", "stiffness ratio", e.stiffness_ratio, "", "times the tissue's modulus"},
           {"x", "centre x", e.x_mm, "mm", kFromMiddle},
           {"y", "centre y", e.y_mm, "mm", kFromMiddle}}};
}

std::vector<lump::Estimate> lumps_of(const lump::Estimate& e) {
  if (!e.lumps.empty()) return e.lumps;
  return reports_numbers(e.verdict) ? std::vector{e} : std::vector<lump::Estimate>{};
}

std::string lumps_csv(const lump::Estimate& e) {
  std::string csv = "lump,verdict,shape";
  for (const EstimateQuantity& q : quantities_of(e)) {
    const std::string name = key_of(q);
    for (const char* part : {"", "_low", "_high"}) csv.append(",").append(name).append(part);
  }
  csv += "\n";
  size_t number = 0;
  for (const lump::Estimate& each : lumps_of(e)) {
    csv += text("%zu,%s,%s", ++number, to_string(each.verdict), to_string(each.shape));
    for (const EstimateQuantity& q : quantities_of(each))
      csv += std::isfinite(q.value.value) ? text(",%.9g,%.9g,%.9g", q.value.value, q.value.low, q.value.high)
                                          : std::string(",,,");
    csv += "\n";
  }
  return csv;
}

Facts facts_of(const lump::Estimate& e) {
  Facts facts;
  const bool consistent = e.verdict != lump::Status::Inconsistent;
  const bool shown = e.detection_statistic >= 1 && std::isfinite(e.size_mm.value) && consistent;
  facts.add("verdict", to_string(e.verdict), std::string("verdict: ") + to_string(e.verdict) + "\n");
  facts.add("evidence", e.detection_statistic);
  facts.add("false_alarm_rate", e.false_alarm_rate,
            text("evidence for a lump: %.3g (1 and more in %.3g %% of observations without one)\n",
                 e.detection_statistic, 100 * e.false_alarm_rate));
  if (shown && !reports_numbers(e.verdict))
    facts.say("if it were one lump as in the training data, which it is not:\n");
  if (shown) facts.say("                     value    90 % interval\n");
  for (const EstimateQuantity& q : quantities_of(e)) {
    const std::string row = text("%-18s %7.3g    %.3g to %.3g %s\n", q.label, q.value.value, q.value.low,
                                 q.value.high, q.of_what);
    facts.add(key_of(q), consistent ? to_json(q.value) : Json(nullptr), shown ? row : "");
  }
  if (e.tissue) {
    const auto& [young, thickness] = *e.tissue;
    facts.add(
        "tissue", {{"young_Pa", interval_json(young)}, {"thickness_mm", interval_json(thickness)}},
        text("tissue by the way of the plate: modulus %.4g Pa (%.4g to %.4g), thickness %.3g mm (%.3g to "
             "%.3g)\n",
             young.value, young.low, young.high, thickness.value, thickness.low, thickness.high));
  }
  add_shape(e, shown, facts);
  add_lumps(e, facts);
  if (e.separable_from_mm > 0) facts.add("separable_from_mm", e.separable_from_mm);
  facts.add("method", e.method);
  facts.add("wall_s", e.wall_s);
  facts.add("bumps_mm", e.bumps_mm);
  std::string notes, effects;
  for (const std::string& reason : e.reasons) notes += "note: " + reason + "\n";
  facts.add("reasons", e.reasons, notes);
  Json limits = Json::array();
  for (const lump::DetectionLimit& limit : e.detection_limits) limits.push_back(limit_json(limit));
  facts.add("detection_limits", limits);
  Json changes = Json::array();
  for (const lump::InputEffect& effect : e.input_effects) {
    changes.push_back(to_json(effect));
    effects += effect_text(effect) + "\n";
  }
  facts.add("input_effects", changes, effects);
  facts.say(text("method: %s, %.3g ms\n", e.method.c_str(), 1e3 * e.wall_s) +
            "For research, not a diagnosis.\n");
  return facts;
}

Json to_json(const std::vector<PressAnswer>& presses) {
  Json all = Json::array();
  for (const PressAnswer& p : presses) {
    Json press = {{"press", p.press},
                  {"first_frame", p.first_frame},
                  {"last_frame", p.last_frame},
                  {"time_s", p.time_s},
                  {"highest_N", p.highest_N},
                  {"loads_N", p.loads_N},
                  {"saturated_share", p.saturated_fraction},
                  {"finished", !p.unfinished}};
    if (p.estimate)
      press["estimate"] = facts_of(*p.estimate).json;
    else
      press["trouble"] = p.trouble;
    all.push_back(std::move(press));
  }
  return all;
}

}  // namespace palpate
