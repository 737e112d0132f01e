#include "engine/numeric/matching/search.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/base/statistics.h"
#include "engine/numeric/dense.h"
#include "engine/numeric/matching/curve.h"
#include "engine/numeric/matching/evidence.h"
#include "engine/numeric/matching/grow.h"
#include "engine/numeric/matching/spacing.h"
#include "engine/numeric/matching/start.h"
#include "engine/numeric/matching/symmetry.h"

namespace palpate {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::MatrixXf;
using Eigen::VectorXd;

// Noise to begin with, over the template's RMS radius.
constexpr double kStartSd = 0.7, kPlainSd = 0.5, kTurnedSd = 0.4, kNearSdOfSpacing = 2;
constexpr double kContextWeight = 10;
constexpr double kExactSd = 0.003, kExactSdOfSpacing = 0.1, kExactFound = 0.95;
constexpr Index kStiffModes = 12;
constexpr uint32_t kScreenIterations = 12, kScreenContextEvery = 7;
constexpr size_t kPlaces = 4, kTurns = 12;
// Starts to finish and cores to grow: at first, and where the answer is doubtful.
constexpr size_t kFinished = 4, kGrown = 12, kMoreGrown = 16, kCoresOfOne = 4;
constexpr size_t kSeeds = 16, kMoreSeeds = 48;
// A neighbourhood of so many pairs that is found again with so much less variance than the best warp leaves;
// how far off its points then are by the best warp, over the variance and over the points' spacing.
constexpr size_t kFullSeed = 11;
constexpr double kSharper = 0.06, kFarOff = 25, kNearSpacing = 0.15, kElsewhere = 0.3, kMuchLeft = 0.85;
// How uneven residuals are: median square over mean square, against what noise would leave; from so much
// noise and so many pairs on.
constexpr double kUneven = 0.52, kUnevenSd = 0.012;
constexpr size_t kUnevenPairs = 20;
// Shares of the points' spacing: how exactly the template is fitted to its slid self, and the residual
// allowed.
constexpr double kSlidFit = 0.1, kMostSlidMiss = 0.25, kSlidSdOfSpacing = 0.3;
constexpr int64_t kMostSlidPart = 4;  // of the curve: the longest slide is its length over this
constexpr int kSlides = 6;            // one after the other
constexpr double kScreenGap = 12;     // nats behind the best start that are not worth finishing
// Mean distance of screened warps that end alike: over the RMS radius, and over the noise of the best end.
constexpr double kSameScreened = 0.05, kSameOfSd = 0.5, kSameEnd = 0.02;
constexpr double kGrownSdOfSpacing = 0.9, kDoubtfulSdOfSpacing = 0.85, kDoubtfulEvidence = 25;
// A later start has to be better by more than rounding and the prior's fuzz.
constexpr double kBetter = 5;

double distance(const MatrixXd& a, const MatrixXd& b) {
  return (a - b).rowwise().norm().mean();
}

bool among(const std::vector<MatrixXd>& all, const MatrixXd& one, double near) {
  return std::any_of(all.begin(), all.end(), [&](const MatrixXd& w) { return distance(w, one) < near; });
}

}  // namespace

bool fits_exactly(const FlowState& state, double spacing, Index smaller) {
  return std::sqrt(state.variance) < std::min(kExactSdOfSpacing * spacing, kExactSd) &&
         static_cast<double>(state.partners.sum()) > kExactFound * static_cast<double>(smaller);
}

bool uneven(const FlowState& state, const MatrixXd& to) {
  if (state.variance < kUnevenSd * kUnevenSd) return false;
  std::vector<double> squares;
  for (Index i = 0; i < state.partners.rows(); ++i) {
    if (state.partners.row(i).sum() < 0.5f) continue;
    Index j = 0;
    state.partners.row(i).maxCoeff(&j);
    squares.push_back((state.warped.row(i) - to.row(j)).squaredNorm());
  }
  if (squares.size() < kUnevenPairs) return false;
  double mean = 0;
  for (const double s : squares) mean += s / static_cast<double>(squares.size());
  // Median of a chi-squared variable with 2 or 3 degrees of freedom, over its mean.
  const double even = to.cols() == 2 ? 0.693 : 0.789;
  return median(std::move(squares)) < kUneven * even * mean;
}

Search::Search(const FlowProblem& problem, const MatrixXd& to, const MatchOptions& options,
               double energy_without)
    : problem_(problem),
      to_(to),
      options_(options),
      energy_without_(energy_without),
      spacing_(median_spacing(problem.from)),
      stiff_(problem.stiff(kStiffModes)) {}

