// Part of DirectSearch that the emulator leads: elements say what it is off by, at few lumps.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

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
constexpr double kSameRefined = 0.5;  // of kSameGrids: way on which what the finest grids say stays the same
/// Lumps that are the same for a search: half of what cells may be off by.
const LumpStep kSameLump{{0.0015, 0.003, 0.01, 0.01, 0.01}};

}  // namespace

DirectSearch::Asked DirectSearch::asked_of(const State& state) {
  const Eigen::VectorXd& finer_Pa = state.grids->finer_Pa;
  return {*state.pressed,
          finer_Pa.size() > 0 ? Eigen::VectorXd(state.beyond_Pa - finer_Pa) : state.beyond_Pa};
}

bool DirectSearch::refined(const State& state) {
  return state.refined &&
         difference(state.lump, *state.refined).cwiseAbs().cwiseQuotient(kSameGrids).maxCoeff() <
             kSameRefined;
}

void DirectSearch::lean_on(const std::vector<Asked>& others, State& state) const {
  state.beyond_by_unknown = {};
  const Eigen::VectorXd own_Pa = asked_of(state).beyond_Pa;
  Eigen::MatrixXd ways(kLumpUnknowns, 0), changes(own_Pa.size(), 0);
  for (auto other = others.rbegin(); other != others.rend(); ++other) {
    const LumpStep way = difference(other->lump, *state.pressed).cwiseQuotient(kSameGrids);
    if (way.cwiseAbs().maxCoeff() > kLongestSecant) continue;
    const Eigen::Index count = ways.cols() + 1;
    ways.conservativeResize(Eigen::NoChange, count);
    changes.conservativeResize(Eigen::NoChange, count);
    ways.col(count - 1) = way;
    changes.col(count - 1) = other->beyond_Pa - own_Pa;
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

DirectSearch::State DirectSearch::best_beyond(const Case::Lump& from, Eigen::VectorXd tissue_Pa,
                                              GridCorrection correction) {
  State state;
  state.lump = from;
  state.cells = response_cells(observation_, from, options_.model);
  state.grids = std::make_shared<const GridCorrection>(std::move(correction));
  state.beyond_Pa = std::move(tissue_Pa);
  emulate(state);
  judge(state);
  uint32_t rounds = options_.most_rounds;
  descend(state, rounds);
  return state;
}

bool DirectSearch::lies_along_y(const Case::Lump& guess) {
  if (!emulator_.reaches(guess)) return guess.along_y;
  const Eigen::VectorXd tissue_Pa = emulator_.tissue_Pa(), none = Eigen::VectorXd::Zero(tissue_Pa.size());
  std::array<double, 2> chi2{};
  for (const bool along_y : {false, true}) {
    Case::Lump from = guess;
    from.along_y = along_y;
    chi2[along_y ? 1 : 0] = best_beyond(from, tissue_Pa, {none, none, none}).chi2;
  }
  return chi2[1] < chi2[0];
}

std::optional<DirectSearch::Glimpse> DirectSearch::glimpse(const Case::Lump& from) {
  if (!emulator_.reaches(from) || !press_tissue()) return std::nullopt;
  State state = best_beyond(from, tissue_->searched_Pa + tissue_->correction.add_Pa, tissue_->correction);
  const std::optional<double> tissue_chi2 = without_lump(state);
  if (!tissue_chi2) return std::nullopt;
  return Glimpse{std::move(state), *tissue_chi2};
}

DirectSearch::Settled DirectSearch::settle_emulated(State& best, double most_chi2) {
  std::vector<Asked> others;
  const double explained = kExplains * static_cast<double>(best.prediction.pressure_Pa.size());
  double part = 1;  // of the way to the best lump by the emulator that is gone
  for (uint32_t asked = 0, in_vain = 0; asked < kMostAsked && in_vain < kMostInVain; ++asked) {
    State next = best;
    uint32_t rounds = options_.most_rounds;
    descend(next, rounds);
    if (next.chi2 > most_chi2) {
      best = std::move(next);
      return Settled::Outdone;
    }
    const LumpStep way = difference(next.lump, best.lump),
                   same = (kStands * solve(next, 0, Sought::Lump).sd).cwiseMax(kSameLump);
    const bool settled = best.chi2 - next.chi2 < kNoGain / 2 || (way.cwiseAbs() - same).maxCoeff() <= 0;
    if (settled) {
      best = std::move(next);
      if (refined(best)) {
        level(best);
        emulate(best);
        judge(best);
        return Settled::Yes;
      }
      others.push_back(asked_of(best));
      // Where the finest grids have no answer, what the others say has to do.
      if (!press(best, AskedGrids::All)) break;
      lean_on(others, best);
      emulate(best);
      judge(best);
      continue;
    }
    std::optional<State> there = part == 1 ? next : moved_to(moved(best.lump, way * part), best);
    for (uint32_t halved = 0; there && !correct(*there); ++halved) {
      // No cells follow such a lump, or it finds no equilibrium: half the way, then.
      part /= 2;
      if (halved == kMostHalved || spent()) return Settled::No;
      there = moved_to(moved(best.lump, way * part), best);
    }
    if (!there) return Settled::No;
    if (there->chi2 < best.chi2) {
      others.push_back(asked_of(best));
      best = std::move(*there);
      in_vain = 0;
      part = std::min(1.0, 2 * part);
    } else {
      // The emulator misled, or finer grids that were asked elsewhere. From where it started it knows better
      // now, and goes less far.
      others.push_back(asked_of(*there));
      if (refined(best) || !press(best, AskedGrids::All)) {
        ++in_vain;
        part /= 2;
      }
    }
    lean_on(others, best);
    emulate(best);
    judge(best);
  }
  if (!refined(best)) press(best, AskedGrids::All);
  // Intervals are of the emulator's own slopes.
  level(best);
  emulate(best);
  judge(best);
  return best.chi2 < explained ? Settled::Yes : Settled::No;
}

}  // namespace palpate::lump
