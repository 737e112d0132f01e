#include "engine/calibrate/photometric/slope_errors.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "engine/sensor/polynomial_normal.h"

namespace palpate::photometric {
namespace {

/// The errors of one component on the map of a press, NaN elsewhere.
std::vector<float> error_map(const PhotometricPress& press, const PhotometricCalibration& weights, size_t c,
                             uint32_t width, uint32_t height) {
  std::vector<float> out(size_t{width} * height, std::numeric_limits<float>::quiet_NaN());
  for (size_t k = 0; k < press.pixels.size(); ++k) {
    const Pixel& pixel = press.pixels[k];
    const auto x = static_cast<size_t>((pixel.across + 1) * width / 2),
               y = static_cast<size_t>((pixel.down + 1) * height / 2);
    const double truth = double{press.normals[k][static_cast<Eigen::Index>(c)]};
    out[y * width + x] =
        static_cast<float>(polynomial_normal(weights, pixel.change, pixel.across, pixel.down)[c] - truth);
  }
  return out;
}

/// RMS error of (n_x, n_y), per component, by a frame's noise at the presses' pixels.
double noise_of_normals(std::span<const PhotometricPress> presses, const PhotometricCalibration& weights,
                        const std::array<double, 3>& frame_sd) {
  double squares = 0, count = 0;
  for (const PhotometricPress& press : presses)
    for (const Pixel& pixel : press.pixels) {
      const auto n = polynomial_normal(weights, pixel.change, pixel.across, pixel.down);
      for (size_t c = 0; c < 3; ++c) {
        std::array<double, 3> noisy = pixel.change;
        noisy[c] += frame_sd[c];
        const auto other = polynomial_normal(weights, noisy, pixel.across, pixel.down);
        squares += std::pow(other[0] - n[0], 2) + std::pow(other[1] - n[1], 2);
      }
      count += 2;
    }
  return count > 0 ? std::sqrt(squares / count) : 0;
}

/// The way, as the deviation of a Gaussian, once `noise_sd` is taken off; 0 where nothing is left.
double reach_of_errors(std::span<const PhotometricPress> presses, const PhotometricCalibration& weights,
                       double noise_sd, uint32_t width, uint32_t height) {
  constexpr std::array<uint32_t, 13> kWays_px = {0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64};
  std::array<double, kWays_px.size()> product{}, pairs{};
  for (const PhotometricPress& press : presses)
    for (size_t c = 0; c < 2; ++c) {
      const std::vector<float> error = error_map(press, weights, c, width, height);
      for (size_t at = 0; at < error.size(); ++at) {
        if (std::isnan(error[at])) continue;
        for (size_t k = 0; k < kWays_px.size(); ++k) {
          const auto add = [&](bool within, size_t other) {
            if (!within || std::isnan(error[other])) return;
            product[k] += double{error[at]} * double{error[other]};
            ++pairs[k];
          };
          add(at % width + kWays_px[k] < width, at + kWays_px[k]);
          add(at / width + kWays_px[k] < height, at + size_t{kWays_px[k]} * width);
        }
      }
    }
  const auto shared = [&](size_t k) {
    return pairs[k] > 0 ? product[k] / pairs[k] - (k == 0 ? noise_sd * noise_sd : 0) : 0;
  };
  const double fallen = std::exp(-0.5) * shared(0);
  if (!(fallen > 0)) return 0;
  for (size_t k = 1; k < kWays_px.size(); ++k) {
    if (shared(k) > fallen) continue;
    const double before = shared(k - 1), part = (before - fallen) / (before - shared(k));
    return kWays_px[k - 1] + part * (kWays_px[k] - kWays_px[k - 1]);
  }
  return kWays_px.back();
}

}  // namespace

void state_parts(std::span<const PhotometricPress> presses, const std::array<double, 3>& frame_sd,
                 const FrameFormat& format, PhotometricCalibration& weights) {
  const double noise = noise_of_normals(presses, weights, frame_sd);
  if (noise <= 0) return;
  weights.noise_sd = std::min(noise, weights.normal_sd);
  weights.pad_reach_px = reach_of_errors(presses, weights, noise, format.width, format.height);
}

}  // namespace palpate::photometric
