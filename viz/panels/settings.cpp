#include "viz/panels/settings.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "capture/files/output_file.h"
#include "capture/open_source.h"
#include "engine/base/json.h"

namespace palpate::viz {
namespace {

using Json = json::Value;
namespace fs = std::filesystem;

constexpr int kVersion = 1;

/// Takes what is there and makes sense; notes what does not.
class Reader {
 public:
  explicit Reader(const Json& json) : json_(json) {}

  void flag(const char* key, bool& to) {
    if (const Json* v = find(key)) v->is_boolean() ? void(to = v->get<bool>()) : complain(key);
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
  template <typename Enum>
  void choice(const char* key, Enum& to, int count) {
    const Json* v = find(key);
    if (!v) return;
    for (int i = 0; i < count; ++i)
      if (v->is_string() && v->get<std::string>() == to_string(static_cast<Enum>(i))) {
        to = static_cast<Enum>(i);
        return;
      }
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

/// A path as it is found again from another folder; other inputs as they are.
std::string absolute_input(const std::string& input) {
  if (!is_recording(input)) return input;
  std::error_code code;
  const fs::path whole = fs::absolute(input, code);
  return code ? input : whole.lexically_normal().string();
}

std::string trouble_of(const Json& json, Settings& s) {
  Reader r(json);
  r.number("width", s.width, 480, 16384);
  r.number("height", s.height, 320, 16384);
  r.number("text_scale", s.text_scale, ViewState::kLeastTextScale, ViewState::kMostTextScale);
  r.choice("colour_map", s.map, kColourMaps);
  r.choice("colours", s.quantity, kQuantities);
  r.flag("light", s.lit);
  r.flag("grid", s.grid);
  r.flag("axes", s.axes);
  r.flag("charts", s.charts);
  r.flag("section", s.section);
  r.flag("contacts", s.contacts);
  r.flag("skin", s.skin);
  r.choice("skin_strain", s.skin_strain, kSkinStrains);
  r.flag("controls", s.controls);
  r.flag("rates", s.rates);
  r.number("chart_span_s", s.chart_span_s, 1, 60);
  if (const Json* line = r.list("section_line")) {
    bool good = line->size() == 4;
    std::array<double, 4> v{};
    for (size_t i = 0; good && i < 4; ++i) {
      good = (*line)[i].is_number();
      if (good) v[i] = (*line)[i].get<double>();
      good = good && v[i] >= 0 && v[i] <= 1;
    }
    if (good)
      s.line = {v[0], v[1], v[2], v[3]};
    else
      r.complain("section_line");
  }
  if (const Json* recent = r.list("recent")) {
    for (const Json& one : *recent) {
      const bool good = one.is_object() && one.contains("input") && one["input"].is_string() &&
                        (!one.contains("sensor") || one["sensor"].is_string());
      if (!good)
        r.complain("recent");
      else if (s.recent.size() < Settings::kMostRecent)
        s.recent.push_back({one["input"].text(), one.contains("sensor") ? one["sensor"].text() : ""});
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

void Settings::take_from(const ViewState& v) {
  text_scale = v.text_scale;
  map = v.map;
  // A quantity that this sensor cannot show stays as it was chosen with one that can.
  if (v.can_show(quantity)) quantity = v.quantity;
  lit = v.lit, grid = v.grid, axes = v.axes;
  charts = v.charts, section = v.section, contacts = v.contacts, skin = v.skin, controls = v.controls;
  rates = v.rates;
  if (v.can_show_skin) skin_strain = v.skin_strain;
  chart_span_s = v.chart_span_s;
  line = v.line;
}

void Settings::apply_to(ViewState& v) const {
  v.text_scale = text_scale;
  v.map = map;
  v.quantity = v.can_show(quantity) ? quantity : Quantity::Depth;
  v.lit = lit, v.grid = grid, v.axes = axes;
  v.charts = charts, v.section = section, v.contacts = contacts, v.skin = skin, v.controls = controls;
  v.rates = rates;
  v.skin_strain = v.can_show_skin ? skin_strain : SkinStrain::Off;
  v.chart_span_s = chart_span_s;
  v.line = line;
}

void Settings::remember(const std::string& input, const fs::path& sensor) {
  const std::string file = sensor.empty() ? std::string() : absolute_input(sensor.string());
  const Recent now{absolute_input(input), file};
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
  for (const Settings::Recent& r : s.recent) recent.push_back(Json{{"input", r.input}, {"sensor", r.sensor}});
  const Json json = {{"palpate_window", kVersion},
                     {"width", s.width},
                     {"height", s.height},
                     {"text_scale", s.text_scale},
                     {"colour_map", to_string(s.map)},
                     {"colours", to_string(s.quantity)},
                     {"light", s.lit},
                     {"grid", s.grid},
                     {"axes", s.axes},
                     {"charts", s.charts},
                     {"section", s.section},
                     {"contacts", s.contacts},
                     {"skin", s.skin},
                     {"skin_strain", to_string(s.skin_strain)},
                     {"controls", s.controls},
                     {"rates", s.rates},
                     {"chart_span_s", s.chart_span_s},
                     {"section_line", Json::array({s.line.x0, s.line.y0, s.line.x1, s.line.y1})},
                     {"recent", recent},
                     {"sensors", s.sensors},
                     {"folder", s.folder}};
  if (file.has_parent_path()) make_output_folder(file.parent_path());
  write_whole(file, json.dump(2, json::Utf8::Replace) + "\n");
}

}  // namespace palpate::viz
