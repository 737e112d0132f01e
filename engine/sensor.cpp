#include "engine/sensor.h"

#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "engine/error.h"
#include "engine/solve/elastic_kernel.h"

namespace palpate {
namespace {

using Json = nlohmann::json;

constexpr int kVersion = 1;
constexpr double kHuge = 1e12;

[[noreturn]] void fail(const std::string& where, const std::string& wanted, const std::string& found,
                       const std::string& remedy = "correcting that key; README.md explains each") {
  throw Error(Failure::Sensor, where + ": " + wanted, found, remedy);
}

/// A value for a message: short, one line, ASCII. What is nested may be nested deeper than a stack is, and is
/// only counted.
std::string shown(const Json& value) {
  for (const Json& part : value) {
    if (value.is_structured() && part.is_structured())
      return (value.is_array() ? "a list of " : "an object of ") + std::to_string(value.size());
  }
  std::string text = value.dump(-1, ' ', true);
  return text.size() > 60 ? text.substr(0, 57) + "..." : text;
}

std::string number_text(double value) {
  std::ostringstream out;
  out << value;
  return out.str();
}

/// One JSON object being read: every key is asked for by name, with its range, and what nobody asked for is
/// an error.
class Reader {
 public:
  Reader(const Json& object, std::string where) : object_(object), where_(std::move(where)) {
    if (!object.is_object()) fail(where_, "an object { ... }", shown(object));
  }

  bool has(const char* key) {
    known_.insert(key);
    return object_.contains(key);
  }
  const Json& at(const char* key) {
    if (!has(key)) fail(where_ + "." + key, "this key", "none");
    return object_.at(key);
  }
  std::string path(const char* key) const { return where_ + "." + key; }

  double number(const char* key, double low, double high, const char* unit) {
    return checked(at(key), path(key), low, high, unit);
  }
  void number(const char* key, double low, double high, const char* unit, double& value) {
    if (has(key)) value = number(key, low, high, unit);
  }
  void whole(const char* key, uint32_t low, uint32_t high, const char* unit, uint32_t& value) {
    if (has(key)) value = checked_whole(at(key), path(key), low, high, unit);
  }
  std::string text(const char* key) {
    const Json& value = at(key);
    if (!value.is_string()) fail(path(key), "a text", shown(value));
    return value.get<std::string>();
  }
  template <typename Enum, size_t N>
  void choice(const char* key, const std::array<Enum, N>& options, Enum& value) {
    if (!has(key)) return;
    const std::string found = text(key);
    std::string names;
    for (const Enum option : options) {
      if (found == to_string(option)) {
        value = option;
        return;
      }
      names += (names.empty() ? "" : ", ") + std::string(to_string(option));
    }
    fail(path(key), "one of " + names, shown(found));
  }
  const Json& array(const char* key, size_t size, const char* meaning) {
    const Json& value = at(key);
    if (!value.is_array() || value.size() != size)
      fail(path(key), "a list of " + std::to_string(size) + ": " + meaning, shown(value));
    return value;
  }

  static double checked(const Json& value, const std::string& where, double low, double high,
                        const char* unit) {
    const std::string wanted = "a number from " + number_text(low) + " to " + number_text(high) +
                               (*unit ? " " + std::string(unit) : "");
    if (!value.is_number()) fail(where, wanted, shown(value));
    const double number = value.get<double>();
    if (!(number >= low && number <= high)) fail(where, wanted, shown(value));
    return number;
  }
  static uint32_t checked_whole(const Json& value, const std::string& where, uint32_t low, uint32_t high,
                                const char* unit) {
    const double number = checked(value, where, low, high, unit);
    if (number != std::floor(number)) fail(where, "a whole number", shown(value));
    return static_cast<uint32_t>(number);
  }

  void finish() const {
    for (const auto& [key, value] : object_.items()) {
      if (known_.contains(key)) continue;
      std::string names;
      for (const std::string& name : known_) names += (names.empty() ? "" : ", ") + name;
      fail(where_, "only known keys (" + names + ")", shown(key), "removing or renaming it");
    }
  }

