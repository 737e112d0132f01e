#include "engine/lump/pair/pair_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "engine/lump/network/damped_search.h"
#include "engine/lump/network/inverse_network.h"
#include "engine/numeric/dense.h"

namespace palpate::lump {
namespace {

constexpr uint32_t kPairRounds = 12;
constexpr double kPairForgiven = 12;  // chi-square beyond the best's from which on shapes are not followed
constexpr double kUnlikelyShape = 0.01;
constexpr int kPairRatios = 9;       // of a posterior
constexpr double kSettled_mm = 0.3;  // a patch that lies as near to its lump is not moved again
constexpr int kMostPairMoves = 4;
constexpr double kUnusualPair = 0.1;  // of the bumps, RMS: what lumps of other shapes are off by
// What two lumps do to each other, by finite elements (RMS over the root of both bumps' product): so much at
// a distance of their mean diameter, and it falls with the distance so; never more than the most.
constexpr double kInteraction = 0.18, kInteractionFall = 1.8, kMostInteraction = 0.25;
/// Balls from which the search begins: diameter and depth, mm.
constexpr std::array<std::array<double, 2>, 3> kBegin = {{{6, 3}, {8, 5}, {5, 2}}};

double pair_chi_square(const Model& model, const PressedNodes& nodes, const PairSight& sight,
                       const PairFit& fit, PairVector* slope, PairMatrix* normal) {
  Eigen::VectorXd left = sight.observation();
  Eigen::MatrixXd jacobian(slope != nullptr ? left.size() : 0, 11);
  for (size_t i = 0; i < 2; ++i) {
    std::array<Eigen::MatrixXd, 5> changes;
    left -= sight.of_factors(i, bump_of(model, sight.view(i).setting, nodes.loads, fit.lumps[i],
                                        slope != nullptr ? &changes : nullptr));
    for (size_t p = 0; p < 5 && slope != nullptr; ++p)
      jacobian.col(static_cast<Eigen::Index>(5 * i + p)) = sight.of_factors(i, changes[p]);
  }
  double sum = 0;
  if (slope == nullptr) {
    sum = sight.whitened(left).squaredNorm();
  } else {
    jacobian.col(10) = left;
    const Eigen::MatrixXd white = sight.whitened(jacobian);
    sum = white.col(10).squaredNorm();
    const Eigen::MatrixXd squares = dense::product_tn(white, white);
    *normal = squares.topLeftCorner<10, 10>();
    *slope = squares.topRightCorner<10, 1>();
  }
  for (int i = 0; i < 2; ++i) {
    const Fit& lump = fit.lumps[static_cast<size_t>(i)];
    LumpVector own_slope = LumpVector::Zero();
    Eigen::Matrix<double, 5, 5> own_normal = Eigen::Matrix<double, 5, 5>::Zero();
    add_prior(model, sight.view(static_cast<size_t>(i)).setting, lump.at, sum, &own_slope, &own_normal);
    if (slope == nullptr) continue;
    slope->segment<5>(5 * i) += own_slope;
    normal->block<5, 5>(5 * i, 5 * i) += own_normal;
  }
  return sum;
}

/// Weighs a sight for two lumps.
void weigh_for(const Model& model, const PressedNodes& nodes, const PairFit& fit, double pattern,
               PairSight& sight) {
  std::array<std::array<double, 2>, 2> at{};
  double size_mm = 0;
  for (size_t i = 0; i < 2; ++i) {
    at[i] = sight.view(i).place_mm(fit.lumps[i].at(3), fit.lumps[i].at(4));
    size_mm += 0.5 * std::exp(fit.lumps[i].at(kSize));
  }
  const double apart_mm = std::max(0.1, std::hypot(at[0][0] - at[1][0], at[0][1] - at[1][1]));
  sight.weigh(bumps_of(model, nodes, sight, fit), pattern,
              std::min(kMostInteraction, kInteraction * std::pow(size_mm / apart_mm, kInteractionFall)));
}

/// Places that a search has found, as patches around them.
std::array<PatchView, 2> views_at(const Model& model, const PressedNodes& nodes, const PairSight& sight,
                                  const PairFit& fit) {
  const auto at = [&](size_t i) {
    const LumpVector& v = fit.lumps[i].at;
    return PatchView(model, nodes, sight.view(i).place_mm(v(3), v(4)), sight.view(i).swapped);
  };
  return {at(0), at(1)};
}

/// Two balls near the tops, with patches around them.
class PairStart {
 public:
  PairStart(const Model& model, const PressedNodes& nodes, const TwoPlaces& tops_mm)
      : sight(model, nodes,
              {PatchView(model, nodes, tops_mm[0], false), PatchView(model, nodes, tops_mm[1], false)}) {
    fit.chi_square = std::numeric_limits<double>::infinity();
    for (const auto& [size_mm, depth_mm] : kBegin) {
      PairFit ball;
      for (Fit& lump : ball.lumps) lump.at << std::log(size_mm), std::log(depth_mm), std::log(6.), 0, 0;
      weigh_for(model, nodes, ball, kUsualPattern * nodes.peak, sight);
      search(model, nodes, sight, kPairRounds, -1, ball);
      // Each start has its own weights, so that one is judged by all with the same.
      weigh_for(model, nodes, ball, kUsualPattern * nodes.peak, sight);
      search(model, nodes, sight, kPairRounds, -1, ball);
      if (ball.chi_square < fit.chi_square) fit = ball;
    }
    settle(model, nodes);
  }

