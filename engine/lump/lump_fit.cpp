#include "engine/lump/lump_fit.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace palpate {
namespace {

using Matrix5 = Eigen::Matrix<double, 5, 5>;

constexpr double kGaugeShare = 0.002;
constexpr double kBeyondRange = 1.1;  // of the training's ranges, where the search is turned back
constexpr std::array<double, 5> kLongestStep = {0.4, 0.5, 0.9, 1.5, 1.5};
constexpr double kForgiven = 30;    // misfit beyond the best's from which on a shape is no longer followed
constexpr double kHopeless = 1e30;  // misfit of what the network has no number for
constexpr int kRatios = 11;         // of the posterior

/// Past `edge` by `over` a parameter costs (over / width)^2.
void wall(double over, double width, int index, double sign, double& misfit, LumpVector* slope,
          Matrix5* normal) {
  if (over <= 0) return;
  misfit += over * over / (width * width);
  if (slope != nullptr) {
    (*slope)(index) -= sign * over / (width * width);
    (*normal)(index, index) += 1 / (width * width);
  }
}

/// Of a variance that rounding may have made nothing.
double sd_of(double variance) {
  return std::sqrt(std::max(variance, 1e-8));
}

std::array<double, 2> log_range(const std::array<double, 2>& range) {
  return {std::log(range[0]), std::log(range[1])};
}

}  // namespace

LumpFitter::LumpFitter(const LumpModel& model, const PressedNodes& nodes, const PatchView& view, int member)
    : model_(model),
      nodes_(nodes),
      view_(view),
      sums_(sum_patch(model.patch, nodes, view)),
      whitener_(model, nodes, sums_, kGaugeShare),
      member_(member) {}

double LumpFitter::misfit(const LumpFit& fit, LumpVector* slope, Matrix5* normal) const {
  const LumpGuess guess{fit.what.shape, fit.at(0), fit.at(1), fit.at(2)};
  std::array<Eigen::MatrixXd, 3> changes;
  const Eigen::MatrixXd plain =
      bump_factors(model_, guess, view_.setting, nodes_.loads, member_, slope ? &changes : nullptr);
  const Eigen::MatrixXd shift = fit.at(3) * model_.patch.along_x + fit.at(4) * model_.patch.along_y;
  const bool still = fit.at(3) == 0 && fit.at(4) == 0;
  const auto moved = [&shift, still](const Eigen::MatrixXd& factors) -> Eigen::MatrixXd {
    if (still) return factors;
    const Eigen::MatrixXd once = shift * factors;
    return factors - once + 0.5 * (shift * once);
  };
  const Eigen::MatrixXd factors = moved(plain);
  const Eigen::VectorXd rest = whitener_.reading() - whitener_.of_factors(factors);
  double sum = rest.squaredNorm();
  if (slope != nullptr) {
    Eigen::MatrixXd jacobian(rest.size(), 5);
    for (size_t p = 0; p < 3; ++p)
      jacobian.col(static_cast<Eigen::Index>(p)) = whitener_.of_factors(moved(changes[p]));
    jacobian.col(3) = whitener_.of_factors(-model_.patch.along_x * factors);
    jacobian.col(4) = whitener_.of_factors(-model_.patch.along_y * factors);
    *slope = jacobian.transpose() * rest;
    *normal = jacobian.transpose() * jacobian;
  }
  // What the training held is likelier than what it did not: wide bells over its ranges, walls beyond them.
  const std::array<std::array<double, 2>, 3> ranges = {log_range(model_.size_mm), log_range(model_.depth_mm),
                                                       log_range(model_.ratio)};
  for (int p = 0; p < 3; ++p) {
    const auto [low, high] = ranges[static_cast<size_t>(p)];
    const double width = high - low + 0.1, off = fit.at(p) - 0.5 * (low + high);
    sum += off * off / (width * width);
    if (slope != nullptr) {
      (*slope)(p) -= off / (width * width);
      (*normal)(p, p) += 1 / (width * width);
    }
    const double beyond = std::log(kBeyondRange);
    wall(fit.at(p) - high - beyond, 0.03, p, 1, sum, slope, normal);
    wall(low - beyond - fit.at(p), 0.03, p, -1, sum, slope, normal);
  }
  for (int p = 3; p < 5; ++p) {
    sum += fit.at(p) * fit.at(p) / 16;
    if (slope != nullptr) {
      (*slope)(p) -= fit.at(p) / 16;
      (*normal)(p, p) += 1.0 / 16;
    }
  }
  // A lump does not reach through the floor.
  const double size = std::exp(fit.at(0)), depth = std::exp(fit.at(1));
  const double over = size + depth - (view_.setting.thickness_mm - 0.9 * model_.floor_mm);
  if (over > 0) {
    const double width = 0.2;
    sum += over * over / (width * width);
    if (slope != nullptr) {
      LumpVector by = LumpVector::Zero();
      by(0) = size / width;
      by(1) = depth / width;
      *slope -= by * over / width;
      *normal += by * by.transpose();
    }
  }
  return sum;
}

