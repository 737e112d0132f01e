// Common parts of the sections of a sensor file: reading a JSON object key by key, and one reader and writer
// a section.
#pragma once

#include <array>
#include <cmath>
#include <set>
#include <string>
#include <utility>

#include "engine/base/json.h"
#include "engine/base/text.h"
#include "palpate/sensor.h"

namespace palpate::sensor_json {

using Json = json::Value;

inline constexpr double kHuge = 1e12;

/// Throws Error(Failure::Sensor).
[[noreturn]] void fail(
    const std::string& where, const std::string& wanted, const std::string& found,
    const std::string& remedy = "correcting that key; engine/sensor/README.md explains each");
/// A value for a message: short, one line, ASCII. What is nested may be nested deeper than a stack is, and is
/// only counted.
std::string shown(const Json& value);
std::string number_text(double value);

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
    if (!has(key)) fail(path(key), "this key", "none", "adding it; engine/sensor/README.md explains each");
    return object_.at(key);
  }
  std::string path(const char* key) const { return where_ + "." + key; }

  double number(const char* key, double low, double high, const char* unit) {
    if (!has(key))
      fail(path(key), std::string("this key") + (*unit ? ", in " : "") + unit, "none",
           "adding it; engine/sensor/README.md explains each");
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
    return value.text();
  }
  template <typename Enum, size_t N>
  void choice(const char* key, const std::array<Enum, N>& options, Enum& value) {
    if (!has(key)) return;
    const std::string found = text(key);
    std::string names;
    std::vector<std::string> words;
    for (const Enum option : options) {
      if (found == to_string(option)) {
        value = option;
        return;
      }
      words.emplace_back(to_string(option));
      names += (names.empty() ? "" : ", ") + words.back();
    }
    fail(path(key), "one of " + names, shown(found) + did_you_mean(found, words));
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
    const double number = value.number();
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
    for (const std::string& key : object_.keys()) {
      if (known_.contains(key)) continue;
      std::string names;
      for (const std::string& name : known_) names += (names.empty() ? "" : ", ") + name;
      fail(where_, "only known keys (" + names + ")",
           shown(key) + did_you_mean(key, {known_.begin(), known_.end()}), "removing or renaming it");
    }
  }

 private:
  const Json& object_;
  std::string where_;
  std::set<std::string> known_;
};

// The sections. `where` names the section in messages.
void read_frame(const Json& json, const std::string& where, Sensor& sensor);
Json frame_json(const Sensor& sensor);
void read_background(const Json& json, const std::string& where, BackgroundSource& background);
Json background_json(const BackgroundSource& background);
void read_surface(const Json& json, const std::string& where, Sensor& sensor);
Json surface_json(const Sensor& sensor);
LayerCalibration read_layer(const Json& json, const std::string& where);
Json layer_json(const LayerCalibration& layer);
PadOutline read_pad(const Json& json, const std::string& where);
Json pad_json(const PadOutline& outline);
ForceCalibration read_force(const Json& json, const std::string& where);
Json force_json(const ForceCalibration& force);
ShearCalibration read_shear(const Json& json, const std::string& where);
Json shear_json(const ShearCalibration& shear);
SkinPattern read_skin(const Json& json, const std::string& where);
Json skin_json(const SkinPattern& skin);
/// Sets json["origin"] where there is one; reads it back.
void add_origin(Json& json, const Origin& origin);
Origin read_origin(Reader& reader);

}  // namespace palpate::sensor_json
