// The lumps that explain a patch, each shape by itself, and what they say together.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "engine/lump/network/inverse_network.h"

namespace palpate::lump {

/// Logarithms of size, depth and ratio, and the centre's shift in the patch's axes, mm.
using LumpVector = Eigen::Matrix<double, 5, 1>;

/// A lump of one shape; the patch lies as it does.
struct Fit {
  InclusionShape shape = InclusionShape::Sphere;
  LumpVector at = LumpVector::Zero();
  double chi_square = 0;  ///< squares, of unit variance each
  Eigen::Matrix<double, 5, 5> normal = Eigen::Matrix<double, 5, 5>::Identity();
};

/// Factors of the fields at each load, of a fitted lump's bump in a patch of this setting; optionally how
/// they change with the fit's five numbers.
Eigen::MatrixXd bump_of(const Model& model, const Setting& setting, const std::vector<double>& loads,
                        const Fit& fit, std::array<Eigen::MatrixXd, 5>* changes = nullptr);

/// Cost of a lump before it is looked at, added to `chi_square`: wide marginals over the ranges of the
/// training data and walls beyond them, near the patch's middle, above the floor. `slope` and `normal`: null,
/// or both, of the five numbers.
void add_prior(const Model& model, const Setting& setting, const LumpVector& at, double& chi_square,
               LumpVector* slope, Eigen::Matrix<double, 5, 5>* normal);

/// One patch as the emulator explains it.
class Fitter {
 public:
  Fitter(const Model& model, const PressedNodes& nodes, const PatchObservation& patch)
      : model_(model), nodes_(nodes), patch_(patch) {}

  const PatchObservation& patch() const { return patch_; }
  /// Factors of the fields at each load, for a fitted lump; optionally how the patch's numbers of unit
  /// variance change with the fit's five, a column each.
  Eigen::MatrixXd factors(const Fit& fit, Eigen::MatrixXd* jacobian = nullptr) const;

  /// Levenberg and Marquardt's search from where the fit is; `ratio_held`: its third number stays.
  void search(Fit& fit, uint32_t rounds, bool ratio_held = false) const;

 private:
  double chi_square(const Fit& fit, LumpVector* slope, Eigen::Matrix<double, 5, 5>* normal) const;

  const Model& model_;
  const PressedNodes& nodes_;
  const PatchObservation& patch_;
};

/// A lump's whole posterior as a sum of split normals.
struct Posterior {
  struct Part {
    double weight = 0;
    InclusionShape shape = InclusionShape::Sphere;
    std::array<SplitNormal, kParameters> marginals{};  ///< of the logarithms
  };
  std::vector<Part> parts;
  std::array<double, 4> shape_probability{};

  /// Quantile of the logarithm of a parameter.
  double quantile(Parameter what, double fraction) const;
};

/// Everything an estimate is made of, before calibration is applied.
struct Inference {
  Posterior posterior;
  std::array<double, 2> place_mm{}, place_sd_mm{};
  /// -2 log likelihood without a lump less that with one, each with the pattern of the sensor that suits it.
  double log_likelihood_ratio = 0;
  double chi_square = 0;  ///< of the best, per degree of freedom
  double rest = 0;        ///< see PatchErrors::rest(), over what noise and pattern account for
  /// The sensor's pattern that is left with the lump and without one, fraction of the highest load's peak.
  double pattern = 0, plain_pattern = 0;
  double misfit = 0;  ///< pattern over the largest that a calibration or an unusual lump leaves
};

/// The one that explains its patch best, of one or more.
const Fit& best_of(const std::vector<Fit>& fits);

/// One patch with the fits of all shapes that were tried, weighed by the pattern that its best lump leaves.
struct Weighing {
  Look look;
  std::vector<Fit> fits;
  Inference found;  ///< without the posterior and the place
};
Weighing weigh(const Model& model, const PressedNodes& nodes, Method method);

/// The mean over an observation and its mirror image about the diagonal, since the network is not quite even
/// in x and y. `temperature` divides logarithms of likelihoods before shapes are weighed; the network alone
/// has no use for it.
Inference weigh_lumps(const Model& model, const PressedNodes& nodes, Method method, double temperature);

/// Turns what weigh_lumps() found into an estimate, with the interval calibration of its loads and noise.
void summarise(const Model& model, const PressedNodes& nodes, Method method, const Inference& found,
               Estimate& estimate);
/// Makes an estimate's values and intervals NaN.
void clear_values(Estimate& estimate);

}  // namespace palpate::lump
