// When the searches of a direct inversion end: numbers that the one by elements and the one that the emulator
// leads share.
#pragma once

#include <algorithm>
#include <cstdint>

#include <Eigen/Core>

#include "engine/lump/fem_inverse/response.h"

namespace palpate::lump {

/// Changes of what is sought: see Unknown.
using LumpStep = Eigen::Matrix<double, kLumpUnknowns, 1>;

inline constexpr uint32_t kMostInVain = 3;
inline constexpr double kStands = 0.2;           // standard deviations that count as none
inline constexpr double kExplains = 1.2;         // chi2 of a value, of an observation that the lump explains
inline constexpr double kNoGain = 0.3;           // of chi2, before elements are asked again
inline constexpr double kNoEmulatedGain = 0.02;  // of chi2, where a step costs next to nothing
inline constexpr Range kRatioRange{0.02, 1000};  // beyond, nothing changes any more
/// Beyond, a ratio counts as open: hardly anything changes any more.
inline constexpr Range kAnyRatios{0.1, 100};
inline constexpr Range kAlongRatio{0.2, 1.2};  // a step of the ratio's logarithm
inline constexpr double kLower = 1;            // of chi2: a better lump than the best
/// Way of a lump on which the grids' correction stays the same.
inline const LumpStep kSameGrids{{0.03, 0.06, 0.15, 0.3, 0.3}};

/// A step with none of its parts longer than a linear model serves.
inline LumpStep shortened(const LumpStep& step) {
  const LumpStep longest{{0.3, 0.4, 1.0, 2.0, 2.0}};
  return step / std::max(1.0, step.cwiseAbs().cwiseQuotient(longest).maxCoeff());
}

}  // namespace palpate::lump
