// Sections of a sensor file: from the camera's image to the rectified frame, its untouched image, the pad.
#include "engine/sensor/json.h"

namespace palpate::sensor_json {
namespace {
constexpr std::array kBackgroundKinds{BackgroundKind::Untouched, BackgroundKind::None};
}

void read_frame(const Json& json, const std::string& where, Sensor& sensor) {
  Reader frame(json, where);
  if (frame.has("camera_px")) {
    const Json& size = frame.array("camera_px", 2, "width, height");
    for (size_t i = 0; i < 2; ++i)
      sensor.camera_px[i] = Reader::checked_whole(size[i], frame.path("camera_px"), 1, kMaxSide_px, "px");
  }
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
  if (frame.has("lens")) {
    Reader reader(frame.at("lens"), frame.path("lens"));
    Lens& lens = sensor.lens.emplace();
    constexpr double kFar_px = 1e6;
    lens.fx_px = reader.number("fx_px", 1e-3, kFar_px, "px");
    lens.fy_px = reader.number("fy_px", 1e-3, kFar_px, "px");
    lens.cx_px = reader.number("cx_px", -kFar_px, kFar_px, "px");
    lens.cy_px = reader.number("cy_px", -kFar_px, kFar_px, "px");
    const Json& terms = reader.array("distortion", 5, "k1, k2, p1, p2, k3");
    for (size_t i = 0; i < 5; ++i)
      lens.distortion[i] = Reader::checked(terms[i], reader.path("distortion"), -1e3, 1e3, "");
    reader.number("residual_px", 0, 1e3, "px", lens.residual_px);
    lens.origin = read_origin(reader);
    reader.finish();
  }
  if (frame.has("flat")) {
    Reader reader(frame.at("flat"), frame.path("flat"));
    FlatField& flat = sensor.flat.emplace();
    flat.image = reader.text("image");
    flat.gain = reader.number("gain", 1e-9, 1e3, "per gray level of the image");
    flat.origin = read_origin(reader);
    reader.finish();
  }
  frame.whole("channels", 1, 3, "", sensor.channels);
  frame.whole("bit_depth", 8, 16, "bits", sensor.bit_depth);
  frame.finish();
}

Json frame_json(const Sensor& s) {
  Json frame{{"channels", s.channels}, {"bit_depth", s.bit_depth}};
  if (s.camera_px[0] > 0) frame["camera_px"] = s.camera_px;
  if (s.crop_px) frame["crop_px"] = *s.crop_px;
  if (s.lens) {
    Json lens{{"fx_px", s.lens->fx_px},           {"fy_px", s.lens->fy_px},
              {"cx_px", s.lens->cx_px},           {"cy_px", s.lens->cy_px},
              {"distortion", s.lens->distortion}, {"residual_px", s.lens->residual_px}};
    add_origin(lens, s.lens->origin);
    frame["lens"] = lens;
  }
  if (s.quad_px) frame["quad_px"] = *s.quad_px;
  if (s.size_px[0] > 0) frame["size_px"] = s.size_px;
  if (s.flat) {
    Json flat{{"image", s.flat->image}, {"gain", s.flat->gain}};
    add_origin(flat, s.flat->origin);
    frame["flat"] = flat;
  }
  return frame;
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

Json background_json(const BackgroundSource& background) {
  Json json{{"source", to_string(background.kind)}};
  if (background.kind == BackgroundKind::Untouched) json["first_frames"] = background.first_frames;
  if (!background.image.empty()) json["image"] = background.image;
  return json;
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

Json pad_json(const PadOutline& outline) {
  if (const auto* r = std::get_if<PadRectangle>(&outline))
    return {{"rectangle_px", {r->x, r->y, r->width, r->height}}};
  if (const auto* e = std::get_if<PadEllipse>(&outline))
    return {{"ellipse_px", {e->x, e->y, e->radius_x, e->radius_y, e->angle_rad}}};
  return {{"polygon_px", std::get<PadPolygon>(outline).corners}};
}

}  // namespace palpate::sensor_json
