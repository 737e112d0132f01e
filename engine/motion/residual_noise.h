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

/// What noise of each reach, of variance 1, makes of a fit.
class ReachSums {
 public:
  /// `field` must live as long.
  explicit ReachSums(const ScoreField& field);

  /// Covariance of the sum of row * score under that noise.
  Matrix6d covariance(const ScoreNoise& noise) const;
  /// From the scores' differences over ways of 1 to 48 px along rows and columns (their variogram), by least
  /// squares with no variance below 0, each reach by what the fit has left of it. Reaches of which hardly
  /// anything is left count as the longest of which more is: a surface integrated from slopes errs alike over
  /// all. `inverse`: of the fit's information. `most_px`: ways no longer than this, the contact's radius.
  ScoreNoise noise(const Matrix6d& inverse, double most_px) const;

  /// Six fields, one after another, on cells of a map.
  struct Cells {
    uint32_t width = 0, height = 0;
    std::vector<float> value;  ///< six to a cell

    float* at(size_t cell) { return value.data() + 6 * cell; }
    const float* at(size_t cell) const { return value.data() + 6 * cell; }
  };

 private:
  using Left = std::array<double, ScoreNoise::kReaches>;
  std::vector<Left> left_over(const std::vector<uint32_t>& ways_px, const Matrix6d& inverse) const;

  const ScoreField& field_;
  uint32_t left_px_ = 0, top_px_ = 0;                     // of the first cells
  std::array<Cells, ScoreNoise::kReaches> carried_;       // the noise's covariance times the rows
  std::array<Matrix6d, ScoreNoise::kReaches> of_unit_{};  // covariance of the sum
};

}  // namespace palpate