  /// Moves the patches until each lies around its lump.
  void settle(const Model& model, const PressedNodes& nodes) {
    for (int move = 0; move < kMostPairMoves; ++move) {
      double farthest = 0;
      for (const Fit& lump : fit.lumps) farthest = std::max(farthest, std::hypot(lump.at(3), lump.at(4)));
      if (move > 0 && farthest < kSettled_mm) break;
      sight = PairSight(model, nodes, views_at(model, nodes, sight, fit));
      for (Fit& lump : fit.lumps) lump.at.tail<2>().setZero();
      weigh_for(model, nodes, fit, kUsualPattern * nodes.peak, sight);
      search(model, nodes, sight, kPairRounds, -1, fit);
    }
  }

  PairSight sight;
  PairFit fit;
};

}  // namespace

PairBumps bumps_of(const Model& model, const PressedNodes& nodes, const PairSight& sight,
                   const PairFit& fit) {
  return {bump_of(model, sight.view(0).setting, nodes.loads, fit.lumps[0]),
          bump_of(model, sight.view(1).setting, nodes.loads, fit.lumps[1])};
}

void search(const Model& model, const PressedNodes& nodes, const PairSight& sight, uint32_t rounds, int held,
            PairFit& fit) {
  damped_search<PairVector>(
      fit, rounds, held,
      [&](const PairFit& at, PairVector* slope, PairMatrix* normal) {
        return pair_chi_square(model, nodes, sight, at, slope, normal);
      },
      [](const PairMatrix& matrix, const PairVector& slope) {
        return PairVector(dense::Ldlt(matrix).solve(Eigen::VectorXd(slope)));
      },
      [](PairFit& at, const PairVector& step) {
        for (int i = 0; i < 2; ++i) at.lumps[static_cast<size_t>(i)].at += step.segment<5>(5 * i);
      });
}

namespace {

/// Likely shapes of one lump with where each begins, read from what the other one's bump leaves.
struct ReadShapes {
  bool across = false;
  std::vector<Fit> starts;
};
ReadShapes read_shapes(const Model& model, const PressedNodes& left, const PatchView& view, const Fit& ball) {
  PatchObservation patch(model, left, view);
  patch.set_pattern(kUsualPattern * left.peak);
  Answer answer = answer_of(model, network_features(model, left, patch));
  double along = 0, across = 0;
  for (const InclusionShape shape : {InclusionShape::Ellipsoid, InclusionShape::LyingCylinder}) {
    const auto s = static_cast<size_t>(shape);
    across += answer.shape_probability[s] * answer.across_probability[s];
    along += answer.shape_probability[s] * (1 - answer.across_probability[s]);
  }
  ReadShapes read;
  read.across = across > along;
  const auto likeliest =
      static_cast<size_t>(std::max_element(answer.shape_probability.begin(), answer.shape_probability.end()) -
                          answer.shape_probability.begin());
  for (size_t s = 0; s < 4; ++s) {
    const bool is_ball = static_cast<InclusionShape>(s) == InclusionShape::Sphere;
    if (!model.shapes[s] || (s != likeliest && !is_ball && answer.shape_probability[s] < kUnlikelyShape))
      continue;
    Fit start = ball;
    start.shape = static_cast<InclusionShape>(s);
    if (!is_ball)
      for (const Parameter p : {kSize, kDepth, kRatio}) start.at(p) = answer.marginals[s][p].middle;
    read.starts.push_back(start);
  }
  return read;
}

/// The marginals of one lump of a pair: its ratio on a grid, all the rest following it.
void add_parts(const Model& model, const PressedNodes& nodes, const PairSight& sight, const PairFit& fit,
               size_t lump, double temperature, std::vector<Posterior::Part>& parts,
               std::vector<double>& log_weights) {
  const auto first = static_cast<int>(5 * lump);
  const int ratio = first + kRatio;
  const PairMatrix covariance = dense::inverse(fit.normal);
  const double low = std::log(model.ratio[0]), high = std::log(model.ratio[1]);
  const double middle = fit.lumps[lump].at(kRatio);
  const double sd = std::sqrt(std::max(1e-8, temperature * covariance(ratio, ratio)));
  const double from = std::max(low, middle - std::clamp(3.2 * sd, 0.05, 3.0));
  const double to = std::min(high, middle + std::clamp(4 * sd, 0.05, 3.0));
  const double centre = std::clamp(middle, from, to);
  const double spacing = std::max(1e-3, (to - from) / (kPairRatios - 1));
  const auto move = [ratio](PairFit& at, const PairMatrix& by, double step) {
    for (int i = 0; i < 2; ++i)
      at.lumps[static_cast<size_t>(i)].at += step / by(ratio, ratio) * by.block<5, 1>(5 * i, ratio);
  };
  for (const double direction : {1.0, -1.0}) {
    PairFit at = fit;
    PairMatrix along = covariance;
    move(at, along, centre - middle);
    for (int i = direction > 0 ? 0 : 1; i < kPairRatios; ++i) {
      const double there = centre + direction * spacing * i;
      if (there > to + 1e-9 || there < from - 1e-9) break;
      move(at, along, there - at.lumps[lump].at(kRatio));
      at.lumps[lump].at(kRatio) = there;
      search(model, nodes, sight, 1, ratio, at);
      if (at.chi_square >= kHopeless) break;
      PairMatrix rest = at.normal;
      rest.row(ratio).setZero();
      rest.col(ratio).setZero();
      rest(ratio, ratio) = 1;
      const PairMatrix inverse = dense::inverse(rest);
      const double volume = std::log(std::max(1e-300, std::abs(dense::determinant(inverse))));
      if (std::isfinite(volume)) {
        double prior = 0;  // even over sizes and depths, as of one lump
        for (const Fit& each : at.lumps) prior += each.at(kSize) + each.at(kDepth);
        log_weights.push_back(-0.5 * at.chi_square / temperature + 0.5 * volume + std::log(spacing) + prior);
        Posterior::Part part;
        part.shape = fit.lumps[lump].shape;
        for (const Parameter p : {kSize, kDepth, kRatio}) {
          const double own = p == kRatio
                                 ? 0.5 * spacing
                                 : std::sqrt(std::max(1e-8, temperature * inverse(first + p, first + p)));
          part.marginals[p] = {at.lumps[lump].at(p), own, own};
        }
        parts.push_back(part);
      }
      if (at.chi_square > fit.chi_square + 16 * temperature) break;
      along = dense::inverse(at.normal);
    }
  }
}

Posterior posterior_of(const Model& model, const PressedNodes& nodes, const PairSight& sight,
                       const std::vector<PairFit>& fits, size_t lump, double temperature) {
  Posterior posterior;
  std::vector<double> log_weights;
  double best = std::numeric_limits<double>::infinity();
  for (const PairFit& fit : fits) best = std::min(best, fit.chi_square);
  for (const PairFit& fit : fits)
    if (fit.chi_square < best + kPairForgiven * temperature)
      add_parts(model, nodes, sight, fit, lump, temperature, posterior.parts, log_weights);
  if (log_weights.empty()) return posterior;
  const double most = *std::max_element(log_weights.begin(), log_weights.end());
  double sum = 0;
  for (double& weight : log_weights) sum += weight = std::exp(weight - most);
  for (size_t i = 0; i < log_weights.size(); ++i) {
    posterior.parts[i].weight = log_weights[i] / sum;
    posterior.shape_probability[static_cast<size_t>(posterior.parts[i].shape)] += posterior.parts[i].weight;
  }
  return posterior;
}

}  // namespace

PairWeighing weigh_pair(const Model& model, const PressedNodes& nodes, const std::vector<TwoPlaces>& tops_mm,
                        double temperature) {
  PairStart start(model, nodes, tops_mm.at(0));
  for (size_t t = 1; t < tops_mm.size(); ++t) {
    PairStart other(model, nodes, tops_mm[t]);
    if (other.fit.chi_square < start.fit.chi_square) start = std::move(other);
  }
  const PairBumps balls = bumps_of(model, nodes, start.sight, start.fit);
  const std::array<ReadShapes, 2> read = {
      read_shapes(model, start.sight.without(1, balls[1]), start.sight.view(0), start.fit.lumps[0]),
      read_shapes(model, start.sight.without(0, balls[0]), start.sight.view(1), start.fit.lumps[1])};
  const auto turned = [&](size_t i) {
    const PatchView& view = start.sight.view(i);
    const LumpVector& v = start.fit.lumps[i].at;
    return PatchView(model, nodes, view.place_mm(v(3), v(4)), view.swapped != read[i].across);
  };
  PairSight sight(model, nodes, {turned(0), turned(1)});
  double pattern = kUsualPattern * nodes.peak;
  const auto left_of = [&sight](const PairBumps& bumps) {
    return Eigen::VectorXd(sight.observation() - sight.of_factors(0, bumps[0]) -
                           sight.of_factors(1, bumps[1]));
  };
  PairFit best = start.fit;
  for (Fit& lump : best.lumps) lump.at.tail<2>().setZero();
  for (int round = 0; round < 2; ++round) {
    weigh_for(model, nodes, best, pattern, sight);
    search(model, nodes, sight, kPairRounds, -1, best);
    pattern = sight.pattern_of(left_of(bumps_of(model, nodes, sight, best))).pattern;
  }
  weigh_for(model, nodes, best, pattern, sight);
  std::vector<PairFit> fits;
  for (const Fit& one : read[0].starts)
    for (const Fit& two : read[1].starts) {
      PairFit fit = best;
      for (const auto& [from, to] : {std::pair{&one, &fit.lumps[0]}, std::pair{&two, &fit.lumps[1]}}) {
        if (from->shape == to->shape) continue;
        to->shape = from->shape;
        to->at.head<3>() = from->at.head<3>();
      }
      search(model, nodes, sight, kPairRounds, -1, fit);
      fits.push_back(fit);
    }
  best = *std::min_element(fits.begin(), fits.end(),
                           [](const PairFit& a, const PairFit& b) { return a.chi_square < b.chi_square; });
  const PairBumps bumps = bumps_of(model, nodes, sight, best);
  const Eigen::VectorXd left = left_of(bumps);
  const PatternSize left_pattern = sight.pattern_of(left);
  const PairMatrix covariance = dense::inverse(best.normal);
  std::array<Inference, 2> found;
  double squares = 0;
  for (const Eigen::MatrixXd& bump : bumps) squares += bump.rightCols(1).squaredNorm();
  const double high = std::sqrt(squares) / static_cast<double>(model.patch.side) / nodes.peak;
  for (size_t i = 0; i < 2; ++i) {
    Inference& of = found[i];
    of.posterior = posterior_of(model, nodes, sight, fits, i, temperature);
    const LumpVector& at = best.lumps[i].at;
    const PatchView& view = sight.view(i);
    of.place_mm = view.place_mm(at(3), at(4));
    for (size_t axis = 0; axis < 2; ++axis) {
      const auto p = static_cast<Eigen::Index>(5 * i + 3 + (view.swapped ? 1 - axis : axis));
      of.place_sd_mm[axis] = std::sqrt(std::max(1e-8, temperature * covariance(p, p)));
    }
    const PatternSize alone = sight.pattern_of(left + sight.of_factors(i, bumps[i]));
    of.log_likelihood_ratio = of.posterior.parts.empty() ? 0 : alone.energy - left_pattern.energy;
    of.plain_pattern = alone.pattern / nodes.peak;
    of.pattern = left_pattern.pattern / nodes.peak;
    of.misfit = of.pattern / std::hypot(kLargestPattern, kUnusualPair * high);
    of.chi_square = best.chi_square / static_cast<double>(std::max<Eigen::Index>(1, sight.freedom() - 10));
    const double over_noise = left_pattern.pattern / nodes.noise;
    of.rest = sight.rest() / (1 + over_noise * over_noise);
  }
  return {std::move(found), best};
}

}  // namespace palpate::lump
