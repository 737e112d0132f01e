#include "palpate/sensor.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <numbers>
#include <sstream>

#include "engine/base/readable.h"
#include "engine/sensor/json.h"
#include "palpate/error.h"

namespace palpate {
namespace {

using namespace sensor_json;

constexpr int kVersion = 1;

constexpr std::array kSignals{Signal::Brighter, Signal::Darker, Signal::Either};
constexpr std::array kFilters{Filter::Binomial5, Filter::None};

void read_contact(const Json& json, const std::string& where, Sensor& sensor) {
  Reader contact(json, where);
  contact.choice("signal", kSignals, sensor.signal);
  contact.choice("filter", kFilters, sensor.filter);
  contact.number("threshold_gray", 0, 65535, "gray levels", sensor.threshold_gray);
  contact.number("gradient_gray_per_px", 0, 255, "gray levels per px", sensor.gradient_gray_per_px);
  contact.whole("saturation_gray", 1, 65535, "gray levels", sensor.saturation_gray);
  contact.whole("smallest_px", 0, 1u << 26, "px", sensor.smallest_contact_px);
  contact.finish();
}

Json to_json(const Sensor& s) {
  Json contact{{"signal", to_string(s.signal)},
               {"filter", to_string(s.filter)},
               {"threshold_gray", s.threshold_gray},
               {"saturation_gray", s.saturation_gray}};
  if (s.gradient_gray_per_px != 1) contact["gradient_gray_per_px"] = s.gradient_gray_per_px;
  if (s.smallest_contact_px != 0) contact["smallest_px"] = s.smallest_contact_px;
  Json json{{"palpate_sensor", kVersion},
            {"name", s.name},
            {"pitch_mm_per_px", has_scale(s) ? Json(s.pitch_mm_per_px) : Json(nullptr)},
            {"frame", frame_json(s)},
            {"background", background_json(s.background)},
            {"contact", contact},
            {"surface", surface_json(s)}};
  if (s.pitch_sd_mm_per_px != 0) json["pitch_sd_mm_per_px"] = s.pitch_sd_mm_per_px;
  if (s.layer) json["layer"] = layer_json(*s.layer);
  if (s.pad) json["pad"] = pad_json(*s.pad);
  if (s.skin) json["skin"] = skin_json(*s.skin);
  if (s.force) json["force"] = force_json(*s.force);
  if (s.shear) json["shear"] = shear_json(*s.shear);
  json.sort_keys();
  return json;
}

/// Refusals of keys that do not fit each other, each by its place in the file.
struct Require {
  const std::string& where;

