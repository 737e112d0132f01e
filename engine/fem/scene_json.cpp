#include "engine/fem/scene_json.h"

namespace palpate::fem {

const char* to_string(Presser presser) {
  switch (presser) {
    case Presser::Flat:
      return "flat";
    case Presser::Sphere:
      return "ball";
    case Presser::Pressure:
      return "pressure";
  }
  return "";
}

json::Value to_json(const Scene& s) {
  json::Value value = {{"block_mm", s.block_mm}, {"young_Pa", s.young_Pa},
                       {"poisson", s.poisson},   {"bottom", s.bottom_slides ? "sliding" : "bonded"},
                       {"cells", s.cells},       {"presser", to_string(s.presser)}};
  if (s.plate_half_mm) value["plate_half_mm"] = *s.plate_half_mm;
  if (s.plate_sticks) value["plate"] = "sticks";
  if (s.plate_friction > 0) value["plate_friction"] = s.plate_friction;
  if (s.presser == Presser::Sphere) value["ball_radius_mm"] = s.ball_radius_mm;
  if (s.press_mm) value["press_mm"] = *s.press_mm;
  if (s.force_N) value["force_N"] = *s.force_N;
  value["inclusion"] = nullptr;
  if (s.inclusion)
    value["inclusion"] = {{"shape", to_string(s.inclusion->shape)},
                          {"size_mm", s.inclusion->size()},
                          {"depth_mm", s.inclusion->depth_mm},
                          {"stiffness_ratio", s.inclusion->stiffness_ratio},
                          {"offset_mm", s.inclusion->offset_mm}};
  if (s.skin)
    value["skin"] = {{"thickness_mm", s.skin->thickness_mm}, {"stiffness_ratio", s.skin->stiffness_ratio}};
  if (!s.pad.empty()) value["pad_on_tissue"] = s.pad_slides ? "sliding" : "bonded";
  value["pad"] = json::Value::array();
  for (const PadSheet& sheet : s.pad)
    value["pad"].push_back({{"thickness_mm", sheet.thickness_mm}, {"young_Pa", sheet.young_Pa}});
  return value;
}

}  // namespace palpate::fem
