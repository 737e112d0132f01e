#include "engine/solve/ball_finder.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "engine/error.h"

namespace palpate {
namespace {

using Vector4 = Eigen::Vector4d;
using Matrix4 = Eigen::Matrix4d;

constexpr double kWindow = 2.2;           // radii around the centre that the fit looks at
constexpr size_t kSamples = 2000;         // pixels of them that it takes
constexpr double kLeastExplained = 0.75;  // of the change in the window
constexpr double kSecondContact = 0.25;   // change outside over the ball's own, both summed squares
constexpr double kLargestContact = 0.98;  // contact over ball radius
constexpr double kLeastRadius_px = 4;
constexpr double kLeastSeen = 0.5;  // of the contact, neither masked nor black nor saturated: as a fit wants

double median_of(std::vector<double> v) {
  if (v.empty()) return 0;
  const auto middle = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
  std::nth_element(v.begin(), middle, v.end());
  return *middle;
}

// The change of a frame from the background, box means of 5 x 5 pixels that leave out what is masked.
struct Change {
  int width = 0, height = 0;
  std::array<std::vector<float>, 3> smooth;  // per channel; 0 where nothing is known
  std::vector<float> size2;                  // squared length over the channels
  uint32_t channels = 0;
};

Change change_of(const Frame& frame, const Frame& background, std::span<const uint8_t> mask) {
  const FrameFormat& f = frame.format;
  Change change;
  change.width = static_cast<int>(f.width);
  change.height = static_cast<int>(f.height);
  change.channels = f.channels;
  const size_t w = f.width, h = f.height;
  change.size2.assign(w * h, 0);
  constexpr size_t kReach = 2;
  std::vector<double> sums((w + 1) * (h + 1)), counts((w + 1) * (h + 1));
  for (uint32_t c = 0; c < f.channels; ++c) {
    change.smooth[c].assign(w * h, 0);
    for (size_t y = 0; y < h; ++y) {
      double row = 0, n = 0;
      for (size_t x = 0; x < w; ++x) {
        if (mask.empty() || !mask[y * w + x]) {
          const auto u = static_cast<uint32_t>(x), v = static_cast<uint32_t>(y);
          row += static_cast<double>(frame.at(c, u, v)) - static_cast<double>(background.at(c, u, v));
          n += 1;
        }
        sums[(y + 1) * (w + 1) + x + 1] = sums[y * (w + 1) + x + 1] + row;
        counts[(y + 1) * (w + 1) + x + 1] = counts[y * (w + 1) + x + 1] + n;
      }
    }
    for (size_t y = 0; y < h; ++y)
      for (size_t x = 0; x < w; ++x) {
        const size_t x0 = x >= kReach ? x - kReach : 0, x1 = std::min(w, x + kReach + 1);
        const size_t y0 = y >= kReach ? y - kReach : 0, y1 = std::min(h, y + kReach + 1);
        const auto box = [&](const std::vector<double>& t) {
          return t[y1 * (w + 1) + x1] - t[y0 * (w + 1) + x1] - t[y1 * (w + 1) + x0] + t[y0 * (w + 1) + x0];
        };
        const double n = box(counts);
        const auto mean = static_cast<float>(n > 0 ? box(sums) / n : 0);
        change.smooth[c][y * w + x] = mean;
        change.size2[y * w + x] += mean * mean;
      }
  }
  return change;
}

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
  f.linear = gram.ldlt().solve(right);
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
      const Vector4 next = bounded(at - damped.ldlt().solve(gradient), largest_px);
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
  const double limit = std::max(2 * median_of(sizes), 1e-6);
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

std::string percent(double share) {
  return std::to_string(static_cast<int>(std::lround(100 * share))) + " %";
}
std::string tenths(double value) {
  std::string text = std::to_string(std::round(value * 10) / 10);
  return text.substr(0, text.find('.') + 2);
}

void check_pair(const Frame& frame, const Frame& background, uint32_t channels,
                std::span<const uint8_t> mask) {
  if (!(frame.format == background.format) || frame.format.channels != channels)
    throw Error(Failure::Input,
                "a press and an untouched image of one format, " + std::to_string(channels) + " channels",
                std::to_string(frame.format.channels) + " and " + std::to_string(background.format.channels) +
                    " channels, or other sizes",
                "images of the same camera and sensor file");
  if (!mask.empty() && mask.size() != size_t{frame.format.width} * frame.format.height)
    throw Error(Failure::Input, "a mask of the frame's size", std::to_string(mask.size()) + " values",
                "one value for each pixel");
}

/// What both kinds of gel ask of a circle.
std::string circle_refusal(const FoundBall& ball, const FrameFormat& format, const BallSearch& search) {
  if (ball.radius_px < kLeastRadius_px)
    return "a contact of " + tenths(ball.radius_px) + " px radius is too small to measure";
  const double left = ball.center_x_px - ball.radius_px, top = ball.center_y_px - ball.radius_px;
  if (left < 1 || top < 1 || ball.center_x_px + ball.radius_px > format.width - 2.0 ||
      ball.center_y_px + ball.radius_px > format.height - 2.0)
    return "the contact reaches the frame's border";
  const double contact_mm = ball.radius_px * search.pitch_mm_per_px;
  if (contact_mm > kLargestContact * search.ball_radius_mm)
    return "a contact of " + std::to_string(contact_mm) + " mm radius does not fit a ball of " +
           std::to_string(search.ball_radius_mm) + " mm: its radius or the sensor's pitch is wrong";
  return {};
}

/// Why too little of a contact can be used; empty: enough can.
std::string coverage_refusal(const FoundBall& ball, const Frame& frame, const Frame& background,
                             std::span<const uint8_t> mask) {
  const FrameFormat& f = frame.format;
  double inside = 0, masked = 0, extreme = 0;
  for (uint32_t y = 0; y < f.height; ++y)
    for (uint32_t x = 0; x < f.width; ++x) {
      if (std::hypot(x - ball.center_x_px, y - ball.center_y_px) >= ball.radius_px) continue;
      inside += 1;
      if (!mask.empty() && mask[size_t{y} * f.width + x]) {
        masked += 1;
        continue;
      }
      bool out = false;
      for (uint32_t c = 0; c < f.channels; ++c)
        for (const Frame* image : {&frame, &background})
          out = out || image->at(c, x, y) == 0 || image->at(c, x, y) >= f.max_gray();
      extreme += out;
    }
  const double disc_px = std::numbers::pi * ball.radius_px * ball.radius_px;
  if (inside - masked - extreme >= kLeastSeen * disc_px) return {};
  return percent(extreme / std::max(inside, 1.0)) + " of the contact is saturated or black, " +
         percent(masked / std::max(inside, 1.0)) + " covered by markers";
}

}  // namespace

FoundBall find_ball(const Frame& frame, const Frame& background, std::span<const uint8_t> mask,
                    const BallSearch& search) {
  check_pair(frame, background, 3, mask);
  const FrameFormat& f = frame.format;
  const Change change = change_of(frame, background, mask);
  FoundBall ball;

  // Coarse: the middle of what changes by a good part of the most that changes.
  std::vector<double> sizes;
  for (size_t i = 0; i < change.size2.size(); i += 7) sizes.push_back(std::sqrt(change.size2[i]));
  const double noise = median_of(sizes);
  std::sort(sizes.begin(), sizes.end());
  const double peak = sizes[sizes.size() - 1 - sizes.size() / 1000];
  const double scale = f.max_gray() / 255.0;
  if (peak < std::max({4 * noise, search.threshold_gray, 4 * scale})) {
    ball.refusal = "nothing is pressed: the image changes by " + tenths(peak) + " gray at most, by " +
                   tenths(noise) + " all over";
    return ball;
  }
  const double level2 = std::pow(std::max(0.35 * peak, 2.5 * noise), 2);
  std::vector<double> xs, ys;
  for (int y = 0; y < change.height; ++y)
    for (int x = 0; x < change.width; ++x)
      if (change.size2[static_cast<size_t>(y) * f.width + static_cast<size_t>(x)] > level2) {
        xs.push_back(x);
        ys.push_back(y);
      }
  const double area = static_cast<double>(xs.size());
  Vector4 start(median_of(xs), median_of(ys),
                std::log(std::max(kLeastRadius_px, 1.05 * std::sqrt(area / std::numbers::pi))),
                std::log(0.5));
  const double largest_px = 0.75 * std::min(f.width, f.height);

  Fitted fitted;
  Matrix4 normal = Matrix4::Identity();
  std::vector<Sample> samples;
  std::vector<double> weights;
  for (int round = 0; round < 4; ++round) {
    start = bounded(start, largest_px);
    samples = samples_around(frame, background, mask, start[0], start[1], std::exp(start[2]));
    if (samples.size() < 60) break;
    weights.assign(samples.size(), 1.0);
    if (round > 0) weights = robust_weights(fit_linear(samples, weights, start));
    start = minimise(samples, weights, start, largest_px, fitted, &normal);
  }
  ball.center_x_px = start[0];
  ball.center_y_px = start[1];
  ball.radius_px = std::exp(start[2]);
  if (samples.size() < 60) {
    ball.refusal = coverage_refusal(ball, frame, background, mask);
    if (ball.refusal.empty()) ball.refusal = "too few pixels change around it";
    return ball;
  }

  // What the model leaves of the change, and what changes elsewhere.
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Sample& s : samples) mean += s.change / static_cast<double>(samples.size());
  double spread = 0, left = 0, weight = 0;
  for (size_t i = 0; i < samples.size(); ++i) {
    spread += weights[i] * (samples[i].change - mean).squaredNorm();
    left += weights[i] * fitted.left.row(static_cast<Eigen::Index>(i)).squaredNorm();
    weight += weights[i];
  }
  ball.explained = spread > 0 ? 1 - left / spread : 0;
  ball.ramp_gray_per_px =
      std::sqrt(fitted.linear.row(1).squaredNorm() + fitted.linear.row(2).squaredNorm()) / ball.radius_px;
  const double per_value = left / (3 * weight - 16),
               factor = correlation_factor(samples, fitted, ball.radius_px);
  const Matrix4 covariance = normal.ldlt().solve(Matrix4::Identity()) * per_value * factor * factor;
  ball.center_sd_px = std::sqrt(std::max(0.0, 0.5 * (covariance(0, 0) + covariance(1, 1))));
  ball.radius_sd_px = ball.radius_px * std::sqrt(std::max(0.0, covariance(2, 2)));

