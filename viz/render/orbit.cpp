#include "viz/render/orbit.h"

namespace palpate::viz {

namespace {

/// Where the box is seen, fractions of the view from its middle.
struct Bounds {
  double left = 1e9, right = -1e9, top = 1e9, bottom = -1e9;
};
Bounds bounds_of(const Eye& eye, const Vec3& half) {
  Bounds b;
  for (int corner = 0; corner < 8; ++corner) {
    const Projected p = eye.project(
        {(corner & 1 ? 1 : -1) * half.x, (corner & 2 ? 1 : -1) * half.y, (corner & 4 ? 0 : -2) * half.z});
    if (!p.in_front) return {-1e9, 1e9, -1e9, 1e9};
    b = {std::min(b.left, p.x - 0.5), std::max(b.right, p.x - 0.5), std::min(b.top, p.y - 0.5),
         std::max(b.bottom, p.y - 0.5)};
  }
  return b;
}

}  // namespace

Eye place(const Camera& camera, const Vec3& half, double aspect, const ViewMargins& margins) {
  Eye eye;
  eye.aspect = aspect;
  eye.right = camera.right();
  eye.up = camera.up();
  eye.backward = camera.backward();
  const double tan_y = std::tan(Camera::kFieldOfView_rad / 2);
  const Vec3 centre{0, 0, -half.z};
  const double width = std::max(0.2, 1 - margins.left - margins.right);
  const double height = std::max(0.2, 1 - margins.top - margins.bottom);
  // As near as the box has room. What is seen of it shrinks with the distance.
  constexpr int kHalvings = 60;
  const double size = std::sqrt(dot(half, half));
  double near_mm = 0, far_mm = 100 * size;
  for (int i = 0; i < kHalvings; ++i) {
    eye.distance_mm = (near_mm + far_mm) / 2;
    eye.position = centre + eye.backward * eye.distance_mm;
    const Bounds b = bounds_of(eye, half);
    (b.right - b.left <= width && b.bottom - b.top <= height ? far_mm : near_mm) = eye.distance_mm;
  }
  eye.position = centre + eye.backward * far_mm;
  const Bounds b = bounds_of(eye, half);
  eye.shift_x = (margins.left - margins.right) / 2 - (b.left + b.right) / 2;
  eye.shift_y = (margins.top - margins.bottom) / 2 - (b.top + b.bottom) / 2;
  eye.distance_mm = far_mm / camera.zoom;
  eye.position = camera.target + centre + eye.backward * eye.distance_mm;

  // View: rows right, up, backward. Projection: depth 0 to 1, y downwards, as Vulkan has it.
  const double near = std::max(eye.distance_mm - 3 * size, 0.02 * eye.distance_mm);
  const double far = eye.distance_mm + 6 * size;
  const double focal = 1 / tan_y;
  const Vec3 rows[3] = {eye.right, eye.up, eye.backward};
  double view[3][4];
  for (int i = 0; i < 3; ++i) {
    view[i][0] = rows[i].x;
    view[i][1] = rows[i].y;
    view[i][2] = rows[i].z;
    view[i][3] = -dot(rows[i], eye.position);
  }
  for (int c = 0; c < 4; ++c) {
    const double last = c == 3 ? 1 : 0;
    eye.clip_from_world[4 * c + 0] =
        static_cast<float>(focal / aspect * view[0][c] - 2 * eye.shift_x * view[2][c]);
    eye.clip_from_world[4 * c + 1] = static_cast<float>(-focal * view[1][c] - 2 * eye.shift_y * view[2][c]);
    eye.clip_from_world[4 * c + 2] =
        static_cast<float>(far / (near - far) * view[2][c] + last * near * far / (near - far));
    eye.clip_from_world[4 * c + 3] = static_cast<float>(-view[2][c]);
  }
  return eye;
}

}  // namespace palpate::viz
