#include "capture/synthetic/optics.h"
#include "palpate/frame.h"

#include <cmath>
#include <numbers>

namespace palpate::optics {
namespace {

constexpr size_t kTable = size_t{1} << 16;

uint64_t mix(uint64_t z) {  // splitmix64
  z += 0x9e3779b97f4a7c15u;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

double uniform(uint64_t z) {
  return (static_cast<double>(z >> 11) + 0.5) * 0x1p-53;
}

std::vector<float> normal_table(uint64_t seed) {
  std::vector<double> v(kTable);
  double sum = 0, squares = 0;
  for (size_t i = 0; i < kTable; ++i) {
    const double radius = std::sqrt(-2 * std::log(uniform(mix(seed + 2 * i))));
    v[i] = radius * std::cos(2 * std::numbers::pi * uniform(mix(seed + 2 * i + 1)));
    sum += v[i];
  }
  const double mean = sum / kTable;
  for (double& x : v) {
    x -= mean;
    squares += x * x;
  }
  const double unit = std::sqrt(0.5 * kTable / squares);  // two tables are added: half the variance each
  std::vector<float> table(kTable + kMaxSide_px);  // the start again at the end, so that a row never wraps
  for (size_t i = 0; i < table.size(); ++i) table[i] = static_cast<float>(v[i % kTable] * unit);
  return table;
}

double distance_mm(double x_mm, double y_mm) {
  return std::sqrt(x_mm * x_mm + y_mm * y_mm);
}

}  // namespace

double scale(uint32_t bit_depth) {
  return std::ldexp(1.0, static_cast<int>(bit_depth) - 8);
}
double pitch_mm(const SyntheticOptions& options) {
  return kFieldWidth_mm / options.width;
}

Field::Field(const SyntheticOptions& options) : scale_(scale(options.bit_depth)) {
  const double w = kFieldWidth_mm / 2, h = w * options.height / options.width;
  leds_ = {{{-w - 2, 0, 1.00}, {w + 2, 0, 0.99}, {0, -h - 2, 1.01}, {0, h + 2, 1.00}}};
  falloff_per_mm2_ = options.falloff / (w * w + h * h);
  guided_centre_ = touch(0, 0);
}

double Field::vignette(double x_mm, double y_mm) const {
  return 1 - falloff_per_mm2_ * (x_mm * x_mm + y_mm * y_mm);
}

double Field::touch(double x_mm, double y_mm) const {
  // Guided light loses little on its way: 1/e in 0.8 m of clear silicone.
  double light = 0;
  for (const Led& led : leds_)
    light += led.power * std::exp(-distance_mm(x_mm - led.x_mm, y_mm - led.y_mm) / 800);
  return light / guided_centre_ * vignette(x_mm, y_mm);
}

double Field::stray_gray(double x_mm, double y_mm) const {
  double light = 3;  // room light and scatter from the whole pad
  for (const Led& led : leds_)
    light += kStray_gray * led.power * std::exp(-distance_mm(x_mm - led.x_mm, y_mm - led.y_mm) / 5);
  return scale_ * (kBlack_gray + light * vignette(x_mm, y_mm));
}

std::array<double, 3> gel_light(int c) {
  const double azimuth = std::numbers::pi / 2 + c * 2 * std::numbers::pi / 3;
  const double flat = std::cos(kLightElevation_rad);
  return {flat * std::cos(azimuth), flat * std::sin(azimuth), std::sin(kLightElevation_rad)};
}

double gel_brightness(int c, double x, double y) {
  const double azimuth = std::numbers::pi / 2 + c * 2 * std::numbers::pi / 3;
  return kGelBrightness * (1 + kGelGradient * (std::cos(azimuth) * x + std::sin(azimuth) * y));
}

namespace {
const std::vector<float>& shared_table(int which) {
  static const std::array<std::vector<float>, 2> tables = {normal_table(0x70616c70),
                                                           normal_table(0x61746521ull << 32)};
  return tables[which];
}
}  // namespace

NormalNoise::NormalNoise() : first_(shared_table(0)), second_(shared_table(1)) {}

void NormalNoise::row(uint64_t seed, uint64_t frame, uint64_t row, uint32_t width, float* out) const {
  const uint64_t h = mix(mix(mix(seed) + frame) + row);
  const float* a = first_.data() + (h & (kTable - 1));
  const float* b = second_.data() + ((h >> 32) & (kTable - 1));
  for (uint32_t x = 0; x < width; ++x) out[x] = a[x] + b[x];
}

}  // namespace palpate::optics
