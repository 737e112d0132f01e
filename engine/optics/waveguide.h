// A pad as a waveguide: plane clear layers between two outsides, which light runs through sideways, kept in
// by total internal reflection (Eq. 13-30). Light is kept that meets an outside at *more* than the critical
// angle (the paper's text has it the other way round in one place). n sin(theta) is the same in all layers: a
// ray is known by this tangential index, 0 along the normal and n_layer along the layer, and only the
// outsides and the layers between decide where it turns.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace palpate::optics {

/// asin(n_out / n_in), rad; none where n_out >= n_in and nothing is kept in. Throws Error(Failure::Input) on
/// an index outside [1, 10].
std::optional<double> critical_angle_rad(double n_in, double n_out);
/// sqrt(n_in^2 - n_out^2); 0 where nothing is kept in (Eq. 18).
double numerical_aperture(double n_in, double n_out);

/// Light that enters the edge from the outside within this angle of the edge's normal is kept in.
struct Acceptance {
  double half_angle_rad = 0;
  bool all = false;  ///< NA >= index outside: whatever enters is kept in, the angle is 90 deg
};
/// asin(NA / n_edge) (Eq. 19), `n_edge` being the medium that the light comes from.
Acceptance acceptance(double n_in, double n_out, double n_edge);

struct GuideLayer {
  double index = 1.4;       ///< 1 to 10
  double thickness_mm = 1;  ///< > 0
};

/// Layers from the face that is touched down to the side of the camera.
struct Waveguide {
  double above = 1;  ///< index outside the touched face
  std::vector<GuideLayer> layers;
  double below = 1;  ///< index on the camera's side
};
/// Throws Error(Failure::Input) without layers, on indices or thicknesses out of range.
void check_waveguide(const Waveguide& guide);
/// The larger index outside: light below it leaves.
double outside_index(const Waveguide& guide);
/// The layer in the middle, the upper of two: where a lamp shines unless it is said to shine elsewhere.
size_t middle_layer(const Waveguide& guide);
/// Depth below the touched face of the middle of a layer, mm. Throws Error(Failure::Input) where there is no
/// such layer.
double middle_depth_mm(const Waveguide& guide, size_t layer);

/// Where light goes that runs in `layer` with a tangential index.
struct Course {
  bool reaches_above = false;  ///< the touched face, neither turned back before nor at 90 deg
  bool reaches_below = false;
  bool leaves_above = false;  ///< it passes that face at least in part
  bool leaves_below = false;
  size_t highest = 0, lowest = 0;  ///< layers that it runs through

  bool guided() const { return !leaves_above && !leaves_below; }
  bool touches() const { return guided() && reaches_above; }
};
/// Throws Error(Failure::Input) where there is no such layer or the tangential index is not in [0, n_layer).
Course course_of(const Waveguide& guide, size_t layer, double tangential_index);

/// Way along the guide from one meeting with the highest face reached to the next: 2 sum(t tan(theta)) over
/// the layers the light runs through, mm.
double hop_mm(const Waveguide& guide, const Course& course, double tangential_index);

/// Light that a layer can guide.
struct LayerGuidance {
  std::optional<double> critical_above_rad, critical_below_rad;  ///< in this layer, of either outside
  double numerical_aperture = 0;                                 ///< against the larger outside
  Acceptance accepts;                                            ///< through the edge, from `n_edge`
  /// Tangential indices of light that is guided, and of guided light that meets the touched face. Empty
  /// (from >= to) where there is none.
  double guided_from = 0, guided_to = 0, touching_from = 0, touching_to = 0;
};
std::vector<LayerGuidance> guidance(const Waveguide& guide, double n_edge);

}  // namespace palpate::optics