  double inside2 = 0, outside2 = 0;
  for (int y = 0; y < change.height; ++y)
    for (int x = 0; x < change.width; ++x) {
      const double size2 = change.size2[static_cast<size_t>(y) * f.width + static_cast<size_t>(x)];
      if (size2 < level2) continue;
      (std::hypot(x - start[0], y - start[1]) < 1.8 * ball.radius_px ? inside2 : outside2) += size2;
    }
  ball.refusal = coverage_refusal(ball, frame, background, mask);
  if (!ball.refusal.empty()) return ball;
  if (outside2 > kSecondContact * inside2)
    ball.refusal = "something else is pressed too: " + percent(outside2 / (inside2 + outside2)) +
                   " of the change lies beside the ball";
  else if (ball.explained < kLeastExplained)
    ball.refusal = "a ball explains only " + percent(ball.explained) + " of the change";
  else
    ball.refusal = circle_refusal(ball, f, search);
  return ball;
}

FoundBall find_gray_ball(const Frame& frame, const Frame& background, std::span<const uint8_t> mask,
                         Signal signal, const BallSearch& search) {
  check_pair(frame, background, 1, mask);
  const FrameFormat& f = frame.format;
  const Change change = change_of(frame, background, mask);
  const float sign = signal == Signal::Darker ? -1.0f : 1.0f;
  FoundBall ball;
  std::vector<double> all;
  for (size_t i = 0; i < change.size2.size(); i += 7) all.push_back(std::abs(change.smooth[0][i]));
  const double noise = median_of(all);
  double peak = 0, sum = 0, sum_x = 0, sum_y = 0;
  for (const float v : change.smooth[0]) peak = std::max(peak, static_cast<double>(sign * v));
  const double level = std::max({search.threshold_gray, 3 * noise, 0.04 * peak});
  if (peak < 4 * level) {
    ball.refusal = "nothing is pressed: the image changes by " + tenths(peak) + " gray at most, by " +
                   tenths(noise) + " all over";
    return ball;
  }
  double area = 0;
  for (int y = 0; y < change.height; ++y)
    for (int x = 0; x < change.width; ++x) {
      const double v = sign * change.smooth[0][static_cast<size_t>(y) * f.width + static_cast<size_t>(x)];
      if (v < 0.5 * peak) continue;
      sum += v;
      sum_x += v * x;
      sum_y += v * y;
      area += 1;
    }
  double cx = sum_x / sum, cy = sum_y / sum;
  const auto at = [&](double x, double y) {
    const double u = std::clamp(x, 0.0, f.width - 1.001), v = std::clamp(y, 0.0, f.height - 1.001);
    const auto i = static_cast<size_t>(u), j = static_cast<size_t>(v);
    const double a = u - static_cast<double>(i), b = v - static_cast<double>(j);
    const auto p = [&](size_t m, size_t n) { return static_cast<double>(change.smooth[0][n * f.width + m]); };
    return sign * ((1 - b) * ((1 - a) * p(i, j) + a * p(i + 1, j)) +
                   b * ((1 - a) * p(i, j + 1) + a * p(i + 1, j + 1)));
  };

  // Along each ray, where the change first falls below the level outside of the strong part.
  constexpr int kRays = 180;
  std::vector<std::pair<double, double>> rim;
  int open = 0;
  for (int k = 0; k < kRays; ++k) {
    const double a = 2 * std::numbers::pi * k / kRays, dx = std::cos(a), dy = std::sin(a);
    double before = at(cx, cy);
    for (double r = 1;; r += 1) {
      const double x = cx + r * dx, y = cy + r * dy;
      if (x < 1 || y < 1 || x > f.width - 2.0 || y > f.height - 2.0) {
        ++open;
        break;
      }
      const double here = at(x, y);
      if (here < level && before >= level) {
        const double back = (level - here) / (before - here);
        rim.emplace_back(cx + (r - back) * dx, cy + (r - back) * dy);
        break;
      }
      before = here;
    }
  }
  ball.center_x_px = cx;
  ball.center_y_px = cy;
  ball.radius_px = std::sqrt(area / std::numbers::pi);
  if (open > kRays / 20 || rim.size() < 20) {
    ball.refusal = "the contact reaches the frame's border";
    return ball;
  }
  // Circle by Gauss-Newton on distances, Huber's weights.
  double radius = ball.radius_px, scale_px = 0;
  Eigen::Matrix3d normal;
  for (int iteration = 0; iteration < 30; ++iteration) {
    std::vector<double> errors;
    for (const auto& [x, y] : rim) errors.push_back(std::abs(std::hypot(x - cx, y - cy) - radius));
    scale_px = std::max(1.4826 * median_of(errors), 0.02);
    normal.setZero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (const auto& [x, y] : rim) {
      const double r = std::max(std::hypot(x - cx, y - cy), 1e-6), error = r - radius;
      const double w = std::abs(error) > 1.5 * scale_px ? 1.5 * scale_px / std::abs(error) : 1;
      const Eigen::Vector3d j((x - cx) / r, (y - cy) / r, 1);
      normal += w * j * j.transpose();
      right += w * error * j;
    }
    const Eigen::Vector3d step = normal.ldlt().solve(right);
    cx += step[0];
    cy += step[1];
    radius += step[2];
    if (step.norm() < 1e-6) break;
  }
  ball.center_x_px = cx;
  ball.center_y_px = cy;
  ball.radius_px = radius;
  // The rays' errors go in waves of about a dozen rays.
  const Eigen::Matrix3d covariance = normal.inverse() * (12 * scale_px * scale_px);
  ball.center_sd_px = std::sqrt(0.5 * (covariance(0, 0) + covariance(1, 1)));
  ball.radius_sd_px = std::sqrt(covariance(2, 2));

  // A ball's change depends on the distance from its centre alone.
  std::vector<double> ring_sum(static_cast<size_t>(radius) + 2), ring_count(ring_sum.size());
  const auto each = [&](const auto& visit) {
    for (int y = std::max(0, static_cast<int>(cy - radius));
         y <= std::min(change.height - 1, static_cast<int>(cy + radius)); ++y)
      for (int x = std::max(0, static_cast<int>(cx - radius));
           x <= std::min(change.width - 1, static_cast<int>(cx + radius)); ++x) {
        const double r = std::hypot(x - cx, y - cy);
        if (r < radius)
          visit(static_cast<size_t>(r),
                sign * change.smooth[0][static_cast<size_t>(y) * f.width + static_cast<size_t>(x)]);
      }
  };
  double mean = 0, count = 0, spread = 0, left = 0, inside = 0, outside = 0;
  each([&](size_t ring, double v) {
    ring_sum[ring] += v;
    ring_count[ring] += 1;
    mean += v;
    count += 1;
  });
  mean /= std::max(count, 1.0);
  each([&](size_t ring, double v) {
    spread += (v - mean) * (v - mean);
    left += std::pow(v - ring_sum[ring] / ring_count[ring], 2);
  });
  ball.explained = spread > 0 ? 1 - left / spread : 0;
  for (int y = 0; y < change.height; ++y)
    for (int x = 0; x < change.width; ++x) {
      const double v = sign * change.smooth[0][static_cast<size_t>(y) * f.width + static_cast<size_t>(x)];
      if (v > 2 * level) (std::hypot(x - cx, y - cy) < 1.3 * radius ? inside : outside) += v;
    }
  ball.refusal = coverage_refusal(ball, frame, background, mask);
  if (!ball.refusal.empty()) return ball;
  if (outside > 0.15 * inside)
    ball.refusal = "something else is pressed too: " + percent(outside / (inside + outside)) +
                   " of the change lies beside the ball";
  else if (scale_px > 0.12 * radius || ball.explained < kLeastExplained)
    ball.refusal = "the change is not round: a ball explains " + percent(ball.explained) + " of it";
  else
    ball.refusal = circle_refusal(ball, f, search);
  return ball;
}

}  // namespace palpate
