#include "capture/sensors/nominal_sensors.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <utility>

#include "capture/sensors/shipped_sensors.h"
#include "engine/base/json.h"
#include "engine/base/text.h"
#include "palpate/error.h"

namespace palpate {

namespace fs = std::filesystem;

namespace {

constexpr double kProportions = 0.02;  // of a mode's width over height
constexpr double kSquare = 0.01;       // from which pixels are made square

fs::path nominal_folder() {
  return shipped_sensors_folder() / "nominal";
}

double above_zero(const json::Value& section, const char* key) {
  const double value = section.at(key).number();
  if (!(value > 0)) throw json::Error(std::string(key) + " above 0 expected");
  return value;
}

/// It stands in error lines.
std::string line_of(const json::Value& value) {
  constexpr size_t kLongest = 100;
  const std::string& line = value.text();
  if (line.size() > kLongest || std::ranges::any_of(line, [](unsigned char c) { return c < ' '; }))
    throw json::Error("a name of one line, of at most 100 characters, expected");
  return line;
}

NominalSensor read(const json::Value& file) {
  if (file.at("palpate_nominal").number() != 1) throw json::Error("\"palpate_nominal\": 1 expected");
  NominalSensor kind;
  kind.name = line_of(file.at("name"));
  const json::Value& camera = file.at("camera");
  kind.channels = camera.at("channels").get<uint32_t>();
  if (kind.channels != 1 && kind.channels != 3) throw json::Error("1 or 3 channels expected");
  for (const json::Value& mode : camera.at("modes")) {
    const auto size_px = mode.at("size_px").get<std::array<uint32_t, 2>>();
    for (const uint32_t side : size_px)
      if (side < 1 || side > kMaxSide_px)
        throw json::Error(text("size_px from 1 to %u expected", kMaxSide_px));
    kind.modes.push_back({.size_px = size_px, .rate_Hz = above_zero(mode, "rate_Hz")});
  }
  const json::Value& scale = file.at("scale");
  kind.field_mm = scale.at("field_mm").get<std::array<double, 2>>();
  for (const double side : kind.field_mm)
    if (!(side > 0)) throw json::Error("field_mm above 0 expected");
  kind.relative_sd = above_zero(scale, "relative_sd");
  kind.source = scale.at("source").text();
  if (const json::Value* gel = file.find("gel")) {
    kind.gel = LayerCalibration{.young_MPa = above_zero(*gel, "young_MPa"),
                                .poisson = above_zero(*gel, "poisson"),
                                .thickness_mm = above_zero(*gel, "thickness_mm"),
                                .relative_sd = above_zero(*gel, "relative_sd")};
    kind.gel->origin = {.from = kind.name + ", not this unit", .made = "", .note = gel->at("source").text()};
  }
  if (const json::Value* markers = file.find("markers"))
    kind.markers = NominalSensor::Markers{.spacing_mm = above_zero(*markers, "spacing_mm"),
                                          .size_mm = above_zero(*markers, "size_mm")};
  const std::string& signal = file.at("light").at("signal").text();
  constexpr std::array kSignals{Signal::Brighter, Signal::Darker, Signal::Either};
  const auto* const found =
      std::ranges::find_if(kSignals, [&](Signal one) { return signal == to_string(one); });
  if (found == kSignals.end()) throw json::Error("signal brighter, darker or either expected");
  kind.signal = *found;
  for (const json::Value& one : file.at("not_known")) kind.not_known.push_back(one.text());
  return kind;
}

}  // namespace

std::vector<std::string> nominal_names() {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(nominal_folder(), error))
    if (entry.path().extension() == ".json") names.push_back(entry.path().stem().string());
  std::ranges::sort(names);
  return names;
}

NominalSensor load_nominal(const std::string& name_or_file) {
  const std::vector<std::string> names = nominal_names();
  const bool shipped = std::ranges::find(names, name_or_file) != names.end();
  const fs::path file = shipped ? nominal_folder() / (name_or_file + ".json") : fs::path(name_or_file);
  std::ifstream in(file, std::ios::binary);
  if (!in || fs::is_directory(file)) {
    std::string list;
    for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
    throw Error(
        Failure::Usage, "a kind of sensor", "'" + name_or_file + "'" + did_you_mean(name_or_file, names),
        (list.empty() ? std::string("a file") : list + ", or a file") + " like capture/sensors/nominal");
  }
  try {
    return read(json::parse(std::string(std::istreambuf_iterator<char>(in), {})));
  } catch (const json::Error& error) {
    throw Error(Failure::Sensor, "a kind of sensor in " + file.string(), error.what(),
                "the keys of capture/sensors/nominal/gelsight_mini.json");
  }
}

void apply_nominal(const NominalSensor& kind, const FrameFormat& camera, Sensor& sensor) {
  const bool upright = camera.height > camera.width;
  const double proportion = static_cast<double>(camera.width) / camera.height;
  const auto fits = [&](const NominalSensor::Mode& mode) {
    const double width = mode.size_px[upright], height = mode.size_px[!upright];
    return std::abs(proportion * height / width - 1) < kProportions;
  };
  if (camera.channels != kind.channels || std::ranges::none_of(kind.modes, fits)) {
    std::string modes;
    for (const NominalSensor::Mode& mode : kind.modes)
      modes += text("%s%u x %u", modes.empty() ? "" : ", ", mode.size_px[0], mode.size_px[1]);
    throw Error(Failure::Input,
                "whole frames of a " + kind.name + " (" + modes + " px, " +
                    (kind.channels == 3 ? "colour" : "gray") + ")",
                text("%u x %u px, %s", camera.width, camera.height, camera.channels == 3 ? "colour" : "gray"),
                "another --like, or --pitch without it");
  }
  const double x_mm = kind.field_mm[upright] / camera.width, y_mm = kind.field_mm[!upright] / camera.height;
  const double pitch = std::min(x_mm, y_mm);
  sensor.pitch_mm_per_px = pitch;
  sensor.pitch_sd_mm_per_px = kind.relative_sd * pitch;
  if (std::abs(x_mm / y_mm - 1) > kSquare) {
    const double right = camera.width - 1.0, bottom = camera.height - 1.0;
    sensor.camera_px = {camera.width, camera.height};
    sensor.quad_px = {{{0, 0}, {right, 0}, {right, bottom}, {0, bottom}}};
    sensor.size_px = {static_cast<uint32_t>(std::lround(camera.width * x_mm / pitch)),
                      static_cast<uint32_t>(std::lround(camera.height * y_mm / pitch))};
  }
  sensor.signal = kind.signal;
  sensor.layer = kind.gel;
  if (kind.markers)
    sensor.skin = SkinPattern{.kind = SkinKind::Markers,
                              .spacing_px = kind.markers->spacing_mm / pitch,
                              .size_px = kind.markers->size_mm / pitch};
}

}  // namespace palpate
