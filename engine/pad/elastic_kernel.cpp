#include "engine/pad/elastic_kernel.h"

#include <cmath>
#include <numbers>

#include "palpate/error.h"

namespace palpate {
namespace {

constexpr double kFar_px = 40;  // from here on what the second moments leave out is below 1e-8

/// The corner term of Love's integral; its limit is 0 on both axes.
double corner(double x, double y) {
  const double ax = std::abs(x), ay = std::abs(y);
  double sum = 0;
  if (ax > 0) sum += x * std::copysign(std::asinh(ay / ax), y);
  if (ay > 0) sum += y * std::copysign(std::asinh(ax / ay), x);
  return sum;
}

}  // namespace

double love_pixel(double dx, double dy) {
  const double r2 = dx * dx + dy * dy;
  if (r2 > kFar_px * kFar_px) return (1 + 1 / (24 * r2)) / std::sqrt(r2);  // the square's second moments
  return corner(dx + 0.5, dy + 0.5) - corner(dx - 0.5, dy + 0.5) - corner(dx + 0.5, dy - 0.5) +
         corner(dx - 0.5, dy - 0.5);
}

ElasticKernel::ElasticKernel(const ElasticCalibration& pad, double pitch_mm_per_px)
    : scale_mm_per_MPa_(pitch_mm_per_px /
                        (std::numbers::pi * effective_modulus_MPa({pad.young_MPa, pad.poisson}))) {
  if (pad.thickness_mm <= 0) return;
  thickness_px_ = pad.thickness_mm / pitch_mm_per_px;
  if (thickness_px_ < ElasticCalibration::kThinnest_px)
    throw Error(Failure::Sensor, "a pad of at least 4 pixels' thickness",
                std::to_string(thickness_px_) + " px (surface.elastic.thickness_mm, pitch_mm_per_px)",
                "correcting one of them");
  loss_.emplace(pad.poisson);
}

double ElasticKernel::loss(double r_px) const {
  return loss_ ? (*loss_)(r_px / thickness_px_) / thickness_px_ : 0;
}

double ElasticKernel::pixel_loss(double dx, double dy) const {
  if (!loss_) return 0;
  // Two by two Gauss points of the pixel: exact up to cubics, and the loss bends over a thickness.
  constexpr double kGauss = 0.28867513459481287;
  double sum = 0;
  for (const double x : {dx - kGauss, dx + kGauss})
    for (const double y : {dy - kGauss, dy + kGauss}) sum += loss(std::hypot(x, y));
  return sum / 4;
}

}  // namespace palpate
