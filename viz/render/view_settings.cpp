#include "viz/render/view_settings.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string>

namespace palpate::viz {
namespace {

using V = ViewSettings;

constexpr std::array kSettings = {
    ViewSetting{.name = "text_scale",
                .member = &V::text_scale,
                .least = V::kLeastTextScale,
                .most = V::kMostTextScale},
    ViewSetting{"colours", &V::quantity, "colours show depth, pressure, strain", 'D', true},
    ViewSetting{"colour_map", &V::map, "colour map: viridis, cividis, magma", 'O', true},
    ViewSetting{.name = "arrows", .member = &V::arrows},
    ViewSetting{"image_large", &V::image_large, "image and surface change places", GLFW_KEY_TAB, true},
    ViewSetting{.name = "arrangement", .member = &V::arrangement},
    ViewSetting{"light", &V::lit, "light on the surface", 'L', true},
    ViewSetting{"grid", &V::grid, "grid on the surface", 'G', true},
    ViewSetting{"axes", &V::axes, "axes in mm", 'Y', true},
    ViewSetting{"section", &V::section, "section line; drag its ends or middle", 'X', true},
    ViewSetting{.name = "section_line", .member = &V::line},
    ViewSetting{"object_map", &V::object_map, "map of what the pad moves over"},
    ViewSetting{"charts", &V::charts, "strip charts", 'P'},
    ViewSetting{.name = "chart_span_s", .member = &V::chart_span_s, .least = 1, .most = 60},
    ViewSetting{"contacts", &V::contacts, "contacts over image and surface", 'K'},
    ViewSetting{"skin", &V::skin, "skin shifts over the image", 'J'},
    ViewSetting{"skin_strain", &V::skin_strain, "strain of the skin over the image", 'N'},
    ViewSetting{"places_in_px", &V::pixels, "places from the top left corner, not in mm from the middle"},
    ViewSetting{"rates", &V::rates, "performance: rates, latency, mesh, timeline", 'F'},
    ViewSetting{"controls", &V::controls, "settings on, off", 'C'},
    ViewSetting{"light_theme", &V::light_theme, "dark words on a light ground", 'U'}};

}  // namespace

const char* to_string(TractionArrows arrows) {
  constexpr std::array kNames{"shear", "pressure", "off"};
  return kNames[static_cast<size_t>(arrows)];
}

void ViewSettings::enlarge_text(bool larger) {
  text_scale = std::clamp(text_scale * (larger ? 1.15f : 1 / 1.15f), kLeastTextScale, kMostTextScale);
}

std::span<const ViewSetting> view_settings() {
  return kSettings;
}

const ViewSetting& view_setting(int key) {
  for (const ViewSetting& setting : kSettings)
    if (setting.key == key) return setting;
  throw std::logic_error("no setting of the key " + std::to_string(key));
}

}  // namespace palpate::viz
