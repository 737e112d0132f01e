#include "engine/motion/slip_witness.h"

#include <cmath>
#include <span>

namespace palpate {
namespace {

/// A length along a direction with its standard error.
struct Along {
  double mm = 0, sd_mm = 0;
  bool below(double z) const { return mm < -z * sd_mm; }
  bool apart(double z) const { return std::abs(mm) > z * sd_mm; }
};

/// Of components with independent errors; those that are not known (sd NaN) have no part.
Along along(std::span<const double> mm, std::span<const double> sd_mm, std::span<const double> way) {
  Along out;
  double square = 0;
  for (size_t k = 0; k < 2; ++k) {
    if (std::isnan(sd_mm[k]) || way[k] == 0) continue;
    out.mm += way[k] * mm[k];
    square += std::pow(way[k] * sd_mm[k], 2);
  }
  out.sd_mm = std::sqrt(square);
  return out;
}

}  // namespace

SlipWitness slip_between(const PoseComponents& object, const SkinDisplacement& skin) {
  constexpr double kChiSquare95[] = {0, 3.841, 5.991}, kSure = 2.576;
  SlipWitness out;
  out.turn_rad = object.turn_rad[2] - skin.turn_rad;
  out.turn_sd_rad = std::hypot(object.turn_sd_rad[2], skin.turn_sd_rad);
  int known = 0;
  double chi_square = 0, way[2] = {}, length_mm = 0;
  for (int k = 0; k < 2; ++k) {
    out.slip_mm[k] = object.shift_mm[k] - skin.shift_mm[k];
    out.slip_sd_mm[k] = std::hypot(object.shift_sd_mm[k], skin.shift_sd_mm[k]);
    if (std::isnan(out.slip_mm[k]) || std::isnan(out.slip_sd_mm[k])) {
      out.slip_mm[k] = out.slip_sd_mm[k] = std::numeric_limits<double>::quiet_NaN();
      continue;
    }
    ++known;
    chi_square += std::pow(out.slip_mm[k] / out.slip_sd_mm[k], 2);
    way[k] = object.shift_mm[k];
    length_mm = std::hypot(length_mm, way[k]);
  }
  if (known == 0) return out;
  out.on_skin = OnSkin::Sticks;
  // Without any error (0 / 0) equal motions stick.
  if (!(chi_square > kChiSquare95[known])) return out;
  out.on_skin = OnSkin::Slips;
  for (double& part : way) part = length_mm > 0 ? part / length_mm : 0;
  const double across[2] = {-way[1], way[0]};
  const Along gone = along(object.shift_mm, out.slip_sd_mm, way),
              ahead = along(out.slip_mm, out.slip_sd_mm, way);
  const Along carried = along(skin.shift_mm, out.slip_sd_mm, way),
              aside = along(skin.shift_mm, out.slip_sd_mm, across);
  if (!gone.apart(kSure) || ahead.below(kSure) || carried.below(kSure) || (known == 2 && aside.apart(kSure)))
    out.on_skin = OnSkin::Disagrees;
  return out;
}

}  // namespace palpate
