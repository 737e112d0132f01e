// The network from an observation to its lump: what the patch around a bump looks like, in a few numbers, and
// what the network says of them.
#pragma once

#include <Eigen/Core>
#include <array>

#include "engine/lump/network/model.h"
#include "engine/lump/network/view.h"

namespace palpate::lump {

/// The principal components' factors at a load, fields x (principal components and, last, their middle): the
/// cubic through those at the inverse network's own loads.
Eigen::MatrixXd components_at(const InverseNetwork& inverse, Eigen::Index fields, double load);

/// A patch of an observation with what all methods need of it. set_pattern() comes before all that is
/// whitened.
struct PatchObservation {
  PatchView view;
  PatchSums sums;
  PatchErrors errors;
  double pattern = 0;  ///< of the sensor, over modulus at the highest load, as it is weighed
  PatchWhitener whitener;
  Eigen::VectorXd observation;  ///< of unit variance

  PatchObservation(const Model& model, const PressedNodes& nodes, const PatchView& from);
  void set_pattern(double size);
  /// Components of unit variance.
  Eigen::VectorXd of_factors(const Eigen::MatrixXd& factors) const {
    return whitener.of(errors.of_factors(factors));
  }
};

/// The inverse network's inputs of one patch, before scaling: the bump's likeliest make-up (see
/// InverseNetwork::components), what noise leaves open of it, place, thickness, loads, noise, pattern.
Eigen::VectorXf network_features(const Model& model, const PressedNodes& nodes,
                                 const PatchObservation& patch);

/// The network's output for a patch.
struct Answer {
  std::array<double, 4> shape_probability{};   ///< in the order of InclusionShape
  std::array<double, 4> across_probability{};  ///< of each shape, that it lies across the patch
  std::array<std::array<SplitNormal, kParameters>, 4> marginals{};  ///< of the logarithms, were it this shape
  std::array<double, 2> shift_mm{}, shift_sd_mm{};  ///< of the lump's centre, in the patch's axes
};
Answer answer_of(const Model& model, const Eigen::VectorXf& features);

/// An observation's bump in the patch that fits it: looked for, then moved and turned as the network says.
/// The sensor's pattern is the usual one.
struct Look {
  PatchObservation patch;
  Answer answer;
};
Look look_for_lump(const Model& model, const PressedNodes& nodes);

/// The outputs' places.
namespace reader_output {
inline constexpr Eigen::Index kClasses = 6;  ///< four shapes along the patch, then two long ones across it
inline constexpr Eigen::Index kBells = kClasses;     ///< four shapes x three logarithms x middle, log sds
inline constexpr Eigen::Index kShift = kBells + 36;  ///< two middles, two log sds
inline constexpr Eigen::Index kCount = kShift + 4;
/// A class's shape, and whether it lies across.
constexpr InclusionShape shape_of(Eigen::Index of) {
  return of < 4    ? static_cast<InclusionShape>(of)
         : of == 4 ? InclusionShape::Ellipsoid
                   : InclusionShape::LyingCylinder;
}
}  // namespace reader_output

}  // namespace palpate::lump
