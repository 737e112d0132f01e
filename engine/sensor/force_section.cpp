// Sections of a sensor file: from signals to newtons, and the pattern on the pad's skin.
#include "engine/sensor/json.h"

namespace palpate::sensor_json {
namespace {

constexpr std::array kForceSignals{ForceSignal::GraySum,  ForceSignal::Area,  ForceSignal::Volume,
                                   ForceSignal::Gradient, ForceSignal::Layer, ForceSignal::LayerAndBending};
constexpr std::array kForceModels{ForceModel::Line, ForceModel::Power, ForceModel::Spline, ForceModel::Scale};
constexpr std::array kShearSignals{ShearSignal::Centroid, ShearSignal::Skin};
constexpr std::array kSkinKinds{SkinKind::Markers, SkinKind::Texture};

std::vector<std::array<double, 2>> read_knots(Reader& reader, const char* key) {
  const Json& list = reader.at(key);
  if (!list.is_array() || list.size() > 64)
    fail(reader.path(key), "up to 64 knots as [signal, force_N]", shown(list));
  std::vector<std::array<double, 2>> knots;
  for (const Json& knot : list) {
    if (!knot.is_array() || knot.size() != 2)
      fail(reader.path(key), "knots as [signal, force_N]", shown(knot));
    knots.push_back({Reader::checked(knot[0], reader.path(key), -1e16, 1e16, ""),
                     Reader::checked(knot[1], reader.path(key), -1e6, 1e6, "N")});
  }
  for (size_t i = 1; i < knots.size(); ++i)
    if (!(knots[i][0] > knots[i - 1][0]) || knots[i][1] < knots[i - 1][1])
      fail(reader.path(key), "a signal that rises and a force that does not fall from knot to knot",
           shown(list[i - 1]) + ", " + shown(list[i]));
  return knots;
}

ForceCurve read_curve(const Json& json, const std::string& where) {
  Reader reader(json, where);
  ForceCurve curve;
  curve.c1 = reader.number("c1", -kHuge, kHuge, "N per unit of the signal");
  curve.c0_N = reader.number("c0_N", -1e6, 1e6, "N");
  reader.number("exponent", 0.05, 20, "", curve.exponent);
  if (reader.has("knots")) curve.knots = read_knots(reader, "knots");
  reader.number("residual_sd_N", 0, 1e6, "N", curve.residual_sd_N);
  reader.finish();
  return curve;
}

Json curve_json(const ForceCurve& curve) {
  Json json{{"c1", curve.c1},
            {"c0_N", curve.c0_N},
            {"exponent", curve.exponent},
            {"residual_sd_N", curve.residual_sd_N}};
  if (!curve.knots.empty()) json["knots"] = curve.knots;
  return json;
}

}  // namespace

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
  force.gray_min = reader.number("gray_min", -1e16, 1e16, "gray levels");
  force.gray_max = reader.number("gray_max", 0, 1e16, "gray levels");
  reader.choice("signal", kForceSignals, force.signal);
  reader.choice("model", kForceModels, force.model);
  reader.number("exponent", 0.05, 20, "", force.exponent);
  if (reader.has("knots")) force.knots = read_knots(reader, "knots");
  for (auto& [key, branch] :
       {std::pair<const char*, std::optional<ForceCurve>*>{"loading", &force.loading},
        std::pair<const char*, std::optional<ForceCurve>*>{"unloading", &force.unloading}})
    if (reader.has(key)) *branch = read_curve(reader.at(key), reader.path(key));
  if (force.loading.has_value() != force.unloading.has_value())
    fail(where, "'loading' and 'unloading', or neither", "one of them");
  if (force.model == ForceModel::Spline && force.loading)
    for (const auto& [key, curve] :
         {std::pair<const char*, const ForceCurve*>{"loading", &*force.loading},
          std::pair<const char*, const ForceCurve*>{"unloading", &*force.unloading}})
      if (curve->knots.size() < 2)
        fail(reader.path(key) + ".knots", "2 knots or more for model 'spline'",
             std::to_string(curve->knots.size()));
  reader.number("force_max_N", 0, 1e6, "N", force.force_max_N);
  reader.number("hysteresis", 0, 10, "share of full scale", force.hysteresis);
  reader.number("drift_N_per_min", -1e6, 1e6, "N per min", force.drift_N_per_min);
  reader.number("r_squared", -1e6, 1, "", force.r_squared);
  reader.number("residual_share", 0, 10, "", force.residual_fraction);
  reader.number("residual_grows_to_N", 0, 1e6, "N", force.residual_grows_to_N);
  reader.number("bending_N_per_mm", 0, 1e9, "N per mm", force.bending_N_per_mm);
  for (const auto& [key, value] :
       {std::pair{"fit_for_use", &force.fit_for_use}, std::pair{"shapes_judged", &force.shapes_judged}}) {
    if (!reader.has(key)) continue;
    const Json& given = reader.at(key);
    if (!given.is_boolean()) fail(reader.path(key), "true or false", shown(given));
    *value = given.get<bool>();
  }
  force.origin = read_origin(reader);
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
  reader.choice("signal", kShearSignals, shear.signal);
  reader.number("friction_sd", 0, 100, "", shear.friction_sd);
  reader.number("shift_max_mm", 0, 1e6, "mm", shear.shift_max_mm);
  shear.origin = read_origin(reader);
  reader.finish();
  return shear;
}

