// What a press shows of two lumps at once: the nodes around both in the terms of both patches' fields,
// weighed by what noise, emulator, sensor and the two lumps' effect on each other leave open.
#pragma once

#include <Eigen/Core>
#include <array>

#include "engine/lump/network/view.h"

namespace palpate::lump {

/// The two bumps: factors of the fields at each load, fields x loads, each in its own patch.
using PairBumps = std::array<Eigen::MatrixXd, 2>;

class PairSight {
 public:
  PairSight(const Model& model, const PressedNodes& nodes, const std::array<PatchView, 2>& views);

  const PatchView& view(size_t lump) const { return views_[lump]; }
  /// What is seen, and what a lump's bump would show, as numbers of variance noise^2 where there is noise
  /// alone.
  const Eigen::VectorXd& observation() const { return observation_; }
  Eigen::VectorXd of_factors(size_t lump, const Eigen::MatrixXd& factors) const;

  /// How two such bumps are weighed, with a pattern of the sensor of that standard deviation (over modulus,
  /// at the highest load), and with what the two lumps do to each other: RMS over the root of both bumps'
  /// product. Comes before whitened().
  void weigh(const PairBumps& bumps, double pattern, double interaction);
  /// Numbers of unit variance.
  Eigen::MatrixXd whitened(const Eigen::MatrixXd& numbers) const;
  /// Standard deviation of the sensor's pattern (over modulus) that is left of numbers, with the least
  /// -2 log likelihood.
  PatternSize pattern_of(const Eigen::VectorXd& remainder) const;

  /// The nodes less one lump's bump.
  PressedNodes without(size_t lump, const Eigen::MatrixXd& factors) const;
  /// Mean square beyond both patches' fields, over the noise's.
  double rest() const { return rest_; }
  Eigen::Index freedom() const { return observation_.size(); }

 private:
  Eigen::MatrixXd covariance(double pattern) const { return plain_ + pattern * pattern * pattern_; }
  Eigen::MatrixXd of_interaction(const PairBumps& bumps, double size) const;

  const Model* model_;
  const PressedNodes* nodes_;
  std::array<PatchView, 2> views_;
  std::vector<Eigen::Index> inside_;         ///< nodes that either patch holds
  Eigen::MatrixXd fields_;                   ///< those nodes x fields of both
  Eigen::MatrixXd basis_;                    ///< those nodes x numbers, orthonormal
  std::array<Eigen::MatrixXd, 2> in_basis_;  ///< numbers x fields
  Eigen::MatrixXd pattern_;                  ///< covariance of a pattern of unit size, all loads
  Eigen::MatrixXd gauge_;                    ///< columns: each load's gauge and the modulus
  Eigen::MatrixXd plain_;                    ///< all that is no pattern
  Eigen::MatrixXd root_inverse_;
  Eigen::VectorXd observation_;
  double rest_ = 0;
};

}  // namespace palpate::lump
