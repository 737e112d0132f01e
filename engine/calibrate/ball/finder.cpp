#include "engine/calibrate/ball/finder.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "engine/base/statistics.h"
#include "engine/numeric/dense.h"

namespace palpate {
namespace {

using ball::Change, ball::percent, ball::tenths, ball::kLeastExplained, ball::kLeastRadius_px,
    ball::kSecondContact;
using Vector4 = Eigen::Vector4d;
using Matrix4 = Eigen::Matrix4d;

constexpr double kWindow = 2.2;    // radii around the centre that the fit looks at
constexpr size_t kSamples = 2000;  // pixels of them that it takes

// Slope of the pad over its slope at the rim, at `rho` contact radii from the centre: linear inside, outside
// that of a half space under a ball (Hertz), falling off faster by `decay` radii.
double radial_slope(double rho, double decay) {
  if (rho <= 1) return rho;
  const double half_space =
      2 / std::numbers::pi * (rho * std::asin(1 / rho) - std::sqrt(std::max(0.0, 1 - 1 / (rho * rho))));
  return half_space * std::exp(-(rho - 1) / decay);
}

struct Sample {
  double x, y;
  Eigen::Vector3d change;
};

// The fit at one set of centre x, y, log radius, log decay: what is linear in it, and what it leaves.
struct Fitted {
  Eigen::Matrix<double, 4, 3> linear;             // rows: constant, n_x, n_y, 1 - n_z
  Eigen::Matrix<double, Eigen::Dynamic, 3> left;  // residuals, not weighted
  double cost = 0;
};

Fitted fit_linear(const std::vector<Sample>& samples, const std::vector<double>& weights, const Vector4& at) {
  const double radius = std::exp(at[2]), decay = std::exp(at[3]);
  const auto n = static_cast<Eigen::Index>(samples.size());
  Eigen::Matrix<double, Eigen::Dynamic, 4> basis(n, 4);
  Matrix4 gram = Matrix4::Zero();
  Eigen::Matrix<double, 4, 3> right = Eigen::Matrix<double, 4, 3>::Zero();
  for (Eigen::Index i = 0; i < n; ++i) {
    const Sample& s = samples[static_cast<size_t>(i)];
    const double dx = s.x - at[0], dy = s.y - at[1], r = std::hypot(dx, dy);
    const double slope = radial_slope(r / radius, decay), across = r > 0 ? slope / r : 1 / radius;
    const Vector4 b(1, dx * across, dy * across, slope * slope);
    basis.row(i) = b.transpose();
    const double w = weights[static_cast<size_t>(i)];
    gram += w * b * b.transpose();
    right += w * b * s.change.transpose();
  }
  gram.diagonal().array() *= 1 + 1e-9;
  Fitted f;
  f.linear = dense::Ldlt(gram).solve(Eigen::MatrixXd(right));
  f.left.resize(n, 3);
  for (Eigen::Index i = 0; i < n; ++i) {
    f.left.row(i) = samples[static_cast<size_t>(i)].change.transpose() - basis.row(i) * f.linear;
    f.cost += weights[static_cast<size_t>(i)] * f.left.row(i).squaredNorm();
  }
  return f;
}

Vector4 bounded(Vector4 at, double largest_px) {
  at[2] = std::clamp(at[2], std::log(kLeastRadius_px / 2), std::log(largest_px));
  at[3] = std::clamp(at[3], std::log(0.03), std::log(10.0));
  return at;
}

// Levenberg-Marquardt over centre, radius and decay; the linear part is projected out at each step.
Vector4 minimise(const std::vector<Sample>& samples, const std::vector<double>& weights, Vector4 at,
                 double largest_px, Fitted& fitted, Matrix4* normal = nullptr) {
  fitted = fit_linear(samples, weights, at);
  const auto n = static_cast<Eigen::Index>(samples.size());
  double damping = 1e-3;
  for (int iteration = 0; iteration < 40; ++iteration) {
    Eigen::Matrix<double, Eigen::Dynamic, 4> jacobian(3 * n, 4);
    Eigen::VectorXd residual(3 * n);
    for (Eigen::Index i = 0; i < n; ++i)
      residual.segment<3>(3 * i) =
          std::sqrt(weights[static_cast<size_t>(i)]) * fitted.left.row(i).transpose();
    const Vector4 steps(0.02, 0.02, 1e-3, 1e-2);
    for (int k = 0; k < 4; ++k) {
      Vector4 other = at;
      other[k] += steps[k];
      const Fitted moved = fit_linear(samples, weights, other);
      for (Eigen::Index i = 0; i < n; ++i)
        jacobian.block<3, 1>(3 * i, k) = std::sqrt(weights[static_cast<size_t>(i)]) *
                                         (moved.left.row(i) - fitted.left.row(i)).transpose() / steps[k];
    }
    const Matrix4 h = jacobian.transpose() * jacobian;
    if (normal) *normal = h;
    const Vector4 gradient = jacobian.transpose() * residual;
    bool better = false;
    for (int attempt = 0; attempt < 6 && !better; ++attempt, damping *= 5) {
      Matrix4 damped = h;
      damped.diagonal() *= 1 + damping;
      damped.diagonal().array() += 1e-12 * h.trace();
      const Vector4 next = bounded(at - dense::solve_ldlt<4>(damped, gradient), largest_px);
      Fitted tried = fit_linear(samples, weights, next);
      if (tried.cost < fitted.cost) {
        const bool settled = fitted.cost - tried.cost < 1e-7 * fitted.cost && (next - at).norm() < 1e-3;
        at = next;
        fitted = std::move(tried);
        better = !settled;
        damping = std::max(damping / 25, 1e-9);
      }
    }
    if (!better) break;
  }
  return at;
}

std::vector<Sample> samples_around(const Frame& frame, const Frame& background, std::span<const uint8_t> mask,
                                   double cx, double cy, double radius) {
  const FrameFormat& f = frame.format;
  const double reach = kWindow * radius;
  const auto clamped = [](double v, uint32_t side) {
    return static_cast<uint32_t>(std::clamp(v, 0.0, static_cast<double>(side)));
  };
  const uint32_t x0 = clamped(std::floor(cx - reach), f.width), x1 = clamped(std::ceil(cx + reach), f.width);
  const uint32_t y0 = clamped(std::floor(cy - reach), f.height),
                 y1 = clamped(std::ceil(cy + reach), f.height);
  const double pixels = static_cast<double>(x1 - x0) * (y1 - y0);
  const auto step = static_cast<uint32_t>(std::max(1.0, std::floor(std::sqrt(pixels / kSamples))));
  std::vector<Sample> samples;
  for (uint32_t y = y0; y < y1; y += step)
    for (uint32_t x = x0; x < x1; x += step) {
      if (!mask.empty() && mask[size_t{y} * f.width + x]) continue;
      if (std::hypot(x - cx, y - cy) > reach) continue;
      Sample s{static_cast<double>(x), static_cast<double>(y), {}};
      bool full = false;
      for (uint32_t c = 0; c < 3; ++c) {
        const uint32_t a = frame.at(c, x, y), b = background.at(c, x, y);
        full = full || a >= f.max_gray() || b >= f.max_gray();
        s.change[c] = static_cast<double>(a) - static_cast<double>(b);
      }
      if (!full) samples.push_back(s);
    }
  return samples;
}

// Huber's weights from the residuals' own scale.
std::vector<double> robust_weights(const Fitted& fitted) {
  std::vector<double> sizes(static_cast<size_t>(fitted.left.rows()));
  for (size_t i = 0; i < sizes.size(); ++i) sizes[i] = fitted.left.row(static_cast<Eigen::Index>(i)).norm();
  const double limit = std::max(2 * median(sizes), 1e-6);
  std::vector<double> weights(sizes.size());
  for (size_t i = 0; i < sizes.size(); ++i) weights[i] = sizes[i] > limit ? limit / sizes[i] : 1;
  return weights;
}

// How much wider a standard error is than for independent residuals: neighbours err alike.
double correlation_factor(const std::vector<Sample>& samples, const Fitted& fitted, double radius) {
  const double side = std::max(4.0, radius / 3);
  std::map<std::pair<int, int>, std::pair<Eigen::Vector3d, int>> blocks;
  double total = 0;
  for (size_t i = 0; i < samples.size(); ++i) {
    const Eigen::Vector3d left = fitted.left.row(static_cast<Eigen::Index>(i)).transpose();
    auto& [sum, count] =
        blocks
            .try_emplace({static_cast<int>(samples[i].x / side), static_cast<int>(samples[i].y / side)},
                         Eigen::Vector3d::Zero(), 0)
            .first->second;
    sum += left;
    ++count;
    total += left.squaredNorm();
  }
  double between = 0;
  for (const auto& [place, block] : blocks) between += block.first.squaredNorm();
  return total > 0 ? std::sqrt(std::max(1.0, between / total)) : 1;
}

// How much a picture changes.
struct ChangeLevels {
  double noise = 0, peak = 0;

