#include "viz/render/orbit.h"

namespace palpate::viz {

Eye place(const Camera& camera, const Vec3& half, double aspect, double fit_x, double fit_y) {
  Eye eye;
  eye.aspect = aspect;
  eye.right = camera.right();
  eye.up = camera.up();
  eye.backward = camera.backward();
  const double tan_y = std::tan(Camera::kFieldOfView_rad / 2);
  const double fit = camera.fit_distance_mm(half, tan_y * aspect * fit_x, tan_y * fit_y);
  eye.distance_mm = fit / camera.zoom;
  const Vec3 centre{0, 0, -half.z};
  eye.position = camera.target + centre + eye.backward * eye.distance_mm;

  // View: rows right, up, backward. Projection: depth 0 to 1, y downwards, as Vulkan has it.
  const double size = std::sqrt(dot(half, half));
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
    eye.clip_from_world[4 * c + 0] = static_cast<float>(focal / aspect * view[0][c]);
    eye.clip_from_world[4 * c + 1] = static_cast<float>(-focal * view[1][c]);
    eye.clip_from_world[4 * c + 2] =
        static_cast<float>(far / (near - far) * view[2][c] + last * near * far / (near - far));
    eye.clip_from_world[4 * c + 3] = static_cast<float>(-view[2][c]);
  }
  return eye;
}

}  // namespace palpate::viz
