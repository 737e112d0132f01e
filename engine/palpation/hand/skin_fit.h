// Skin fit: the exact place of one relief in another of the same skin, from near it.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "engine/motion/rigid_motion.h"
#include "engine/palpation/hand/skin_texture.h"

namespace palpate {

/// A relief's texture from coarse to fine.
struct SkinLevels {
  explicit SkinLevels(const SkinRelief& relief);

  std::array<TextureMap, 2> texture;
};

/// Skin at p in the first pad's frame lies at stretch R(turn) (p - from) + at in the second's.
struct SkinFit {
  Eigen::Vector2d from_mm, at_mm;  ///< the middle of what both see
  double turn_rad = 0, stretch = 1;
  Eigen::Matrix4d covariance;  ///< of `at_mm`, the turn, and the stretch's logarithm
  double overlap = 0;          ///< pixels compared, of the smaller contact's
  double correlation = 0;      ///< of the finest texture there

  /// Without the stretch.
  RigidMotion motion() const;
};

/// Least squares of the texture's differences, weighted against strangers, over the shift, the turn, the
/// texture's height, and the skin's stretch, which a tilted pad changes from place to place. `start` is right
/// to a third of the texture's lengths. None where it does not converge, or what is left is not alike.
std::optional<SkinFit> fit_skin(const SkinLevels& first, const SkinLevels& second, const RigidMotion& start);

}  // namespace palpate