  explicit ChangeLevels(const Change& change) {
    std::vector<double> sizes;
    for (size_t i = 0; i < change.size2.size(); i += 7) sizes.push_back(std::sqrt(change.size2[i]));
    noise = median(sizes);
    std::sort(sizes.begin(), sizes.end());
    peak = sizes[sizes.size() - 1 - sizes.size() / 1000];
  }
  // Squared change above which a pixel counts.
  double strong2() const { return std::pow(std::max(0.35 * peak, 2.5 * noise), 2); }
};

// Coarse: the middle of what changes by a good part of the most that changes.
Vector4 coarse_start(const Change& change, uint32_t width, double level2) {
  std::vector<double> xs, ys;
  for (int y = 0; y < change.height; ++y)
    for (int x = 0; x < change.width; ++x)
      if (change.size2[static_cast<size_t>(y) * width + static_cast<size_t>(x)] > level2) {
        xs.push_back(x);
        ys.push_back(y);
      }
  const double area = static_cast<double>(xs.size());
  return {median(xs), median(ys),
          std::log(std::max(kLeastRadius_px, 1.05 * std::sqrt(area / std::numbers::pi))), std::log(0.5)};
}

// The model fitted to the pixels around the ball, which are chosen anew from round to round.
struct BallFit {
  Vector4 at;  // centre x, y, log radius, log decay
  Fitted fitted;
  Matrix4 normal = Matrix4::Identity();
  std::vector<Sample> samples;
  std::vector<double> weights;

