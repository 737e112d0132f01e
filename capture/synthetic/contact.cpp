#include "capture/synthetic/contact.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "capture/synthetic/optics.h"
#include "capture/synthetic/skin.h"

namespace palpate {
namespace {

struct Press {
  Scene scene;
  Layer layer;
  double radius_mm;
  double force_scale = 1;
  double own_N;

  explicit Press(const SyntheticOptions& o)
      : scene(scene_of(o)),
        layer({o.pad_young_MPa, 0.5}, o.pad_thickness_mm),
        radius_mm(o.indenter_radius_mm > 0 ? o.indenter_radius_mm : scene.indenter_radius_mm),
        own_N(scene.largest_force_N()) {
    if (o.force_N > 0 && own_N > 0) force_scale = o.force_N / own_N;
  }
  double reference_N() const { return own_N > 0 ? own_N * force_scale : 1; }
  LayerContact at(double force_N) const {
    return scene.flat ? layer.press_flat(force_N, radius_mm) : layer.press_sphere(force_N, radius_mm);
  }
};

}  // namespace

Scene scene_of(const SyntheticOptions& o) {
  Scene scene = find_scene(o.scene);
  if (!is_grip(o)) return scene;
  // Each pad carries half of the weight: down in the left picture, up in the right one, whose camera hangs
  // upside down.
  const double limit_N = o.friction * (o.force_N > 0 ? o.force_N : scene.largest_force_N());
  const double down = o.grip.side == SyntheticSide::Left ? 1 : -1;
  scene.keyframes = grip_script(scene.largest_force_N(), down * o.grip.weight_N / 2 / limit_N);
  return scene;
}

ScriptRules script_rules(const SyntheticOptions& o) {
  const Press press(o);
  const double reference_N = press.reference_N(), radius_mm = press.at(reference_N).summary().radius_mm;
  // At 1 N: the limit grows with F / a^2, the cube root of F.
  const double limit_rad =
      turn_limit_rad(o.friction, o.pad_young_MPa, radius_mm) * std::cbrt(reference_N * reference_N);
  return {o.rate_Hz,
          press.force_scale,
          mindlin_stiffness_N_per_mm({o.pad_young_MPa, 0.5}, radius_mm),
          o.friction,
          limit_rad,
          o.hysteresis,
          press.own_N * press.force_scale,
          1e-3 * skew_ms(o)};
}

PressedPad::PressedPad(const SyntheticOptions& o)
    : options_(o),
      pitch_mm_(optics::pitch_mm(o)),
      flat_(find_scene(o.scene).flat),
      radius_mm_(Press(o).radius_mm),
      layer_({o.pad_young_MPa, 0.5}, o.pad_thickness_mm) {
  const Scene scene = scene_of(o);
  const ScriptRules rules = script_rules(o);
  const auto count = static_cast<size_t>(std::max(1.0, std::round(scene.duration_s() * o.rate_Hz)));
  states_.push_back(play(scene.keyframes, count, rules));
  for (const Script& script : scene.others) states_.push_back(play(script, count, rules));
}

LayerContact PressedPad::press(double force_N) const {
  return flat_ ? layer_.press_flat(force_N, radius_mm_) : layer_.press_sphere(force_N, radius_mm_);
}

RadialTable PressedPad::touch_light(const LayerContact& contact, double gain) const {
  const double half_mm = std::max(pitch_mm_ / 2, flat_ ? 0.1 : 0.0), per_px = 4, step_mm = pitch_mm_ / per_px;
  const double reach_mm = contact.summary().radius_mm + half_mm;
  auto table = RadialTable::make(per_px, static_cast<int>(reach_mm / step_mm) + 4);
  const double scale = optics::scale(options_.bit_depth), limit = optics::kResponseLimit_gray * scale;
  for (size_t i = 0; i < table.values.size(); ++i) {
    const double r = static_cast<double>(i) * step_mm, out = r + half_mm, in = std::max(0.0, r - half_mm);
    const double force_N = contact.force_within_N(out) - (in > 0 ? contact.force_within_N(in) : 0);
    double gray = optics::kGrayPerMPa * scale * force_N / (std::numbers::pi * (out * out - in * in));
    gray *= gain;
    if (options_.response == SyntheticResponse::Saturating) gray = limit * (1 - std::exp(-gray / limit));
    table.values[i] = static_cast<float>(std::max(0.0, gray));
  }
  table.values.end()[-1] = table.values.end()[-2] = 0;
  return table;
}

RadialTable PressedPad::facing_light(const LayerContact& contact) const {
  const double per_px = 4, a_px = contact.summary().radius_mm / pitch_mm_;
  auto table = RadialTable::make(per_px, static_cast<int>((a_px + 1) * per_px) + 4);
  for (size_t i = 0; i < table.values.size(); ++i) {
    const double r_px = static_cast<double>(i) / per_px,
                 slope = flat_ ? 0 : std::min(r_px, a_px) * pitch_mm_ / radius_mm_;
    const double inside = std::clamp(a_px - r_px + 0.5, 0.0, 1.0);
    table.values[i] = static_cast<float>(inside * optics::kFacing_gray * optics::scale(options_.bit_depth) /
                                         std::sqrt(1 + slope * slope));
  }
  return table;
}

RadialTable PressedPad::over_frame(double x_px, double y_px, double per_px) const {
  const double to_corner_px =
      std::hypot(std::max(x_px, options_.width - 1 - x_px), std::max(y_px, options_.height - 1 - y_px));
  // Nothing is drawn beyond the layer's reach of 16 thicknesses.
  const double reach = std::min(to_corner_px + 1, 16 * options_.pad_thickness_mm / pitch_mm_ + 2);
  return RadialTable::make(per_px, static_cast<int>(reach * per_px) + 3);
}

RadialTable PressedPad::depth(const LayerContact& contact, double x_px, double y_px, double per_px) const {
  RadialTable table = over_frame(x_px, y_px, per_px);
  for (size_t i = 0; i < table.values.size(); ++i)
    table.values[i] = static_cast<float>(contact.deflection_mm(static_cast<double>(i) * pitch_mm_ / per_px));
  return table;
}

RadialTable PressedPad::slope_over_r(const LayerContact& contact, double x_px, double y_px) const {
  const double per_px = 2;
  RadialTable table = over_frame(x_px, y_px, per_px);
  const double step_mm = pitch_mm_ / per_px, a = contact.summary().radius_mm;
  std::vector<double> slope(table.values.size());
  for (size_t i = 1; i < slope.size(); ++i) {
    const double r = static_cast<double>(i) * step_mm, h = std::min(0.1 * step_mm, r / 2);
    // Differences within one side of the rim: a flat end's surface has an edge there.
    const double low = r > a ? std::max(r - h, a) : r - h, high = r <= a ? std::min(r + h, a) : r + h;
    slope[i] = (contact.deflection_mm(high) - contact.deflection_mm(low)) / (high - low) / r;
  }
  slope[0] = slope.size() > 1 ? slope[1] : 0;
  std::copy(slope.begin(), slope.end(), table.values.begin());
  return table;
}

}  // namespace palpate
