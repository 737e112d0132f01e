#include "engine/lump/press_effect/plate_check.h"

#include <Eigen/Core>
#include <cmath>

#include "engine/base/text.h"
#include "engine/lump/network/block_hypotheses.h"
#include "engine/lump/network/network.h"
#include "engine/lump/network/view.h"
#include "engine/lump/observation/saturated_loads.h"
#include "engine/lump/press_effect/press_effect.h"
#include "engine/tissue/map_sampling.h"

namespace palpate::lump {
namespace {

constexpr double kTriedFriction = 0.1;
constexpr double kLeastGrip = 0.45, kLeastErrors = 4.5;  // beyond doubt: see README.md

}  // namespace

std::optional<PlateGrip> plate_grip(const Network& network, const Observation& observation) {
  Estimate unused;
  const auto seen = without_saturated_loads(observation, unused);
  const auto nodes = seen ? pressed_nodes(network.model(), *seen, unused) : std::nullopt;
  if (!nodes || nodes->loads.size() != seen->force_N.size()) return std::nullopt;
  const PressEffect effect(*seen, {{}, false, kTriedFriction}, PressEffect::Effort::Rough);
  if (!effect.converged()) return std::nullopt;
  Eigen::MatrixXd pattern(static_cast<Eigen::Index>(nodes->x_mm.size()),
                          static_cast<Eigen::Index>(nodes->loads.size()));
  for (size_t k = 0; k < nodes->loads.size(); ++k) {
    const PressureMap change = effect.block_change_Pa(k);
    for (size_t n = 0; n < nodes->x_mm.size(); ++n)
      pattern(static_cast<Eigen::Index>(n), static_cast<Eigen::Index>(k)) =
          map_at(change, nodes->x_mm[n], nodes->y_mm[n]) / seen->young_Pa;
  }
  const LinearFit fit = BlockHypotheses(network.model(), *nodes, seen->uneven_sd).pattern(pattern);
  PlateGrip found{fit.value(0), fit.sd(0), true};
  found.slides = std::abs(found.grip) < kLeastGrip || std::abs(found.grip) < kLeastErrors * found.sd;
  return found;
}

void report_plate(const Network& network, const Observation& observation, Estimate& estimate) {
  if (observation.skin || observation.plate || observation.relaxation ||
      estimate.verdict == Status::Inconsistent || estimate.verdict == Status::Saturated)
    return;
  Observation told = observation;
  if (!(told.young_Pa > 0) && estimate.tissue) told.young_Pa = estimate.tissue->young_Pa.value;
  if (!(told.young_Pa > 0)) return;
  const std::optional<PlateGrip> found = plate_grip(network, told);
  if (!found || found->slides) return;
  estimate.verdict = Status::Inconsistent;
  estimate.lumps.clear();
  estimate.reasons.insert(
      estimate.reasons.begin(),
      found->grip > 0
          ? text("the pressure falls towards the rim as under a plate that holds the tissue, with %.2g "
                 "(standard error %.2g) of what a friction of %g does: let it slide (oil, talc), or say "
                 "--plate-friction",
                 found->grip, found->sd, kTriedFriction)
          : text("the pressure does not fall towards the rim as under a plate that slides, with or without "
                 "friction (%.2g, standard error %.2g): if it sticks let it slide (oil, talc), or say "
                 "--plate-sticks",
                 found->grip, found->sd));
}

}  // namespace palpate::lump
