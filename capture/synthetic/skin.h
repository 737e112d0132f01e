// The synthetic pad's skin: how it moves along itself under a contact that sticks, slips in part or slides,
// and the pattern that rides on it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "capture/synthetic/options.h"

namespace palpate {

/// Tangential displacement by distance r from the centre of a contact of radius a that sticks within c, as a
/// fraction of the core's: cattaneo_fraction. Beyond the contact the half space's answer is tapered by
/// exp(-pi (r - a) / (2 H)), the slowest decay of shear in a layer of thickness H that is bonded at its base.
double pulled_fraction(double r_mm, double a_mm, double c_mm, double thickness_mm);

/// The same of a twisted contact that sticks: u_theta / (turn * a), r/a inside (Reissner and Sagoci 1944),
/// with the same taper.
double turned_fraction(double r_mm, double a_mm, double thickness_mm);

/// Turn that friction holds under a sphere pressed with 1 N whose contact has the radius a: the torque
/// 3 pi / 16 mu F a over the stiffness 16/3 G a^3.
double turn_limit_rad(double friction, double young_MPa, double a_mm);

/// Light of the skin's pattern, relative to the bare skin, over the whole frame.
class SkinMap {
 public:
  explicit SkinMap(const SyntheticOptions& options);

  /// At a place of the untouched frame, px.
  float at(float x_px, float y_px) const;
  double mean() const { return mean_; }  ///< over the frame

 private:
  static constexpr int kPerPixel = 2;    // samples
  static constexpr int kMargin_px = 32;  // beyond the frame, for what moves in
  int columns_, rows_;
  double mean_ = 1;
  std::vector<float> light_;
};

namespace skin {
inline constexpr double kSpacing_mm = 1.0;  ///< of the markers
inline constexpr double kRadius_mm = 0.17;  ///< of a marker
inline constexpr uint32_t kLeastWidth_px = 320;
}  // namespace skin

}  // namespace palpate