LumpFit LumpFitter::start(const LumpHypothesis& what) const {
  LumpFit best;
  best.what = what;
  best.misfit = std::numeric_limits<double>::infinity();
  const auto between = [](const std::array<double, 2>& range, double share) {
    const auto [low, high] = log_range(range);
    return low + share * (high - low);
  };
  std::vector<LumpVector> tried;
  for (const double s : {0.1, 0.4, 0.7, 0.95})
    for (const double d : {0.1, 0.4, 0.7, 0.95})
      for (const double r : {0.25, 0.75}) {
        LumpVector at;
        at << between(model_.size_mm, s), between(model_.depth_mm, d), between(model_.ratio, r), 0, 0;
        if (std::exp(at(0)) + std::exp(at(1)) <= view_.setting.thickness_mm - model_.floor_mm)
          tried.push_back(at);
      }
  if (tried.empty()) tried.push_back(best.at);
  // All at once, at the highest load: it shows most.
  const double load = nodes_.loads.back();
  Eigen::MatrixXf in(kLumpFeatures, static_cast<Eigen::Index>(tried.size()));
  for (size_t i = 0; i < tried.size(); ++i)
    in.col(static_cast<Eigen::Index>(i)) =
        (lump_features({what.shape, tried[i](0), tried[i](1), tried[i](2)}, view_.setting, load)
             .cast<float>() -
         model_.in_mean)
            .array() *
        model_.in_scale.array();
  const Eigen::MatrixXf out = model_.members[static_cast<size_t>(std::max(member_, 0))].apply(in);
  const Eigen::MatrixXd factors =
      load * ((model_.out_scale.asDiagonal() * out).colwise() + model_.out_mean).cast<double>();
  const Eigen::MatrixXd weighed = sums_.gram * factors;
  const Eigen::VectorXd seen = sums_.right.rightCols(1);
  for (size_t i = 0; i < tried.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    const double misfit = factors.col(column).dot(weighed.col(column) - 2 * seen);
    if (misfit < best.misfit) {
      best.misfit = misfit;
      best.at = tried[i];
    }
  }
  return best;
}

void LumpFitter::search(LumpFit& fit, uint32_t rounds, bool ratio_held) const {
  LumpVector slope;
  fit.misfit = misfit(fit, &slope, &fit.normal);
  if (!std::isfinite(fit.misfit)) {
    fit.misfit = kHopeless;
    return;
  }
  double damping = 1e-3;
  for (uint32_t round = 0; round < rounds; ++round) {
    Matrix5 matrix = fit.normal;
    matrix.diagonal() *= 1 + damping;
    if (ratio_held) {
      matrix.row(2).setZero();
      matrix.col(2).setZero();
      matrix(2, 2) = 1;
      slope(2) = 0;
    }
    LumpVector step = matrix.ldlt().solve(slope);
    double shrink = 1;
    for (int p = 0; p < 5; ++p)
      shrink = std::min(shrink, kLongestStep[static_cast<size_t>(p)] / std::max(1e-12, std::abs(step(p))));
    step *= shrink;
    LumpFit next = fit;
    next.at += step;
    LumpVector next_slope;
    next.misfit = misfit(next, &next_slope, &next.normal);
    if (std::isfinite(next.misfit) && next.misfit < fit.misfit) {
      const double gain = fit.misfit - next.misfit;
      fit = next;
      slope = next_slope;
      damping = std::max(1e-6, damping * 0.2);
      if (gain < 0.02 && shrink == 1) break;
    } else {
      if (step.cwiseAbs().maxCoeff() < 1e-4) break;
      damping = std::max(damping * 10, 1e-2);
    }
  }
}

