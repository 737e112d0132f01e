// Orbit camera of the surface view, and the matrix algebra that it needs.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

namespace palpate::viz {

struct Vec3 {
  double x = 0, y = 0, z = 0;
  Vec3 operator+(const Vec3& o) const { return {x + o.x, y + o.y, z + o.z}; }
  Vec3 operator-(const Vec3& o) const { return {x - o.x, y - o.y, z - o.z}; }
  Vec3 operator*(double s) const { return {x * s, y * s, z * s}; }
};
inline double dot(const Vec3& a, const Vec3& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline Vec3 normalized(const Vec3& a) {
  return a * (1 / std::sqrt(dot(a, a)));
}

/// Column major, as GLSL reads it.
using Mat4 = std::array<float, 16>;

/// Screen place of a world point, as fractions of the view: (0, 0) top left, (1, 1) bottom right.
struct Projected {
  double x = 0, y = 0;
  bool in_front = false;
};

/// Looks at `target` from `distance` away. World axes: x right and y up in the image, z out of the pad, mm.
struct Camera {
  static constexpr double kFieldOfView_rad = 0.5;  ///< vertical
  static constexpr double kMaxElevation_rad = 1.55;

  double azimuth_rad = -0.3;    ///< 0: seen from the image's bottom edge; positive: the eye moves right
  double elevation_rad = 0.85;  ///< above the pad; negative: from inside
  double zoom = 1;              ///< 1: the whole pad fits
  Vec3 target;                  ///< from the middle of the fitted box, mm

  void orbit(double right_rad, double up_rad) {
    azimuth_rad = std::remainder(azimuth_rad + right_rad, 2 * std::acos(-1.0));
    elevation_rad = std::clamp(elevation_rad + up_rad, -kMaxElevation_rad, kMaxElevation_rad);
  }
  void magnify(double factor) { zoom = std::clamp(zoom * factor, 0.2, 40.0); }

  Vec3 backward() const {
    return {std::sin(azimuth_rad) * std::cos(elevation_rad), -std::cos(azimuth_rad) * std::cos(elevation_rad),
            std::sin(elevation_rad)};
  }
  Vec3 right() const { return {std::cos(azimuth_rad), std::sin(azimuth_rad), 0}; }
  Vec3 up() const { return cross(backward(), right()); }
};

/// A camera placed for one view: the matrix and what is needed to project labels and move with the mouse.
struct Eye {
  Vec3 position;
  Vec3 right, up, backward;
  double distance_mm = 1;
  double aspect = 1;
  double shift_x = 0, shift_y = 0;  ///< of the middle of the picture from that of the view, in its sizes
  Mat4 clip_from_world{};

  /// Scale of a picture `height_px` high, at the middle of the view.
  double mm_per_px(double height_px) const {
    return 2 * distance_mm * std::tan(Camera::kFieldOfView_rad / 2) / height_px;
  }
  Projected project(const Vec3& world) const {
    const Vec3 d = world - position;
    const double depth = -dot(d, backward);
    const double tan_y = std::tan(Camera::kFieldOfView_rad / 2);
    if (depth <= 1e-9) return {};
    return {0.5 + shift_x + 0.5 * dot(d, right) / (depth * tan_y * aspect),
            0.5 + shift_y - 0.5 * dot(d, up) / (depth * tan_y), true};
  }
  /// The direction in which a place of the view is seen, fractions as of Projected.
  Vec3 ray(double x, double y) const {
    const double tan_y = std::tan(Camera::kFieldOfView_rad / 2);
    return right * (2 * (x - 0.5 - shift_x) * tan_y * aspect) - up * (2 * (y - 0.5 - shift_y) * tan_y) -
           backward;
  }
};

/// What stays free around the surface for labels, fractions of the view.
struct ViewMargins {
  double left = 0, right = 0, top = 0, bottom = 0;
};

/// `half`: half sizes of the box that fills the view within the margins at zoom 1, mm; its top is at rest
/// level.
Eye place(const Camera& camera, const Vec3& half, double aspect, const ViewMargins& margins);

}  // namespace palpate::viz
