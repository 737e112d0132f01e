#include "engine/numeric/matching/matching.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>

#include "engine/numeric/dense.h"
#include "engine/numeric/matching/evidence.h"
#include "engine/numeric/matching/flow.h"
#include "engine/numeric/matching/search.h"
#include "engine/numeric/matching/spacing.h"
#include "engine/numeric/matching/symmetry.h"
#include "engine/numeric/matching/warp.h"
#include "palpate/error.h"

namespace palpate {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::MatrixXf;
using Eigen::RowVectorXd;

constexpr uint32_t kFinishing = 300;  // iterations at most
// Larger sets are matched thinned to this many first.
constexpr Index kCoarse = 200, kLargest = 300;
// Nats per target point. Unrelated sets come to -0.3 to 0, a shape under noise of twice its points' spacing
// to 0.1 and more, an exact one to 8.
constexpr double kLeastLikelihoodGain = 0.06;
// On what these were chosen: engine/numeric/README.md.
constexpr double kLeastPosterior = 0.98;
// A vague fit among strangers needs more, for points of chance lie under any warp.
constexpr double kLeastVagueGain = 0.12, kFewStrangers = 0.1;
constexpr double kLeastFound = 0.3;
constexpr double kSharp = 0.5, kLoose = 0.9, kSharpEvidence = 25, kEvidencePerSd = 150;
constexpr double kMostlyFound = 0.85, kLeftOverEvidence = 150;
constexpr Index kLeastPoints = 5;  // beyond the axes + 1 of an affine map

MatrixXd matrix_of(const PointSet& set) {
  return Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
      set.coordinates.data(), static_cast<Index>(set.size()), static_cast<Index>(set.axes));
}

void check(const PointSet& set, const char* which) {
  const std::string name = which;
  if (set.axes != 2 && set.axes != 3)
    throw Error(Failure::Input, "points of 2 or 3 coordinates in the " + name,
                std::to_string(set.axes) + " coordinates", "columns x,y or x,y,z");
  if (set.coordinates.size() % set.axes != 0 || set.size() < set.axes + 1)
    throw Error(Failure::Input, "at least " + std::to_string(set.axes + 1) + " points in the " + name,
                std::to_string(set.size()), "more points");
  const auto bad = std::find_if(set.coordinates.begin(), set.coordinates.end(),
                                [](double v) { return !std::isfinite(v); });
  if (bad != set.coordinates.end())
    throw Error(Failure::Input, "finite coordinates in the " + name,
                "point " + std::to_string(static_cast<size_t>(bad - set.coordinates.begin()) / set.axes + 1) +
                    " with one that is not",
                "leaving it out");
}

double rms_radius(const MatrixXd& centred) {
  return std::sqrt(centred.rowwise().squaredNorm().mean());
}

// Of the box round the target; flat directions get a tenth of the widest.
double log_volume(const MatrixXd& points) {
  const RowVectorXd size = points.colwise().maxCoeff() - points.colwise().minCoeff();
  return size.cwiseMax(0.1 * size.maxCoeff()).array().log().sum();
}

// -log likelihood of the target without any template: one normal distribution, or evenly over its box.
double energy_without(const MatrixXd& to, double log_volume_) {
  const MatrixXd covariance = dense::product_tn(to, to) / static_cast<double>(to.rows());
  const Eigen::VectorXd spread = dense::symmetric_eigen(covariance).values;
  const double floor = std::max(1e-6 * spread.maxCoeff(), kLeastSd * kLeastSd);
  const double normal =
      0.5 * (2 * std::numbers::pi * std::numbers::e * spread.cwiseMax(floor).array()).log().sum();
  return static_cast<double>(to.rows()) * std::min(normal, log_volume_);
}

// A set thinned in an order that does not depend on how it is stored along.
std::vector<Index> thinned(Index size, Index count, uint32_t seed) {
  std::vector<Index> order(static_cast<size_t>(size));
  std::iota(order.begin(), order.end(), Index{0});
  std::mt19937 random(seed);
  for (size_t i = order.size() - 1; i > 0; --i) std::swap(order[i], order[random() % (i + 1)]);
  order.resize(static_cast<size_t>(std::min(size, count)));
  std::sort(order.begin(), order.end());
  return order;
}

