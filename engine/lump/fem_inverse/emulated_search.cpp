// Part of DirectSearch that the emulator leads: elements say what it is off by, at few lumps.
#include <algorithm>
#include <cmath>

#include "engine/lump/fem_inverse/prediction.h"
#include "engine/lump/fem_inverse/search.h"
#include "engine/numeric/dense.h"

namespace palpate::lump {
namespace {

constexpr uint32_t kMostAsked = 10;  // times that elements are asked
constexpr uint32_t kMostHalved = 4;  // ways to a lump that they refuse
constexpr Eigen::Index kMostSecants = 2;
constexpr double kLongestSecant = 3;  // of kSameGrids: the slope of a longer way is none here
constexpr double kSecantDoubt = 0.1;  // of kSameGrids: way below which elements differ by chance
/// Lumps that are the same for a search: half of what cells may be off by.
const LumpStep kSameLump{{0.0015, 0.003, 0.01, 0.01, 0.01}};

}  // namespace

void DirectSearch::lean_on(const std::vector<Asked>& others, State& state) const {
  state.beyond_by_unknown = {};
  Eigen::MatrixXd ways(kLumpUnknowns, 0), changes(state.beyond_Pa.size(), 0);
  for (auto other = others.rbegin(); other != others.rend(); ++other) {
    const LumpStep way = difference(other->lump, *state.pressed).cwiseQuotient(kSameGrids);
    if (way.cwiseAbs().maxCoeff() > kLongestSecant) continue;
    const Eigen::Index count = ways.cols() + 1;
    ways.conservativeResize(Eigen::NoChange, count);
    changes.conservativeResize(Eigen::NoChange, count);
    ways.col(count - 1) = way;
    changes.col(count - 1) = other->beyond_Pa - state.beyond_Pa;
    if (count == kMostSecants) break;
  }
  if (ways.cols() == 0) return;
  Eigen::MatrixXd normal = dense::product_tn(ways, ways);
  normal.diagonal().array() += kSecantDoubt * kSecantDoubt;
  state.beyond_by_unknown =
      dense::product(changes, dense::Ldlt(normal).solve(Eigen::MatrixXd(ways.transpose()))) *
      kSameGrids.cwiseInverse().asDiagonal();
}

void DirectSearch::level(State& state) {
  if (state.beyond_by_unknown.size() > 0)
    state.beyond_Pa += state.beyond_by_unknown * difference(state.lump, *state.pressed);
  state.beyond_by_unknown = {};
  state.pressed = state.lump;
}

std::optional<DirectSearch::Glimpse> DirectSearch::glimpse(const Case::Lump& from) {
  if (!emulator_.reaches(from) || !press_tissue()) return std::nullopt;
  State state;
  state.lump = from;
  state.cells = response_cells(observation_, from, options_.model);
  state.grids = std::make_shared<const GridCorrection>(tissue_->correction);
  state.beyond_Pa = tissue_->searched_Pa + tissue_->correction.add_Pa;
  emulate(state);
  judge(state);
  uint32_t rounds = options_.most_rounds;
  descend(state, rounds);
  const std::optional<double> tissue_chi2 = without_lump(state);
  if (!tissue_chi2) return std::nullopt;
  return Glimpse{std::move(state), *tissue_chi2};
}

bool DirectSearch::settle_emulated(State& best) {
  std::vector<Asked> others;
  // Off the middle a whole block is solved, at four times the cost.
  const double no_gain = best.cells.in_middle(options_.model.cells) ? kNoGain / 2 : kNoGain;
  double part = 1;  // of the way to the best lump by the emulator that is gone
  for (uint32_t asked = 0, in_vain = 0; asked < kMostAsked && in_vain < kMostInVain; ++asked) {
    State next = best;
    uint32_t rounds = options_.most_rounds;
    descend(next, rounds);
    const LumpStep way = difference(next.lump, best.lump),
                   same = (kStands * solve(next, 0, Sought::Lump).sd).cwiseMax(kSameLump);
    if (best.chi2 - next.chi2 < no_gain || (way.cwiseAbs() - same).maxCoeff() <= 0) {
      best = std::move(next);
      break;
    }
    std::optional<State> there = part == 1 ? next : moved_to(moved(best.lump, way * part), best);
    for (uint32_t halved = 0; there && !correct(*there); ++halved) {
      // No cells follow such a lump, or it finds no equilibrium: half the way, then.
      part /= 2;
      if (halved == kMostHalved) return false;
      there = moved_to(moved(best.lump, way * part), best);
    }
    if (!there) return false;
    if (there->chi2 < best.chi2) {
      others.push_back({*best.pressed, best.beyond_Pa});
      best = std::move(*there);
      in_vain = 0;
      part = std::min(1.0, 2 * part);
    } else {
      // The emulator misled: from where it started it knows better now, and goes less far.
      others.push_back({*there->pressed, there->beyond_Pa});
      ++in_vain;
      part /= 2;
    }
    lean_on(others, best);
    emulate(best);
    judge(best);
  }
  // Intervals are of the emulator's own slopes.
  level(best);
  emulate(best);
  judge(best);
  return best.chi2 < kExplains * static_cast<double>(best.prediction.pressure_Pa.size());
}

}  // namespace palpate::lump
