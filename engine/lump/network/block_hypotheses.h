// Fit of an observation to the block as stated, with any lump in it, and to a block that differs from it.
//
// Generalised least squares on all loads together: pressure is the block's own (Base) plus a bump that is any
// sum of the inverse network's principal components, plus slow errors of sensor and gauge. What of the
// observation none of these explains is what chi-square counts; another pitch or another place of the window
// moves the block's own pressure only, so their chi-squares are comparable.
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <vector>

#include "engine/lump/network/view.h"

namespace palpate::dense {
class Cholesky;
}

namespace palpate::lump {

/// Differences between the true block and the stated one.
struct Change {
  double pitch = 0;                  ///< true over stated, less 1
  std::array<double, 2> shift_mm{};  ///< of the window's middle, true less stated
  double thickness = 0, young = 0;   ///< of the tissue, true over stated, less 1
};

/// The change that explains an observation best.
struct ChangeFit {
  Change change;
  double chi_square = 0;
  double sd = 0;  ///< standard error of the change's one number, or of its shift's length; noise and model
};

/// Columns by which maps may be wrong, fitted linearly.
struct LinearFit {
  Eigen::VectorXd value, sd;
  double chi_square = 0;
};

class BlockHypotheses {
 public:
  /// `uneven_sd`: standard deviation of the sensor's slow errors at the block's rim, share of the pressure.
  BlockHypotheses(const Model& model, const PressedNodes& nodes, double uneven_sd);

  /// Chi-square of the block as stated.
  double chi_square() const { return told_; }
  double chi_square(const Change& change) const;
  /// Nodes that count: beyond a long bump's end none do.
  double nodes() const { return nodes_counted_; }

  ChangeFit best_pitch() const;
  ChangeFit best_shift() const;
  ChangeFit best_thickness() const;
  /// Pressure that rises along x and y, as a share at the rim. `expected_sd`: its standard deviation about 0;
  /// 0: any is as likely.
  LinearFit tilt(double expected_sd = 0) const;
  /// Any other pattern of pressure over modulus, nodes x loads, as a multiple of it.
  LinearFit pattern(const Eigen::MatrixXd& at_nodes) const;

 private:
  Eigen::VectorXd block(const Change& change) const;
  /// `expected_sd`: standard deviations about 0; empty: any value is.
  LinearFit linear(const Eigen::MatrixXd& columns, const Eigen::VectorXd& expected_sd = {}) const;
  double squares(const Eigen::VectorXd& left) const;
  template <typename At>
  ChangeFit search(const std::vector<double>& grid, const At& at) const;

  const Model& model_;
  const PressedNodes& nodes_;
  std::vector<double> weights_;  ///< of the loads
  Eigen::VectorXd observed_;     ///< all loads together; the block alone is about 1
  Eigen::VectorXd plain_;        ///< the block's own, as stated
  Eigen::VectorXd sd_;           ///< of each node: noise, and what the model leaves
  Eigen::MatrixXd other_;        ///< nodes x what else may be, unit variance each, over sd
  std::shared_ptr<const dense::Cholesky> root_;
  double told_ = 0, nodes_counted_ = 0;
};

}  // namespace palpate::lump
