#include "capture/files/lump_maps.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "capture/files/csv_table.h"
#include "capture/files/npy.h"
#include "engine/base/json.h"
#include "engine/base/statistics.h"
#include "engine/base/text.h"
#include "engine/lump/dataset/sweep.h"
#include "engine/lump/error_sources.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr size_t kMostNodes = 4096;  // along a side
constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();

fem::Map read_table(const std::filesystem::path& file) {
  const std::string wanted = "a table of pressures in Pa, as many numbers in each line";
  const auto refuse = [&](const std::string& found) {
    throw Error(Failure::Input, wanted, found + " in " + file.string(), "a .npy file or a table of numbers");
  };
  CsvTable table(file, wanted, {.header = false, .width = CsvWidth::Any});
  fem::Map map;
  std::string cut;  // the first line whose numbers seem to be cut at decimal commas
  bool points = false;
  while (table.next()) {
    if (cut.empty() && table.seems_cut()) cut = table.where();
    for (const std::string& cell : table.cells()) points = points || cell.find('.') != std::string::npos;
    const auto cells = static_cast<uint32_t>(table.cells().size());
    if (cells > kMostNodes) refuse("a line of more than 4096 numbers");
    if (map.height == 0) map.width = cells;
    if (cells != map.width)
      refuse("lines of " + std::to_string(map.width) + " and of " + std::to_string(cells) + " numbers");
    if (++map.height > kMostNodes) refuse("more than 4096 lines");
    for (uint32_t i = 0; i < cells; ++i)
      map.values.push_back(static_cast<float>(table.number_if_any(i).value_or(kNotANumber)));
  }
  if (map.height == 0) refuse("nothing");
  if (!cut.empty() && !points)
    throw Error(Failure::Input, wanted, cut + ", where decimal commas cut numbers in two",
                "decimal points, or semicolons between the numbers");
  return map;
}

}  // namespace

fem::Map read_pressure_map(const std::filesystem::path& file, double pitch_mm) {
  fem::Map map;
  if (file.extension() == ".npy") {
    NpyArray array = read_npy(file);
    if (array.shape.size() != 2 || array.shape[0] > kMostNodes || array.shape[1] > kMostNodes)
      throw Error(Failure::Input, "a map of height x width values",
                  describe_shape(array.shape) + " in " + file.string(), "one map a file");
    map.height = static_cast<uint32_t>(array.shape[0]);
    map.width = static_cast<uint32_t>(array.shape[1]);
    map.values = std::move(array.values);
  } else {
    map = read_table(file);
  }
  map.pitch_mm = {pitch_mm, pitch_mm};
  return map;
}

std::string estimate_text(const lump::Estimate& e) {
  std::string line;
  std::string text = std::string("verdict: ") + to_string(e.verdict) + "\n";
  line = palpate::text("evidence for a lump: %.3g (1 and more in %.3g %% of observations without one)\n",
                       e.detection_statistic, 100 * e.false_alarm_rate);
  text += line;
  if (e.detection_statistic >= 1 && std::isfinite(e.size_mm.value) &&
      e.verdict != lump::Status::Inconsistent) {
    if (!reports_numbers(e.verdict))
      text += "if it were one lump as in the training data, which it is not:\n";
    text += "                     value    90 % interval\n";
    const auto row = [&](const char* name, const lump::Value& v, const char* unit) {
      line = palpate::text("%-18s %7.3g    %.3g to %.3g %s\n", name, v.value, v.low, v.high, unit);
      text += line;
    };
    row("size", e.size_mm, "mm");
    row("depth of its top", e.depth_mm, "mm");
    row("stiffness ratio", e.stiffness_ratio, "times the tissue's modulus");
    row("centre x", e.x_mm, "mm from the block's middle");
    row("centre y", e.y_mm, "mm from the block's middle");
    text += "shape:";
    for (size_t s = 0; s < 4; ++s) {
      line = palpate::text("%s %s %.0f %%", s > 0 ? "," : "", to_string(static_cast<fem::InclusionShape>(s)),
                           100 * e.shape_probability[s]);
      text += line;
    }
    text += "\n";
  }
  for (const std::string& reason : e.reasons) text += "note: " + reason + "\n";
  for (const lump::InputEffect& effect : e.input_effects) text += effect_text(effect) + "\n";
  line = palpate::text("method: %s, %.3g ms\n", e.method.c_str(), 1e3 * e.wall_s);
  return text + line + "For research, not a diagnosis.\n";
}

std::string estimate_json(const lump::Estimate& e) {
  using Json = json::Value;
  const auto value = [&e](const lump::Value& v) {
    return e.verdict != lump::Status::Inconsistent && std::isfinite(v.value) && v.high > 0 - 1e300 &&
                   (v.value != 0 || v.low != 0 || v.high != 0)
               ? Json{{"value", v.value}, {"low", v.low}, {"high", v.high}}
               : Json(nullptr);
  };
  Json json{{"verdict", to_string(e.verdict)},
            {"evidence", e.detection_statistic},
            {"false_alarm_rate", e.false_alarm_rate},
            {"size_mm", value(e.size_mm)},
            {"depth_mm", value(e.depth_mm)},
            {"stiffness_ratio", value(e.stiffness_ratio)},
            {"x_mm", value(e.x_mm)},
            {"y_mm", value(e.y_mm)},
            {"shape", to_string(e.shape)}};
  for (size_t s = 0; s < 4; ++s)
    json["shape_probability"][to_string(static_cast<fem::InclusionShape>(s))] = e.shape_probability[s];
  json["method"] = e.method;
  json["wall_s"] = e.wall_s;
  json["bumps_mm"] = e.bumps_mm;
  json["reasons"] = e.reasons;
  json["input_effects"] = Json::array();
  const auto changes = [](const std::array<double, 3>& c) {
    return std::isfinite(c[0]) ? Json{{"size", c[0]}, {"depth", c[1]}, {"stiffness_ratio", c[2]}}
                               : Json(nullptr);
  };
  for (const lump::InputEffect& effect : e.input_effects)
    json["input_effects"].push_back({{"input", effect.input},
                                     {"error", effect.error},
                                     {"lower", changes(effect.lower)},
                                     {"higher", changes(effect.higher)}});
  return json.dump(2);
}

}  // namespace palpate