Json force_json(const ForceCalibration& f) {
  Json json{{"c1_N_per_gray", f.c1_N_per_gray}, {"c0_N", f.c0_N},         {"residual_sd_N", f.residual_sd_N},
            {"covariance", f.covariance},       {"gray_min", f.gray_min}, {"gray_max", f.gray_max}};
  if (f.signal != ForceSignal::GraySum) json["signal"] = to_string(f.signal);
  if (f.model != ForceModel::Line) json["model"] = to_string(f.model);
  if (f.model == ForceModel::Power) json["exponent"] = f.exponent;
  if (!f.knots.empty()) json["knots"] = f.knots;
  if (f.loading) json["loading"] = curve_json(*f.loading);
  if (f.unloading) json["unloading"] = curve_json(*f.unloading);
  if (f.force_max_N != 0) json["force_max_N"] = f.force_max_N;
  if (f.hysteresis != 0) json["hysteresis"] = f.hysteresis;
  if (f.drift_N_per_min != 0) json["drift_N_per_min"] = f.drift_N_per_min;
  if (f.r_squared != 0) json["r_squared"] = f.r_squared;
  if (f.residual_fraction != 0) json["residual_share"] = f.residual_fraction;
  if (f.residual_grows_to_N != 0) json["residual_grows_to_N"] = f.residual_grows_to_N;
  if (f.bending_N_per_mm != 0) json["bending_N_per_mm"] = f.bending_N_per_mm;
  if (!f.fit_for_use) json["fit_for_use"] = false;
  if (!f.shapes_judged) json["shapes_judged"] = false;
  add_origin(json, f.origin);
  return json;
}

Json shear_json(const ShearCalibration& s) {
  Json json{{"kx_N_per_mm", s.kx_N_per_mm},
            {"ky_N_per_mm", s.ky_N_per_mm},
            {"friction", s.friction},
            {"relative_sd", s.relative_sd}};
  if (s.signal != ShearSignal::Centroid) json["signal"] = to_string(s.signal);
  if (s.friction_sd != 0) json["friction_sd"] = s.friction_sd;
  if (s.shift_max_mm != 0) json["shift_max_mm"] = s.shift_max_mm;
  add_origin(json, s.origin);
  return json;
}

SkinPattern read_skin(const Json& json, const std::string& where) {
  Reader reader(json, where);
  SkinPattern skin;
  reader.choice("kind", kSkinKinds, skin.kind);
  reader.number("spacing_px", 2, kMaxSide_px, "px", skin.spacing_px);
  reader.number("size_px", 1, kMaxSide_px, "px", skin.size_px);
  reader.number("shift_sd_px", 0, 100, "px", skin.shift_sd_px);
  reader.finish();
  return skin;
}

Json skin_json(const SkinPattern& skin) {
  return {{"kind", to_string(skin.kind)},
          {"spacing_px", skin.spacing_px},
          {"size_px", skin.size_px},
          {"shift_sd_px", skin.shift_sd_px}};
}

}  // namespace palpate::sensor_json
