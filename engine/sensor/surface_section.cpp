// Section of a sensor file: how an image becomes a surface.
#include <charconv>
#include <cinttypes>

#include "engine/sensor/json.h"

namespace palpate::sensor_json {
namespace {

constexpr std::array kSurfaceReadings{SurfaceReading::None, SurfaceReading::Shading,
                                      SurfaceReading::Photometric, SurfaceReading::Elastic,
                                      SurfaceReading::Lookup};

void read_weights(Reader& reader, const char* key, NormalWeights& weights) {
  const Json& rows = reader.at(key);
  if (!rows.is_array() || (rows.size() != 3 && rows.size() != 9))
    fail(reader.path(key), "3 rows for red, green, blue, or 9 with their products", shown(rows));
  weights.clear();
  for (const Json& row : rows) {
    const std::string where = reader.path(key) + "[" + std::to_string(weights.size()) + "]";
    const size_t terms = row.is_array() ? row.size() : 0;
    if (terms != 1 && terms != 3 && terms != 6 && terms != 10)
      fail(where, "a list of 1, 3, 6 or 10: the terms 1, X, Y, XX, XY, YY, ... up to a degree", shown(row));
    std::vector<double>& to = weights.emplace_back();
    for (const Json& value : row) to.push_back(Reader::checked(value, where, -1e6, 1e6, ""));
    if (terms != weights.front().size())
      fail(where, "as many terms as in the rows before, " + std::to_string(weights.front().size()),
           shown(row));
  }
}

// [[X, Y, radius, error], ...].
std::vector<PressError> read_presses(Reader& reader) {
  std::vector<PressError> presses;
  const std::string where = reader.path("presses");
  const Json& list = reader.at("presses");
  if (!list.is_array() || list.size() > 1000)
    fail(where, "up to 1000 presses as [X, Y, radius, depth_error]", shown(list));
  for (const Json& press : list) {
    if (!press.is_array() || press.size() != 4)
      fail(where, "presses as [X, Y, radius, depth_error]", shown(press));
    presses.push_back({.across = Reader::checked(press[0], where, -2, 2, "half frames"),
                       .down = Reader::checked(press[1], where, -2, 2, "half frames"),
                       .radius = Reader::checked(press[2], where, 0, 4, "half frames"),
                       .depth_error = Reader::checked(press[3], where, -10, 10, "")});
  }
  return presses;
}

SeenColours read_colours(const Json& json, const std::string& where) {
  Reader reader(json, where);
  SeenColours colours;
  for (const auto& [key, to] : {std::pair{"low", &colours.low}, std::pair{"high", &colours.high}}) {
    const Json& list = reader.array(key, 3, "changes of red, green, blue");
    for (size_t c = 0; c < 3; ++c) (*to)[c] = Reader::checked(list[c], reader.path(key), -1, 1, "full scale");
  }
  for (size_t c = 0; c < 3; ++c)
    if (!(colours.high[c] > colours.low[c]))
      fail(reader.path("high"), "more than low in each colour", shown(reader.at("high")));
  const Json& rows = reader.array("bins", SeenColours::kSide, "bins of blue, each 16 hexadecimal digits");
  for (size_t b = 0; b < SeenColours::kSide; ++b) {
    const std::string digits = rows[b].is_string() ? rows[b].text() : "";
    const char* end = digits.data() + digits.size();
    const auto [read, error] = std::from_chars(digits.data(), end, colours.bins[b], 16);
    if (digits.size() != 16 || error != std::errc{} || read != end)
      fail(reader.path("bins"), "texts of 16 hexadecimal digits", shown(rows[b]));
  }
  reader.finish();
  return colours;
}

Json colours_json(const SeenColours& colours) {
  Json bins = Json::array();
  for (const uint64_t bin : colours.bins) bins.push_back(text("%016" PRIx64, bin));
  return {{"low", colours.low}, {"high", colours.high}, {"bins", bins}};
}

}  // namespace

void read_surface(const Json& json, const std::string& where, Sensor& sensor) {
  Reader surface(json, where);
  surface.choice("reading", kSurfaceReadings, sensor.reading);
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
    photometric.number("noise_sd", 0, sensor.photometric.normal_sd, "", sensor.photometric.noise_sd);
    photometric.number("pad_reach_px", 0, 1e4, "px", sensor.photometric.pad_reach_px);
    if (photometric.has("table"))
      fail(photometric.path("table"), "weights by place alone (palpate calibrate photometric fits them)",
           "a table of normals, as files of earlier versions have");
    if (photometric.has("presses")) sensor.photometric.presses = read_presses(photometric);
    if (photometric.has("colours"))
      sensor.photometric.colours = read_colours(photometric.at("colours"), photometric.path("colours"));
    sensor.photometric.origin = read_origin(photometric);
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
  if (surface.has("lookup")) {
    Reader lookup(surface.at("lookup"), surface.path("lookup"));
    const Json& points = lookup.at("points");
    if (!points.is_array() || points.size() < 2 || points.size() > 256)
      fail(lookup.path("points"), "2 to 256 points as [gray, depth_mm]", shown(points));
    for (const Json& point : points) {
      if (!point.is_array() || point.size() != 2)
        fail(lookup.path("points"), "points as [gray, depth_mm]", shown(point));
      sensor.lookup.points.push_back(
          {Reader::checked(point[0], lookup.path("points"), 0, 65535, "gray levels"),
           Reader::checked(point[1], lookup.path("points"), 0, 1e3, "mm")});
    }
    lookup.number("depth_sd_mm", 0, 1e3, "mm", sensor.lookup.depth_sd_mm);
    sensor.lookup.origin = read_origin(lookup);
    lookup.finish();
  }
  surface.finish();
}

LayerCalibration read_layer(const Json& json, const std::string& where) {
  Reader reader(json, where);
  LayerCalibration layer;
  layer.young_MPa = reader.number("young_MPa", 1e-6, 1e6, "MPa");
  reader.number("poisson", 0, 0.5, "", layer.poisson);
  layer.thickness_mm = reader.number("thickness_mm", 1e-6, 1e6, "mm");
  reader.number("relative_sd", 0, 10, "", layer.relative_sd);
  layer.origin = read_origin(reader);
  reader.finish();
  return layer;
}

Json layer_json(const LayerCalibration& layer) {
  Json json{{"young_MPa", layer.young_MPa},
            {"poisson", layer.poisson},
            {"thickness_mm", layer.thickness_mm},
            {"relative_sd", layer.relative_sd}};
  add_origin(json, layer.origin);
  return json;
}

Json surface_json(const Sensor& s) {
  Json surface{{"reading", to_string(s.reading)}, {"max_slope", s.max_slope}};
  if (s.shadow_gray) surface["shadow_gray"] = *s.shadow_gray;
  if (s.reading == SurfaceReading::Shading || s.shading.facing_gray != 0)
    surface["shading"] = {{"facing_gray", s.shading.facing_gray}, {"depth_gain", s.shading.depth_gain}};
  const PhotometricCalibration none;
  if (s.reading == SurfaceReading::Photometric || s.photometric.wx != none.wx ||
      s.photometric.wy != none.wy) {
    Json photometric{
        {"wx", s.photometric.wx}, {"wy", s.photometric.wy}, {"normal_sd", s.photometric.normal_sd}};
    if (s.photometric.noise_sd > 0) photometric["noise_sd"] = s.photometric.noise_sd;
    if (s.photometric.pad_reach_px > 0) photometric["pad_reach_px"] = s.photometric.pad_reach_px;
    if (!s.photometric.presses.empty()) {
      Json presses = Json::array();
      for (const PressError& p : s.photometric.presses)
        presses.push_back(std::vector<double>{p.across, p.down, p.radius, p.depth_error});
      photometric["presses"] = presses;
    }
    if (s.photometric.colours) photometric["colours"] = colours_json(*s.photometric.colours);
    add_origin(photometric, s.photometric.origin);
    surface["photometric"] = photometric;
  }
  if (s.reading == SurfaceReading::Elastic || s.elastic.gray_per_MPa != 0) {
    Json elastic{{"gray_per_MPa", s.elastic.gray_per_MPa},
                 {"young_MPa", s.elastic.young_MPa},
                 {"poisson", s.elastic.poisson},
                 {"relative_sd", s.elastic.relative_sd}};
    if (s.elastic.limit_gray != 0) elastic["limit_gray"] = s.elastic.limit_gray;
    if (s.elastic.thickness_mm != 0) elastic["thickness_mm"] = s.elastic.thickness_mm;
    surface["elastic"] = elastic;
  }
  if (!s.lookup.points.empty()) {
    Json lookup{{"points", s.lookup.points}, {"depth_sd_mm", s.lookup.depth_sd_mm}};
    add_origin(lookup, s.lookup.origin);
    surface["lookup"] = lookup;
  }
  return surface;
}

}  // namespace palpate::sensor_json
