// Noise of residuals that is correlated over the pad, and what it makes of a least-squares fit.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "engine/motion/rigid_motion.h"

namespace palpate {

/// The terms of a fit's gradient, sum of row * score, each at its pixel of a map.
struct ScoreField {
  uint32_t width = 0, height = 0;
  std::vector<uint32_t> pixel;  ///< rising
  std::vector<std::array<float, 6>> row;
  std::vector<float> score;
};

/// Covariance of scores as a sum of Gaussian ones of several reaches: variance[k] exp(-d^2 / (2
/// reach_px(k)^2)), the first of no reach at all. A surface integrated from slopes errs over all of them.
struct ScoreNoise {
  static constexpr size_t kReaches = 7;
  std::array<double, kReaches> variance{};

  static double reach_px(size_t k) { return k == 0 ? 0 : 1.5 * double(1u << (k - 1)); }
};

/// From the scores' differences over ways of 1 to 48 px along rows and columns (their variogram), by least
/// squares with no variance below 0. `most_px`: ways no longer than this, the contact's radius. A shift of
/// the whole is in no difference, and the fit has taken away the tilt, which is allowed for.
ScoreNoise score_noise(const ScoreField& field, double most_px);

/// Covariance of the sum of row * score under that noise.
Matrix6d gradient_covariance(const ScoreField& field, const ScoreNoise& noise);

}  // namespace palpate