void Search::screen(MatchStart start, double turn_deg, const MatrixXd& placed, double sd,
                    double context_weight, const MatrixXf* likeness) {
  if (std::abs(turn_deg) > options_.most_turn_deg) return;
  Candidate& candidate = screened_.emplace_back();
  candidate.start = start;
  candidate.turn_deg = turn_deg;
  candidate.context_weight = context_weight;
  candidate.sd = sd;
  candidate.placed = placed;
  candidate.state.warped = placed;
  flow(stiff_,
       {.sd = sd,
        .context_weight = context_weight,
        .amplitude = kAmplitude / 2,
        .count_freedom = true,
        .most_iterations = kScreenIterations,
        .likeness = likeness,
        .context_every = kScreenContextEvery},
       candidate.state);
  weigh(stiff_, kAmplitude / 2, candidate.state);
}

void Search::screen_all(bool in_place, const MatrixXd& as_it_lies) {
  if (in_place) {
    screen(MatchStart::Near, 0, as_it_lies, kNearSdOfSpacing * spacing_, 0, nullptr);
    screen(MatchStart::Plain, 0, as_it_lies, kPlainSd, 0, nullptr);
  }
  const Votes votes(problem_.from, to_, options_.reflections);
  for (size_t k = 0; k < std::min(kPlaces, votes.size()); ++k) {
    const Placement place = votes.place(k);
    screen(MatchStart::Turned, place.turn_deg, place.points, kTurnedSd, kContextWeight, nullptr);
  }
  // The basin of the right answer is wide but has to be met: every turn about the centre.
  if (tries_every_turn(options_)) {
    const size_t most = kTurns * (options_.reflections ? 2 : 1) + (problem_.from.cols() > 2 ? kTurns : 0);
    for (size_t k = 0; k < std::min(votes.size(), most); ++k)
      screen(MatchStart::Turned, angle_of(votes.turn(k)), dense::product(problem_.from, votes.turn(k)),
             kTurnedSd, kContextWeight, votes.likeness(k));
  }
  if (screened_.empty() && ended_.empty()) screen(MatchStart::Plain, 0, as_it_lies, kPlainSd, 0, nullptr);
  std::stable_sort(screened_.begin(), screened_.end(),
                   [](const Candidate& a, const Candidate& b) { return a.state.energy > b.state.energy; });
  if (!screened_.empty()) least_ = screened_.back().state.energy;
}

void Search::finish(Candidate candidate, MatchResult& result) {
  FlowState& state = candidate.state;
  flow(problem_,
       {.sd = candidate.sd,
        .context_weight = candidate.context_weight,
        .amplitude = kAmplitude / 2,
        .count_freedom = true},
       state);
  settle(std::move(candidate), result);
}

void Search::settle(Candidate candidate, MatchResult& result) {
  FlowState& state = candidate.state;
  flow(problem_, {.sd = std::sqrt(state.variance), .amplitude = kAmplitude}, state);
  weigh(problem_, kAmplitude, state);
  result.attempts.push_back({candidate.start, candidate.turn_deg, state.energy, state.bending,
                             std::sqrt(state.variance), state.iterations, state.converged});
  result.iterations += state.iterations;
  if (ended_.empty() || state.energy < best_.energy - kBetter) {
    best_ = state;
    result.winner = result.attempts.size() - 1;
  }
  ended_.push_back(std::move(candidate));
}

bool Search::clean() const {
  return fits_exactly(best_, spacing_, std::min(problem_.from.rows(), problem_.to.rows()));
}

bool Search::unproven() const {
  return energy_without_ - best_.energy - freedom_cost(problem_, best_, kAmplitude) < kDoubtfulEvidence;
}

// Little noise and yet little evidence: the warp has bent itself onto what it does not belong to.
bool Search::doubtful() const {
  return std::sqrt(best_.variance) < kDoubtfulSdOfSpacing * spacing_ && unproven();
}

void Search::finish_some(MatchResult& result) {
  std::vector<Candidate> later;
  std::vector<MatrixXd> taken;
  while (!screened_.empty()) {
    Candidate candidate = std::move(screened_.back());
    screened_.pop_back();
    later.push_back(candidate);
    const MatrixXd& at = candidate.state.warped;
    const double same = std::max(kSameScreened, kSameOfSd * std::sqrt(best_.variance));
    const bool known = among(taken, at, kSameScreened) ||
                       std::any_of(ended_.begin(), ended_.end(), [&](const Candidate& end) {
                         return distance(end.state.warped, at) < same;
                       });
    if (known || taken.size() >= kFinished || clean() || candidate.state.energy > least_ + kScreenGap)
      continue;
    taken.push_back(at);
    candidate.sd = std::sqrt(candidate.state.variance);
    finish(std::move(candidate), result);
  }
  screened_ = std::move(later);  // the best first
}

// Every start from its beginning, with the whole warp.
void Search::finish_all(MatchResult& result) {
  for (Candidate& candidate : screened_) {
    if (clean()) return;
    candidate.state = FlowState();
    candidate.state.warped = candidate.placed;
    finish(std::move(candidate), result);
  }
}