  void operator()(bool fits, const char* key, const std::string& wanted, const std::string& found) const {
    if (!fits) fail(where + "." + key, wanted, found);
  }
};

void check_frame(const Sensor& s, const Require& require) {
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
}

void check_background(const Sensor& s, const Require& require) {
  if (s.background.kind != BackgroundKind::None) return;
  const std::string change = "frames hold the change already (background.source 'none')";
  require(s.signal != Signal::Darker, "contact.signal", "brighter or either where " + change,
          to_string(s.signal));
  require(s.reading != SurfaceReading::Photometric, "surface.reading",
          "no photometric reading where " + change, "one: a change's sign is needed");
  require(s.shadow_gray.value_or(0) == 0, "surface.shadow_gray", "0 or none where " + change,
          std::to_string(s.shadow_gray.value_or(0)));
}

void check_surface_reading(const Sensor& s, const Require& require) {
  require(s.filter != Filter::None || s.reading == SurfaceReading::None ||
              s.reading == SurfaceReading::Photometric,
          "contact.filter", "'binomial5' for reading '" + std::string(to_string(s.reading)) + "'", "'none'");
  if (s.reading == SurfaceReading::Shading)
    require(s.shading.facing_gray > 0, "surface.shading.facing_gray", "more than 0 gray levels",
            number_text(s.shading.facing_gray));
  if (s.reading == SurfaceReading::Elastic) {
    require(s.channels == 1, "frame.channels", "1 for reading 'elastic'", std::to_string(s.channels));
    require(s.elastic.gray_per_MPa > 0, "surface.elastic", "this section, for reading 'elastic'", "none");
    require(s.elastic.thickness_mm == 0 ||
                s.elastic.thickness_mm >= ElasticCalibration::kThinnest_px * s.pitch_mm_per_px,
            "surface.elastic.thickness_mm", "at least 4 pixels (pitch_mm_per_px), or none for a half space",
            number_text(s.elastic.thickness_mm));
  }
  if (s.reading == SurfaceReading::Photometric) {
    require(s.channels == 3, "frame.channels", "3 for reading 'photometric'", std::to_string(s.channels));
    const size_t colours = s.photometric.wx.size(), terms = colours ? s.photometric.wx.front().size() : 0;
    require((colours == 3 || colours == 9) && s.photometric.wy.size() == colours &&
                (terms == 1 || terms == 3 || terms == 6 || terms == 10),
            "surface.photometric", "wx and wy of 3 or 9 rows of 1, 3, 6 or 10 terms",
            std::to_string(colours) + " and " + std::to_string(s.photometric.wy.size()) + " rows of " +
                std::to_string(terms));
    double largest = 0;
    for (const auto* weights : {&s.photometric.wx, &s.photometric.wy})
      for (const auto& row : *weights) {
        require(row.size() == terms, "surface.photometric", "rows of as many terms as the first",
                std::to_string(row.size()) + " instead of " + std::to_string(terms));
        for (const double weight : row) largest = std::max(largest, std::abs(weight));
      }
    require(largest > 0, "surface.photometric", "weights that are not all 0", "none");
  }
  if (s.reading == SurfaceReading::Lookup) {
    require(s.channels == 1, "frame.channels", "1 for reading 'lookup'", std::to_string(s.channels));
    require(s.lookup.points.size() >= 2, "surface.lookup", "this section, for reading 'lookup'", "none");
    for (size_t i = 1; i < s.lookup.points.size(); ++i)
      require(s.lookup.points[i][0] > s.lookup.points[i - 1][0] &&
                  s.lookup.points[i][1] >= s.lookup.points[i - 1][1],
              "surface.lookup.points", "gray that rises and depth that does not fall from point to point",
              number_text(s.lookup.points[i][0]) + ", " + number_text(s.lookup.points[i][1]) + " mm");
  }
}

void check_layer(const Sensor& s, const Require& require) {
  if (!s.layer) return;
  require(has_scale(s), "layer", "a scale, pitch_mm_per_px, with it", "none");
  const double least_mm = LayerCalibration::kThinnest_px * s.pitch_mm_per_px;
  require(s.layer->thickness_mm >= least_mm, "layer.thickness_mm",
          "at least 3 pixels (pitch_mm_per_px), " + number_text(least_mm) + " mm",
          number_text(s.layer->thickness_mm) +
              (s.layer->thickness_mm * 1e3 >= least_mm ? ", which would fit in m" : ""));
  require(s.layer->young_MPa > 0, "layer.young_MPa", "more than 0 MPa", number_text(s.layer->young_MPa));
}

void check_force(const Sensor& s, const Require& require) {
  if (s.force) {
    require(s.force->model == ForceModel::Spline || s.force->c1_N_per_gray != 0, "force.c1_N_per_gray",
            "not 0", "0");
    require(s.force->model != ForceModel::Spline || s.force->knots.size() >= 2, "force.knots",
            "2 knots or more for model 'spline'", std::to_string(s.force->knots.size()));
    require(s.force->signal == ForceSignal::Volume || s.force->gray_min >= 0, "force.gray_min",
            "0 or more for this signal", number_text(s.force->gray_min));
    require(s.force->signal != ForceSignal::Gradient || s.bit_depth == 8, "force.signal",
            "'gradient' with frames of 8 bits", std::to_string(s.bit_depth) + " bits");
    require(!is_by_layer(s.force->signal) || (layer_of(s) && s.reading != SurfaceReading::None),
            "force.signal",
            text("'%s' with the section 'layer' and a reading of the surface", to_string(s.force->signal)),
            "neither, or one");
    require(s.force->signal != ForceSignal::LayerAndBending || has_gel_contacts(s), "force.signal",
            "'layer and bending' with a colour gel that reads a surface", "another sensor");
    require(s.force->signal != ForceSignal::LayerAndBending || s.force->bending_N_per_mm > 0,
            "force.bending_N_per_mm", "more than 0 for this signal", number_text(s.force->bending_N_per_mm));
    require(s.force->gray_max > s.force->gray_min, "force.gray_max", "more than gray_min",
            number_text(s.force->gray_max));
  }
}

/// Checks that the keys fit each other.
void check_together(const Sensor& s, const std::string& where) {
  const Require require{where};
  require(has_scale(s) || (s.reading == SurfaceReading::None && !s.shear), "pitch_mm_per_px",
          "a scale, for surfaces and shear", "none");
  check_frame(s, require);
  check_background(s, require);
  check_surface_reading(s, require);
  check_layer(s, require);
  check_force(s, require);
}

Sensor from_json(const Json& json, const std::string& where, const std::string& default_name) {
  Reader reader(json, where);
  const double version = reader.number("palpate_sensor", 0, 1000, "(version of the format)");
  if (version != kVersion)
    fail(where + ".palpate_sensor", "version " + std::to_string(kVersion), number_text(version),
         "a newer palpate");
  Sensor sensor;
  sensor.name = reader.has("name") ? reader.text("name") : default_name;
  if (reader.has("pitch_mm_per_px") && reader.at("pitch_mm_per_px").is_null())
    sensor.pitch_mm_per_px = std::numeric_limits<double>::quiet_NaN();
  else
    sensor.pitch_mm_per_px =
        reader.number("pitch_mm_per_px", 1e-6, 100, "mm per px, such as 0.0593; null: not known");
  reader.number("pitch_sd_mm_per_px", 0, 100, "mm per px", sensor.pitch_sd_mm_per_px);
  if (reader.has("frame")) read_frame(reader.at("frame"), reader.path("frame"), sensor);
  sensor.saturation_gray = (1u << sensor.bit_depth) - 1;
  if (reader.has("background"))
    read_background(reader.at("background"), reader.path("background"), sensor.background);
  if (reader.has("contact")) read_contact(reader.at("contact"), reader.path("contact"), sensor);
  if (reader.has("surface")) read_surface(reader.at("surface"), reader.path("surface"), sensor);
  if (reader.has("layer")) sensor.layer = read_layer(reader.at("layer"), reader.path("layer"));
  if (reader.has("pad")) sensor.pad = read_pad(reader.at("pad"), reader.path("pad"));
  if (reader.has("skin")) sensor.skin = read_skin(reader.at("skin"), reader.path("skin"));
  if (reader.has("force")) sensor.force = read_force(reader.at("force"), reader.path("force"));
  if (reader.has("shear")) sensor.shear = read_shear(reader.at("shear"), reader.path("shear"));
  reader.finish();
  check_together(sensor, where);
  return sensor;
}

/// Throws where the text is no JSON or writes a key twice.
Json parse(const std::string& text, const std::filesystem::path& file) {
  try {
    return json::parse(text, {.comments = true, .unique_keys = true, .sorted_keys = true});
  } catch (const json::KeyTwice& e) {
    fail(file.string(), "each key once", shown(e.key) + " twice", "removing one of them");
  } catch (const json::Error& e) {
    const std::string what = e.what();
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

Sensor for_rectified_frames(Sensor sensor) {
  sensor.camera_px = {};
  sensor.crop_px.reset();
  sensor.quad_px.reset();
  sensor.lens.reset();
  sensor.flat.reset();
  return sensor;
}

std::optional<LayerCalibration> layer_of(const Sensor& sensor) {
  if (sensor.layer) return sensor.layer;
  const ElasticCalibration& pad = sensor.elastic;
  if (sensor.reading != SurfaceReading::Elastic || !(pad.thickness_mm > 0)) return std::nullopt;
  return LayerCalibration{.young_MPa = pad.young_MPa,
                          .poisson = pad.poisson,
                          .thickness_mm = pad.thickness_mm,
                          .relative_sd = pad.relative_sd};
}

uint32_t shadow_gray(const Sensor& sensor) {
  if (sensor.shadow_gray) return *sensor.shadow_gray;
  constexpr uint32_t kPerCent = 2;
  return sensor.reading == SurfaceReading::Photometric ? ((1u << sensor.bit_depth) - 1) * kPerCent / 100 : 0;
}

uint32_t dead_gray(const Sensor& sensor) {
  const uint32_t margin = std::max(1u, (1u << sensor.bit_depth) / 64);
  return sensor.saturation_gray - std::min(sensor.saturation_gray, margin);
}

bool has_gel_contacts(const Sensor& sensor) {
  // Printed markers in the sensor file mean that the pad is a gel, whatever its colours are read as; they are
  // filled first.
  const bool printed = sensor.skin && sensor.skin->kind == SkinKind::Markers && sensor.channels == 3;
  const bool colours =
      sensor.reading == SurfaceReading::Photometric || (printed && sensor.reading == SurfaceReading::None);
  return colours && sensor.background.kind == BackgroundKind::Untouched && sensor.bit_depth == 8;
}

uint32_t smallest_contact_px(const Sensor& sensor, const FrameFormat& format) {
  if (sensor.smallest_contact_px > 0) return sensor.smallest_contact_px;
  double least_px = std::max(9.0, static_cast<double>(format.width) * format.height / 4000);
  // Where the skin moves, its pattern changes the picture too. What one marker leaves, where it was and where
  // it is, each as wide as the filter makes it, or one patch of texture, is no touch.
  if (sensor.skin) {
    const bool markers = sensor.skin->kind == SkinKind::Markers;
    const double side = markers ? sensor.skin->size_px + 4 : 2 * sensor.skin->size_px;
    least_px = std::max(least_px, markers ? 2 * std::numbers::pi / 4 * side * side : side * side);
  }
  return static_cast<uint32_t>(std::min(least_px, double{1u << 26}));
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

const char* to_string(SurfaceReading reading) {
  switch (reading) {
    case SurfaceReading::None:
      return "none";
    case SurfaceReading::Shading:
      return "shading";
    case SurfaceReading::Photometric:
      return "photometric";
    case SurfaceReading::Elastic:
      return "elastic";
    case SurfaceReading::Lookup:
      return "lookup";
  }
  return "?";
}

const char* to_string(ForceSignal signal) {
  switch (signal) {
    case ForceSignal::GraySum:
      return "gray sum";
    case ForceSignal::Area:
      return "area";
    case ForceSignal::Volume:
      return "volume";
    case ForceSignal::Gradient:
      return "gradient";
    case ForceSignal::Layer:
      return "layer";
    case ForceSignal::LayerAndBending:
      return "layer and bending";
  }
  return "?";
}

const char* to_string(ForceModel model) {
  switch (model) {
    case ForceModel::Line:
      return "line";
    case ForceModel::Power:
      return "power";
    case ForceModel::Spline:
      return "spline";
    case ForceModel::Scale:
      return "scale";
  }
  return "?";
}

const char* to_string(ShearSignal signal) {
  return signal == ShearSignal::Centroid ? "centroid" : "skin";
}

const char* to_string(SkinKind kind) {
  return kind == SkinKind::Markers ? "markers" : "texture";
}

void validate(const Sensor& sensor, const std::string& where) {
  from_json(to_json(sensor), where, "");
}

// A path in the file is relative to the file, whatever the working directory.
static std::string beside(const std::filesystem::path& file, const std::string& image) {
  return (std::filesystem::absolute(file).parent_path() / image).lexically_normal().string();
}

Sensor load_sensor(const std::filesystem::path& file, ToMake to_make) {
  constexpr uintmax_t kMaxBytes = 1 << 20;
  if (const std::string why = why_unreadable(file); !why.empty())
    fail(file.string(), "a sensor file (JSON)", why, "checking the path");
  std::error_code error;
  const uintmax_t bytes = std::filesystem::file_size(file, error);
  if (error) fail(file.string(), "a sensor file (JSON)", system_words(error), "checking the path");
  if (bytes > kMaxBytes)
    fail(file.string(), "a sensor file of at most 1 MiB", std::to_string(bytes) + " bytes", "another file");
  std::ifstream in(file, std::ios::binary);
  std::string text(static_cast<size_t>(bytes), '\0');
  if (!in.read(text.data(), static_cast<std::streamsize>(text.size())))
    fail(file.string(), "a readable sensor file", "a read error", "checking its permissions");

  Json json = parse(text, file);
  if (to_make != ToMake::Nothing && json.is_object() && !json.contains("pitch_mm_per_px"))
    json["pitch_mm_per_px"] = nullptr;
  if (to_make == ToMake::Reading && json.is_object() && json.contains("surface") &&
      json.at("surface").is_object())
    json["surface"].erase("reading");
  Sensor sensor = from_json(json, file.filename().string(), file.stem().string());
  if (!sensor.background.image.empty()) sensor.background.image = beside(file, sensor.background.image);
  if (sensor.flat) sensor.flat->image = beside(file, sensor.flat->image);
  return sensor;
}

std::string sensor_text(const Sensor& sensor) {
  validate(sensor, "sensor");
  return to_json(sensor).dump(2, json::Utf8::Replace);
}

Sensor sensor_from_text(const std::string& text, const std::string& where) {
  return from_json(parse(text, where), where, "");
}

void save_sensor(const Sensor& given, const std::filesystem::path& file) {
  validate(given, file.filename().string());
  Sensor sensor = given;
  // So that folder and sensor file can move together; an image elsewhere keeps its whole path.
  const auto shorten = [&](std::string& path) {
    const std::filesystem::path image = path;
    if (!image.is_absolute()) return;
    const auto near =
        image.lexically_relative(std::filesystem::absolute(file).lexically_normal().parent_path());
    if (!near.empty() && *near.begin() != "..") path = near.string();
  };
  shorten(sensor.background.image);
  if (sensor.flat) shorten(sensor.flat->image);
  const auto fail_to_write = [&](const std::string& why) {
    throw Error(Failure::Output, "to write " + file.string(), why, "another folder, or freeing disk space");
  };
  auto temporary = file;
  temporary += ".tmp";
  std::error_code error, ignored;
  if (file.has_parent_path()) std::filesystem::create_directories(file.parent_path(), error);
  if (error) fail_to_write("its folder cannot be made: " + system_words(error));
  {
    std::ofstream out(temporary, std::ios::binary | std::ios::trunc);
    out << to_json(sensor).dump(2, json::Utf8::Replace) << '\n';
    out.close();
    if (!out) {
      std::filesystem::remove(temporary, ignored);
      fail_to_write("it cannot be written");
    }
  }
  std::filesystem::rename(temporary, file, error);
  if (error) {
    std::filesystem::remove(temporary, ignored);
    fail_to_write(system_words(error));
  }
}

}  // namespace palpate