  bool enough() const { return samples.size() >= 60; }
};

BallFit fit_ball(const Frame& frame, const Frame& background, std::span<const uint8_t> mask,
                 const Vector4& start) {
  const double largest_px = 0.75 * std::min(frame.format.width, frame.format.height);
  BallFit b;
  b.at = start;
  for (int round = 0; round < 4; ++round) {
    b.at = bounded(b.at, largest_px);
    b.samples = samples_around(frame, background, mask, b.at[0], b.at[1], std::exp(b.at[2]));
    if (!b.enough()) break;
    b.weights.assign(b.samples.size(), 1.0);
    if (round > 0) b.weights = robust_weights(fit_linear(b.samples, b.weights, b.at));
    b.at = minimise(b.samples, b.weights, b.at, largest_px, b.fitted, &b.normal);
  }
  return b;
}

// Mean gray of the untouched contact; never so dark that a ratio to it were noise.
double brightness(const Frame& background, const std::vector<Sample>& samples, const FoundBall& found) {
  constexpr double kDarkest = 4.0 / 255;  // of full scale
  double sum = 0, values = 0;
  for (const Sample& s : samples) {
    if (std::hypot(s.x - found.center_x_px, s.y - found.center_y_px) > found.radius_px) continue;
    for (uint32_t c = 0; c < 3; ++c)
      sum += background.at(c, static_cast<uint32_t>(s.x), static_cast<uint32_t>(s.y)), ++values;
  }
  return std::max(values > 0 ? sum / values : 0, kDarkest * background.format.max_gray());
}

// Fills what the model leaves of the change, and the standard errors that follow from it.
void judge_fit(const BallFit& b, const Frame& background, FoundBall& found) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Sample& s : b.samples) mean += s.change / static_cast<double>(b.samples.size());
  double spread = 0, left = 0, weight = 0;
  for (size_t i = 0; i < b.samples.size(); ++i) {
    spread += b.weights[i] * (b.samples[i].change - mean).squaredNorm();
    left += b.weights[i] * b.fitted.left.row(static_cast<Eigen::Index>(i)).squaredNorm();
    weight += b.weights[i];
  }
  found.explained = spread > 0 ? 1 - left / spread : 0;
  const auto& linear = b.fitted.linear;
  found.ramp_per_px = std::sqrt(linear.row(1).squaredNorm() + linear.row(2).squaredNorm()) /
                      (found.radius_px * brightness(background, b.samples, found));
  const double per_value = left / (3 * weight - 16),
               factor = correlation_factor(b.samples, b.fitted, found.radius_px);
  const Matrix4 covariance = Matrix4(dense::Ldlt(b.normal).solve(Eigen::MatrixXd(Matrix4::Identity()))) *
                             per_value * factor * factor;
  found.center_sd_px = std::sqrt(std::max(0.0, 0.5 * (covariance(0, 0) + covariance(1, 1))));
  found.radius_sd_px = found.radius_px * std::sqrt(std::max(0.0, covariance(2, 2)));
}

