#include "engine/lump/network/fit.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "engine/lump/network/damped_search.h"
#include "engine/numeric/dense.h"

namespace palpate::lump {
namespace {

using Matrix5 = Eigen::Matrix<double, 5, 5>;

constexpr double kBeyondRange = 1.1;  // of the training's ranges, where the search is turned back
constexpr double kForgiven = 30;  // chi-square beyond the best's from which on a shape is no longer followed
constexpr int kRatios = 11;       // of the posterior
constexpr double kUnlikely = 1e-3;                 // probability of a shape from which on it is not tried
constexpr uint32_t kRefining = 12, kChecking = 3;  // rounds
constexpr int kPatternRounds = 2;
constexpr double kSamePattern = 0.25;  // change of a pattern's logarithm that changes nothing else
constexpr double kUnusual = 0.1;       // of a bump, RMS: what lumps of other shapes are off by

/// Past `edge` by `over` a parameter costs (over / width)^2.
void wall(double over, double width, int index, double sign, double& chi_square, LumpVector* slope,
          Matrix5* normal) {
  if (over <= 0) return;
  chi_square += over * over / (width * width);
  if (slope != nullptr) {
    (*slope)(index) -= sign * over / (width * width);
    (*normal)(index, index) += 1 / (width * width);
  }
}

/// Standard deviation of a variance that rounding may have made negative.
double sd_of(double variance) {
  return std::sqrt(std::max(variance, 1e-8));
}

std::array<double, 2> log_range(const std::array<double, 2>& range) {
  return {std::log(range[0]), std::log(range[1])};
}

/// Factors of a bump that lies in the patch's middle, to those of one where the fit has it.
Eigen::MatrixXd moved_by(const Patch& patch, const Fit& fit, const Eigen::MatrixXd& factors) {
  if (fit.at(3) == 0 && fit.at(4) == 0) return factors;
  const Eigen::MatrixXd shift = fit.at(3) * patch.along_x + fit.at(4) * patch.along_y;
  const Eigen::MatrixXd once = dense::product(shift, factors);
  return factors - once + 0.5 * dense::product(shift, once);
}

}  // namespace

Eigen::MatrixXd bump_of(const Model& model, const Setting& setting, const std::vector<double>& loads,
                        const Fit& fit, std::array<Eigen::MatrixXd, 5>* changes) {
  const Guess guess{fit.shape, fit.at(0), fit.at(1), fit.at(2)};
  std::array<Eigen::MatrixXd, 3> own;
  Eigen::MatrixXd moved = moved_by(
      model.patch, fit, bump_factors(model, guess, setting, loads, -1, changes != nullptr ? &own : nullptr));
  if (changes != nullptr) {
    for (size_t p = 0; p < 3; ++p) (*changes)[p] = moved_by(model.patch, fit, own[p]);
    (*changes)[3] = dense::product(-model.patch.along_x, moved);
    (*changes)[4] = dense::product(-model.patch.along_y, moved);
  }
  return moved;
}

void add_prior(const Model& model, const Setting& setting, const LumpVector& at, double& sum,
               LumpVector* slope, Matrix5* normal) {
  const std::array<std::array<double, 2>, 3> ranges = {log_range(model.size_mm), log_range(model.depth_mm),
                                                       log_range(model.ratio)};
  for (int p = 0; p < 3; ++p) {
    const auto [low, high] = ranges[static_cast<size_t>(p)];
    const double width = high - low + 0.1, off = at(p) - 0.5 * (low + high);
    sum += off * off / (width * width);
    if (slope != nullptr) {
      (*slope)(p) -= off / (width * width);
      (*normal)(p, p) += 1 / (width * width);
    }
    const double beyond = std::log(kBeyondRange);
    wall(at(p) - high - beyond, 0.03, p, 1, sum, slope, normal);
    wall(low - beyond - at(p), 0.03, p, -1, sum, slope, normal);
  }
  for (int p = 3; p < 5; ++p) {
    sum += at(p) * at(p) / 16;
    if (slope != nullptr) {
      (*slope)(p) -= at(p) / 16;
      (*normal)(p, p) += 1.0 / 16;
    }
  }
  // A lump does not reach through the floor.
  const double size = std::exp(at(0)), depth = std::exp(at(1));
  const double over = size + depth - (setting.thickness_mm - 0.9 * model.floor_mm);
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
}

Eigen::MatrixXd Fitter::factors(const Fit& fit, Eigen::MatrixXd* jacobian) const {
  std::array<Eigen::MatrixXd, 5> changes;
  Eigen::MatrixXd moved =
      bump_of(model_, patch_.view.setting, nodes_.loads, fit, jacobian != nullptr ? &changes : nullptr);
  if (jacobian != nullptr) {
    jacobian->resize(patch_.observation.size(), 5);
    for (size_t p = 0; p < 5; ++p)
      jacobian->col(static_cast<Eigen::Index>(p)) = patch_.of_factors(changes[p]);
  }
  return moved;
}

double Fitter::chi_square(const Fit& fit, LumpVector* slope, Matrix5* normal) const {
  Eigen::MatrixXd jacobian;
  const Eigen::VectorXd rest =
      patch_.observation - patch_.of_factors(factors(fit, slope ? &jacobian : nullptr));
  double sum = rest.squaredNorm();
  if (slope != nullptr) {
    *slope = jacobian.transpose() * rest;
    *normal = dense::product_tn(jacobian, jacobian);
  }
  add_prior(model_, patch_.view.setting, fit.at, sum, slope, normal);
  return sum;
}

void Fitter::search(Fit& fit, uint32_t rounds, bool ratio_held) const {
  damped_search<LumpVector>(
      fit, rounds, ratio_held ? 2 : -1,
      [this](const Fit& at, LumpVector* slope, Matrix5* normal) { return chi_square(at, slope, normal); },
      [](const Matrix5& matrix, const LumpVector& slope) { return dense::solve_ldlt<5>(matrix, slope); },
      [](Fit& at, const LumpVector& step) { at.at += step; });
}

double Posterior::quantile(Parameter what, double fraction) const {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const Part& part : parts) {
    const SplitNormal& normal = part.marginals[what];
    low = std::min(low, normal.middle - 6 * normal.below);
    high = std::max(high, normal.middle + 6 * normal.above);
  }
  for (int step = 0; step < 40; ++step) {
    const double middle = 0.5 * (low + high);
    double below = 0;
    for (const Part& part : parts) below += part.weight * part.marginals[what].cdf(middle);
    (below < fraction ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

namespace {

/// The marginals of one fit: its ratio on a grid, the rest following it.
void add_bells(const Model& model, const Fitter& fitter, const Fit& fit, double temperature,
               std::vector<Posterior::Part>& parts, std::vector<double>& log_weights) {
  const Matrix5 covariance = dense::inverse(fit.normal);
  const auto [low, high] = log_range(model.ratio);
  const double sd = sd_of(temperature * covariance(2, 2));
  const double from = std::max(low, fit.at(2) - std::clamp(3.2 * sd, 0.05, 3.0));
  const double to = std::min(high, fit.at(2) + std::clamp(4 * sd, 0.05, 3.0));
  const double centre = std::clamp(fit.at(2), from, to);
  const double spacing = std::max(1e-3, (to - from) / (kRatios - 1));
  LumpVector along = covariance.col(2) / covariance(2, 2);
  const auto add = [&](const Fit& at) {
    Eigen::Matrix4d rest;
    constexpr std::array<int, 4> kept = {0, 1, 3, 4};
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < 4; ++b)
        rest(a, b) = at.normal(kept[static_cast<size_t>(a)], kept[static_cast<size_t>(b)]);
    const Eigen::Matrix4d inverse = rest.inverse();
    const double volume = std::log(std::max(1e-300, std::abs(inverse.determinant())));
    // A prior even over size and depth. Data sets are now even over their logarithms; intervals are
    // calibrated with this one.
    if (!std::isfinite(volume) || at.chi_square >= kHopeless) return;
    log_weights.push_back(-0.5 * at.chi_square / temperature + 0.5 * volume + std::log(spacing) + at.at(0) +
                          at.at(1));
    Posterior::Part part;
    part.shape = fit.shape;
    const std::array<double, kParameters> sds = {sd_of(temperature * inverse(0, 0)),
                                                 sd_of(temperature * inverse(1, 1)), 0.5 * spacing};
    for (const Parameter p : {kSize, kDepth, kRatio}) part.marginals[p] = {at.at(p), sds[p], sds[p]};
    parts.push_back(part);
  };
  for (const double direction : {1.0, -1.0}) {
    Fit at = fit;
    at.at += (centre - fit.at(2)) * along;
    for (int i = direction > 0 ? 0 : 1; i < kRatios; ++i) {
      const double ratio = centre + direction * spacing * i;
      if (ratio > to + 1e-9 || ratio < from - 1e-9) break;
      at.at += (ratio - at.at(2)) * along;
      at.at(2) = ratio;
      fitter.search(at, 1, true);
      add(at);
      if (at.chi_square > fit.chi_square + 16 * temperature) break;
      // The direction in which size and depth give way for the next ratio.
      const Matrix5 here = dense::inverse(at.normal);
      along = here.col(2) / here(2, 2);
    }
  }
}

/// Fits of each likely shape, by a search that starts from the network's answer.
std::vector<Fit> fits_of(const Model& model, const Fitter& fitter, const Answer& answer, Method method) {
  const auto likeliest =
      static_cast<size_t>(std::max_element(answer.shape_probability.begin(), answer.shape_probability.end()) -
                          answer.shape_probability.begin());
  std::vector<Fit> fits;
  for (size_t s = 0; s < 4; ++s) {
    const bool tried = method == Method::Refined && answer.shape_probability[s] > kUnlikely;
    if (!model.shapes[s] || (s != likeliest && !tried)) continue;
    Fit fit;
    fit.shape = static_cast<InclusionShape>(s);
    for (const Parameter p : {kSize, kDepth, kRatio}) fit.at(p) = answer.marginals[s][p].middle;
    fit.at(3) = answer.shift_mm[0];
    fit.at(4) = answer.shift_mm[1];
    fitter.search(fit, method == Method::Refined ? kRefining : kChecking);
    fits.push_back(fit);
  }
  return fits;
}

/// Residual of an observation with and without the best lump, as the sensor's pattern.
void judge_pattern(const Model& model, const PressedNodes& nodes, const Fitter& fitter, const Fit& best,
                   Inference& found) {
  const PatchErrors& errors = fitter.patch().errors;
  const Eigen::MatrixXd factors = fitter.factors(best);
  Eigen::MatrixXd remainders(errors.observation().size(), 2);
  remainders.col(0) = errors.observation();
  remainders.col(1) = errors.observation() - errors.of_factors(factors);
  const std::vector<PatternSize> sizes = pattern_sizes(errors, nodes, remainders);
  found.plain_pattern = sizes[0].pattern / nodes.peak;
  found.pattern = sizes[1].pattern / nodes.peak;
  found.log_likelihood_ratio = sizes[0].energy - sizes[1].energy;
  const double bump = factors.rightCols(1).norm() / static_cast<double>(model.patch.side) / nodes.peak;
  found.misfit = found.pattern / std::hypot(kLargestPattern, kUnusual * bump);
  const double over_noise = sizes[1].pattern / nodes.noise;
  found.rest = errors.rest() / (1 + over_noise * over_noise);
}

}  // namespace

const Fit& best_of(const std::vector<Fit>& fits) {
  return *std::min_element(fits.begin(), fits.end(),
                           [](const Fit& a, const Fit& b) { return a.chi_square < b.chi_square; });
}

Weighing weigh(const Model& model, const PressedNodes& nodes, Method method) {
  Weighing w{look_for_lump(model, nodes), {}, {}};
  const Fitter fitter(model, nodes, w.look.patch);
  // The pattern that a lump leaves decides how the lump is weighed, and so what it leaves.
  for (int round = 0;; ++round) {
    w.fits = fits_of(model, fitter, w.look.answer, method);
    judge_pattern(model, nodes, fitter, best_of(w.fits), w.found);
    const double pattern = w.found.pattern * nodes.peak;
    if (round == kPatternRounds || std::abs(std::log(pattern / w.look.patch.pattern)) < kSamePattern) break;
    w.look.patch.set_pattern(pattern);
    w.look.answer = answer_of(model, network_features(model, nodes, w.look.patch));
  }
  w.found.chi_square = best_of(w.fits).chi_square /
                       static_cast<double>(std::max<Eigen::Index>(1, w.look.patch.whitener.size() - 5));
  return w;
}

namespace {

Inference weigh_one(const Model& model, const PressedNodes& nodes, Method method, double temperature) {
  Weighing weighing = weigh(model, nodes, method);
  const Look& look = weighing.look;
  const Fitter fitter(model, nodes, look.patch);
  const Answer& answer = look.answer;
  const std::vector<Fit>& fits = weighing.fits;
  Inference& found = weighing.found;
  const Fit& best = best_of(fits);
  std::array<double, 2> shift = answer.shift_mm, sd = answer.shift_sd_mm;
  Posterior& posterior = found.posterior;
  if (method == Method::Network) {
    posterior.shape_probability = answer.shape_probability;
    for (size_t s = 0; s < 4; ++s)
      if (model.shapes[s])
        posterior.parts.push_back(
            {answer.shape_probability[s], static_cast<InclusionShape>(s), answer.marginals[s]});
  } else {
    std::vector<double> log_weights;
    for (const Fit& fit : fits)
      if (fit.chi_square < best.chi_square + kForgiven * temperature)
        add_bells(model, fitter, fit, temperature, posterior.parts, log_weights);
    if (log_weights.empty()) {
      found.log_likelihood_ratio = 0;
      return found;
    }
    const double most = *std::max_element(log_weights.begin(), log_weights.end());
    double sum = 0;
    for (double& weight : log_weights) sum += weight = std::exp(weight - most);
    for (size_t i = 0; i < log_weights.size(); ++i) {
      Posterior::Part& part = posterior.parts[i];
      part.weight = log_weights[i] / sum;
      posterior.shape_probability[static_cast<size_t>(part.shape)] += part.weight;
    }
    const Matrix5 covariance = dense::inverse(best.normal);
    shift = {best.at(3), best.at(4)};
    sd = {sd_of(temperature * covariance(3, 3)), sd_of(temperature * covariance(4, 4))};
  }
  const PatchView& view = look.patch.view;
  found.place_mm = view.place_mm(shift[0], shift[1]);
  for (size_t axis = 0; axis < 2; ++axis) found.place_sd_mm[axis] = sd[view.swapped ? 1 - axis : axis];
  return found;
}

}  // namespace

Inference weigh_lumps(const Model& model, const PressedNodes& nodes, Method method, double temperature) {
  Inference found = weigh_one(model, nodes, method, temperature);
  PressedNodes turned = nodes;
  std::swap(turned.x_mm, turned.y_mm);
  Inference other = weigh_one(model, turned, method, temperature);
  if (found.posterior.parts.empty() || other.posterior.parts.empty()) {
    found.log_likelihood_ratio = 0;
    return found;
  }
  const auto mean = [](double& a, double b) { a = 0.5 * (a + b); };
  for (Posterior::Part& part : found.posterior.parts) part.weight *= 0.5;
  for (Posterior::Part& part : other.posterior.parts) {
    part.weight *= 0.5;
    found.posterior.parts.push_back(part);
  }
  for (size_t s = 0; s < 4; ++s)
    mean(found.posterior.shape_probability[s], other.posterior.shape_probability[s]);
  for (size_t axis = 0; axis < 2; ++axis) {
    mean(found.place_mm[axis], other.place_mm[1 - axis]);
    mean(found.place_sd_mm[axis], other.place_sd_mm[1 - axis]);
  }
  mean(found.log_likelihood_ratio, other.log_likelihood_ratio);
  mean(found.chi_square, other.chi_square);
  mean(found.rest, other.rest);
  mean(found.misfit, other.misfit);
  mean(found.pattern, other.pattern);
  mean(found.plain_pattern, other.plain_pattern);
  return found;
}

}  // namespace palpate::lump
