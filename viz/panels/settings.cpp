#include "viz/panels/settings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <type_traits>
#include <variant>

#include "capture/files/output_file.h"
#include "capture/open_source.h"
#include "engine/base/json.h"

namespace palpate::viz {
namespace {

using Json = json::Value;
namespace fs = std::filesystem;

constexpr int kVersion = 1;

constexpr int count_of(Quantity) {
  return kQuantities;
}
constexpr int count_of(ColourMap) {
  return kColourMaps;
}
constexpr int count_of(Arrangement) {
  return kArrangements;
}
constexpr int count_of(TractionArrows) {
  return kTractionArrows;
}
constexpr int count_of(SkinStrain) {
  return kSkinStrains;
}

template <typename Enum>
Json written(Enum value) requires std::is_enum_v<Enum> {
  return to_string(value);
}
template <typename Plain>
Json written(Plain value) requires std::is_arithmetic_v<Plain> {
  return value;
}
Json written(const SectionLine& line) {
  return Json::array({line.x0, line.y0, line.x1, line.y1});
}

/// Takes what is there and makes sense; notes what does not.
class Reader {
 public:
  explicit Reader(const Json& json) : json_(json) {}

  void read(const ViewSetting& setting, bool& to) {
    if (const Json* v = find(setting.name))
      v->is_boolean() ? void(to = v->boolean()) : complain(setting.name);
  }
  template <std::floating_point Number>
  void read(const ViewSetting& setting, Number& to) {
    number(setting.name, to, setting.least, setting.most);
  }
  template <typename Enum>
  void read(const ViewSetting& setting, Enum& to) {
    const Json* v = find(setting.name);
    if (!v) return;
    for (int i = 0; i < count_of(to); ++i)
      if (v->is_string() && v->text() == to_string(static_cast<Enum>(i))) {
        to = static_cast<Enum>(i);
        return;
      }
    complain(setting.name);
  }
  void read(const ViewSetting& setting, SectionLine& to) {
    const Json* v = find(setting.name);
    if (!v) return;
    std::array<double, 4> ends{};
    try {
      v->get_to(ends);
    } catch (const json::Error&) {
      ends[0] = -1;
    }
    if (std::ranges::all_of(ends, [](double x) { return x >= 0 && x <= 1; }))
      to = {ends[0], ends[1], ends[2], ends[3]};
    else
      complain(setting.name);
  }
  template <typename Number>
  void number(const char* key, Number& to, double least, double most) {
    const Json* v = find(key);
    if (!v) return;
    const double value = v->is_number() ? v->get<double>() : NAN;
    if (value >= least && value <= most)
      to = static_cast<Number>(value);
    else
      complain(key);
  }
  void words(const char* key, std::string& to) {
    if (const Json* v = find(key)) v->is_string() ? void(to = v->get<std::string>()) : complain(key);
  }
  const Json* list(const char* key) {
    const Json* v = find(key);
    if (v && !v->is_array()) complain(key);
    return v && v->is_array() ? v : nullptr;
  }
  void complain(const char* key) {
    if (trouble_.empty()) trouble_ = std::string("'") + key + "' makes no sense";
  }
  const std::string& trouble() const { return trouble_; }

