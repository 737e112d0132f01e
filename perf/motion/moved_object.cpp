#include "perf/motion/moved_object.h"

#include <algorithm>
#include <cmath>

#include "capture/synthetic/object_mesh.h"

namespace palpate::scenes {

namespace {

/// Of standard deviation 1 and a covariance of that reach.
std::vector<float> noise_layer(const PadView& pad, double reach_px, std::mt19937& random) {
  std::normal_distribution<float> normal;
  std::vector<float> map(size_t{pad.width} * pad.height);
  for (float& value : map) value = normal(random);
  smooth(map, pad.width, pad.height, reach_px / std::sqrt(2.0));
  double squares = 0;
  for (const float value : map) squares += double{value} * double{value};
  const auto scale = static_cast<float>(1 / std::sqrt(squares / double(map.size())));
  for (float& value : map) value *= scale;
  return map;
}

/// Depth of the pad's own slope error, each octave a fifth of its square.
std::vector<float> pad_map(const PadView& pad) {
  std::mt19937 random(pad.slope_seed);
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
  smooth(out.depth, pad.width, pad.height, pad.skin_px);
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
