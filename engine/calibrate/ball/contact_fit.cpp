#include "engine/calibrate/ball/contact_fit.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "engine/base/statistics.h"
#include "engine/numeric/dense.h"

namespace palpate::ball {
namespace {

using Vector4 = Eigen::Vector4d;
using Matrix4 = Eigen::Matrix4d;

constexpr size_t kSamples = 2000;  // pixels that a fit takes

// Slope of the pad over its slope at the rim, at `rho` half widths from the middle: inside that of the shape,
// outside that of a half space under it, falling off faster by `decay` half widths.
double slope_of(const SlopeModel& model, double rho, double radius_px, double decay) {
  double half_space = 0;
  switch (model.kind) {
    case PressedShape::Kind::Ball:  // Hertz
      if (rho <= 1) return rho;
      half_space =
          2 / std::numbers::pi * (rho * std::asin(1 / rho) - std::sqrt(std::max(0.0, 1 - 1 / (rho * rho))));
      break;
    case PressedShape::Kind::Cylinder:  // Hertz
      if (rho <= 1) return rho;
      half_space = rho - std::sqrt(rho * rho - 1);
      break;
    case PressedShape::Kind::Cone:  // Sneddon
      if (rho <= 1) return std::min(1.0, rho * radius_px / std::max(model.tip_px, 1.0));
      half_space = 1 - std::sqrt(1 - 1 / (rho * rho));
      break;
  }
  return half_space * std::exp(-(rho - 1) / decay);
}

// The fit at one set of unknowns: what is linear in it, and what it leaves.
struct Fitted {
  Eigen::Matrix<double, 4, 3> linear;
  Eigen::Matrix<double, Eigen::Dynamic, 3> left;
  double cost = 0;
};

Fitted fit_linear(const SlopeModel& model, const std::vector<Sample>& samples,
                  const std::vector<double>& weights, const Vector4& at) {
  const double radius = std::exp(at[2]), decay = std::exp(at[3]);
  const auto n = static_cast<Eigen::Index>(samples.size());
  Eigen::Matrix<double, Eigen::Dynamic, 4> basis(n, 4);
  Matrix4 gram = Matrix4::Zero();
  Eigen::Matrix<double, 4, 3> right = Eigen::Matrix<double, 4, 3>::Zero();
  for (Eigen::Index i = 0; i < n; ++i) {
    const Sample& s = samples[static_cast<size_t>(i)];
    const Vector4 b = model.basis(model.at(at, s.x, s.y), radius, decay);
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

// Levenberg-Marquardt; the linear part is projected out at each step.
Vector4 minimise(const SlopeModel& model, const std::vector<Sample>& samples,
                 const std::vector<double>& weights, Vector4 at, double largest_px, Fitted& fitted,
                 Matrix4& normal) {
  fitted = fit_linear(model, samples, weights, at);
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
      const Fitted moved = fit_linear(model, samples, weights, other);
      for (Eigen::Index i = 0; i < n; ++i)
        jacobian.block<3, 1>(3 * i, k) = std::sqrt(weights[static_cast<size_t>(i)]) *
                                         (moved.left.row(i) - fitted.left.row(i)).transpose() / steps[k];
    }
    const Matrix4 h = jacobian.transpose() * jacobian;
    normal = h;
    const Vector4 gradient = jacobian.transpose() * residual;
    bool better = false;
    for (int attempt = 0; attempt < 6 && !better; ++attempt, damping *= 5) {
      Matrix4 damped = h;
      damped.diagonal() *= 1 + damping;
      damped.diagonal().array() += 1e-12 * h.trace();
      const Vector4 next = bounded(at - dense::solve_ldlt<4>(damped, gradient), largest_px);
      Fitted tried = fit_linear(model, samples, weights, next);
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
double correlation_factor(const ContactFit& fit, double radius) {
  const double side = std::max(4.0, radius / 3);
  std::map<std::pair<int, int>, std::pair<Eigen::Vector3d, int>> blocks;
  double total = 0;
  for (size_t i = 0; i < fit.samples.size(); ++i) {
    const Eigen::Vector3d left = fit.left.row(static_cast<Eigen::Index>(i)).transpose();
    auto& [sum, count] = blocks
                             .try_emplace({static_cast<int>(fit.samples[i].x / side),
                                           static_cast<int>(fit.samples[i].y / side)},
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

// Mean gray of the untouched contact; never so dark that a ratio to it were noise.
double brightness(const Frame& background, const std::vector<Sample>& samples, const FoundBall& found) {
  constexpr double kDarkest = 4.0 / 255;  // of full scale
  double sum = 0, values = 0;
  for (const Sample& s : samples) {
    if (offset_from(found, s.x, s.y).px > found.radius_px) continue;
    for (uint32_t c = 0; c < 3; ++c)
      sum += background.at(c, static_cast<uint32_t>(s.x), static_cast<uint32_t>(s.y)), ++values;
  }
  return std::max(values > 0 ? sum / values : 0, kDarkest * background.format.max_gray());
}

// Squared change at the contact and elsewhere.
struct Sides {
  double inside2 = 0, outside2 = 0;
};

Sides change_beside(const Change& change, const FoundBall& found, double level2) {
  Sides sides;
  for (int y = 0; y < change.height; ++y)
    for (int x = 0; x < change.width; ++x) {
      const double size2 =
          change.size2[static_cast<size_t>(y) * static_cast<size_t>(change.width) + static_cast<size_t>(x)];
      if (size2 < level2) continue;
      (offset_from(found, x, y).px < 1.8 * found.radius_px ? sides.inside2 : sides.outside2) += size2;
    }
  return sides;
}

}  // namespace

SlopeModel::At SlopeModel::at(const Vector4& unknowns, double x, double y) const {
  if (kind != PressedShape::Kind::Cylinder) {
    const double dx = x - unknowns[0], dy = y - unknowns[1];
    return {dx, dy, std::hypot(dx, dy)};
  }
  const double axis = axis_rad + unknowns[1] / reach_px, ux = std::cos(axis), uy = std::sin(axis);
  const double dx = x - pivot_x_px, dy = y - pivot_y_px, across = dy * ux - dx * uy - unknowns[0];
  return {across, 0, std::abs(across), dx * ux + dy * uy};
}

Vector4 SlopeModel::basis(const At& at, double radius_px, double decay) const {
  const double slope = slope_of(*this, at.r / radius_px, radius_px, decay),
               across = at.r > 0 ? slope / at.r : 1 / radius_px;
  // A light's share changes along a cylinder.
  const double second = kind == PressedShape::Kind::Cylinder ? at.dx * at.along / reach_px : at.dy;
  return {1, at.dx * across, second * across, slope * slope};
}

std::vector<Sample> samples_in(const Frame& frame, const Frame& background, std::span<const uint8_t> mask,
                               const SampleBox& box, const std::function<bool(double, double)>& wanted) {
  const FrameFormat& f = frame.format;
  const auto clamped = [](double v, uint32_t side) {
    return static_cast<uint32_t>(std::clamp(v, 0.0, static_cast<double>(side)));
  };
  const uint32_t x0 = clamped(std::floor(box.x_px - box.reach_x_px), f.width),
                 x1 = clamped(std::ceil(box.x_px + box.reach_x_px), f.width);
  const uint32_t y0 = clamped(std::floor(box.y_px - box.reach_y_px), f.height),
                 y1 = clamped(std::ceil(box.y_px + box.reach_y_px), f.height);
  const double pixels = static_cast<double>(x1 - x0) * (y1 - y0);
  const auto step = static_cast<uint32_t>(std::max(1.0, std::floor(std::sqrt(pixels / kSamples))));
  std::vector<Sample> samples;
  for (uint32_t y = y0; y < y1; y += step)
    for (uint32_t x = x0; x < x1; x += step) {
      if (!mask.empty() && mask[size_t{y} * f.width + x]) continue;
      if (!wanted(x, y)) continue;
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

ContactFit fit_contact(const SlopeModel& model, const Vector4& start, double largest_px,
                       const std::function<std::vector<Sample>(const Vector4&)>& choose) {
  ContactFit fit;
  fit.at = start;
  for (int round = 0; round < 4; ++round) {
    fit.at = bounded(fit.at, largest_px);
    fit.samples = choose(fit.at);
    if (!fit.enough()) break;
    fit.weights.assign(fit.samples.size(), 1.0);
    if (round > 0) fit.weights = robust_weights(fit_linear(model, fit.samples, fit.weights, fit.at));
    Fitted fitted;
    fit.at = minimise(model, fit.samples, fit.weights, fit.at, largest_px, fitted, fit.normal);
    fit.linear = fitted.linear;
    fit.left = std::move(fitted.left);
  }
  return fit;
}

ContactFit fit_round(const Frame& frame, const Frame& background, std::span<const uint8_t> mask,
                     const SlopeModel& model, const Vector4& start, double most_px) {
  const double largest_px = 0.75 * std::min(frame.format.width, frame.format.height);
  return fit_contact(model, start, std::min(largest_px, most_px), [&](const Vector4& at) {
    const double reach = std::min(kWindow * std::exp(at[2]), most_px);
    return samples_in(frame, background, mask, {at[0], at[1], reach, reach},
                      [&](double x, double y) { return std::hypot(x - at[0], y - at[1]) <= reach; });
  });
}

void judge_fit(const ContactFit& b, const SlopeModel& model, const Frame& background, FoundBall& found) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Sample& s : b.samples) mean += s.change / static_cast<double>(b.samples.size());
  double spread = 0, left = 0, weight = 0;
  for (size_t i = 0; i < b.samples.size(); ++i) {
    spread += b.weights[i] * (b.samples[i].change - mean).squaredNorm();
    left += b.weights[i] * b.left.row(static_cast<Eigen::Index>(i)).squaredNorm();
    weight += b.weights[i];
  }
  found.explained = spread > 0 ? 1 - left / spread : 0;
  const auto& linear = b.linear;
  const bool round = model.kind != PressedShape::Kind::Cylinder;
  const double second = round ? linear.row(2).squaredNorm() : linear.row(1).squaredNorm();
  // A cone is as steep at any width.
  const double wide_px = model.kind == PressedShape::Kind::Cone ? 1 : found.radius_px;
  found.ramp_per_px =
      std::sqrt(linear.row(1).squaredNorm() + second) / (wide_px * brightness(background, b.samples, found));
  const double per_value = left / (3 * weight - 16), factor = correlation_factor(b, found.radius_px);
  const Matrix4 covariance = Matrix4(dense::Ldlt(b.normal).solve(Eigen::MatrixXd(Matrix4::Identity()))) *
                             per_value * factor * factor;
  const double center2 = round ? 0.5 * (covariance(0, 0) + covariance(1, 1)) : covariance(0, 0);
  found.center_sd_px = std::sqrt(std::max(0.0, center2));
  found.radius_sd_px = found.radius_px * std::sqrt(std::max(0.0, covariance(2, 2)));
}

PressedPicture pressed_picture(const Frame& frame, const Frame& background, std::span<const uint8_t> mask,
                               const BallSearch& search) {
  check_pair(frame, background, 3, mask);
  PressedPicture picture{.change = change_of(frame, background, mask), .found = {}};
  std::vector<double> sizes;
  for (size_t i = 0; i < picture.change.size2.size(); i += 7)
    sizes.push_back(std::sqrt(picture.change.size2[i]));
  const double noise = median(sizes), scale = frame.format.max_gray() / 255.0;
  std::sort(sizes.begin(), sizes.end());
  const double peak = sizes[sizes.size() - 1 - sizes.size() / 1000];
  picture.level2 = std::pow(std::max(0.35 * peak, 2.5 * noise), 2);
  if (peak < std::max({4 * noise, search.threshold_gray, 4 * scale}))
    picture.found.refuse(BallRefusal::Untouched, "nothing is pressed: the image changes by " + tenths(peak) +
                                                     " gray at most, by " + tenths(noise) + " all over");
  return picture;
}

void check_fit(FoundBall& found, const Change& change, double level2, const Frame& frame,
               const Frame& background, std::span<const uint8_t> mask, const BallSearch& search) {
  const auto [inside2, outside2] = change_beside(change, found, level2);
  check_coverage(found, frame, background, mask);
  if (!found.good()) return;
  const std::string name = name_of(search.shape.kind);
  if (outside2 > kSecondContact * inside2)
    found.refuse(BallRefusal::MoreThanOne,
                 "something else is pressed too: " + percent(outside2 / (inside2 + outside2)) +
                     " of the change lies beside the " + name);
  else if (found.explained < kLeastExplained)
    found.refuse(BallRefusal::MoreThanOne,
                 "a " + name + " explains only " + percent(found.explained) + " of the change");
  else
    check_contact(found, frame.format, search);
}

}  // namespace palpate::ball
