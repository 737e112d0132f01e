#include "perf/motion/moved_object.h"

#include <algorithm>

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

namespace {

/// In place, by a Gaussian whose weights sum to 1; the border goes on.
void blur(std::vector<float>& map, uint32_t width, uint32_t height, double sd_px) {
  if (sd_px <= 0) return;
  const auto far = static_cast<size_t>(std::ceil(3 * sd_px));
  std::vector<float> kernel, line;
  double sum = 0;
  const auto weight = [&](size_t k) {
    const double way = static_cast<double>(k) - static_cast<double>(far);
    return std::exp(-way * way / (2 * sd_px * sd_px));
  };
  for (size_t k = 0; k <= 2 * far; ++k) sum += weight(k);
  for (size_t k = 0; k <= 2 * far; ++k) kernel.push_back(static_cast<float>(weight(k) / sum));
  const auto pass = [&](uint32_t lines, uint32_t length, size_t next, size_t step) {
    line.resize(length);
    for (uint32_t l = 0; l < lines; ++l) {
      for (uint32_t i = 0; i < length; ++i) line[i] = map[l * next + i * step];
      for (size_t i = 0; i < length; ++i) {
        float value = 0;
        for (size_t k = 0; k < kernel.size(); ++k)
          value += kernel[k] * line[std::clamp<size_t>(i + k, far, far + length - 1) - far];
        map[l * next + i * step] = value;
      }
    }
  };
  pass(height, width, width, 1);
  pass(width, height, 1, width);
}

/// Of standard deviation 1 and a covariance of that reach.
std::vector<float> noise_layer(const PadView& pad, double reach_px, std::mt19937& random) {
  std::normal_distribution<float> normal;
  std::vector<float> map(size_t{pad.width} * pad.height);
  for (float& value : map) value = normal(random);
  blur(map, pad.width, pad.height, reach_px / std::sqrt(2.0));
  double squares = 0;
  for (const float value : map) squares += double{value} * double{value};
  const auto scale = static_cast<float>(1 / std::sqrt(squares / double(map.size())));
  for (float& value : map) value *= scale;
  return map;
}

/// Depth of the pad's own slope error, each octave a fifth of its square.
std::vector<float> pad_map(const PadView& pad) {
  std::mt19937 random(77);
  std::vector<float> sum(size_t{pad.width} * pad.height);
  for (const double reach_px : {3.0, 6.0, 12.0, 24.0, 48.0}) {
    const std::vector<float> part = noise_layer(pad, reach_px, random);
    const auto sd_mm = static_cast<float>(pad.slope_error / std::sqrt(5.0) * reach_px * pad.pitch_mm);
    for (size_t i = 0; i < sum.size(); ++i) sum[i] += sd_mm * part[i];
  }
  return sum;
}

/// Of standard deviation 1, before any smoothing.
std::vector<float> noise_map(const PadView& pad, DepthNoise kind, std::mt19937& random) {
  const auto layer = [&](double reach_px) { return noise_layer(pad, reach_px, random); };
  if (kind == DepthNoise::White) return layer(0);
  if (kind == DepthNoise::Reach3) return layer(3);
  // Equal parts of all octaves, as the spectrum 1 / k^2 has.
  std::vector<float> sum(size_t{pad.width} * pad.height);
  for (const double reach : {1.0, 2.0, 4.0, 8.0, 16.0}) {
    const std::vector<float> part = layer(reach);
    for (size_t i = 0; i < sum.size(); ++i) sum[i] += part[i] / std::sqrt(5.0f);
  }
  return sum;
}

}  // namespace

RigidMotion on_path(double time_s) {
  Vector6d twist;
  twist << 2 * std::sin(0.9 * time_s), 1.5 * std::sin(0.55 * time_s), 0.05 * std::sin(1.3 * time_s),
      3 * kDegree * std::sin(0.7 * time_s), 3 * kDegree * std::sin(0.4 * time_s),
      35 * kDegree * std::sin(0.33 * time_s);
  return motion_about(Eigen::Vector3d::Zero(), twist);
}

PressedMap pressed(const SolidObject& object, const RigidMotion& motion, const PadView& pad, double noise_mm,
                   DepthNoise kind, std::mt19937& random) {
  PressedMap out{pad.width, pad.height, pad.pitch_mm, {}, {}};
  const size_t pixels = size_t{pad.width} * pad.height;
  out.depth.resize(pixels);
  out.contact.resize(pixels);
  const RigidMotion back = motion.inverse();
  for (size_t i = 0; i < pixels; ++i) {
    const size_t column = i % pad.width, row = i / pad.width;
    const double x = (static_cast<double>(column) - (pad.width - 1) / 2.0) * pad.pitch_mm;
    const double y = (static_cast<double>(row) - (pad.height - 1) / 2.0) * pad.pitch_mm;
    double z = 0;
    for (int step = 0; step < 6; ++step) {
      const Eigen::Vector3d p = back * Eigen::Vector3d(x, y, z);
      const double miss = object.depth_mm(p[0], p[1]) - p[2];
      z += miss / back.turn(2, 2);
      if (std::abs(miss) < 1e-8) break;
    }
    out.contact[i] = z > 0 && std::hypot(x, y) < pad.radius_mm ? 1 : 0;
    out.depth[i] = static_cast<float>(std::max(z, 0.0));
  }
  blur(out.depth, pad.width, pad.height, pad.skin_px);
  if (pad.slope_error > 0) {
    const std::vector<float> own = pad_map(pad);
    std::transform(out.depth.begin(), out.depth.end(), own.begin(), out.depth.begin(), std::plus<>());
  }
  if (kind == DepthNoise::None || noise_mm <= 0) return out;
  const std::vector<float> noise = noise_map(pad, kind, random);
  for (size_t i = 0; i < pixels; ++i) out.depth[i] += static_cast<float>(noise_mm) * noise[i];
  return out;
}

}  // namespace palpate::scenes
