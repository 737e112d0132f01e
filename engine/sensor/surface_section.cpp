// Section of a sensor file: how an image becomes a surface.
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
    if (photometric.has("table")) {
      Reader table(photometric.at("table"), photometric.path("table"));
      NormalTable& t = sensor.photometric.table.emplace();
      t.reach = table.number("reach", 1e-3, 1, "");
      table.whole("side", 3, 65, "", t.side);
      for (const auto& [key, values] : {std::pair<const char*, std::vector<double>*>{"nx", &t.nx},
                                        std::pair<const char*, std::vector<double>*>{"ny", &t.ny}}) {
        const Json& list = table.array(key, size_t{t.side} * t.side, "side x side, rows of n_y");
        for (const Json& value : list) values->push_back(Reader::checked(value, table.path(key), -1, 1, ""));
      }
      table.finish();
    }
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
    if (const auto& t = s.photometric.table)
      photometric["table"] = {{"reach", t->reach}, {"side", t->side}, {"nx", t->nx}, {"ny", t->ny}};
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