// Both sets, each about its own centre, over a common unit.
struct Prepared {
  MatrixXd from, to;
  RowVectorXd from_centre, to_centre;
  double from_scale = 1, unit = 1;
  bool in_place = true;  // the template as it lies is worth a try
  MatrixXd as_it_lies;   // the template in the target's coordinates

  Prepared(const PointSet& a, const PointSet& b) : from(matrix_of(a)), to(matrix_of(b)) {
    from_centre = from.colwise().mean();
    to_centre = to.colwise().mean();
    from.rowwise() -= from_centre;
    to.rowwise() -= to_centre;
    from_scale = rms_radius(from);
    const double to_scale = rms_radius(to), shift = (to_centre - from_centre).norm();
    const double least = 1e-12 * std::max(from_centre.norm(), to_centre.norm());
    if (!(from_scale > least && to_scale > least))
      throw Error(Failure::Input, "points that differ", "all points of a set in one place",
                  "another set of points");
    in_place =
        to_scale < 3 * from_scale && from_scale < 3 * to_scale && shift < 3 * std::max(from_scale, to_scale);
    unit = in_place ? from_scale : to_scale;
    as_it_lies = (from.rowwise() + (from_centre - to_centre)) / unit;
    from /= from_scale;
    to /= unit;
  }
};

// Nats of evidence that a fit needs. One that leaves noise like the points' spacing is held by many points at
// once and judged by the posterior; with less noise the warp may have bent itself onto a few, the more so
// where points of both sides are left over. `sd`: of the noise over the spacing.
double least_evidence(double sd, double found) {
  if (sd > kLoose) return -std::numeric_limits<double>::infinity();
  const double needed = kSharpEvidence - std::max(0., sd - kSharp) * kEvidencePerSd;
  return found < kMostlyFound ? std::max(needed, kLeftOverEvidence) : needed;
}

double least_gain(double sd, double strangers) {
  return sd > kLoose && strangers > kFewStrangers ? kLeastVagueGain : kLeastLikelihoodGain;
}

// The most probable pairs first, each point in one of them.
std::vector<Partner> pair_up(const MatrixXf& p) {
  struct Pair {
    float probability;
    uint32_t from, to;
  };
  std::vector<Partner> partners(static_cast<size_t>(p.rows()));
  std::vector<Pair> pairs;
  const Eigen::VectorXf found = p.rowwise().sum();
  const Eigen::VectorXf most = p.rowwise().maxCoeff();
  for (Index j = 0; j < p.cols(); ++j)
    for (Index i = 0; i < p.rows(); ++i)
      if (p(i, j) > 0.05f * most[i] && found[i] >= 0.5f)
        pairs.push_back({p(i, j), static_cast<uint32_t>(i), static_cast<uint32_t>(j)});
  std::sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) {
    return a.probability != b.probability ? a.probability > b.probability
           : a.from != b.from             ? a.from < b.from
                                          : a.to < b.to;
  });
  std::vector<char> taken(static_cast<size_t>(p.cols()), 0);
  for (const Pair& pair : pairs)
    if (!partners[pair.from].target && !taken[pair.to]) {
      partners[pair.from] = {pair.to, std::min(1., double{pair.probability})};
      taken[pair.to] = 1;
    }
  for (size_t i = 0; i < partners.size(); ++i)
    if (!partners[i].target)
      partners[i].probability = std::clamp(1 - double{found[static_cast<Index>(i)]}, 0., 1.);
  return partners;
}

}  // namespace

