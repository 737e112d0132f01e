// Strain of a surface from the motion of points on it.
//
// What the images determine: points on a surface carry its motion along and out of the plane, as functions of
// the place in the plane. Their gradient gives the tensor in the plane, all of it. They carry nothing about
// how displacement changes with depth: a spline in space through points of a nearly flat relief answers for
// that derivative with noise over the relief's height (errors of 0.04 to 200 where the relief flattens). The
// axial strain comes from one of two assumptions instead, each stated where it is made.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "engine/numeric/thin_plate/thin_plate.h"

namespace palpate {

/// Green-Lagrange strain E = (F^T F - I) / 2 in the plane, F = I + gradient: exact for any rotation. The
/// source paper's (73)-(75) print cubes where squares belong.
struct PlaneStrain {
  double xx = 0, yy = 0, xy = 0;  ///< of the tensor: xy is half the engineering shear
  double first = 0, second = 0;   ///< principal strains, first >= second
  double direction_rad = 0;  ///< of the first in the untouched picture, from +x towards +y, -pi/2 to pi/2
  double shear = 0;          ///< largest of the tensor: (first - second) / 2
  double area = 0;           ///< change of area over area at rest, det F - 1
};

/// `gradient`: du/dx, du/dy, dv/dx, dv/dy.
PlaneStrain plane_strain(const std::array<double, 4>& gradient);

/// In space, from nine derivatives du/dx, du/dy, du/dz, dv/dx ... : xx, xy, xz, yy, yz, zz. For displacements
/// that are known throughout a volume.
std::array<double, 6> green_lagrange(const std::array<double, 9>& gradient);

/// (a) Of a layer of `thickness` at rest whose surface has gone in by `depth` (same unit, in towards its
/// foot) and whose foot has not moved: the mean over the thickness, E_zz = ((1 - depth / thickness)^2 - 1)
/// / 2. Determined by the depth map and the thickness; where pad and sample are pressed together, thickness
/// is their sum and so is depth. Throws Error(Failure::Input) where depth reaches the thickness or thickness
/// is not above 0.
double axial_strain_by_thickness(double depth, double thickness);

/// (b) Of the skin itself, free to thicken or thin as its area changes (no pull across it): stretch
/// (1 + area)^(-nu / (1 - nu)), which keeps the volume for Poisson's ratio nu = 0.5 and is the linear law
/// -nu / (1 - nu) (xx + yy) where strains are small. Determined by the motion in the plane alone; `area`
/// above -1, nu from 0 to 0.5, else Error(Failure::Input).
double axial_strain_by_area(double area, double poisson = 0.5);

/// Mean over places with standard errors; those hold for the points' noise, not for what smoothing takes off
/// a peak, and are NaN where the spline passes through all points.
struct MeanStrain {
  PlaneStrain mean;  ///< principal values are those of the mean tensor
  PlaneStrain
      sd;  ///< standard errors; of direction_rad NaN where the principal strains do not differ significantly
};

/// The mean of independent estimates of one strain, its standard errors from their scatter. Throws
/// Error(Failure::Input) for fewer than two.
MeanStrain mean_of(std::span<const PlaneStrain> draws);

/// The strain of a plane over which `points` moved by `shifts` (same unit).
class StrainField {
 public:
  /// Both components with one lambda; none: chosen by the data, which is what noisy points want. Throws as
  /// ThinPlate.
  StrainField(std::span<const std::array<double, 2>> points, std::span<const std::array<double, 2>> shifts,
              std::optional<double> lambda = {}, std::span<const double> weights = {});

  /// Other shifts of the same points: nothing is factored again. Throws as ThinPlate.
  void follow(std::span<const std::array<double, 2>> shifts, std::optional<double> lambda = {}) {
    spline_ = plate_.fit<2>(shifts, lambda);
  }
  std::vector<PlaneStrain> at(std::span<const std::array<double, 2>> places) const;
  /// Throws Error(Failure::Input) without a place.
  MeanStrain mean(std::span<const std::array<double, 2>> places);
  /// Below rank 2 the points do not determine the tensor: strain along what they leave out reads 0.
  const PlateStatistics& statistics() const { return spline_.statistics(); }
  const ThinPlateSpline<2>& spline() const { return spline_; }

 private:
  std::vector<double> gradients(std::span<const std::array<double, 2>> places) const;

  ThinPlate<2> plate_;
  ThinPlateSpline<2> spline_;
  std::vector<double> weights_;
};

}  // namespace palpate
