// An observation as the network wants it: pressure beyond that of a block without a lump, and its patch
// around a bump in the terms of the network's fields, weighed by what noise and network leave open.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "engine/lump/network/model.h"
#include "engine/lump/observation/observation.h"
#include "engine/numeric/dense.h"

namespace palpate::lump {

// Standard deviations that observations are weighed by, and that the inverse network is trained with.
inline constexpr double kGaugeFraction = 0.002;    ///< of a load's force, each by itself
inline constexpr double kModulusFraction = 0.007;  ///< of the tissue's modulus and of the model's force
/// A sensor's own pattern, fraction of the highest load's peak: where a search for it begins, the most that a
/// calibration is taken to leave, and what is looked at.
inline constexpr double kUsualPattern = 1e-3, kLargestPattern = 5e-3;
inline constexpr std::array<double, 8> kPatterns = {3e-4, 7e-4, 1.6e-3, 3.5e-3, 8e-3, 1.8e-2, 4e-2, 9e-2};

/// Variance of a pattern that is each load's own, relative to the common one.
inline constexpr double kLoadPattern = 0.1;

/// Nodes that all loads saw, away from the rim.
struct PressedNodes {
  std::vector<double> x_mm, y_mm;  ///< from the block's middle
  Eigen::MatrixXd total;           ///< nodes x loads: pressure over modulus
  Eigen::MatrixXd rest;            ///< without what the block alone shows
  std::vector<double> loads;       ///< force over area and modulus
  double noise = 0;                ///< of a value over modulus; more than 0
  double noise_fraction = 0;       ///< of the highest load's peak
  double peak = 0;                 ///< of the highest load's pressure over modulus
  double thickness_mm = 0;
  std::vector<std::string> reasons;  ///< loads that were left out
};

/// Throws Error(Failure::Usage) where the observation's parts do not fit each other. Where it cannot be used,
/// or lies outside of what the model was made for: none, and why in `estimate`.
std::optional<PressedNodes> pressed_nodes(const Model& model, const Observation& observation,
                                          Estimate& estimate);

/// The middle of the largest bump, mm from the block's middle.
std::array<double, 2> find_bump(const Model& model, const PressedNodes& nodes);

/// A patch around a place, mirrored so that the block's middle lies to the left and above; `swapped`: its
/// first axis is the block's y.
struct PatchView {
  std::array<double, 2> center_mm{};
  bool swapped = false;
  Setting setting;

  PatchView(const Model& model, const PressedNodes& nodes, std::array<double, 2> place_mm, bool swap);
  std::array<double, 2> to_patch(double x_mm, double y_mm) const;
  /// A place in the patch's axes as the block has it, mm from its middle.
  std::array<double, 2> place_mm(double u_mm, double v_mm) const;
  /// Turns a shift in the patch's axes into the block's.
  std::array<double, 2> to_block(double u_mm, double v_mm) const;

 private:
  double sign_x_ = 1, sign_y_ = 1;
};

/// Adds a bump, as factors of the view's fields at each load, to what the nodes show beyond the block.
void add_bump(const Model& model, const PatchView& view, const Eigen::MatrixXd& factors, PressedNodes& nodes);

/// The patch as sums over its nodes: all that a fit needs of it.
struct PatchSums {
  Eigen::MatrixXd gram;     ///< fields x fields
  Eigen::MatrixXd right;    ///< fields x loads, of the rest
  Eigen::MatrixXd total;    ///< fields x loads, of the whole pressure
  double rest_squares = 0;  ///< of all nodes and loads
  Eigen::Index nodes = 0;
};
PatchSums sum_patch(const Patch& patch, const PressedNodes& nodes, const PatchView& view);

/// Covariance of a patch's factors without the lump: each value's noise, the network's own error, the
/// gauge's, and a pattern of the sensor that is alike at all loads, white or smooth, added or a gain.
class PatchErrors {
 public:
  PatchErrors(const Model& model, const PressedNodes& nodes, const PatchSums& sums, double gauge_fraction);

  /// The patch's own factors, as numbers of variance noise^2 each where there is noise alone; and others.
  const Eigen::VectorXd& observation() const { return observation_; }
  Eigen::VectorXd of_factors(const Eigen::MatrixXd& factors) const;
  /// PatchSums::right for other values at the same nodes.
  Eigen::VectorXd of_right(const Eigen::MatrixXd& right) const;
  /// Covariance of those, with a pattern of that standard deviation (over modulus, at the highest load).
  Eigen::MatrixXd covariance(double pattern) const;
  /// Covariance of what another press of the same block does not repeat: each value's noise and each load's
  /// gauge.
  Eigen::MatrixXd of_one_press() const;
  /// The same of a press by another pad, which has a pattern of its own: of that standard deviation, as
  /// covariance() has it.
  Eigen::MatrixXd of_another_pad(double pattern) const {
    return of_one_press() + pattern * pattern * pattern_;
  }
  /// Mean square beyond the fields, over the noise's.
  double rest() const { return rest_; }
  double noise() const { return noise_; }

 private:
  Eigen::MatrixXd lower_;  ///< gram = lower lower^T
  Eigen::MatrixXd plain_, pattern_;
  Eigen::MatrixXd gauge_;  // a column each load, and one of the modulus
  Eigen::VectorXd observation_;
  double rest_ = 0, noise_ = 0;
};

/// A sensor's pattern of one size among kPatterns, and what PatchErrors' numbers cost under it.
class PatternCovariance {
 public:
  PatternCovariance(const PatchErrors& errors, double peak, double pattern_fraction)
      : PatternCovariance(errors.covariance(pattern_fraction * peak), pattern_fraction) {}
  /// `covariance`: with the pattern.
  PatternCovariance(const Eigen::MatrixXd& covariance, double pattern_fraction);
  /// Squares of unit variance, a row of each column's.
  Eigen::RowVectorXd squares(const Eigen::MatrixXd& numbers) const;
  /// Sum to add to squares for -2 log likelihood, with what large patterns cost.
  double cost() const { return cost_; }

 private:
  dense::Cholesky root_;
  double cost_ = 0;
};

/// How large the pattern is that is left of numbers of PatchErrors (the observation less what explains it).
struct PatternSize {
  double pattern = 0;  ///< over modulus, mean of the logarithm over what is likely
  double energy = 0;   ///< least -2 log likelihood, with what large patterns cost
};
/// The size by what each of kPatterns costs in -2 log likelihood; `peak`: the highest pressure over modulus.
PatternSize pattern_size(const std::array<double, kPatterns.size()>& energy, double peak);
/// For each of several remainders, columns.
std::vector<PatternSize> pattern_sizes(const PatchErrors& errors, const PressedNodes& nodes,
                                       const Eigen::MatrixXd& remainders);

/// Numbers of PatchErrors to numbers with unit variance.
class PatchWhitener {
 public:
  PatchWhitener() = default;  ///< of nothing
  PatchWhitener(const PatchErrors& errors, double pattern);

  Eigen::VectorXd of(const Eigen::VectorXd& numbers) const;
  Eigen::MatrixXd of_covariance(const Eigen::MatrixXd& numbers) const;
  Eigen::Index size() const { return root_inverse_.rows(); }

 private:
  Eigen::MatrixXd root_inverse_;  ///< lower half
};

}  // namespace palpate::lump