void Search::grow_some(size_t most, MatchResult& result) {
  size_t grows = 0;
  while (grows < most && !clean()) {
    size_t at = ended_.size();
    for (size_t k = 0; k < ended_.size(); ++k)
      if ((at == ended_.size() || ended_[k].state.energy < ended_[at].state.energy) &&
          std::sqrt(ended_[k].state.variance) < kGrownSdOfSpacing * spacing_ &&
          !among(grown_, ended_[k].state.warped, kSameEnd))
        at = k;
    if (at == ended_.size()) return;
    const Candidate from = ended_[at];
    grown_.push_back(from.state.warped);
    for (const Core& core : cores(problem_, from.state, kAmplitude, kCoresOfOne)) {
      if (clean() || grows++ >= most) return;
      Candidate grown = from;
      grown.state.iterations = 0;
      grow(problem_, kAmplitude, core, spacing_, grown.state);
      settle(std::move(grown), result);
    }
  }
}

/// Mean square per axis by which the best warp misses the seed's own partners, or the nearest points.
double Search::squared_miss(const Seed& seed, bool nearest) const {
  double sum = 0;
  for (const auto& [i, j] : seed.pairs)
    sum += nearest ? (to_.rowwise() - best_.warped.row(i)).rowwise().squaredNorm().minCoeff()
                   : (to_.row(j) - best_.warped.row(i)).squaredNorm();
  return sum / static_cast<double>(seed.pairs.size() * static_cast<size_t>(to_.cols()));
}

// From neighbourhoods that are found again as they are: no start whose whole lies roughly right is needed.
void Search::grow_seeds(size_t first, MatchResult& result) {
  for (size_t k = first; k < seeds_.size(); ++k) {
    if (clean()) return;
    const Seed& seed = seeds_[k];
    // Where the best warp brings it as close as the noise lets it, it holds already.
    if (squared_miss(seed, false) < 2 * best_.variance && seed.miss > kSharper * best_.variance) continue;
    Candidate grown;
    grown.start = MatchStart::Local;
    grown.state.outlier_fraction = best_.outlier_fraction;
    grown.state.partners = MatrixXf::Zero(problem_.from.rows(), to_.rows());
    Core core{Eigen::VectorXd::Zero(problem_.from.rows()), seed.miss};
    for (const auto& [i, j] : seed.pairs) {
      grown.state.partners(i, j) = 1;
      core.weight[i] = 1;
    }
    grow(problem_, kAmplitude, core, spacing_, grown.state);
    settle(std::move(grown), result);
  }
}

void Search::try_self_maps(MatchResult& result) {
  constexpr size_t kMostMaps = 3;
  if (!tries_every_turn(options_)) return;
  const FlowState found = best_;
  for (const std::vector<Index>& map : self_maps(problem_.from, options_.reflections, kMostMaps)) {
    Candidate other;
    other.start = MatchStart::Turned;
    other.turn_deg = 0;
    other.state.outlier_fraction = found.outlier_fraction;
    other.state.warped = found.warped(map, Eigen::all);
    other.state.variance = std::max(found.variance, std::pow(0.3 * spacing_, 2));
    settle(std::move(other), result);
  }
}

double Search::paid_energy(const FlowState& state) const {
  return state.energy + freedom_cost(problem_, state, kAmplitude);
}

/// The best warp, each point of the curve brought to where the point `step` places farther along it was, and
/// settled from there. None: no smooth warp does that to the template.
std::optional<FlowState> Search::slid(const Curve& curve, int64_t step) const {
  const auto size = static_cast<int64_t>(curve.order.size());
  const Index n = problem_.from.rows(), axes = problem_.from.cols();
  VectorXd weight = VectorXd::Zero(n);
  MatrixXd pull = MatrixXd::Zero(n, axes);
  for (int64_t at = 0; at < size; ++at) {
    int64_t to = at + step;
    if (curve.closed) to = (to + size) % size;
    if (to < 0 || to >= size) continue;
    const Index i = curve.order[static_cast<size_t>(at)];
    weight[i] = 1;
    pull.row(i) = best_.warped.row(curve.order[static_cast<size_t>(to)]);
  }
  FlowState state;
  state.outlier_fraction = best_.outlier_fraction;
  state.variance = std::pow(kSlidFit * spacing_, 2);
  fit_warp(problem_, weight, pull, kAmplitude, state);
  const double squares = (weight.asDiagonal() * (state.warped - pull)).squaredNorm() / weight.sum();
  if (squares > static_cast<double>(axes) * std::pow(kMostSlidMiss * spacing_, 2)) return std::nullopt;
  const double sd = std::max(std::sqrt(best_.variance), kSlidSdOfSpacing * spacing_);
  flow(problem_, {.sd = sd, .amplitude = kAmplitude}, state);
  weigh(problem_, kAmplitude, state);
  return state;
}

