#include "engine/lump/observation/sensor_model.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "engine/lump/observation/fixed_pattern.h"
#include "engine/tissue/map_sampling.h"
#include "palpate/error.h"

namespace palpate::lump {
namespace {

constexpr double kSaturatedPixels = 0.02;  // of a node's: more, and the node is not seen

void check_range(double value, double low, double high, const char* what) {
  if (!(value >= low && value <= high))
    throw Error(Failure::Usage,
                std::string(what) + " from " + std::to_string(low) + " to " + std::to_string(high),
                std::to_string(value), "a value in that range");
}

void check(const PalpationSensor& sensor, size_t maps, size_t forces) {
  if (maps == 0 || maps != forces)
    throw Error(Failure::Usage, "one pressure map and one force per load",
                std::to_string(maps) + " maps and " + std::to_string(forces) + " forces", "as many of both");
  for (const uint32_t side : sensor.size_px) check_range(side, 16, 16384, "a sensor's pixels along a side");
  for (const double side : sensor.window_mm) check_range(side, 1, 1000, "a sensor's window in mm");
  check_range(sensor.full_scale_Pa, 0, 1e9, "a sensor's full scale in Pa");
  check_range(sensor.exposure, 0.01, 100, "the peak's exposure over full scale");
  check_range(sensor.pixel_noise_gray, 0, 100, "pixel noise in gray levels");
  check_range(sensor.node_pitch_mm, 0.05, 10, "a reading's pitch in mm");
  check_range(sensor.least_cell, 0, 0.98, "the share of a node's square that must be seen");
  check_range(sensor.noise_fraction, 0, 1, "a reading's noise as a share of the peak");
  check_range(sensor.pattern_fraction, 0, 1, "a sensor's pattern as a share of the peak");
  check_range(sensor.pattern_length_mm, 0, 100, "the length of a sensor's pattern in mm");
  check_range(sensor.gauge_fraction, 0, 1, "a gauge's error as a share");
}

double peak_of(const PressureMap& map) {
  double peak = 0;
  for (const float value : map.values)
    if (std::isfinite(value)) peak = std::max(peak, static_cast<double>(value));
  return peak;
}

/// Sums over the pixels around each node.
struct NodeSums {
  std::vector<double> sum;
  std::vector<uint32_t> pixels, saturated;
  explicit NodeSums(size_t nodes) : sum(nodes), pixels(nodes), saturated(nodes) {}
};

}  // namespace

Observation sensor_observation(const std::vector<PressureMap>& pressure_Pa,
                               const std::vector<double>& force_N, std::array<double, 3> block_mm,
                               double young_Pa, const PalpationSensor& sensor, uint64_t seed) {
  check(sensor, pressure_Pa.size(), force_N.size());
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  Observation observation;
  observation.block_mm = block_mm;
  observation.young_Pa = young_Pa;
  observation.window_mm = sensor.window_center_mm;
  const double peak_Pa = peak_of(pressure_Pa.back());
  const double full_scale_Pa =
      sensor.full_scale_Pa > 0 ? sensor.full_scale_Pa : std::max(peak_Pa, 1e-9) / sensor.exposure;
  const double gray_per_Pa = 255 / full_scale_Pa;
  const std::array<double, 2> pixel_mm = {sensor.window_mm[0] / sensor.size_px[0],
                                          sensor.window_mm[1] / sensor.size_px[1]};
  const double pitch = sensor.node_pitch_mm;
  // Nodes at the window's edge see half of their square, or the window is cut so that none lies there.
  const double margin = sensor.least_cell > 0.5 ? 0 : pitch;
  const uint32_t width = window_nodes(sensor.window_mm[0] + margin, pitch),
                 height = window_nodes(sensor.window_mm[1] + margin, pitch);
  const auto node_of = [&](uint32_t pixel, size_t axis, uint32_t nodes) {
    const double place = (pixel + 0.5 - sensor.size_px[axis] / 2.0) * pixel_mm[axis];
    const double node = std::floor(place / pitch + nodes / 2.0);
    return node >= 0 && node < nodes ? static_cast<int>(node) : -1;
  };
  const double noise_Pa = sensor.noise_fraction * peak_Pa;
  const double reach_x = block_mm[0] / 2 + 1e-9, reach_y = block_mm[1] / 2 + 1e-9;
  // A node that sees only a part of its cell would measure another place.
  const double least_pixels = std::max(1e-6, sensor.least_cell) * pitch * pitch / (pixel_mm[0] * pixel_mm[1]);
  double pixels_per_node = 0;
  // Its own numbers: what else is random stays as it is without a pattern.
  std::mt19937_64 pattern_random(seed ^ 0x9e3779b97f4a7c15ULL);
  const Eigen::MatrixXd pattern =
      sensor.pattern_fraction > 0
          ? fixed_pattern(width, height, pitch, sensor.pattern_length_mm, pattern_random)
          : Eigen::MatrixXd::Zero(height, width);
  for (size_t k = 0; k < pressure_Pa.size(); ++k) {
    NodeSums nodes(size_t{width} * height);
    for (uint32_t y = 0; y < sensor.size_px[1]; ++y) {
      const int j = node_of(y, 1, height);
      const double y_mm = (y + 0.5 - sensor.size_px[1] / 2.0) * pixel_mm[1] + sensor.window_center_mm[1];
      if (j < 0 || std::abs(y_mm) > reach_y) continue;
      for (uint32_t x = 0; x < sensor.size_px[0]; ++x) {
        const int i = node_of(x, 0, width);
        const double x_mm = (x + 0.5 - sensor.size_px[0] / 2.0) * pixel_mm[0] + sensor.window_center_mm[0];
        if (i < 0 || std::abs(x_mm) > reach_x) continue;
        const double light = gray_per_Pa * map_at(pressure_Pa[k], x_mm, y_mm);
        // Where the block is not touched the camera sees its noise as much below the dark level as above it:
        // the dark level is taken off after the camera.
        const double gray = std::min(255.0, std::round(light + sensor.pixel_noise_gray * normal(random)));
        const size_t n = static_cast<size_t>(j) * width + static_cast<size_t>(i);
        nodes.sum[n] += gray;
        ++nodes.pixels[n];
        nodes.saturated[n] += gray >= 255;
      }
    }
    PressureMap map;
    map.width = width;
    map.height = height;
    map.pitch_mm = {pitch, pitch};
    map.values.assign(size_t{width} * height, std::numeric_limits<float>::quiet_NaN());
    size_t seen = 0, saturated = 0;
    for (size_t n = 0; n < map.values.size(); ++n) {
      if (nodes.pixels[n] < least_pixels) continue;
      ++seen;
      pixels_per_node += nodes.pixels[n];
      const double noise = noise_Pa * normal(random);
      const double pressure = nodes.sum[n] / nodes.pixels[n] / gray_per_Pa;
      const double fixed =
          sensor.pattern_fraction * (sensor.pattern_gain ? pressure : peak_Pa) *
          pattern(static_cast<Eigen::Index>(n / width), static_cast<Eigen::Index>(n % width));
      if (nodes.saturated[n] > kSaturatedPixels * nodes.pixels[n])
        ++saturated;
      else
        map.values[n] = static_cast<float>(pressure + fixed + noise);
    }
    if (k + 1 == pressure_Pa.size() && seen > 0) {
      observation.saturated_fraction = static_cast<double>(saturated) / static_cast<double>(seen);
      pixels_per_node /= static_cast<double>(seen) * static_cast<double>(pressure_Pa.size());
    }
    observation.pressure_Pa.push_back(std::move(map));
    observation.force_N.push_back(force_N[k] * (1 + sensor.gauge_fraction * normal(random)));
  }
  const double gray_sd = std::sqrt(sensor.pixel_noise_gray * sensor.pixel_noise_gray + 1.0 / 12);
  observation.noise_Pa =
      std::hypot(noise_Pa, gray_sd / gray_per_Pa / std::sqrt(std::max(1.0, pixels_per_node)));
  return observation;
}

Observation ideal_observation(const std::vector<PressureMap>& pressure_Pa, const std::vector<double>& force_N,
                              std::array<double, 3> block_mm, double young_Pa, double node_pitch_mm) {
  Observation observation;
  observation.block_mm = block_mm;
  observation.young_Pa = young_Pa;
  observation.force_N = force_N;
  for (const PressureMap& map : pressure_Pa)
    observation.pressure_Pa.push_back(node_means(map, {0, 0}, {block_mm[0], block_mm[1]}, node_pitch_mm));
  return observation;
}

}  // namespace palpate::lump