MatchResult match_points(const PointSet& from, const PointSet& to, const MatchOptions& options) {
  check(from, "template");
  check(to, "target");
  if (from.axes != to.axes)
    throw Error(Failure::Input, "template and target of the same coordinates",
                std::to_string(from.axes) + " and " + std::to_string(to.axes), "sets of one kind");
  const Prepared sets(from, to);
  const WarpModes modes(sets.from);
  const Index n = sets.from.rows(), m = sets.to.rows();
  const double volume = log_volume(sets.to), without = energy_without(sets.to, volume);
  const FlowProblem whole(sets.from, modes, sets.to, volume, false);
  MatchResult result;
  FlowState state;
  if (std::max(n, m) <= kLargest) {
    const FlowProblem problem(sets.from, modes, sets.to, volume, true);
    Search search(problem, sets.to, options, without);
    search.run(sets.in_place, sets.as_it_lies, result);
    result.posterior = search.posterior();
    state = std::move(search.best());
  } else {
    const double fraction = std::min(1., static_cast<double>(kCoarse) / static_cast<double>(std::min(n, m)));
    const auto part = [&](Index size) {
      return thinned(size, static_cast<Index>(std::ceil(fraction * static_cast<double>(size))), 1);
    };
    const std::vector<Index> some = part(n);
    const MatrixXd coarse_to = sets.to(part(m), Eigen::all);
    const FlowProblem coarse(sets.from(some, Eigen::all), modes, coarse_to, volume, true);
    Search search(coarse, coarse_to, options, energy_without(coarse_to, volume));
    search.run(sets.in_place, sets.as_it_lies(some, Eigen::all), result);
    result.posterior = search.posterior();
    state = std::move(search.best());
    state.warped = dense::product(whole.basis, state.coefficients);
    flow(whole, {.sd = std::sqrt(state.variance), .amplitude = kAmplitude, .cooling = 0.7}, state);
    weigh(whole, kAmplitude, state);
    MatchAttempt& winner = result.attempts[result.winner];
    result.iterations += state.iterations - winner.iterations;
    winner.noise_sd = std::sqrt(state.variance);
    winner.energy = state.energy;
    winner.bending = state.bending;
    winner.iterations = state.iterations;
    winner.converged = state.converged;
  }

  if (!state.converged) {
    const uint32_t before = state.iterations;
    flow(whole, {.sd = std::sqrt(state.variance), .amplitude = kAmplitude, .most_iterations = kFinishing},
         state);
    weigh(whole, kAmplitude, state);
    result.iterations += state.iterations - before;
  }
  const double found = static_cast<double>(state.partners.sum());
  result.converged = state.converged;
  result.scale = sets.from_scale;
  result.log_likelihood_gain = (without - state.energy) / static_cast<double>(m);
  result.evidence = without - state.energy - freedom_cost(whole, state, kAmplitude);
  result.held_out_gain = held_out_gain(whole, state, kAmplitude, without);
  result.noise_sd = std::sqrt(state.variance) * sets.unit;
  result.noise_below = state.variance <= 1.01 * kLeastSd * kLeastSd;
  result.target_outlier_fraction = std::clamp(1 - found / static_cast<double>(m), 0., 1.);
  result.template_nil_fraction = std::clamp(1 - found / static_cast<double>(n), 0., 1.);
  result.warped.axes = from.axes;
  result.warped.coordinates.resize(from.coordinates.size());
  Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
      result.warped.coordinates.data(), n, state.warped.cols()) =
      (state.warped * sets.unit).rowwise() + sets.to_centre;
  const Index smaller = std::min(n, m);
  // Where the template lies is known, other warps are other slides along the same shape, which the caller
  // judges.
  const bool searched = tries_every_turn(options);
  const double spacing = median_spacing(sets.from), sd = std::sqrt(state.variance) / spacing;
  // Thinned sets do not have the same points: their energies say little where all points fit exactly.
  const bool thinned_fit = std::max(n, m) > kLargest && fits_exactly(state, spacing, smaller) &&
                           self_maps(sets.from, options.reflections, 1).empty();
  if (!searched || thinned_fit) result.posterior = 1;
  result.verdict = smaller < state.warped.cols() + 1 + kLeastPoints     ? MatchVerdict::TooFewPoints
                   : !state.converged                                   ? MatchVerdict::NotSettled
                   : found < kLeastFound * static_cast<double>(smaller) ? MatchVerdict::TooFewFound
                   : result.log_likelihood_gain < least_gain(sd, result.target_outlier_fraction)
                       ? MatchVerdict::TooVague
                   : result.posterior < kLeastPosterior ? MatchVerdict::Ambiguous
                   : searched && result.evidence < least_evidence(sd, found / static_cast<double>(smaller))
                       ? MatchVerdict::Bent
                       : MatchVerdict::Reliable;
  result.partners =
      result.reliable() ? pair_up(state.partners) : std::vector<Partner>(static_cast<size_t>(n));
  return result;
}

}  // namespace palpate
