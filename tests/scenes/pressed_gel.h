// Pictures of a simulated gel under any pressure, also of what lies beyond the picture, in a light that may
// change.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <random>
#include <tuple>
#include <vector>

#include "capture/synthetic/optics.h"
#include "engine/elasticity/layer.h"
#include "engine/pad/layer_convolution.h"
#include "tests/scenes/synthetic_run.h"

namespace palpate::scenes {

/// The built-in gel of 320 x 240 px, its pad as the sensor file has it: a bonded linear layer.
class PressedGel {
 public:
  /// MPa at a place, mm from the picture's middle.
  using Pressure = std::function<double(double x_mm, double y_mm)>;
  struct Light {
    std::array<double, 3> gain{1, 1, 1}, offset_gray{};
  };

  PressedGel()
      : run_("press?mode=gel&size=320x240"),
        cell_mm_(kCell_px * run_.sensor.pitch_mm_per_px),
        layer_(LayerKernel(pad_of(*run_.sensor.layer), cell_mm_), kAcross, kDown, false) {}

  const Sensor& sensor() const { return run_.sensor; }
  const Frame& untouched() const { return run_.background; }
  Layer layer() const {
    const LayerCalibration& pad = *run_.sensor.layer;
    return Layer({pad.young_MPa, pad.poisson}, pad.thickness_mm);
  }

  /// A ball: its exact contact, seen anywhere.
  static Pressure ball(const LayerContact& contact, double at_x_mm, double at_y_mm) {
    return [contact, at_x_mm, at_y_mm](double x, double y) {
      return contact.pressure_MPa(std::hypot(x - at_x_mm, y - at_y_mm));
    };
  }
  /// Foam: an even face, whose pressure ends within a rim.
  static Pressure foam(double force_N, double radius_mm, double rim_mm, double at_x_mm = 0) {
    const double mean_mm = radius_mm + rim_mm / 2;
    const double even_MPa = force_N / (std::numbers::pi * (mean_mm * mean_mm + rim_mm * rim_mm / 20));
    return [=](double x, double y) {
      const double out = std::clamp((std::hypot(x - at_x_mm, y) - radius_mm) / rim_mm, 0.0, 1.0);
      return even_MPa * (1 - out * out * (3 - 2 * out));
    };
  }

  /// The next picture, with a camera's noise; force_N() is then what presses, wherever. Without a pressure
  /// nothing touches.
  const Frame& picture(const Pressure& pressure, const Light& light) {
    load(pressure);
    frame_.reshape(run_.background.format);
    std::normal_distribution<double> normal(0, 1);
    const double per_e = 255 / optics::kFullWell_e;
    for (uint32_t y = 0; y < frame_.format.height; ++y)
      for (uint32_t x = 0; x < frame_.format.width; ++x) {
        const std::array<double, 3> n = normal_at(x, y);
        for (uint32_t c = 0; c < 3; ++c) {
          const std::array<double, 3> lamp = optics::gel_light(static_cast<int>(c));
          const double u = 2.0 * x / (frame_.format.width - 1) - 1,
                       v = 2.0 * y / (frame_.format.height - 1) - 1;
          const double facing = std::max(0.0, n[0] * lamp[0] + n[1] * lamp[1] + n[2] * lamp[2]);
          const double lit =
              light.gain[c] * 255 * optics::gel_brightness(static_cast<int>(c), u, v) * facing +
              light.offset_gray[c];
          // The untouched image has the camera's fixed pattern.
          const double pattern =
              static_cast<double>(run_.background.at(c, x, y)) -
              (optics::kBlack_gray + 255 * optics::gel_brightness(static_cast<int>(c), u, v) * lamp[2]);
          const double noise =
              std::sqrt(per_e * per_e * optics::kReadNoise_e * optics::kReadNoise_e + per_e * lit);
          const double gray = optics::kBlack_gray + pattern + lit + noise * normal(random_);
          frame_.set(c, x, y, static_cast<uint32_t>(std::clamp(std::lround(gray), 0L, 255L)));
        }
      }
    frame_.time_ns += 33'333'333;
    ++frame_.sequence;
    return frame_;
  }
  double force_N() const { return force_N_; }

 private:
  static constexpr uint32_t kCell_px = 4, kAcross = 200,
                            kDown = 180;  // 70 x 63 mm, the picture in the middle

  void load(const Pressure& pressure) {
    constexpr int kParts = 4;
    std::vector<double> map(size_t{kAcross} * kDown);
    force_N_ = 0;
    depth_mm_.assign(map.size(), 0);
    if (!pressure) return;
    for (size_t i = 0; i < map.size(); ++i) {
      const size_t row = i / kAcross, column = i % kAcross;
      const double x = (static_cast<double>(column) + 0.5 - kAcross / 2.0) * cell_mm_,
                   y = (static_cast<double>(row) + 0.5 - kDown / 2.0) * cell_mm_;
      for (int a = 0; a < kParts; ++a)
        for (int b = 0; b < kParts; ++b)
          map[i] +=
              pressure(x + ((a + 0.5) / kParts - 0.5) * cell_mm_, y + ((b + 0.5) / kParts - 0.5) * cell_mm_) /
              (kParts * kParts);
      force_N_ += map[i] * cell_mm_ * cell_mm_;
    }
    layer_.depth_by_pressure(map, depth_mm_);
  }

  std::array<double, 3> normal_at(uint32_t x, uint32_t y) const {
    // In cells, from the middle of the first.
    const double u = (x + 0.5 - 160) / kCell_px + kAcross / 2.0 - 0.5,
                 v = (y + 0.5 - 120) / kCell_px + kDown / 2.0 - 0.5;
    const auto i = static_cast<size_t>(u), j = static_cast<size_t>(v);
    const double s = u - static_cast<double>(i), t = v - static_cast<double>(j);
    std::array<double, 2> slope{};
    for (const auto& [a, b, weight] :
         {std::tuple{0, 0, (1 - s) * (1 - t)}, {1, 0, s * (1 - t)}, {0, 1, (1 - s) * t}, {1, 1, s * t}}) {
      const size_t at = (j + static_cast<size_t>(b)) * kAcross + i + static_cast<size_t>(a);
      slope[0] += weight * (depth_mm_[at + 1] - depth_mm_[at - 1]) / (2 * cell_mm_);
      slope[1] += weight * (depth_mm_[at + kAcross] - depth_mm_[at - kAcross]) / (2 * cell_mm_);
    }
    const double nz = 1 / std::sqrt(1 + slope[0] * slope[0] + slope[1] * slope[1]);
    return {slope[0] * nz, slope[1] * nz, nz};
  }

  SyntheticRun run_;
  double cell_mm_, force_N_ = 0;
  LayerConvolution layer_;
  std::vector<double> depth_mm_;
  std::mt19937 random_{7};
  Frame frame_;
};

}  // namespace palpate::scenes
