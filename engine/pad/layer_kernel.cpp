#include "engine/pad/layer_kernel.h"

#include <math.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "engine/elasticity/layer_response.h"
#include "engine/numeric/quadrature.h"
#include "engine/pad/elastic_kernel.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr int kWaves = 192;       // wave numbers up to kMissingResponseEnd / H
constexpr double kFarthest = 16;  // thicknesses: beyond, a layer's surface does not move
constexpr int kSteps = 32;        // of the table, per thickness
constexpr double kNear = 3;  // cells and thicknesses within which a thin layer's answer is integrated finely

/// Integrals over a cell of side 1 whose middle lies at (x, y).
struct CellIntegrals {
  double xx, xy, yy;  ///< of x^2 / r^3 and so on
  double x, y;        ///< of x / r^2 and y / r^2
};

CellIntegrals cell_integrals(double x, double y) {
  CellIntegrals sum{};
  for (const int i : {-1, 1})
    for (const int j : {-1, 1}) {
      const double a = x + 0.5 * i, b = y + 0.5 * j, sign = i * j, r = std::hypot(a, b);
      if (r == 0) continue;
      const double log = std::log(r);
      if (b != 0 && a != 0) {
        sum.xx += sign * b * std::asinh(a / std::abs(b));
        sum.yy += sign * a * std::asinh(b / std::abs(a));
        sum.x += sign * a * std::atan(b / a);
        sum.y += sign * b * std::atan(a / b);
      }
      sum.xy -= sign * r;
      sum.x += sign * b * log;
      sum.y += sign * a * log;
    }
  return sum;
}

}  // namespace

LayerKernel::LayerKernel(const Material& layer, double thickness_mm, double cell_mm)
    : poisson_(layer.poisson) {
  effective_modulus_MPa(layer);  // its checks
  if (!std::isfinite(layer.young_MPa))
    throw Error(Failure::Input, "a layer of finite Young's modulus", "a rigid one", "its modulus in MPa");
  if (!(thickness_mm >= 0) || !(cell_mm > 0))
    throw Error(Failure::Input, "a layer's thickness >= 0 and cells > 0, mm",
                std::to_string(thickness_mm) + " and " + std::to_string(cell_mm), "lengths in mm");
  const double shear_MPa = layer.young_MPa / (2 * (1 + poisson_));
  scale_mm_per_MPa_ = cell_mm / (2 * std::numbers::pi * shear_MPa);
  if (thickness_mm == 0) return;
  thickness_cells_ = thickness_mm / cell_mm;
  const Quadrature waves = gauss_legendre(kWaves, kMissingResponseEnd);
  std::array<Loss, kWaves> spectrum;
  for (size_t i = 0; i < kWaves; ++i) {
    const LayerResponse at = layer_response(waves.x[i], poisson_);
    spectrum[i] = {.depth = waves.w[i] * (1 - poisson_ - at.normal),
                   .even = waves.w[i] * (1 - poisson_ / 2 - (at.across + at.along) / 2),
                   .twofold = waves.w[i] * (-poisson_ / 2 - (at.along - at.across) / 2),
                   .coupling = waves.w[i] * ((1 - 2 * poisson_) / 2 - at.coupling)};
  }
  table_.resize(static_cast<size_t>(kFarthest) * kSteps + 3);
  for (size_t i = 0; i < table_.size(); ++i) {
    Loss& sum = table_[i];
    for (size_t k = 0; k < kWaves; ++k) {
      const double kr = waves.x[k] * static_cast<double>(i) / kSteps;
      const double j0 = ::j0(kr), j1 = ::j1(kr), j2 = kr > 0 ? 2 * j1 / kr - j0 : 0;
      sum.depth += spectrum[k].depth * j0;
      sum.even += spectrum[k].even * j0;
      sum.twofold += spectrum[k].twofold * j2;
      sum.coupling += spectrum[k].coupling * j1;
    }
  }
}