 private:
  const Json& object_;
  std::string where_;
  std::set<std::string> known_;
};

constexpr std::array kSignals{Signal::Brighter, Signal::Darker, Signal::Either};
constexpr std::array kFilters{Filter::Binomial5, Filter::None};
constexpr std::array kBackgroundKinds{BackgroundKind::Untouched, BackgroundKind::None};
constexpr std::array kReadings{Reading::None, Reading::Shading, Reading::Photometric, Reading::Elastic};

void read_weights(Reader& reader, const char* key, std::array<std::array<double, 3>, 3>& weights) {
  const Json& rows = reader.array(key, 3, "for red, green, blue");
  for (size_t channel = 0; channel < 3; ++channel) {
    const std::string where = reader.path(key) + "[" + std::to_string(channel) + "]";
    if (!rows[channel].is_array() || rows[channel].size() != 3)
      fail(where, "a list of 3: 1, X, Y", shown(rows[channel]));
    for (size_t term = 0; term < 3; ++term)
      weights[channel][term] = Reader::checked(rows[channel][term], where, -1e6, 1e6, "");
  }
}

void read_frame(const Json& json, const std::string& where, Sensor& sensor) {
  Reader frame(json, where);
  if (frame.has("crop_px")) {
    const Json& crop = frame.array("crop_px", 4, "x, y, width, height");
    sensor.crop_px.emplace();
    for (size_t i = 0; i < 4; ++i)
      (*sensor.crop_px)[i] =
          Reader::checked_whole(crop[i], frame.path("crop_px"), i < 2 ? 0 : 1, kMaxSide_px, "px");
  }
  if (frame.has("quad_px")) {
    const Json& quad = frame.array("quad_px", 4, "corners top left, top right, bottom right, bottom left");
    sensor.quad_px.emplace();
    for (size_t i = 0; i < 4; ++i) {
      if (!quad[i].is_array() || quad[i].size() != 2)
        fail(frame.path("quad_px"), "corners as [x, y]", shown(quad[i]));
      for (size_t k = 0; k < 2; ++k)
        (*sensor.quad_px)[i][k] =
            Reader::checked(quad[i][k], frame.path("quad_px"), -double{kMaxSide_px}, kMaxSide_px, "px");
    }
  }
  if (frame.has("size_px")) {
    const Json& size = frame.array("size_px", 2, "width, height");
    for (size_t i = 0; i < 2; ++i)
      sensor.size_px[i] = Reader::checked_whole(size[i], frame.path("size_px"), 1, kMaxSide_px, "px");
  }
  frame.whole("channels", 1, 3, "", sensor.channels);
  frame.whole("bit_depth", 8, 16, "bits", sensor.bit_depth);
  frame.finish();
}

void read_background(const Json& json, const std::string& where, BackgroundSource& background) {
  Reader reader(json, where);
  reader.choice("source", kBackgroundKinds, background.kind);
  if (background.kind == BackgroundKind::None) {
    for (const char* key : {"image", "first_frames"})
      if (reader.has(key)) fail(reader.path(key), "no such key with source 'none'", "it");
  }
  if (reader.has("image")) background.image = reader.text("image");
  reader.whole("first_frames", 1, 10000, "frames", background.first_frames);
  reader.finish();
}

void read_contact(const Json& json, const std::string& where, Sensor& sensor) {
  Reader contact(json, where);
  contact.choice("signal", kSignals, sensor.signal);
  contact.choice("filter", kFilters, sensor.filter);
  contact.number("threshold_gray", 0, 65535, "gray levels", sensor.threshold_gray);
  contact.whole("saturation_gray", 1, 65535, "gray levels", sensor.saturation_gray);
  contact.finish();
}

void read_surface(const Json& json, const std::string& where, Sensor& sensor) {
  Reader surface(json, where);
  surface.choice("reading", kReadings, sensor.reading);
  surface.number("max_slope", 1e-3, 1e3, "", sensor.max_slope);
  if (surface.has("shadow_gray"))
    surface.whole("shadow_gray", 0, 65535, "gray levels", sensor.shadow_gray.emplace());
  if (surface.has("shading")) {
    Reader shading(surface.at("shading"), surface.path("shading"));
    sensor.shading.facing_gray = shading.number("facing_gray", 1e-3, 65535, "gray levels");
    shading.number("depth_gain", 1e-6, 1e6, "", sensor.shading.depth_gain);
    shading.finish();
  }
  if (surface.has("photometric")) {
    Reader photometric(surface.at("photometric"), surface.path("photometric"));
    read_weights(photometric, "wx", sensor.photometric.wx);
    read_weights(photometric, "wy", sensor.photometric.wy);
    photometric.number("normal_sd", 0, 1, "", sensor.photometric.normal_sd);
    photometric.finish();
  }
  if (surface.has("elastic")) {
    Reader elastic(surface.at("elastic"), surface.path("elastic"));
    ElasticCalibration& pad = sensor.elastic;
    pad.gray_per_MPa = elastic.number("gray_per_MPa", 1e-9, kHuge, "gray levels per MPa");
    elastic.number("limit_gray", 1e-3, 1e9, "gray levels", pad.limit_gray);
    pad.young_MPa = elastic.number("young_MPa", 1e-9, 1e9, "MPa");
    elastic.number("poisson", 0, 0.5, "", pad.poisson);
    elastic.number("thickness_mm", 1e-6, 1e6, "mm", pad.thickness_mm);
    elastic.number("relative_sd", 0, 10, "", pad.relative_sd);
    elastic.finish();
  }
  surface.finish();
}

PadOutline read_pad(const Json& json, const std::string& where) {
  Reader reader(json, where);
  const auto numbers = [](const Json& list, const std::string& at, double low, double high) {
    std::vector<double> values;
    for (const Json& value : list) values.push_back(Reader::checked(value, at, low, high, "px"));
    return values;
  };
  constexpr double kFar_px = 4.0 * kMaxSide_px;
  std::vector<PadOutline> found;
  if (reader.has("rectangle_px")) {
    const auto v = numbers(reader.array("rectangle_px", 4, "x, y, width, height"),
                           reader.path("rectangle_px"), -kFar_px, kFar_px);
    found.emplace_back(PadRectangle{v[0], v[1], v[2], v[3]});
  }
  if (reader.has("circle_px")) {
    const auto v =
        numbers(reader.array("circle_px", 3, "x, y, radius"), reader.path("circle_px"), -kFar_px, kFar_px);
    found.emplace_back(PadEllipse{v[0], v[1], v[2], v[2], 0});
  }
  if (reader.has("ellipse_px")) {
    const auto v = numbers(reader.array("ellipse_px", 5, "x, y, radius, other radius, angle in rad"),
                           reader.path("ellipse_px"), -kFar_px, kFar_px);
    found.emplace_back(PadEllipse{v[0], v[1], v[2], v[3], v[4]});
  }
  if (reader.has("polygon_px")) {
    const Json& corners = reader.at("polygon_px");
    PadPolygon polygon;
    if (!corners.is_array() || corners.size() < 3 || corners.size() > 1000)
      fail(reader.path("polygon_px"), "3 to 1000 corners as [x, y]", shown(corners));
    for (const Json& corner : corners) {
      if (!corner.is_array() || corner.size() != 2)
        fail(reader.path("polygon_px"), "corners as [x, y]", shown(corner));
      const auto v = numbers(corner, reader.path("polygon_px"), -kFar_px, kFar_px);
      polygon.corners.push_back({v[0], v[1]});
    }
    found.emplace_back(polygon);
  }
  reader.finish();
  if (found.size() != 1)
    fail(where, "one outline: rectangle_px, circle_px, ellipse_px or polygon_px",
         std::to_string(found.size()));
  return found.front();
}

Json to_json(const PadOutline& outline) {
  if (const auto* r = std::get_if<PadRectangle>(&outline))
    return {{"rectangle_px", {r->x, r->y, r->width, r->height}}};
  if (const auto* e = std::get_if<PadEllipse>(&outline))
    return {{"ellipse_px", {e->x, e->y, e->radius_x, e->radius_y, e->angle_rad}}};
  return {{"polygon_px", std::get<PadPolygon>(outline).corners}};
}

ForceCalibration read_force(const Json& json, const std::string& where) {
  Reader reader(json, where);
  ForceCalibration force;
  force.c1_N_per_gray = reader.number("c1_N_per_gray", -kHuge, kHuge, "N per gray level");
  force.c0_N = reader.number("c0_N", -1e6, 1e6, "N");
  force.residual_sd_N = reader.number("residual_sd_N", 0, 1e6, "N");
  if (reader.has("covariance")) {
    const Json& covariance = reader.array("covariance", 3, "var(c0), cov(c0, c1), var(c1)");
    for (size_t i = 0; i < 3; ++i)
      force.covariance[i] =
          Reader::checked(covariance[i], reader.path("covariance"), i == 1 ? -kHuge : 0, kHuge, "");
  }
  force.gray_min = reader.number("gray_min", 0, 1e16, "gray levels");
  force.gray_max = reader.number("gray_max", 0, 1e16, "gray levels");
  reader.finish();
  return force;
}

ShearCalibration read_shear(const Json& json, const std::string& where) {
  Reader reader(json, where);
  ShearCalibration shear;
  shear.kx_N_per_mm = reader.number("kx_N_per_mm", 1e-9, 1e6, "N per mm");
  shear.ky_N_per_mm = reader.number("ky_N_per_mm", 1e-9, 1e6, "N per mm");
  shear.friction = reader.number("friction", 0, 100, "");
  reader.number("relative_sd", 0, 10, "", shear.relative_sd);
  reader.finish();
  return shear;
}

Json to_json(const Sensor& s) {
  Json frame{{"channels", s.channels}, {"bit_depth", s.bit_depth}};
  if (s.crop_px) frame["crop_px"] = *s.crop_px;
  if (s.quad_px) frame["quad_px"] = *s.quad_px;
  if (s.size_px[0] > 0) frame["size_px"] = s.size_px;
  Json background{{"source", to_string(s.background.kind)}};
  if (s.background.kind == BackgroundKind::Untouched) background["first_frames"] = s.background.first_frames;
  if (!s.background.image.empty()) background["image"] = s.background.image;
  Json surface{{"reading", to_string(s.reading)}, {"max_slope", s.max_slope}};
  if (s.shadow_gray) surface["shadow_gray"] = *s.shadow_gray;
  if (s.reading == Reading::Shading || s.shading.facing_gray != 0)
    surface["shading"] = {{"facing_gray", s.shading.facing_gray}, {"depth_gain", s.shading.depth_gain}};
  const PhotometricCalibration none;
  if (s.reading == Reading::Photometric || s.photometric.wx != none.wx || s.photometric.wy != none.wy)
    surface["photometric"] = {
        {"wx", s.photometric.wx}, {"wy", s.photometric.wy}, {"normal_sd", s.photometric.normal_sd}};
  if (s.reading == Reading::Elastic || s.elastic.gray_per_MPa != 0) {
    Json elastic{{"gray_per_MPa", s.elastic.gray_per_MPa},
                 {"young_MPa", s.elastic.young_MPa},
                 {"poisson", s.elastic.poisson},
                 {"relative_sd", s.elastic.relative_sd}};
    if (s.elastic.limit_gray != 0) elastic["limit_gray"] = s.elastic.limit_gray;
    if (s.elastic.thickness_mm != 0) elastic["thickness_mm"] = s.elastic.thickness_mm;
    surface["elastic"] = elastic;
  }
  Json json{{"palpate_sensor", kVersion},
            {"name", s.name},
            {"pitch_mm_per_px", s.pitch_mm_per_px},
            {"frame", frame},
            {"background", background},
            {"contact",
             {{"signal", to_string(s.signal)},
              {"filter", to_string(s.filter)},
              {"threshold_gray", s.threshold_gray},
              {"saturation_gray", s.saturation_gray}}},
            {"surface", surface}};
  if (s.pad) json["pad"] = to_json(*s.pad);
  if (s.force) {
    json["force"] = {{"c1_N_per_gray", s.force->c1_N_per_gray}, {"c0_N", s.force->c0_N},
                     {"residual_sd_N", s.force->residual_sd_N}, {"covariance", s.force->covariance},
                     {"gray_min", s.force->gray_min},           {"gray_max", s.force->gray_max}};
  }
  if (s.shear) {
    json["shear"] = {{"kx_N_per_mm", s.shear->kx_N_per_mm},
                     {"ky_N_per_mm", s.shear->ky_N_per_mm},
                     {"friction", s.shear->friction},
                     {"relative_sd", s.shear->relative_sd}};
  }
  return json;
}

/// What no single key can tell: that the keys fit each other.
void check_together(const Sensor& s, const std::string& where) {
  const auto require = [&](bool fits, const char* key, const std::string& wanted, const std::string& found) {
    if (!fits) fail(where + "." + key, wanted, found);
  };
  require(s.channels == 1 || s.channels == 3, "frame.channels", "1 or 3", std::to_string(s.channels));
  require(s.channels == 1 || s.bit_depth == 8, "frame.bit_depth", "8 for colour",
          std::to_string(s.bit_depth));
  require(!s.quad_px || (s.size_px[0] > 0 && s.size_px[1] > 0), "frame.size_px",
          "the size of the rectified frame, with quad_px", "none");
  const double full_scale = (1u << s.bit_depth) - 1;
  require(s.threshold_gray >= 0 && s.threshold_gray <= full_scale, "contact.threshold_gray",
          "0 to " + number_text(full_scale) + " gray levels", number_text(s.threshold_gray));
  require(s.saturation_gray >= 1 && s.saturation_gray <= full_scale, "contact.saturation_gray",
          "1 to " + number_text(full_scale) + " gray levels", std::to_string(s.saturation_gray));
  require(!s.shadow_gray || *s.shadow_gray * 2 <= full_scale, "surface.shadow_gray",
          "0 to " + number_text(std::floor(full_scale / 2)) + " gray levels",
          std::to_string(s.shadow_gray.value_or(0)));
  if (s.pad) {
    const auto* rectangle = std::get_if<PadRectangle>(&*s.pad);
    const auto* ellipse = std::get_if<PadEllipse>(&*s.pad);
    const auto* polygon = std::get_if<PadPolygon>(&*s.pad);
    require(!rectangle || (rectangle->width >= 1 && rectangle->height >= 1), "pad.rectangle_px",
            "width and height of at least 1 px", "less");
    require(!ellipse || (ellipse->radius_x > 0 && ellipse->radius_y > 0), "pad", "radii of more than 0 px",
            "less");
    require(!polygon || polygon->corners.size() >= 3, "pad.polygon_px", "three corners or more", "fewer");
  }
  if (s.background.kind == BackgroundKind::None) {
    const std::string change = "frames hold the change already (background.source 'none')";
    require(s.signal != Signal::Darker, "contact.signal", "brighter or either where " + change,
            to_string(s.signal));
    require(s.reading != Reading::Photometric, "surface.reading", "no photometric reading where " + change,
            "one: a change's sign is needed");
    require(s.shadow_gray.value_or(0) == 0, "surface.shadow_gray", "0 or none where " + change,
            std::to_string(s.shadow_gray.value_or(0)));
  }
  require(s.filter != Filter::None || s.reading == Reading::None || s.reading == Reading::Photometric,
          "contact.filter", "'binomial5' for reading '" + std::string(to_string(s.reading)) + "'", "'none'");
  if (s.reading == Reading::Shading)
    require(s.shading.facing_gray > 0, "surface.shading.facing_gray", "more than 0 gray levels",
            number_text(s.shading.facing_gray));
  if (s.reading == Reading::Elastic) {
    require(s.channels == 1, "frame.channels", "1 for reading 'elastic'", std::to_string(s.channels));
    require(s.elastic.gray_per_MPa > 0, "surface.elastic", "this section, for reading 'elastic'", "none");
    require(s.elastic.thickness_mm == 0 ||
                s.elastic.thickness_mm >= ElasticKernel::kThinnest_px * s.pitch_mm_per_px,
            "surface.elastic.thickness_mm", "at least 4 pixels (pitch_mm_per_px), or none for a half space",
            number_text(s.elastic.thickness_mm));
  }
  if (s.reading == Reading::Photometric) {
    require(s.channels == 3, "frame.channels", "3 for reading 'photometric'", std::to_string(s.channels));
    double largest = 0;
    for (const auto* weights : {&s.photometric.wx, &s.photometric.wy})
      for (const auto& row : *weights)
        for (const double weight : row) largest = std::max(largest, std::abs(weight));
    require(largest > 0, "surface.photometric", "weights that are not all 0", "none");
  }
  if (s.force) {
    require(s.force->c1_N_per_gray != 0, "force.c1_N_per_gray", "not 0", "0");
    require(s.force->gray_max > s.force->gray_min, "force.gray_max", "more than gray_min",
            number_text(s.force->gray_max));
  }
}

/// A file holds a sensor of which at least the scale is known.
void require_scale(const Sensor& sensor, const std::string& where) {
  if (!has_scale(sensor)) fail(where + ".pitch_mm_per_px", "a scale", "none");
}

Sensor from_json(const Json& json, const std::string& where, const std::string& default_name) {
  Reader reader(json, where);
  const double version = reader.number("palpate_sensor", 0, 1000, "(version of the format)");
  if (version != kVersion)
    fail(where + ".palpate_sensor", "version " + std::to_string(kVersion), number_text(version),
         "a newer palpate");
  Sensor sensor;
  sensor.name = reader.has("name") ? reader.text("name") : default_name;
  sensor.pitch_mm_per_px = reader.number("pitch_mm_per_px", 1e-6, 100, "mm per px");
  if (reader.has("frame")) read_frame(reader.at("frame"), reader.path("frame"), sensor);
  sensor.saturation_gray = (1u << sensor.bit_depth) - 1;
  if (reader.has("background"))
    read_background(reader.at("background"), reader.path("background"), sensor.background);
  if (reader.has("contact")) read_contact(reader.at("contact"), reader.path("contact"), sensor);
  if (reader.has("surface")) read_surface(reader.at("surface"), reader.path("surface"), sensor);
  if (reader.has("pad")) sensor.pad = read_pad(reader.at("pad"), reader.path("pad"));
  if (reader.has("force")) sensor.force = read_force(reader.at("force"), reader.path("force"));
  if (reader.has("shear")) sensor.shear = read_shear(reader.at("shear"), reader.path("shear"));
  reader.finish();
  check_together(sensor, where);
  return sensor;
}

/// Throws where the text is no JSON or writes a key twice.
Json parse(const std::string& text, const std::filesystem::path& file) {
  std::vector<std::set<std::string>> keys;
  const auto no_key_twice = [&](int, Json::parse_event_t event, Json& parsed) {
    if (event == Json::parse_event_t::object_start) keys.emplace_back();
    if (event == Json::parse_event_t::object_end) keys.pop_back();
    if (event == Json::parse_event_t::key && !keys.back().insert(parsed.get<std::string>()).second)
      fail(file.string(), "each key once", shown(parsed) + " twice", "removing one of them");
    return true;
  };
  try {
    return Json::parse(text, no_key_twice, true, true);  // comments are allowed
  } catch (const Json::exception& e) {
    std::string what = e.what();
    const size_t at = what.find("at line"), after_code = what.find("] ");
    if (at != std::string::npos)
      what = "an error " + what.substr(at);
    else if (after_code != std::string::npos)
      what = what.substr(after_code + 2);
    for (char& c : what)
      if (c < ' ' || c > '~') c = '?';  // a damaged file's bytes are no text
    fail(file.string(), "valid JSON", what.size() > 160 ? what.substr(0, 157) + "..." : what,
         "correcting it there");
  }
}

}  // namespace

bool has_scale(const Sensor& sensor) {
  return !std::isnan(sensor.pitch_mm_per_px);
}

Sensor uncalibrated_sensor(const FrameFormat& format) {
  Sensor sensor;
  sensor.name = "uncalibrated camera";
  sensor.pitch_mm_per_px = std::numeric_limits<double>::quiet_NaN();
  sensor.size_px = {format.width, format.height};
  sensor.channels = format.channels;
  sensor.bit_depth = format.bit_depth;
  sensor.signal = Signal::Either;
  sensor.threshold_gray = 0.02 * format.max_gray();
  sensor.saturation_gray = format.max_gray();
  sensor.background.first_frames = 10;
  return sensor;
}

uint32_t shadow_gray(const Sensor& sensor) {
  if (sensor.shadow_gray) return *sensor.shadow_gray;
  constexpr uint32_t kPerCent = 2;
  return sensor.reading == Reading::Photometric ? ((1u << sensor.bit_depth) - 1) * kPerCent / 100 : 0;
}

const char* to_string(Signal signal) {
  switch (signal) {
    case Signal::Brighter:
      return "brighter";
    case Signal::Darker:
      return "darker";
    case Signal::Either:
      return "either";
  }
  return "?";
}

const char* to_string(Filter filter) {
  return filter == Filter::Binomial5 ? "binomial5" : "none";
}

const char* to_string(BackgroundKind kind) {
  return kind == BackgroundKind::Untouched ? "untouched" : "none";
}

const char* to_string(Reading reading) {
  switch (reading) {
    case Reading::None:
      return "none";
    case Reading::Shading:
      return "shading";
    case Reading::Photometric:
      return "photometric";
    case Reading::Elastic:
      return "elastic";
  }
  return "?";
}

void validate(const Sensor& sensor, const std::string& where) {
  if (has_scale(sensor)) {
    from_json(to_json(sensor), where, "");
    return;
  }
  if (sensor.reading != Reading::None || sensor.shear)
    fail(where + ".pitch_mm_per_px", "a scale, for surfaces and shear", "none");
  Sensor scaled = sensor;  // no other key depends on the scale then
  scaled.pitch_mm_per_px = 1;
  from_json(to_json(scaled), where, "");
}

Sensor load_sensor(const std::filesystem::path& file) {
  constexpr uintmax_t kMaxBytes = 1 << 20;
  std::error_code error;
  const uintmax_t bytes = std::filesystem::file_size(file, error);
  if (error) fail(file.string(), "a sensor file (JSON)", error.message(), "checking the path");
  if (bytes > kMaxBytes)
    fail(file.string(), "a sensor file of at most 1 MiB", std::to_string(bytes) + " bytes", "another file");
  std::ifstream in(file, std::ios::binary);
  std::string text(static_cast<size_t>(bytes), '\0');
  if (!in.read(text.data(), static_cast<std::streamsize>(text.size())))
    fail(file.string(), "a readable sensor file", "a read error", "checking its permissions");

  Sensor sensor = from_json(parse(text, file), file.filename().string(), file.stem().string());
  if (!sensor.background.image.empty()) {
    // A path in the file is relative to the file, whatever the working directory.
    sensor.background.image =
        (std::filesystem::absolute(file).parent_path() / sensor.background.image).lexically_normal().string();
  }
  return sensor;
}

std::string sensor_text(const Sensor& sensor) {
  require_scale(sensor, "sensor");
  validate(sensor, "sensor");
  return to_json(sensor).dump(2, ' ', false, Json::error_handler_t::replace);
}

Sensor sensor_from_text(const std::string& text, const std::string& where) {
  return from_json(parse(text, where), where, "");
}

void save_sensor(const Sensor& given, const std::filesystem::path& file) {
  require_scale(given, file.filename().string());
  validate(given, file.filename().string());
  Sensor sensor = given;
  const std::filesystem::path image = sensor.background.image;
  if (image.is_absolute()) {
    // So that folder and sensor file can move together; an image elsewhere keeps its whole path.
    const auto near =
        image.lexically_relative(std::filesystem::absolute(file).lexically_normal().parent_path());
    if (!near.empty() && *near.begin() != "..") sensor.background.image = near.string();
  }
  const auto fail_to_write = [&](const std::string& why) {
    throw Error(Failure::Output, "to write " + file.string(), why, "another folder, or freeing disk space");
  };
  auto temporary = file;
  temporary += ".tmp";
  std::error_code error, ignored;
  {
    std::ofstream out(temporary, std::ios::binary | std::ios::trunc);
    out << to_json(sensor).dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
    out.close();
    if (!out) {
      std::filesystem::remove(temporary, ignored);
      fail_to_write("it cannot be written");
    }
  }
  std::filesystem::rename(temporary, file, error);
  if (error) {
    std::filesystem::remove(temporary, ignored);
    fail_to_write(error.message());
  }
}

}  // namespace palpate
