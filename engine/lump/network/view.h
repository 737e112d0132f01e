// An observation as the network wants it: pressure beyond that of a block without a lump, and its patch
// around a bump in the terms of the network's fields, weighed by what noise and network leave open.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "engine/lump/network/model.h"
#include "engine/lump/observation/observation.h"

namespace palpate::lump {

// Standard deviations that observations are weighed by, and that the inverse network is trained with.
inline constexpr double kGaugeFraction = 0.002;    ///< of a load's force, each by itself
inline constexpr double kModulusFraction = 0.007;  ///< of the tissue's modulus and of the model's force

/// Nodes that all loads saw, away from the rim.
struct PressedNodes {
  std::vector<double> x_mm, y_mm;  ///< from the block's middle
  Eigen::MatrixXd total;           ///< nodes x loads: pressure over modulus
  Eigen::MatrixXd rest;            ///< without what the block alone shows
  std::vector<double> loads;       ///< force over area and modulus
  double noise = 0;                ///< of a value over modulus; more than 0
  double noise_fraction = 0;       ///< of the highest load's peak
  double thickness_mm = 0;
  std::vector<std::string> reasons;  ///< loads that were left out
};

/// Throws Error(Failure::Usage) where the observation's parts do not fit each other. Where it cannot be used,
/// or lies outside of what the model was made for: none, and why in `estimate`.
std::optional<PressedNodes> pressed_nodes(const Model& model, const Observation& observation,
                                          Estimate& estimate);

/// The middle of the largest bump, mm from the block's middle.
std::array<double, 2> find_bump(const Model& model, const PressedNodes& nodes);

/// What of the whole window a block without a lump leaves, per value and noise (squares).
double no_lump_chi_square(const PressedNodes& nodes);

/// A patch around a place, mirrored so that the block's middle lies to the left and above; `swapped`: its
/// first axis is the block's y.
struct PatchView {
  std::array<double, 2> center_mm{};
  bool swapped = false;
  Setting setting;

  PatchView(const Model& model, const PressedNodes& nodes, std::array<double, 2> place_mm, bool swap);
  std::array<double, 2> to_patch(double x_mm, double y_mm) const;
  /// Of a shift in the patch's axes.
  std::array<double, 2> to_block(double u_mm, double v_mm) const;

 private:
  double sign_x_ = 1, sign_y_ = 1;
};

/// The patch as sums over its nodes: all that a fit needs of it.
struct PatchSums {
  Eigen::MatrixXd gram;     ///< fields x fields
  Eigen::MatrixXd right;    ///< fields x loads, of the rest
  Eigen::MatrixXd total;    ///< fields x loads, of the whole pressure
  double rest_squares = 0;  ///< of all nodes and loads
  Eigen::Index nodes = 0;
};
PatchSums sum_patch(const Patch& patch, const PressedNodes& nodes, const PatchView& view);

/// Factors (fields x loads) to numbers with unit variance: what the observation's noise, the network's own
/// error and the gauge make of them.
class PatchWhitener {
 public:
  PatchWhitener(const Model& model, const PressedNodes& nodes, const PatchSums& sums, double gauge_fraction);

  Eigen::VectorXd of_factors(const Eigen::MatrixXd& factors) const;
  const Eigen::VectorXd& observation() const { return observation_; }
  /// Mean square beyond the fields, over the noise's.
  double rest() const { return rest_; }
  Eigen::Index size() const { return observation_.size(); }

 private:
  Eigen::VectorXd spread(const Eigen::MatrixXd& lower_factors) const;

  Eigen::MatrixXd lower_;                 ///< gram = lower lower^T
  Eigen::MatrixXd modes_;                 ///< loads x loads
  std::vector<Eigen::MatrixXd> inverse_;  ///< one per mode
  Eigen::MatrixXd gauge_;                 ///< directions of the gauge's errors
  Eigen::VectorXd gauge_kept_;
  Eigen::VectorXd observation_;
  double rest_ = 0;
};

}  // namespace palpate::lump
