// Two lumps that explain a press together, by the emulator's bumps superposed.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "engine/lump/network/fit.h"
#include "engine/lump/pair/pair_sight.h"

namespace palpate::lump {

using PairMatrix = Eigen::Matrix<double, 10, 10>;
using PairVector = Eigen::Matrix<double, 10, 1>;

/// Two lumps of one shape each; each patch lies as its lump does.
struct PairFit {
  std::array<Fit, 2> lumps;
  double chi_square = 0;                       ///< squares of unit variance each
  PairMatrix normal = PairMatrix::Identity();  ///< of the first one's five numbers, then the second one's
};

/// Levenberg and Marquardt's search from where the fit is. `held`: one of the ten numbers that stays; -1:
/// none.
void search(const Model& model, const PressedNodes& nodes, const PairSight& sight, uint32_t rounds, int held,
            PairFit& fit);

/// Both bumps of a fit.
PairBumps bumps_of(const Model& model, const PressedNodes& nodes, const PairSight& sight, const PairFit& fit);

/// Two lumps with what is said of each, and the fit that explains the press best.
struct PairWeighing {
  std::array<Inference, 2> lumps;
  PairFit best;
};

/// Two places, mm from the block's middle.
using TwoPlaces = std::array<std::array<double, 2>, 2>;

/// The two lumps nearest to two places; their order stays. Of several pairs of places the one from which two
/// balls explain the press best. `temperature` as of weigh_lumps().
PairWeighing weigh_pair(const Model& model, const PressedNodes& nodes, const std::vector<TwoPlaces>& tops_mm,
                        double temperature);

}  // namespace palpate::lump
