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

  double azimuth_rad = -0.42;   ///< 0: seen from the image's bottom edge; positive: the eye moves right
  double elevation_rad = 0.72;  ///< above the pad; negative: from inside
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

  /// Distance at which the box of half sizes `half` (mm, about the point looked at) fits a view whose edges
  /// are seen at these tangents.
  double fit_distance_mm(const Vec3& half, double tan_x, double tan_y) const {
    double distance = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3 p{(corner & 1 ? 1 : -1) * half.x, (corner & 2 ? 1 : -1) * half.y,
                   (corner & 4 ? 1 : -1) * half.z};
      const double toward = dot(p, backward());
      distance = std::max(
          {distance, toward + std::abs(dot(p, right())) / tan_x, toward + std::abs(dot(p, up())) / tan_y});
    }
    return distance;
  }
};

/// A camera placed for one view: the matrix and what is needed to project labels and move with the mouse.
struct Eye {
  Vec3 position;
  Vec3 right, up, backward;
  double distance_mm = 1;
  double aspect = 1;
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
    return {0.5 + 0.5 * dot(d, right) / (depth * tan_y * aspect), 0.5 - 0.5 * dot(d, up) / (depth * tan_y),
            true};
  }
};

/// `half`: half sizes of the box that must fit at zoom 1, mm; its top is at rest level. It takes the middle
/// `fit_x` and `fit_y` (fractions) of the view, so that labels have room around it.
Eye place(const Camera& camera, const Vec3& half, double aspect, double fit_x, double fit_y);

}  // namespace palpate::viz
