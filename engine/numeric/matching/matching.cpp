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
#include "engine/numeric/matching/unbent.h"
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
constexpr double kLeastPointsFound = 0.3;
constexpr double kSharp = 0.5, kLoose = 0.9, kSharpEvidence = 25, kEvidencePerSd = 150;
constexpr double kMostlyFound = 0.85, kLeftOverEvidence = 150;
constexpr Index kLeastPoints = 5;  // beyond the axes + 1 of an affine map, to be matched by bending
// Nats that a map without bending needs. Of unrelated sets fewer than one in e^10 has as many.
constexpr double kLeastUnbentEvidence = 10;

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

double centred_rms_radius(const MatrixXd& centred) {
  return std::sqrt(centred.rowwise().squaredNorm().mean());
}

// Log volume of the box around the target; flat directions get a tenth of the widest.
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
    from_scale = centred_rms_radius(from);
    const double to_scale = centred_rms_radius(to), shift = (to_centre - from_centre).norm();
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

// Rows in an order that the points alone decide: first coordinate first.
std::vector<size_t> by_place(const PointSet& set) {
  std::vector<size_t> order(set.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    return std::lexicographical_compare(set.at(a).begin(), set.at(a).end(), set.at(b).begin(),
                                        set.at(b).end());
  });
  return order;
}

PointSet in_order(const PointSet& set, const std::vector<size_t>& order) {
  PointSet result{set.axes, {}};
  result.coordinates.reserve(set.coordinates.size());
  for (const size_t i : order)
    for (const double v : set.at(i)) result.coordinates.push_back(v);
  return result;
}

// Step of the decimals that coordinates are written with; 0: finer than it matters.
double resolution(const PointSet& set) {
  constexpr int kCoarsest = 6, kFinest = -9;
  constexpr double kOff = 1e-4;        // of a step
  constexpr double kLeastSteps = 100;  // a few round numbers say nothing about the digits
  double largest = 0;
  for (const double v : set.coordinates) largest = std::max(largest, std::abs(v));
  for (int power = kCoarsest; power >= kFinest; --power) {
    const double per_step = std::pow(10., -power);
    if (largest * per_step < kLeastSteps) continue;
    const bool all = std::all_of(set.coordinates.begin(), set.coordinates.end(), [&](double v) {
      return std::abs(v * per_step - std::round(v * per_step)) < kOff;
    });
    if (all) return 1 / per_step;
  }
  return 0;
}

// Matches one pair of sets, points in an order of their own.
class Matcher {
 public:
  Matcher(const PointSet& from, const PointSet& to, const MatchOptions& options)
      : options_(options),
        sets_(from, to),
        modes_(sets_.from),
        n_(sets_.from.rows()),
        m_(sets_.to.rows()),
        volume_(log_volume(sets_.to)),
        without_(energy_without(sets_.to, volume_)),
        resolution_(std::max(resolution(from) / sets_.from_scale, resolution(to) / sets_.unit)),
        whole_(sets_.from, modes_, sets_.to, volume_, false) {}

  MatchResult match() {
    if (std::max(n_, m_) <= kLargest)
      search();
    else
      search_thinned();
    if (!state_.converged) {
      const uint32_t before = state_.iterations;
      flow(whole_, {.sd = std::sqrt(state_.variance), .amplitude = kAmplitude, .most_iterations = kFinishing},
           state_);
      weigh(whole_, kAmplitude, state_);
      result_.iterations += state_.iterations - before;
    }
    result_.evidence = without_ - state_.energy - freedom_cost(whole_, state_, kAmplitude);
    result_.verdict = verdict();
    try_unbent();
    describe();
    return std::move(result_);
  }

 private:
  void search() {
    const FlowProblem problem(sets_.from, modes_, sets_.to, volume_, true);
    Search search(problem, sets_.to, options_, without_);
    search.run(sets_.in_place, sets_.as_it_lies, result_);
    take(search);
  }

  void take(Search& search) {
    result_.posterior = search.posterior();
    contradicted_ = search.contradicted();
    state_ = std::move(search.best());
  }

  // Larger sets: some of both first, then all from there.
  void search_thinned() {
    const double fraction =
        std::min(1., static_cast<double>(kCoarse) / static_cast<double>(std::min(n_, m_)));
    const auto part = [&](Index size) {
      return thinned(size, static_cast<Index>(std::ceil(fraction * static_cast<double>(size))), 1);
    };
    const std::vector<Index> some = part(n_);
    const MatrixXd coarse_to = sets_.to(part(m_), Eigen::all);
    const FlowProblem coarse(sets_.from(some, Eigen::all), modes_, coarse_to, volume_, true);
    Search search(coarse, coarse_to, options_, energy_without(coarse_to, volume_));
    search.run(sets_.in_place, sets_.as_it_lies(some, Eigen::all), result_);
    take(search);
    contradicted_ = false;  // thinned neighbourhoods are not found again
    state_.warped = dense::product(whole_.basis, state_.coefficients);
    flow(whole_, {.sd = std::sqrt(state_.variance), .amplitude = kAmplitude, .cooling = 0.7}, state_);
    weigh(whole_, kAmplitude, state_);
    MatchAttempt& winner = result_.attempts[result_.winner];
    result_.iterations += state_.iterations - winner.iterations;
    winner.noise_sd = std::sqrt(state_.variance);
    winner.energy = state_.energy;
    winner.bending = state_.bending;
    winner.iterations = state_.iterations;
    winner.converged = state_.converged;
  }

