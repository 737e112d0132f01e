// The contacts of the synthetic pad, solved, and what follows from one by distance from its centre: light,
// depth, slope, the skin's displacement.
#pragma once

#include <cmath>
#include <vector>

#include "capture/synthetic/options.h"
#include "capture/synthetic/scene.h"
#include "engine/elasticity/layer.h"

namespace palpate {

/// A function of the distance from the contact's centre, sampled evenly in r.
struct RadialTable {
  float per_px = 1;  ///< samples in one pixel
  float last = 0;    ///< largest position that can be interpolated
  std::vector<float> values;

  float at(float position) const {
    position = std::min(position, last);
    const auto i = static_cast<int>(position);
    const float t = position - static_cast<float>(i);
    return values[i] + t * (values[i + 1] - values[i]);
  }
  /// At an offset from the centre, px.
  float at(float dx, float dy) const { return at(std::sqrt(dx * dx + dy * dy) * per_px); }
  static RadialTable make(double per_px, int count) {
    return {static_cast<float>(per_px), static_cast<float>(count - 2) + 0.999f, std::vector<float>(count)};
  }
};

/// The pad, what presses on it, and what friction makes of it.
class PressedPad {
 public:
  explicit PressedPad(const SyntheticOptions& options);

  size_t frames() const { return states_.front().size(); }
  size_t indenters() const { return states_.size(); }
  const ScriptState& state(size_t indenter, uint64_t sequence) const {
    return states_[indenter][sequence % frames()];
  }
  LayerContact press(double force_N) const;

  /// Touch light: the pressure's mean over a pixel (the flat end's edge is broken by 0.1 mm), times the gain,
  /// then the response. Gray.
  RadialTable touch_light(const LayerContact& contact, double gain) const;
  /// Lambert: facing_gray * n_z inside the contact, nothing outside; the rim pixel is blended by its covered
  /// fraction inside.
  RadialTable facing_light(const LayerContact& contact) const;
  /// Depth over the whole frame, mm, about a contact's centre.
  RadialTable depth(const LayerContact& contact, double x_px, double y_px, double per_px) const;
  /// d(depth)/dr / r, 1/mm: times the offset from the centre it is the gradient.
  RadialTable slope_over_r(const LayerContact& contact, double x_px, double y_px) const;

 private:
  /// Without values yet: from the centre to the farthest corner.
  RadialTable over_frame(double x_px, double y_px, double per_px) const;

  SyntheticOptions options_;
  double pitch_mm_;
  bool flat_;
  double radius_mm_;  // of the indenters
  Layer layer_;
  std::vector<std::vector<ScriptState>> states_;  // of each indenter
};

/// The scene of these options; that of a grip with the load of the object's weight.
Scene scene_of(const SyntheticOptions& options);

/// Stiffness for tangential loads of a scene's contact, and all else that turns its scripts into states.
ScriptRules script_rules(const SyntheticOptions& options);

}  // namespace palpate
