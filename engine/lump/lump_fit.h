// The lumps that explain a patch, each shape by itself, and what they say together.
#pragma once

#include <Eigen/Dense>
#include <array>
#include <vector>

#include "engine/lump/lump_view.h"

namespace palpate {

/// Logarithms of size, depth and ratio, and the centre's shift in the patch's axes, mm.
using LumpVector = Eigen::Matrix<double, 5, 1>;

/// A shape and how it lies: `swapped` patches have their first axis along the block's y.
struct LumpHypothesis {
  LumpShape shape = LumpShape::Sphere;
  bool swapped = false;
  double prior = 0;
};

struct LumpFit {
  LumpHypothesis what;
  LumpVector at = LumpVector::Zero();
  double misfit = 0;  ///< squares, of unit variance each
  Eigen::Matrix<double, 5, 5> normal = Eigen::Matrix<double, 5, 5>::Identity();
};

/// One patch as seen by a model (one member, or the mean of all: -1).
class LumpFitter {
 public:
  LumpFitter(const LumpModel& model, const PressedNodes& nodes, const PatchView& view, int member);

  /// Who predicts from here on, as for the constructor.
  void use(int member) { member_ = member; }
  const PatchView& view() const { return view_; }
  const PatchWhitener& whitener() const { return whitener_; }
  double no_lump() const { return whitener_.reading().squaredNorm(); }

  /// The best of a coarse search over size, depth and ratio.
  LumpFit start(const LumpHypothesis& what) const;
  /// Levenberg and Marquardt's search from there; `ratio_held`: its third number stays.
  void search(LumpFit& fit, uint32_t rounds, bool ratio_held = false) const;

 private:
  double misfit(const LumpFit& fit, LumpVector* slope, Eigen::Matrix<double, 5, 5>* normal) const;

  const LumpModel& model_;
  const PressedNodes& nodes_;
  PatchView view_;
  PatchSums sums_;
  PatchWhitener whitener_;
  int member_;
};

/// A lump's whole posterior as a sum of bells.
struct LumpPosterior {
  struct Bell {
    double weight = 0;
    LumpShape shape = LumpShape::Sphere;
    std::array<double, kParameters> mean{}, sd{};  ///< of the logarithms
  };
  std::vector<Bell> bells;
  std::array<double, 4> shape_probability{};

  /// Of a logarithm, where the bells' sum reaches `share`.
  double quantile(LumpParameter what, double share) const;
};

/// Everything an estimate is made of, before trust is applied.
struct LumpEvidence {
  std::vector<LumpFit> fits;  ///< best first
  LumpPosterior posterior;
  std::array<double, 2> place_mm{}, place_sd_mm{};
  double evidence = 0;  ///< misfit without a lump less misfit with one
  double misfit = 0;    ///< of the best, per degree of freedom
  double rest = 0;      ///< see PatchWhitener::rest()
  double no_lump_misfit = 0;
};

/// `warmth` divides logarithms of likelihoods before hypotheses are weighed.
LumpEvidence weigh_lumps(const LumpModel& model, const PressedNodes& nodes, double warmth, int member = -1);

/// What weigh_lumps() found with the trust that its like has earned.
void conclude(const LumpModel& model, const PressedNodes& nodes, const LumpEvidence& found,
              LumpEstimate& estimate);

}  // namespace palpate