  // Where the template lies is known, other warps are other slides along the same shape, which the caller
  // judges.
  MatchVerdict verdict() {
    const bool searched = tries_every_turn(options_);
    const Index smaller = std::min(n_, m_);
    const double spacing = median_spacing(sets_.from), sd = std::sqrt(state_.variance) / spacing,
                 found = static_cast<double>(state_.partners.sum());
    // Thinned sets do not have the same points: their energies say little where all points fit exactly.
    const bool thinned_fit = std::max(n_, m_) > kLargest && fits_exactly(state_, spacing, smaller) &&
                             self_maps(sets_.from, options_.reflections, 1).empty();
    if (!searched || thinned_fit) result_.posterior = 1;
    const double gain = (without_ - state_.energy) / static_cast<double>(m_);
    const double strangers = std::clamp(1 - found / static_cast<double>(m_), 0., 1.);
    return smaller < state_.warped.cols() + 1 + kLeastPoints          ? MatchVerdict::TooFewPoints
           : !state_.converged                                        ? MatchVerdict::NotSettled
           : found < kLeastPointsFound * static_cast<double>(smaller) ? MatchVerdict::TooFewFound
           : gain < least_gain(sd, strangers)                         ? MatchVerdict::TooVague
           : result_.posterior < kLeastPosterior                      ? MatchVerdict::Ambiguous
           : searched && (contradicted_ || uneven(state_, sets_.to))  ? MatchVerdict::PartlyWrong
           : searched && result_.evidence < least_evidence(sd, found / static_cast<double>(smaller))
               ? MatchVerdict::Bent
               : MatchVerdict::Reliable;
  }

  // Few points are not matched by bending, but by a map that leaves next to nothing.
  void try_unbent() {
    const std::optional<UnbentMap> unbent = find_unbent(
        sets_.from, sets_.to, {options_.most_turn_deg, options_.reflections, without_, volume_, resolution_});
    if (!unbent || unbent->evidence < kLeastUnbentEvidence) return;
    if (unbent->posterior < kLeastPosterior) {
      if (result_.verdict == MatchVerdict::Reliable && result_.evidence > unbent->evidence) return;
      result_.verdict = MatchVerdict::Ambiguous;
      result_.posterior = std::min(result_.posterior, unbent->posterior);
      return;
    }
    if (result_.verdict == MatchVerdict::Reliable && result_.evidence > unbent->evidence) return;
    state_ = FlowState();
    state_.coefficients = MatrixXd::Zero(whole_.basis.cols(), whole_.from.cols());
    state_.coefficients.topRows(unbent->map.rows()) = unbent->map;
    state_.warped = dense::product(whole_.basis, state_.coefficients);
    state_.variance = std::max(unbent->sd * unbent->sd, kLeastSd * kLeastSd);
    state_.outlier_fraction = outlier_fraction(whole_, static_cast<double>(unbent->pairs));
    state_.converged = true;
    set_partners(whole_, state_);
    weigh(whole_, kAmplitude, state_);
    result_.winner = result_.attempts.size();
    result_.attempts.push_back(
        {MatchStart::Unbent, unbent->turn_deg, state_.energy, 0, std::sqrt(state_.variance), 0, true});
    result_.evidence = unbent->evidence;
    result_.posterior = unbent->posterior;
    result_.verdict = MatchVerdict::Reliable;
  }

  void describe() {
    const double found = static_cast<double>(state_.partners.sum());
    result_.converged = state_.converged;
    result_.scale = sets_.from_scale;
    result_.log_likelihood_gain = (without_ - state_.energy) / static_cast<double>(m_);
    result_.held_out_gain = held_out_gain(whole_, state_, kAmplitude, without_);
    result_.noise_sd = std::sqrt(state_.variance) * sets_.unit;
    result_.noise_below = state_.variance <= 1.01 * kLeastSd * kLeastSd;
    result_.target_outlier_fraction = std::clamp(1 - found / static_cast<double>(m_), 0., 1.);
    result_.template_nil_fraction = std::clamp(1 - found / static_cast<double>(n_), 0., 1.);
    result_.warped.axes = static_cast<uint32_t>(whole_.from.cols());
    result_.warped.coordinates.resize(static_cast<size_t>(whole_.from.size()));
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
        result_.warped.coordinates.data(), n_, whole_.from.cols()) =
        (state_.warped * sets_.unit).rowwise() + sets_.to_centre;
    result_.partners =
        result_.reliable() ? pair_up(state_.partners) : std::vector<Partner>(static_cast<size_t>(n_));
  }

  const MatchOptions& options_;
  Prepared sets_;
  WarpModes modes_;
  Index n_, m_;
  double volume_, without_, resolution_;
  FlowProblem whole_;
  FlowState state_;
  bool contradicted_ = false;
  MatchResult result_;
};

}  // namespace

MatchResult match_points(const PointSet& from, const PointSet& to, const MatchOptions& options) {
  check(from, "template");
  check(to, "target");
  if (from.axes != to.axes)
    throw Error(Failure::Input, "template and target of the same coordinates",
                std::to_string(from.axes) + " and " + std::to_string(to.axes), "sets of one kind");
  // Sums are rounded by their order, and a search ends elsewhere by a hair: one order for all.
  const std::vector<size_t> from_order = by_place(from), to_order = by_place(to);
  MatchResult result = Matcher(in_order(from, from_order), in_order(to, to_order), options).match();
  const std::vector<Partner> partners = result.partners;
  const PointSet warped = result.warped;
  for (size_t i = 0; i < from_order.size(); ++i) {
    Partner& partner = result.partners[from_order[i]];
    partner = partners[i];
    if (partner.target) partner.target = static_cast<uint32_t>(to_order[*partner.target]);
    std::copy_n(warped.at(i).begin(), from.axes,
                result.warped.coordinates.begin() + static_cast<std::ptrdiff_t>(from_order[i] * from.axes));
  }
  return result;
}

}  // namespace palpate