LayerKernel::Loss LayerKernel::loss(double r) const {
  if (r >= kFarthest)
    return {(1 - poisson_) / r, (1 - poisson_ / 2) / r, -poisson_ / (2 * r), (1 - 2 * poisson_) / (2 * r)};
  // Cubic through the four nearest; the table's first point stands for its mirror image, with the function's
  // own parity.
  const double position = r * kSteps;
  const auto i = static_cast<size_t>(position);
  const double t = position - static_cast<double>(i);
  const double before = -t * (t - 1) * (t - 2) / 6, here = (t + 1) * (t - 1) * (t - 2) / 2,
               next = -(t + 1) * t * (t - 2) / 2, after = (t + 1) * t * (t - 1) / 6;
  const Loss &a = table_[i == 0 ? 1 : i - 1], &b = table_[i], &c = table_[i + 1], &d = table_[i + 2];
  const double odd = i == 0 ? -1 : 1;
  return {before * a.depth + here * b.depth + next * c.depth + after * d.depth,
          before * a.even + here * b.even + next * c.even + after * d.even,
          before * a.twofold + here * b.twofold + next * c.twofold + after * d.twofold,
          odd * before * a.coupling + here * b.coupling + next * c.coupling + after * d.coupling};
}

CellAnswer LayerKernel::at(double dx, double dy) const {
  const CellIntegrals half = cell_integrals(dx, dy);
  const double shift = (1 - 2 * poisson_) / 2;
  CellAnswer answer{.depth = (1 - poisson_) * love_pixel(dx, dy),
                    .x_by_pressure = -shift * half.x,
                    .y_by_pressure = -shift * half.y,
                    .x_by_x = (1 - poisson_) * love_pixel(dx, dy) + poisson_ * half.xx,
                    .y_by_x = poisson_ * half.xy,
                    .y_by_y = (1 - poisson_) * love_pixel(dx, dy) + poisson_ * half.yy};
  if (thickness_cells_ > 0) {
    // Two by two Gauss points are exact up to cubics, and the loss bends over a thickness.
    const double reach = kNear * (1 + thickness_cells_);
    const bool fine = thickness_cells_ < 4 && std::abs(dx) < reach && std::abs(dy) < reach;
    const int parts = fine ? std::clamp(static_cast<int>(std::ceil(4 / thickness_cells_)), 2, 12) : 1;
    constexpr double kGauss = 0.28867513459481287;
    CellAnswer taken;
    for (int i = 0; i < 2 * parts; ++i)
      for (int j = 0; j < 2 * parts; ++j) {
        const auto place = [&](int k) {
          return (k / 2 + 0.5 + (k % 2 == 0 ? -kGauss : kGauss)) / parts - 0.5;
        };
        const double x = dx + place(i), y = dy + place(j), r = std::hypot(x, y);
        const Loss at = loss(r / thickness_cells_);
        const double c = r > 0 ? x / r : 0, s = r > 0 ? y / r : 0;
        taken.depth += at.depth;
        taken.x_by_pressure -= c * at.coupling;
        taken.y_by_pressure -= s * at.coupling;
        taken.x_by_x += at.even - at.twofold * (c * c - s * s);
        taken.y_by_y += at.even + at.twofold * (c * c - s * s);
        taken.y_by_x -= at.twofold * 2 * c * s;
      }
    const double weight = 1 / (4.0 * parts * parts * thickness_cells_);
    answer.depth -= weight * taken.depth;
    answer.x_by_pressure -= weight * taken.x_by_pressure;
    answer.y_by_pressure -= weight * taken.y_by_pressure;
    answer.x_by_x -= weight * taken.x_by_x;
    answer.y_by_x -= weight * taken.y_by_x;
    answer.y_by_y -= weight * taken.y_by_y;
  }
  for (double* part : {&answer.depth, &answer.x_by_pressure, &answer.y_by_pressure, &answer.x_by_x,
                       &answer.y_by_x, &answer.y_by_y})
    *part *= scale_mm_per_MPa_;
  return answer;
}

}  // namespace palpate