/// Nats that half of the points left over would be worth if they were found as the others are.
double Search::left_over_worth() const {
  const auto smaller = static_cast<double>(std::min(problem_.from.rows(), problem_.to.rows())),
             found = static_cast<double>(best_.partners.sum());
  return 0.5 * std::max(0., smaller - found) * std::max(0., energy_without_ - best_.energy) /
         std::max(found, 1.);
}

// Points along one curve fit nearly as well some places farther along it. The best slide is followed while it
// is better; then the margin over the next best one tells whether the answer is the only one. A slide that no
// start has met may bind what the best warp leaves over, so the margin has to be worth more than that.
void Search::try_slides(MatchResult& result) {
  if (!tries_every_turn(options_)) return;
  const std::optional<Curve> curve = curve_through(problem_.from);
  if (!curve) return;
  const auto most = static_cast<int64_t>(curve->order.size()) / kMostSlidPart;
  for (int round = 0; round < kSlides; ++round) {
    const FlowState before = best_;
    const double paid = paid_energy(before);
    double least = paid - kBetter;
    std::optional<Candidate> better;
    slide_margin_ = std::numeric_limits<double>::infinity();
    for (int64_t step = 1; step <= most; step += std::max<int64_t>(1, step / 2))
      for (const int64_t way : {step, -step}) {
        Candidate other;
        other.start = MatchStart::Slid;
        if (std::optional<FlowState> state = slid(*curve, way))
          other.state = std::move(*state);
        else
          continue;
        const double now = paid_energy(other.state);
        if (distance(other.state.warped, before.warped) > kOtherWarp)
          slide_margin_ = std::min(slide_margin_, now - paid - left_over_worth());
        if (now < least && other.state.energy < before.energy - kBetter)
          least = now, better = std::move(other);
      }
    if (!better) return;
    settle(std::move(*better), result);
  }
}

void Search::run(bool in_place, const MatrixXd& as_it_lies, MatchResult& result) {
  if (in_place) {
    Candidate here;
    here.start = MatchStart::Context;
    here.context_weight = kContextWeight;
    here.sd = kStartSd;
    here.state.warped = as_it_lies;
    finish(std::move(here), result);
  }
  if (!in_place || !clean()) {
    screen_all(in_place, as_it_lies);
    finish_some(result);
    // Where the template lies is known, parts of it would only slide along the shape.
    const bool searched = tries_every_turn(options_);
    if (searched) grow_some(kGrown, result);
    if (searched && !clean() && doubtful()) {
      finish_all(result);
      grow_some(kMoreGrown, result);
      finished_all_ = true;
    }
    if (searched && !clean()) {
      seeds_ = find_seeds(problem_.from, to_, spacing_, options_.most_turn_deg, kSeeds);
      grow_seeds(0, result);
    }
    if (searched && !clean() && (contradicted() || uneven(best_, to_))) {
      if (!finished_all_) finish_all(result);
      grow_some(kMoreGrown, result);
      const size_t before = seeds_.size();
      seeds_ = find_seeds(problem_.from, to_, spacing_, options_.most_turn_deg, kMoreSeeds);
      grow_seeds(before, result);
    }
  }
  try_self_maps(result);
  try_slides(result);
}

// A neighbourhood that is found again far sharper than the warp leaves its points: the warp has brought it to
// no points in particular, or to others although much of the smaller set has no partner.
bool Search::contradicted() const {
  if (clean()) return false;
  const double variance = best_.variance, near = std::pow(kNearSpacing * spacing_, 2),
               elsewhere = std::max(kFarOff * variance, std::pow(kElsewhere * spacing_, 2));
  const auto smaller = static_cast<double>(std::min(problem_.from.rows(), problem_.to.rows()));
  const bool much_left = static_cast<double>(best_.partners.sum()) < kMuchLeft * smaller;
  return std::any_of(seeds_.begin(), seeds_.end(), [&](const Seed& seed) {
    if (seed.pairs.size() < kFullSeed || seed.miss > kSharper * variance) return false;
    return squared_miss(seed, true) > std::max(kFarOff * seed.miss, near) ||
           (much_left && squared_miss(seed, false) > elsewhere);
  });
}

double Search::posterior() const {
  std::vector<MatrixXd> basins;
  double others = 0;
  for (const Candidate& c : ended_) {
    if (distance(c.state.warped, best_.warped) <= kOtherWarp || among(basins, c.state.warped, kOtherWarp))
      continue;
    basins.push_back(c.state.warped);
    others += std::exp(std::min(best_.energy - c.state.energy, 50.));
  }
  return 1 / (1 + others + std::exp(-slide_margin_));
}

}  // namespace palpate