// Squared change at the ball and beside it.
struct Sides {
  double inside2 = 0, outside2 = 0;
};

Sides change_beside(const Change& change, uint32_t width, const FoundBall& found, double level2) {
  Sides sides;
  for (int y = 0; y < change.height; ++y)
    for (int x = 0; x < change.width; ++x) {
      const double size2 = change.size2[static_cast<size_t>(y) * width + static_cast<size_t>(x)];
      if (size2 < level2) continue;
      (std::hypot(x - found.center_x_px, y - found.center_y_px) < 1.8 * found.radius_px ? sides.inside2
                                                                                        : sides.outside2) +=
          size2;
    }
  return sides;
}

}  // namespace

FoundBall find_ball(const Frame& frame, const Frame& background, std::span<const uint8_t> mask,
                    const BallSearch& search) {
  ball::check_pair(frame, background, 3, mask);
  const FrameFormat& f = frame.format;
  const Change change = ball::change_of(frame, background, mask);
  FoundBall found;
  const ChangeLevels levels(change);
  const double scale = f.max_gray() / 255.0;
  if (levels.peak < std::max({4 * levels.noise, search.threshold_gray, 4 * scale})) {
    found.refuse(BallRefusal::Untouched, "nothing is pressed: the image changes by " + tenths(levels.peak) +
                                             " gray at most, by " + tenths(levels.noise) + " all over");
    return found;
  }
  const double level2 = levels.strong2();
  const BallFit fit = fit_ball(frame, background, mask, coarse_start(change, f.width, level2));
  found.center_x_px = fit.at[0];
  found.center_y_px = fit.at[1];
  found.radius_px = std::exp(fit.at[2]);
  if (!fit.enough()) {
    ball::check_coverage(found, frame, background, mask);
    if (found.good()) found.refuse(BallRefusal::TooSmall, "too few pixels change around it");
    return found;
  }
  judge_fit(fit, background, found);
  const auto [inside2, outside2] = change_beside(change, f.width, found, level2);
  ball::check_coverage(found, frame, background, mask);
  if (!found.good()) return found;
  if (outside2 > kSecondContact * inside2)
    found.refuse(BallRefusal::MoreThanOne,
                 "something else is pressed too: " + percent(outside2 / (inside2 + outside2)) +
                     " of the change lies beside the ball");
  else if (found.explained < kLeastExplained)
    found.refuse(BallRefusal::MoreThanOne,
                 "a ball explains only " + percent(found.explained) + " of the change");
  else
    ball::check_circle(found, f, search);
  return found;
}

}  // namespace palpate
