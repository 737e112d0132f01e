#include "capture/synthetic/object_shapes.h"

#include <algorithm>
#include <random>
#include <vector>

namespace palpate::scenes {

SolidObject textured_dome(double relief_mm) {
  struct Wave {
    double x, y, phase;
  };
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(0, 2 * M_PI);
  std::vector<Wave> waves;
  for (int k = 0; k < 12; ++k) {
    const double way = any(random), length = 1.1 + 0.08 * k;
    waves.push_back({2 * M_PI / length * std::cos(way), 2 * M_PI / length * std::sin(way), any(random)});
  }
  return {"textured dome", [waves, relief_mm](double x, double y) {
            double sum = 0;
            for (const Wave& w : waves) sum += std::sin(w.x * x + w.y * y + w.phase);
            return 0.45 - (x * x + y * y) / 60 + relief_mm * sum / std::sqrt(6.0);
          }};
}

SolidObject textured_plane() {
  return {"textured plane", [dome = textured_dome()](double x, double y) {
            return dome.depth_mm(x, y) + (x * x + y * y) / 60;
          }};
}

SolidObject ball(double radius_mm, double depth_mm) {
  return {"ball", [=](double x, double y) {
            const double square = radius_mm * radius_mm - x * x - y * y;
            return square > 0 ? std::sqrt(square) - radius_mm + depth_mm : -radius_mm;
          }};
}
SolidObject plane(double depth_mm) {
  return {"plane", [=](double x, double y) { return depth_mm + 0.02 * x - 0.01 * y; }};
}
SolidObject cylinder(double radius_mm, double depth_mm) {
  return {"cylinder", [=](double x, double y) {
            const double across = 0.8 * y - 0.6 * x, square = radius_mm * radius_mm - across * across;
            return square > 0 ? std::sqrt(square) - radius_mm + depth_mm : -radius_mm;
          }};
}
SolidObject ellipsoid() {
  return {"ellipsoid", [](double x, double y) {
            const double square = 1 - x * x / 81 - y * y / 16;
            return square > 0 ? 6 * std::sqrt(square) - 6 + 0.6 : -6.0;
          }};
}
SolidObject screw(double radius_mm, double pitch_mm) {
  return {"screw", [=](double x, double y) {
            if (std::abs(y) > 0.9 * radius_mm) return -radius_mm;
            // The radius depends on the angle about the axis, and that on the radius.
            double high = std::sqrt(radius_mm * radius_mm - y * y);
            for (int step = 0; step < 8; ++step) {
              const double r = radius_mm + 0.06 * std::cos(2 * M_PI * x / pitch_mm - std::atan2(y, high));
              high = std::sqrt(r * r - y * y);
            }
            return high - radius_mm + 0.6;
          }};
}
SolidObject key_relief() {
  return {"key", [](double x, double y) {
            const auto step = [](double d) { return 1 / (1 + std::exp(-d / 0.08)); };
            const double bow = step(1.6 - std::hypot(x + 2.2, y)) * step(std::hypot(x + 2.2, y) - 0.7);
            const double shaft = step(0.5 - std::abs(y)) * step(x + 1) * step(3.4 - x);
            const double teeth =
                step(y) * step(1.3 + 0.3 * std::cos(4 * x) - y) * step(x - 1.4) * step(3.2 - x);
            return 0.15 + 0.25 * std::max({bow, shaft, teeth}) - (x * x + y * y) / 160;
          }};
}
SolidObject coin() {
  return {"coin", [](double x, double y) {
            const auto step = [](double d) { return 1 / (1 + std::exp(-d / 0.06)); };
            const double r = std::hypot(x, y);
            double relief = step(0.25 - std::abs(r - 4)) + step(0.3 - std::abs(x + 0.4 * y)) * step(2.4 - r);
            for (int k = 0; k < 7; ++k) {
              const double a = 0.9 * k * (1 + 0.07 * k);
              relief += step(0.3 - std::hypot(x - 3.1 * std::cos(a), y - 3.1 * std::sin(a)));
            }
            return 0.3 + 0.1 * std::min(relief, 1.2);
          }};
}

RoundObject bead(double radius_mm, double relief_mm) {
  struct Wave {
    double x, y, z, phase;
  };
  std::mt19937 random(11);
  std::uniform_real_distribution<double> any(-1, 1);
  std::vector<Wave> waves;
  for (int k = 0; k < 16; ++k) {
    const double up = any(random), around = M_PI * any(random), flat = std::sqrt(1 - up * up);
    const double per_unit = 2 * M_PI / (1.1 + 0.06 * k) * radius_mm;
    waves.push_back({per_unit * flat * std::cos(around), per_unit * flat * std::sin(around), per_unit * up,
                     M_PI * any(random)});
  }
  return {"bead", [waves, radius_mm, relief_mm](double x, double y, double z) {
            double sum = 0;
            for (const Wave& w : waves) sum += std::sin(w.x * x + w.y * y + w.z * z + w.phase);
            return radius_mm + relief_mm * sum / std::sqrt(8.0);
          }};
}

RoundObject seed() {
  return {"seed", [](double x, double y, double z) {
            const double ellipsoid = 1 / std::sqrt(x * x / 16 + y * y / 6.25 + z * z / 4);
            return ellipsoid * (1 + 0.012 * std::cos(14 * std::atan2(y, z)) * (1 - x * x));
          }};
}

}  // namespace palpate::scenes
