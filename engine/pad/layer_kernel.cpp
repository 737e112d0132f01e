#include "engine/pad/layer_kernel.h"

#include <math.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "engine/numeric/quadrature.h"
#include "engine/pad/layer_response.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr int kWaves = 192;       // wave numbers up to kMissingResponseEnd / H
constexpr double kFarthest = 16;  // thicknesses: beyond, a layer's surface does not move
constexpr int kSteps = 32;        // of the table, per thickness
constexpr size_t kPoints = static_cast<size_t>(kFarthest) * kSteps + 3;
constexpr double kFar = 40;  // cells; from here on what the second moments leave out is below 1e-8
constexpr double kNear = 3;  // cells and thicknesses within which a thin layer's answer is integrated finely

/// The corner term of Love's integral; its limit is 0 on both axes.
double corner(double x, double y) {
  const double ax = std::abs(x), ay = std::abs(y);
  double sum = 0;
  if (ax > 0) sum += x * std::copysign(std::asinh(ay / ax), y);
  if (ay > 0) sum += y * std::copysign(std::asinh(ax / ay), x);
  return sum;
}

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

/// Wave numbers times the thickness.
const Quadrature& waves() {
  static const Quadrature q = gauss_legendre(kWaves, kMissingResponseEnd);
  return q;
}

/// J0 and J1 of every wave at every point of the table; the same for every layer.
const std::vector<std::array<double, 2>>& bessel_table() {
  static const std::vector<std::array<double, 2>> table = [] {
    std::vector<std::array<double, 2>> values;
    for (size_t i = 0; i < kPoints; ++i)
      for (size_t k = 0; k < kWaves; ++k) {
        const double kr = waves().x[k] * static_cast<double>(i) / kSteps;
        values.push_back({::j0(kr), ::j1(kr)});
      }
    return values;
  }();
  return table;
}

}  // namespace

double love_cell(double dx, double dy) {
  const double r2 = dx * dx + dy * dy;
  if (r2 > kFar * kFar) return (1 + 1 / (24 * r2)) / std::sqrt(r2);  // the square's second moments
  return corner(dx + 0.5, dy + 0.5) - corner(dx - 0.5, dy + 0.5) - corner(dx + 0.5, dy - 0.5) +
         corner(dx - 0.5, dy - 0.5);
}