double LumpPosterior::quantile(LumpParameter what, double share) const {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const Bell& bell : bells) {
    low = std::min(low, bell.mean[what] - 6 * bell.sd[what]);
    high = std::max(high, bell.mean[what] + 6 * bell.sd[what]);
  }
  for (int step = 0; step < 40; ++step) {
    const double middle = 0.5 * (low + high);
    double below = 0;
    for (const Bell& bell : bells)
      below +=
          bell.weight * 0.5 * std::erfc((bell.mean[what] - middle) / (bell.sd[what] * std::numbers::sqrt2));
    (below < share ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

namespace {

/// The bells of one fit: its ratio on a grid, the rest following it.
void add_bells(const LumpModel& model, const LumpFitter& fitter, const LumpFit& fit, double warmth,
               std::vector<LumpPosterior::Bell>& bells, std::vector<double>& log_weights) {
  const Matrix5 covariance = fit.normal.inverse();
  const auto [low, high] = log_range(model.ratio);
  const double sd = sd_of(warmth * covariance(2, 2));
  const double from = std::max(low, fit.at(2) - std::clamp(3.2 * sd, 0.05, 3.0));
  const double to = std::min(high, fit.at(2) + std::clamp(4 * sd, 0.05, 3.0));
  const double centre = std::clamp(fit.at(2), from, to);
  const double spacing = std::max(1e-3, (to - from) / (kRatios - 1));
  LumpVector along = covariance.col(2) / covariance(2, 2);
  const auto add = [&](const LumpFit& at) {
    Eigen::Matrix4d rest;
    constexpr std::array<int, 4> kept = {0, 1, 3, 4};
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < 4; ++b)
        rest(a, b) = at.normal(kept[static_cast<size_t>(a)], kept[static_cast<size_t>(b)]);
    const Eigen::Matrix4d inverse = rest.inverse();
    const double volume = std::log(std::max(1e-300, std::abs(inverse.determinant())));
    // Sizes and depths were even in the training, not their logarithms.
    if (!std::isfinite(volume) || at.misfit >= kHopeless) return;
    log_weights.push_back(-0.5 * at.misfit / warmth + 0.5 * volume + std::log(spacing) + at.at(0) + at.at(1) +
                          std::log(fit.what.prior));
    LumpPosterior::Bell bell;
    bell.shape = fit.what.shape;
    bell.mean = {at.at(0), at.at(1), at.at(2)};
    bell.sd = {sd_of(warmth * inverse(0, 0)), sd_of(warmth * inverse(1, 1)), 0.5 * spacing};
    bells.push_back(bell);
  };
  for (const double direction : {1.0, -1.0}) {
    LumpFit at = fit;
    at.at += (centre - fit.at(2)) * along;
    for (int i = direction > 0 ? 0 : 1; i < kRatios; ++i) {
      const double ratio = centre + direction * spacing * i;
      if (ratio > to + 1e-9 || ratio < from - 1e-9) break;
      at.at += (ratio - at.at(2)) * along;
      at.at(2) = ratio;
      fitter.search(at, 1, true);
      add(at);
      if (at.misfit > fit.misfit + 16 * warmth) break;
      // The direction in which size and depth give way for the next ratio.
      const Matrix5 here = at.normal.inverse();
      along = here.col(2) / here(2, 2);
    }
  }
}

}  // namespace

LumpEvidence weigh_lumps(const LumpModel& model, const PressedNodes& nodes, double warmth, int member) {
  LumpEvidence found;
  found.no_lump_misfit = no_lump_misfit(nodes);
  std::vector<LumpHypothesis> hypotheses;
  const auto add = [&](LumpShape shape, bool both) {
    if (!model.shapes[static_cast<size_t>(shape)]) return;
    for (const bool swapped : {false, true})
      if (!swapped || both) hypotheses.push_back({shape, swapped, both ? 0.5 : 1});
  };
  add(LumpShape::Sphere, false);
  add(LumpShape::Ellipsoid, true);
  add(LumpShape::Cylinder, false);
  add(LumpShape::LyingCylinder, true);

  std::array<double, 2> center = find_bump(model, nodes);
  std::array<std::optional<LumpFitter>, 2> fitters;
  const double reach = model.offset_mm + 2;
  for (int pass = 0; pass < 3; ++pass) {
    for (size_t f = 0; f < 2; ++f)
      fitters[f].emplace(model, nodes, PatchView(model, nodes, center, f == 1), std::max(member, 0));
    if (pass == 0) {
      for (const LumpHypothesis& what : hypotheses)
        found.fits.push_back(fitters[what.swapped ? 1 : 0]->start(what));
    } else {
      for (LumpFit& fit : found.fits) fit.at(3) = fit.at(4) = 0;
    }
    double best = std::numeric_limits<double>::infinity();
    for (LumpFit& fit : found.fits) {
      fitters[fit.what.swapped ? 1 : 0]->search(fit, pass == 0 ? 6 : 4);
      best = std::min(best, fit.misfit);
    }
    std::sort(found.fits.begin(), found.fits.end(),
              [](const LumpFit& a, const LumpFit& b) { return a.misfit < b.misfit; });
    // Shapes that are far off are not followed; while the centre moves, with patience.
    const double forgiven = (pass == 0 ? 4 : 1) * kForgiven * warmth;
    std::erase_if(found.fits, [&](const LumpFit& fit) { return fit.misfit > best + forgiven; });
    const LumpFit& first = found.fits.front();
    if (std::hypot(first.at(3), first.at(4)) < 0.35 || pass == 2) break;
    const auto move = fitters[first.what.swapped ? 1 : 0]->view().to_block(first.at(3), first.at(4));
    for (size_t axis = 0; axis < 2; ++axis)
      center[axis] = std::clamp(center[axis] + move[axis], -reach, reach);
  }
  // The search was one member's, which is quick and near; the answer is everyone's.
  if (member < 0) {
    for (auto& each : fitters) each->use(member);
    for (LumpFit& fit : found.fits) fitters[fit.what.swapped ? 1 : 0]->search(fit, 3);
    std::sort(found.fits.begin(), found.fits.end(),
              [](const LumpFit& a, const LumpFit& b) { return a.misfit < b.misfit; });
  }
  const LumpFit& best = found.fits.front();
  const LumpFitter& fitter = *fitters[best.what.swapped ? 1 : 0];
  found.evidence = fitter.no_lump() - best.misfit;
  found.misfit = best.misfit / static_cast<double>(std::max<Eigen::Index>(1, fitter.whitener().size() - 5));
  found.rest = fitter.whitener().rest();

  std::vector<double> log_weights;
  for (const LumpFit& fit : found.fits)
    if (fit.misfit < best.misfit + kForgiven * warmth)
      add_bells(model, *fitters[fit.what.swapped ? 1 : 0], fit, warmth, found.posterior.bells, log_weights);
  if (log_weights.empty()) {
    found.evidence = 0;
    return found;
  }
  const double most = *std::max_element(log_weights.begin(), log_weights.end());
  double sum = 0;
  for (double& weight : log_weights) sum += weight = std::exp(weight - most);
  for (size_t i = 0; i < log_weights.size(); ++i) {
    LumpPosterior::Bell& bell = found.posterior.bells[i];
    bell.weight = log_weights[i] / sum;
    found.posterior.shape_probability[static_cast<size_t>(bell.shape)] += bell.weight;
  }
  const Matrix5 covariance = best.normal.inverse();
  const auto move = fitter.view().to_block(best.at(3), best.at(4));
  const std::array<double, 2> sd = {sd_of(warmth * covariance(3, 3)), sd_of(warmth * covariance(4, 4))};
  for (size_t axis = 0; axis < 2; ++axis) {
    found.place_mm[axis] = fitter.view().center_mm[axis] + move[axis];
    found.place_sd_mm[axis] = sd[best.what.swapped ? 1 - axis : axis];
  }
  return found;
}

}  // namespace palpate
