// The pad's answer to a load on one pixel: the Green's function of the reading `elastic`.
#pragma once

#include <optional>

#include "engine/elasticity/layer.h"
#include "palpate/sensor.h"

namespace palpate {

/// Integral of 1/r over a pixel of side 1 whose middle lies (dx, dy) pixels away (A. E. H. Love, Phil. Trans.
/// R. Soc. A 228 (1929) 377): finite over the pixel itself, 4 ln(1 + sqrt 2).
double love_pixel(double dx, double dy);

/// Deflection by pressure, frictionless: Boussinesq's u = (1 - nu^2) / (pi E) p / r for the half space; less
/// what a bonded layer of finite thickness takes away (engine/elasticity/layer.h).
class ElasticKernel {
 public:
  /// Throws Error(Failure::Sensor) where the layer is thinner than ElasticCalibration::kThinnest_px.
  ElasticKernel(const ElasticCalibration& pad, double pitch_mm_per_px);

  /// Deflection at (dx, dy) pixels from the middle of a pixel that carries 1 MPa, mm.
  double at(double dx, double dy) const {
    return scale_mm_per_MPa_ * (love_pixel(dx, dy) - pixel_loss(dx, dy));
  }
  /// mm per MPa and per pixel of 1/r.
  double scale_mm_per_MPa() const { return scale_mm_per_MPa_; }
  /// Of the layer, px; 0 for the half space.
  double thickness_px() const { return thickness_px_; }
  /// What the finite thickness takes away from 1/r at r pixels, 1/px.
  double loss(double r_px) const;

 private:
  double pixel_loss(double dx, double dy) const;

  double scale_mm_per_MPa_;
  double thickness_px_ = 0;
  std::optional<PointLoadLoss> loss_;
};

}  // namespace palpate
