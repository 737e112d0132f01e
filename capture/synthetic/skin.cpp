#include "capture/synthetic/skin.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "capture/synthetic/optics.h"
#include "engine/measure/motion/skin_motion.h"

namespace palpate {
namespace {

constexpr double kMarkerJitter_mm = 0.03;
constexpr double kGelInk = 0.75;           // light that a marker takes away
constexpr double kWaveguideInk = 0.6;      // printed on what glows, the marker glows a little too
constexpr double kTextureGrain_mm = 0.07;  // standard deviation of the smoothing
constexpr double kTexture = 0.2;           // relative standard deviation of the light

double beyond(double r, double a, double thickness) {
  return r > a ? std::exp(-std::numbers::pi * (r - a) / (2 * thickness)) : 1;
}

uint64_t mix(uint64_t z) {  // splitmix64
  z += 0x9e3779b97f4a7c15u;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}
double uniform(uint64_t seed, int64_t i, int64_t j) {
  const uint64_t z = mix(mix(seed + static_cast<uint64_t>(i)) + static_cast<uint64_t>(j));
  return (static_cast<double>(z >> 11) + 0.5) * 0x1p-53;
}

}  // namespace

double pulled_fraction(double r, double a, double c, double thickness) {
  return cattaneo_fraction(r / a, c / a) * beyond(r, a, thickness);
}

double turned_fraction(double r, double a, double thickness) {
  if (r <= a) return r / a;
  const double s = a / r;
  return 2 / std::numbers::pi * (std::asin(s) - s * std::sqrt(1 - s * s)) / s * beyond(r, a, thickness);
}

double turn_limit_rad(double friction, double young_MPa, double a) {
  return 9 * std::numbers::pi * friction / (256 * (young_MPa / 3) * a * a);
}

SkinMap::SkinMap(const SyntheticOptions& o)
    : columns_((static_cast<int>(o.width) + 2 * kMargin_px) * kPerPixel + 1),
      rows_((static_cast<int>(o.height) + 2 * kMargin_px) * kPerPixel + 1),
      light_(static_cast<size_t>(columns_) * rows_, 1.0f) {
  const double pitch = optics::pitch_mm(o), left = (o.width - 1) / 2.0, top = (o.height - 1) / 2.0;
  const auto x_px = [](int i) { return static_cast<double>(i) / kPerPixel - kMargin_px; };
  if (o.skin == SyntheticSkin::Markers) {
    const double ink = o.mode == SyntheticMode::Gel ? kGelInk : kWaveguideInk;
    for (int j = 0; j < rows_; ++j) {
      const double y_mm = (x_px(j) - top) * pitch;
      for (int i = 0; i < columns_; ++i) {
        const double x_mm = (x_px(i) - left) * pitch;
        const double u = std::round(x_mm / skin::kSpacing_mm), v = std::round(y_mm / skin::kSpacing_mm);
        const auto p = static_cast<int64_t>(u), q = static_cast<int64_t>(v);
        const double dx = x_mm - u * skin::kSpacing_mm - kMarkerJitter_mm * (2 * uniform(11, p, q) - 1),
                     dy = y_mm - v * skin::kSpacing_mm - kMarkerJitter_mm * (2 * uniform(12, p, q) - 1);
        const double edge = std::clamp((skin::kRadius_mm - std::hypot(dx, dy)) / pitch / 1.5 + 0.5, 0.0, 1.0);
        light_[static_cast<size_t>(j) * columns_ + i] =
            static_cast<float>(1 - ink * edge * edge * (3 - 2 * edge));
      }
    }
  } else if (o.skin == SyntheticSkin::Texture) {
    // Noise of the pad, not of the camera: the same at every seed.
    const double sd = std::max(kTextureGrain_mm / pitch, 1.2) * kPerPixel;
    const int reach = static_cast<int>(std::ceil(3 * sd));
    std::vector<double> taps(2 * reach + 1);
    double squares = 0;
    for (int k = -reach; k <= reach; ++k) taps[k + reach] = std::exp(-k * k / (2 * sd * sd));
    for (const double t : taps) squares += t * t;
    std::vector<float> rough(light_.size()), across(light_.size());
    const optics::NormalNoise normal;
    for (int j = 0; j < rows_; ++j) {
      for (int begin = 0; begin < columns_; begin += kMaxSide_px) {
        const int count = std::min(columns_ - begin, static_cast<int>(kMaxSide_px));
        normal.row(77, static_cast<uint64_t>(begin), static_cast<uint64_t>(j), static_cast<uint32_t>(count),
                   rough.data() + static_cast<size_t>(j) * columns_ + begin);
      }
      const float* from = rough.data() + static_cast<size_t>(j) * columns_;
      for (int i = 0; i < columns_; ++i) {
        double sum = 0;
        for (int k = -reach; k <= reach; ++k)
          sum += taps[k + reach] * from[std::clamp(i + k, 0, columns_ - 1)];
        across[static_cast<size_t>(j) * columns_ + i] = static_cast<float>(sum);
      }
    }
    for (int j = 0; j < rows_; ++j)
      for (int i = 0; i < columns_; ++i) {
        double sum = 0;
        for (int k = -reach; k <= reach; ++k)
          sum +=
              taps[k + reach] * across[static_cast<size_t>(std::clamp(j + k, 0, rows_ - 1)) * columns_ + i];
        light_[static_cast<size_t>(j) * columns_ + i] =
            static_cast<float>(1 + kTexture * std::clamp(sum / squares, -3.0, 3.0));
      }
  }
  double sum = 0;
  for (const float v : light_) sum += v;
  mean_ = sum / static_cast<double>(light_.size());
}

float SkinMap::at(float x_px, float y_px) const {
  const float x = std::clamp((x_px + kMargin_px) * kPerPixel, 0.0f, static_cast<float>(columns_) - 1.001f),
              y = std::clamp((y_px + kMargin_px) * kPerPixel, 0.0f, static_cast<float>(rows_) - 1.001f);
  const auto i = static_cast<int>(x), j = static_cast<int>(y);
  const float u = x - static_cast<float>(i), v = y - static_cast<float>(j);
  const float* p = light_.data() + static_cast<size_t>(j) * columns_ + i;
  const float above = p[0] + u * (p[1] - p[0]), below = p[columns_] + u * (p[columns_ + 1] - p[columns_]);
  return above + v * (below - above);
}

}  // namespace palpate