LayerKernel::LayerKernel(const Pad& pad, double cell_mm)
    : poisson_(pad.material.poisson), thickness_cells_(pad.thickness_mm / cell_mm) {
  effective_modulus_MPa(pad.material);  // its checks
  if (!std::isfinite(pad.material.young_MPa))
    throw Error(Failure::Input, "a layer of finite Young's modulus", "a rigid one", "its modulus in MPa");
  if (!(pad.thickness_mm > 0) || !(cell_mm > 0) || pad.base != Base::Bonded)
    throw Error(Failure::Input, "a bonded layer's thickness and cells > 0 mm",
                std::to_string(pad.thickness_mm) + " and " + std::to_string(cell_mm) +
                    (pad.base == Base::Bonded ? "" : ", without friction"),
                "lengths in mm");
  const double shear_MPa = pad.material.young_MPa / (2 * (1 + poisson_));
  scale_mm_per_MPa_ = cell_mm / (2 * std::numbers::pi * shear_MPa);
  if (std::isinf(thickness_cells_)) return;
  std::array<Loss, kWaves> spectrum;
  for (size_t i = 0; i < kWaves; ++i) {
    const LayerResponse at = layer_response(waves().x[i], poisson_);
    const double weight = waves().w[i];
    spectrum[i] = {.depth = weight * (1 - poisson_ - at.normal),
                   .even = weight * (1 - poisson_ / 2 - (at.across + at.along) / 2),
                   .twofold = weight * (-poisson_ / 2 - (at.along - at.across) / 2),
                   .coupling = weight * ((1 - 2 * poisson_) / 2 - at.coupling)};
  }
  table_.resize(kPoints);
  for (size_t i = 0; i < kPoints; ++i) {
    Loss& sum = table_[i];
    for (size_t k = 0; k < kWaves; ++k) {
      const double kr = waves().x[k] * static_cast<double>(i) / kSteps;
      const auto [j0, j1] = bessel_table()[i * kWaves + k];
      const double j2 = kr > 0 ? 2 * j1 / kr - j0 : 0;
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

double LayerKernel::depth_loss(double r_cells) const {
  return table_.empty() ? 0 : loss(r_cells / thickness_cells_).depth / ((1 - poisson_) * thickness_cells_);
}

// Calls take(x, y) at points of the cell; returns what each weighs. Two by two Gauss points are exact up to
// cubics, and the loss bends over a thickness.
template <typename Take>
double LayerKernel::over_cell(double dx, double dy, const Take& take) const {
  const double reach = kNear * (1 + thickness_cells_);
  const bool fine = thickness_cells_ < 4 && std::abs(dx) < reach && std::abs(dy) < reach;
  const int parts = fine ? std::clamp(static_cast<int>(std::ceil(4 / thickness_cells_)), 2, 12) : 1;
  constexpr double kGauss = 0.28867513459481287;
  const auto place = [&](int k) { return (k / 2 + 0.5 + (k % 2 == 0 ? -kGauss : kGauss)) / parts - 0.5; };
  for (int i = 0; i < 2 * parts; ++i)
    for (int j = 0; j < 2 * parts; ++j) take(dx + place(i), dy + place(j));
  return 1 / (4.0 * parts * parts * thickness_cells_);
}

double LayerKernel::depth(double dx, double dy) const {
  double taken = 0;
  if (!table_.empty()) {
    const double weight = over_cell(
        dx, dy, [&](double x, double y) { taken += loss(std::hypot(x, y) / thickness_cells_).depth; });
    taken *= weight;
  }
  return scale_mm_per_MPa_ * ((1 - poisson_) * love_cell(dx, dy) - taken);
}

CellAnswer LayerKernel::at(double dx, double dy) const {
  const CellIntegrals half = cell_integrals(dx, dy);
  const double shift = (1 - 2 * poisson_) / 2, love = (1 - poisson_) * love_cell(dx, dy);
  CellAnswer answer{.x_by_pressure = -shift * half.x,
                    .y_by_pressure = -shift * half.y,
                    .x_by_x = love + poisson_ * half.xx,
                    .y_by_x = poisson_ * half.xy,
                    .y_by_y = love + poisson_ * half.yy};
  if (!table_.empty()) {
    CellAnswer taken;
    const double weight = over_cell(dx, dy, [&](double x, double y) {
      const double r = std::hypot(x, y);
      const Loss at = loss(r / thickness_cells_);
      const double c = r > 0 ? x / r : 0, s = r > 0 ? y / r : 0;
      taken.x_by_pressure -= c * at.coupling;
      taken.y_by_pressure -= s * at.coupling;
      taken.x_by_x += at.even - at.twofold * (c * c - s * s);
      taken.y_by_y += at.even + at.twofold * (c * c - s * s);
      taken.y_by_x -= at.twofold * 2 * c * s;
    });
    answer.x_by_pressure -= weight * taken.x_by_pressure;
    answer.y_by_pressure -= weight * taken.y_by_pressure;
    answer.x_by_x -= weight * taken.x_by_x;
    answer.y_by_x -= weight * taken.y_by_x;
    answer.y_by_y -= weight * taken.y_by_y;
  }
  for (double* part :
       {&answer.x_by_pressure, &answer.y_by_pressure, &answer.x_by_x, &answer.y_by_x, &answer.y_by_y})
    *part *= scale_mm_per_MPa_;
  answer.depth = depth(dx, dy);
  return answer;
}

}  // namespace palpate