 private:
  const Json* find(const char* key) const { return json_.find(key); }
  const Json& json_;
  std::string trouble_;
};

std::string trouble_of(const Json& json, Settings& s) {
  Reader r(json);
  r.number("width", s.width, 480, 16384);
  r.number("height", s.height, 320, 16384);
  for (const ViewSetting& setting : view_settings())
    std::visit([&](auto member) { r.read(setting, s.view.*member); }, setting.member);
  if (const Json* recent = r.list("recent")) {
    for (const Json& one : *recent) {
      const bool good = one.is_object() && one.contains("input") && one["input"].is_string() &&
                        (!one.contains("sensor") || one["sensor"].is_string()) &&
                        (!one.contains("largest_N") || one["largest_N"].is_number());
      if (!good)
        r.complain("recent");
      else if (s.recent.size() < Settings::kMostRecent)
        s.recent.push_back({one["input"].text(), one.contains("sensor") ? one["sensor"].text() : "",
                            one.contains("largest_N") ? one["largest_N"].get<double>() : 0});
    }
  }
  if (const Json* sensors = r.list("sensors")) {
    for (const Json& one : *sensors) {
      if (!one.is_string())
        r.complain("sensors");
      else if (s.sensors.size() < Settings::kMostRecent)
        s.sensors.push_back(one.get<std::string>());
    }
  }
  r.words("folder", s.folder);
  return r.trouble();
}

}  // namespace

std::string absolute_input(const std::string& input) {
  if (!is_recording(input)) return input;
  std::error_code code;
  const fs::path whole = fs::absolute(input, code);
  return code ? input : whole.lexically_normal().string();
}

void Settings::remember(const std::string& input, const fs::path& sensor) {
  const std::string file = sensor.empty() ? std::string() : absolute_input(sensor.string());
  Recent now{absolute_input(input), file};
  for (const Recent& r : recent)
    if (r.input == now.input) now.largest_N = r.largest_N;
  forget(now);
  recent.insert(recent.begin(), now);
  if (recent.size() > kMostRecent) recent.resize(kMostRecent);
  if (file.empty()) return;
  std::erase(sensors, file);
  sensors.insert(sensors.begin(), file);
  if (sensors.size() > kMostRecent) sensors.resize(kMostRecent);
}

void Settings::forget(const Recent& one) {
  std::erase_if(recent, [&](const Recent& r) { return r.input == one.input; });
}

fs::path settings_file() {
  const auto variable = [](const char* name) {
    const char* value = std::getenv(name);
    return std::string(value ? value : "");
  };
  if (const std::string file = variable("PALPATE_CONFIG"); !file.empty()) return file == "none" ? "" : file;
  if (const std::string home = variable("XDG_CONFIG_HOME"); !home.empty() && fs::path(home).is_absolute())
    return fs::path(home) / "palpate" / "window.json";
  if (const std::string home = variable("HOME"); !home.empty())
    return fs::path(home) / ".config" / "palpate" / "window.json";
  return {};
}

LoadedSettings load_settings(const fs::path& file) {
  LoadedSettings loaded;
  std::error_code code;
  if (file.empty() || !fs::exists(file, code)) return loaded;
  std::ifstream in(file, std::ios::binary);
  std::ostringstream bytes;
  bytes << in.rdbuf();
  Json json;
  try {
    json = json::parse(bytes.str(), {.deepest = 16});
  } catch (const json::Error&) {
    json = nullptr;
  }
  std::string trouble;
  if (!json.is_object())
    trouble = "it is no JSON object";
  else if (!json.contains("palpate_window") || !(json["palpate_window"] == kVersion))
    trouble = "it is of another version";
  else
    trouble = trouble_of(json, loaded.settings);
  if (!trouble.empty())
    loaded.warning = "the window's settings in '" + file.string() + "' are not all used: " + trouble +
                     "; the rest is as on the first run";
  return loaded;
}

void save_settings(const Settings& s, const fs::path& file) {
  if (file.empty()) return;
  Json recent = Json::array();
  for (const Settings::Recent& r : s.recent)
    recent.push_back(Json{{"input", r.input}, {"sensor", r.sensor}, {"largest_N", r.largest_N}});
  Json json = {{"palpate_window", kVersion}, {"width", s.width}, {"height", s.height}};
  for (const ViewSetting& setting : view_settings())
    std::visit([&](auto member) { json[setting.name] = written(s.view.*member); }, setting.member);
  json["recent"] = recent;
  json["sensors"] = s.sensors;
  json["folder"] = s.folder;
  if (file.has_parent_path()) make_output_folder(file.parent_path());
  write_whole(file, json.dump(2, json::Utf8::Replace) + "\n");
}

}  // namespace palpate::viz
