// A press of a scan while it is put into its place.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "engine/lump/observation/observation.h"

namespace palpate::lump {

using PlaceVector = Eigen::Matrix<double, 5, 1>;  ///< shift x, y, mm; ln gain; tilt x, y, per mm

/// A press while it is put into its place.
struct Placed {
  std::vector<PressureMap> maps;  ///< at the common forces
  std::array<double, 2> stage_mm;
  double turn_rad;
  double noise_Pa;
  PlaceVector place = PlaceVector::Zero();
  std::vector<double> rise = {};                    ///< at the common forces, see rise_with_compression()
  Eigen::Vector2d taken = Eigen::Vector2d::Zero();  ///< tilt that the maps are already without
  double deviation = 0;                             ///< see PressPlace
  bool used = false;

  /// The maps at other forces, without the present tilt.
  void read(const Observation& r, const std::vector<double>& forces_N);
  static double compression_at(const Observation& r, double force_N);
  /// Scale of a value at a place of the block.
  double scale(size_t load, double x_mm, double y_mm) const;
  /// A place of the block, from the window's middle and along its sides.
  std::array<double, 2> in_window(double x_mm, double y_mm) const;

  /// Covariance of at() with its slopes along the block, by the nodes' noise.
  Eigen::Vector2d with_slopes(double x_mm, double y_mm, double step_mm) const;

  /// How far inside the window; < 0: outside.
  double edge_mm(double x_mm, double y_mm) const;
  /// At a place of the block; NaN off the window and where nothing was seen.
  double at(size_t load, double x_mm, double y_mm) const;
  /// The same; beside places that were not seen, the mean of the seen corners of its cell where they are the
  /// nearer half. Else a window that reaches over the block's rim would cost the rim.
  double near(size_t load, double x_mm, double y_mm) const;
  /// Over its noise's variance, and over that with what presses differ by.
  double weight() const { return 1 / (noise_Pa * noise_Pa); }
  double unlike_Pa = 0;  ///< on top of the noise, while places are found
  double trust() const { return 1 / (noise_Pa * noise_Pa + unlike_Pa * unlike_Pa); }
};

}  // namespace palpate::lump
