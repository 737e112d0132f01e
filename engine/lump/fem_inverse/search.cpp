#include "engine/lump/fem_inverse/search.h"

#include <algorithm>
#include <cmath>

#include "engine/base/statistics.h"
#include "engine/lump/fem_inverse/prediction.h"
#include "engine/numeric/dense.h"

namespace palpate::lump {
namespace {

constexpr uint32_t kMostCorrections = 4;
constexpr double kSameEmulated = 0.4;  // of kSameGrids, where asking all grids is most of the work anyway
constexpr double kHeaviest = 1e3;
constexpr uint32_t kMostAlongRatio = 5;
constexpr double kWorthAnother = 1;  // of chi2, that a second step at a ratio gains
constexpr double kGridDoubt = 2;     // standard deviations of the change that fewer grids would make
// Gaussians whose sum is the elements' error.
constexpr double kDoubtPitch_mm = 4, kDoubtSigma_mm = 3;
constexpr double kPlainlyThere =
    1000;  // of chi2, that a lump gains where the emulator's tissue is near enough

/// Gaussians over the nodes, on a grid, scaled so that factors of unit variance make unit variance
/// everywhere; last what is the same everywhere.
Eigen::MatrixXd doubt_fields(const ComparedNodes& nodes) {
  std::array<double, 2> low = {HUGE_VAL, HUGE_VAL}, high = {-HUGE_VAL, -HUGE_VAL};
  for (size_t n = 0; n < nodes.count(); ++n) {
    const std::array<double, 2> at = {nodes.x_mm(n), nodes.y_mm(n)};
    for (size_t c = 0; c < 2; ++c) low[c] = std::min(low[c], at[c]), high[c] = std::max(high[c], at[c]);
  }
  std::vector<std::array<double, 2>> centres;
  for (double y = low[1]; y <= high[1] + kDoubtPitch_mm; y += kDoubtPitch_mm)
    for (double x = low[0]; x <= high[0] + kDoubtPitch_mm; x += kDoubtPitch_mm) centres.push_back({x, y});
  const auto gaussians = static_cast<Eigen::Index>(centres.size());
  Eigen::MatrixXd fields = Eigen::MatrixXd::Ones(static_cast<Eigen::Index>(nodes.count()), gaussians + 1);
  for (Eigen::Index n = 0; n < fields.rows(); ++n) {
    const auto node = static_cast<size_t>(n);
    for (Eigen::Index k = 0; k < gaussians; ++k) {
      const auto& [x, y] = centres[static_cast<size_t>(k)];
      fields(n, k) = std::exp(-0.5 * (std::pow(nodes.x_mm(node) - x, 2) + std::pow(nodes.y_mm(node) - y, 2)) /
                              (kDoubtSigma_mm * kDoubtSigma_mm));
    }
    fields.row(n).head(gaussians).normalize();
  }
  return fields;
}

}  // namespace

LumpStep difference(const Case::Lump& to, const Case::Lump& from) {
  return LumpStep{{std::log(to.diameter_mm / from.diameter_mm), std::log(to.depth_mm / from.depth_mm),
                   std::log(to.stiffness_ratio / from.stiffness_ratio), to.offset_mm[0] - from.offset_mm[0],
                   to.offset_mm[1] - from.offset_mm[1]}};
}

DirectSearch::DirectSearch(const Observation& observation, const DirectInversionOptions& options)
    : observation_(observation),
      options_(options),
      nodes_(observation, options.model.rim_mm),
      emulator_(options.emulator, nodes_),
      effort_(options.most_work, options.stop),
      series_(nodes_, options.model, effort_),
      wanted_(nodes_.values()),
      doubt_(nodes_.count() > 0 ? doubt_fields(nodes_) : Eigen::MatrixXd()) {
  const double peak = wanted_.size() > 0 ? wanted_.maxCoeff() : 0;
  sigma_Pa_ = std::hypot(observation.noise_Pa, options.model_fraction * peak);
}

void DirectSearch::judge(State& state) const {
  state.chi2 = solve(state, 0, Sought::Nothing).chi2;
}

void DirectSearch::emulate(State& state) const {
  state.prediction.converged = true;
  Eigen::VectorXd& pressure_Pa = state.prediction.pressure_Pa;
  pressure_Pa = state.beyond_Pa + emulator_.bump_Pa(state.lump);
  const bool bent = state.beyond_by_unknown.size() > 0;
  if (bent) pressure_Pa += state.beyond_by_unknown * difference(state.lump, *state.pressed);
  emulator_.fill(state.lump, state.prediction);
  if (bent) state.prediction.by_unknown += state.beyond_by_unknown;
}

std::optional<DirectSearch::State> DirectSearch::moved_to(const Case::Lump& lump, const State& from) const {
  State state = from;
  state.lump = lump;
  if (from.emulated()) {
    if (!emulator_.reaches(lump)) return std::nullopt;
    emulate(state);
  } else {
    state.prediction = predict(nodes_, FittedLump{lump, from.cells}, options_.model, true, effort_);
    if (!state.prediction.converged) return std::nullopt;
    state.prediction.pressure_Pa += state.grids->add_Pa;
  }
  judge(state);
  return state;
}

// The elements at the state's lump, in its cells.
bool DirectSearch::press(State& state, AskedGrids grids) {
  const std::optional<GridAnswer> answer = series_.lump({state.lump, state.cells}, grids, state.grids.get());
  if (!answer) return false;
  const Eigen::VectorXd last_Pa = state.grids ? state.grids->add_Pa : Eigen::VectorXd();
  if (grids != AskedGrids::Searched) {
    state.grids = std::make_shared<const GridCorrection>(answer->correction);
    state.corrected = state.lump;
  }
  if (answer->of_all) state.refined = state.lump;
  if (emulator_.reaches(state.lump) && emulator_.reaches(*answer->lump)) {
    state.pressed = state.lump;
    state.beyond_Pa = answer->searched_Pa + state.grids->add_Pa - emulator_.bump_Pa(*answer->lump);
    state.beyond_by_unknown = {};
    emulate(state);
  } else if (state.prediction.converged && !state.emulated()) {
    state.prediction.pressure_Pa += state.grids->add_Pa - last_Pa;
  } else {
    state.beyond_Pa = {};
    std::optional<State> own = moved_to(state.lump, state);
    if (!own) return false;
    state = std::move(*own);
  }
  judge(state);
  return true;
}

std::optional<DirectSearch::State> DirectSearch::fresh_at(const Case::Lump& lump, AskedGrids grids,
                                                          const State* like) {
  State first;
  if (like != nullptr) first.grids = like->grids;
  first.lump = lump;
  first.cells = response_cells(observation_, lump, options_.model);
  if (!press(first, grids)) return std::nullopt;
  return first;
}

std::optional<DirectSearch::State> DirectSearch::state_at(const Case::Lump& lump, const State* like) {
  const bool shared = like != nullptr && like->refined && emulator_.reaches(lump);
  return fresh_at(lump, shared ? AskedGrids::Coarse : AskedGrids::All, shared ? like : nullptr);
}

bool DirectSearch::correct(State& state) {
  if (!cells_match(state)) {
    std::optional<State> fresh = state_at(state.lump);
    if (fresh) state = std::move(*fresh);
    return fresh.has_value();
  }
  if (!state.emulated()) return press(state, AskedGrids::All);
  const LumpStep way = difference(state.lump, state.corrected).cwiseAbs().cwiseQuotient(kSameGrids);
  const bool near = state.pressed && way.maxCoeff() < kSameEmulated;
  return press(state, near ? AskedGrids::Searched : AskedGrids::All);
}

bool DirectSearch::cells_match(const State& state) const {
  return matches(state.cells, observation_, state.lump, options_.model);
}

bool DirectSearch::press_tissue() {
  if (!tissue_) tissue_ = series_.tissue();
  return tissue_.has_value();
}

std::optional<double> DirectSearch::without_lump(const State& with_lump) {
  State tissue = with_lump;
  if (!tissue_ && emulator_.knows_block()) {
    tissue.prediction.pressure_Pa = emulator_.tissue_Pa();
    const double chi2 = solve(tissue, 0, Sought::Nothing).chi2;
    if (chi2 > with_lump.chi2 + kPlainlyThere) return chi2;
  }
  if (!press_tissue()) return std::nullopt;
  tissue.prediction.pressure_Pa = tissue_->searched_Pa + tissue_->correction.add_Pa;
  return solve(tissue, 0, Sought::Nothing).chi2;
}

DirectSearch::Step DirectSearch::solve(const State& from, double damping, Sought sought) const {
  const Prediction& p = from.prediction;
  const Eigen::MatrixXd doubted_by = doubted(from);
  const Eigen::Index first = sought == Sought::Nothing ? 0
                             : options_.model.centred  ? kPlaceX
                                                       : kLumpUnknowns,
                     loads = p.by_force.cols(), doubts = first + loads + 1,
                     columns = doubts + doubted_by.cols();
  Eigen::MatrixXd j(p.pressure_Pa.size(), columns);
  j.leftCols(first) = p.by_unknown.leftCols(first);
  j.middleCols(first, loads) = p.by_force;
  j.col(doubts - 1) = p.by_modulus;
  j.rightCols(doubted_by.cols()) = doubted_by;
  if (sought == Sought::LumpOfThisRatio) j.col(kLnRatio).setZero();
  j /= sigma_Pa_;
  const Eigen::VectorXd open = (wanted_ - p.pressure_Pa) / sigma_Pa_;
  Eigen::MatrixXd normal = dense::product_tn(j, j);
  for (Eigen::Index l = 0; l < loads; ++l)
    normal(first + l, first + l) += 1 / (options_.gauge_fraction * options_.gauge_fraction);
  normal(doubts - 1, doubts - 1) += 1 / (options_.young_fraction * options_.young_fraction);
  normal.diagonal().tail(doubted_by.cols()).array() += 1;
  if (sought == Sought::LumpOfThisRatio) normal(kLnRatio, kLnRatio) = 1;
  Step step;
  Eigen::MatrixXd damped = normal;
  for (Eigen::Index k = 0; k < first; ++k) damped(k, k) *= 1 + damping;
  const Eigen::VectorXd right = dense::product_tn(j, open);
  const Eigen::VectorXd found = dense::Ldlt(damped).solve(right);
  step.chi2 = open.squaredNorm() - 2 * found.dot(right) + found.dot(normal * found);
  step.change.head(first) = found.head(first);
  if (sought != Sought::Lump) return step;
  const Eigen::MatrixXd covariance =
      dense::Ldlt(normal).solve(Eigen::MatrixXd(Eigen::MatrixXd::Identity(columns, columns)));
  step.sd.head(first) = covariance.diagonal().head(first).cwiseMax(0).cwiseSqrt();
  step.by_ratio.head(first) = covariance.col(kLnRatio).head(first) / covariance(kLnRatio, kLnRatio);
  return step;
}

Case::Lump DirectSearch::moved(const Case::Lump& from, const LumpStep& by) const {
  Case::Lump lump = from;
  const double thickness = observation_.block_mm[2];
  lump.diameter_mm = std::clamp(from.diameter_mm * std::exp(by(kLnSize)), 1.0, 0.8 * thickness);
  lump.depth_mm =
      std::clamp(from.depth_mm * std::exp(by(kLnDepth)), 0.3, 0.97 * thickness - lump.diameter_mm);
  lump.stiffness_ratio =
      std::clamp(from.stiffness_ratio * std::exp(by(kLnRatio)), kRatioRange.low, kRatioRange.high);
  const std::array<double, 3> size = lump.size_mm();
  for (size_t c = 0; c < 2; ++c) {
    const double room = std::max(0.0, 0.98 * (observation_.block_mm[c] - size[c]) / 2);
    lump.offset_mm[c] =
        std::clamp(from.offset_mm[c] + by(kPlaceX + static_cast<Eigen::Index>(c)), -room, room);
  }
  return lump;
}

/// Error of a prediction, per factor of unit variance.
Eigen::MatrixXd DirectSearch::doubted(const State& state) const {
  const Eigen::VectorXd& pressure_Pa = state.prediction.pressure_Pa;
  const Eigen::Index count = doubt_.rows(), fields = doubt_.cols();
  Eigen::MatrixXd by_factor(pressure_Pa.size(), 2 * fields + 1);
  by_factor.rightCols(1) = kGridDoubt * state.grids->open_Pa;
  const std::vector<double>& force_N = observation_.force_N;
  for (Eigen::Index l = 0; l < static_cast<Eigen::Index>(force_N.size()); ++l) {
    const auto of_load = pressure_Pa.segment(l * count, count);
    const Eigen::ArrayXd bump = of_load.array() - median(std::vector<double>(of_load.begin(), of_load.end()));
    const double change = force_N[static_cast<size_t>(l)] / force_N.back() - 0.5;
    by_factor.block(l * count, 0, count, fields) =
        options_.bump_fraction * (doubt_.array().colwise() * bump).matrix();
    by_factor.block(l * count, fields, count, fields) =
        options_.bump_change_fraction * change * (doubt_.array().colwise() * bump).matrix();
  }
  return by_factor;
}

bool DirectSearch::descend(State& best, uint32_t& rounds) {
  double damping = 5e-3;
  uint32_t in_vain = 0;  // rounds in a row
  const auto all = static_cast<double>(best.prediction.pressure_Pa.size());
  const bool emulated = best.emulated();
  const double no_gain = emulated ? kNoEmulatedGain : kNoGain;
  for (; rounds > 0; --rounds) {
    const Step step = solve(best, damping, Sought::Lump);
    const LumpStep change = shortened(step.change);
    const bool fits = best.chi2 < kExplains * all;
    if ((fits && best.chi2 - step.chi2 < no_gain) ||
        (change.cwiseAbs() - (emulated ? 0.1 : 1) * kStands * step.sd).maxCoeff() <= 0 ||
        change.cwiseAbs().maxCoeff() < (emulated ? 2e-4 : 2e-3))
      return true;
    std::optional<State> next = moved_to(moved(best.lump, change), best);
    if (next && next->chi2 < best.chi2) {
      const bool settled = best.chi2 - next->chi2 < 0.05;
      best = std::move(*next);
      if (!best.emulated() && !cells_match(best))
        if (std::optional<State> fresh = state_at(best.lump)) best = std::move(*fresh);
      if (settled) return true;
      in_vain = 0;
      damping = std::max(damping / 4, 1e-6);
    } else {
      damping *= 6;
      if ((++in_vain >= kMostInVain && fits) || damping > kHeaviest) return fits;
    }
  }
  return false;
}

bool DirectSearch::settle_by_elements(State& best) {
  uint32_t rounds = options_.most_rounds;
  bool settled = descend(best, rounds);
  for (uint32_t again = 0; again < kMostCorrections && settled; ++again) {
    const Case::Lump from = best.lump;
    if (difference(from, best.corrected).cwiseAbs().cwiseQuotient(kSameGrids).maxCoeff() < 1 ||
        !correct(best))
      break;
    settled = descend(best, rounds);
    const LumpStep sd = solve(best, 0, Sought::Lump).sd;
    if ((difference(best.lump, from).cwiseAbs() - kStands * sd).maxCoeff() <= 0) break;
  }
  return settled;
}

DirectSearch::Settled DirectSearch::settle(State& best, double most_chi2) {
  if (best.emulated()) {
    if (const Settled led = settle_emulated(best, most_chi2); led != Settled::No) return led;
    best.beyond_Pa = {};
    std::optional<State> own = moved_to(best.lump, best);
    if (!own) return Settled::No;
    best = std::move(*own);
  }
  return settle_by_elements(best) ? Settled::Yes : Settled::No;
}

DirectSearch::RatioEnd DirectSearch::ratio_end_by_elements(const State& best, double direction,
                                                           double allowed, double step) {
  const double least = solve(best, 0, Sought::LumpOfThisRatio).chi2;
  const auto at_limit = [&](const Case::Lump& lump) {
    return moved(lump, LumpStep::Unit(kLnRatio) * (direction * std::log(kRatioRange.high / kRatioRange.low)));
  };
  RatioEnd end{at_limit(best.lump), std::nullopt};
  State here = best;
  double reached = 0, risen = 0;  // of the ratio's logarithm, and the root of what chi2 rose by
  for (uint32_t round = 0; round < kMostAlongRatio; ++round) {
    step = std::clamp(step, kAlongRatio.low, kAlongRatio.high);
    const LumpStep way = solve(here, 0, Sought::Lump).by_ratio * (direction * step);
    std::optional<State> next = moved_to(moved(here.lump, shortened(way)), here);
    if (!next) break;
    Step rest = solve(*next, 0, Sought::LumpOfThisRatio);
    if (next->chi2 - rest.chi2 > kWorthAnother)
      if (std::optional<State> nearer = moved_to(moved(next->lump, shortened(rest.change)), *next);
          nearer && nearer->chi2 < next->chi2)
        next = std::move(nearer);
    if (!correct(*next)) break;
    rest = solve(*next, 0, Sought::LumpOfThisRatio);
    if (rest.chi2 < least - kLower && next->chi2 < best.chi2 - kLower) {
      end.lower = std::move(next);
      break;
    }
    const double to = std::abs(std::log(next->lump.stiffness_ratio / best.lump.stiffness_ratio));
    const double root = std::sqrt(std::max(0.0, rest.chi2 - least)), wanted = std::sqrt(allowed);
    if (root >= wanted) {
      const double fraction = (wanted - risen) / (root - risen);
      end.lump = moved(here.lump, difference(next->lump, here.lump) * fraction);
      break;
    }
    end.lump = at_limit(next->lump);
    if (next->lump.stiffness_ratio < kAnyRatios.low || next->lump.stiffness_ratio > kAnyRatios.high) break;
    step = root > risen ? (wanted - root) * (to - reached) / (root - risen) * 1.05 : kAlongRatio.high;
    reached = to;
    risen = root;
    here = std::move(*next);
    if (!cells_match(here))
      if (std::optional<State> fresh = state_at(here.lump)) here = std::move(*fresh);
  }
  return end;
}

}  // namespace palpate::lump
