#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "engine/calibrate/ball_finder.h"
#include "engine/calibrate/ball_press.h"
#include "engine/numeric/dense.h"

namespace palpate {

using ball::Change, ball::median_of, ball::percent, ball::tenths, ball::kLeastExplained, ball::kSecondContact;

FoundBall find_gray_ball(const Frame& frame, const Frame& background, std::span<const uint8_t> mask,
                         Signal signal, const BallSearch& search) {
  ball::check_pair(frame, background, 1, mask);
  const FrameFormat& f = frame.format;
  const Change change = ball::change_of(frame, background, mask);
  const float sign = signal == Signal::Darker ? -1.0f : 1.0f;
  FoundBall found;
  std::vector<double> all;
  for (size_t i = 0; i < change.size2.size(); i += 7) all.push_back(std::abs(change.smooth[0][i]));
  const double noise = median_of(all);
  double peak = 0, sum = 0, sum_x = 0, sum_y = 0;
  for (const float v : change.smooth[0]) peak = std::max(peak, static_cast<double>(sign * v));
  const double level = std::max({search.threshold_gray, 3 * noise, 0.04 * peak});
  if (peak < 4 * level) {
    found.refusal = "nothing is pressed: the image changes by " + tenths(peak) + " gray at most, by " +
                    tenths(noise) + " all over";
    return found;
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
  found.center_x_px = cx;
  found.center_y_px = cy;
  found.radius_px = std::sqrt(area / std::numbers::pi);
  if (open > kRays / 20 || rim.size() < 20) {
    found.refusal = "the contact reaches the frame's border";
    return found;
  }
  // Circle by Gauss-Newton on distances, Huber's weights.
  double radius = found.radius_px, scale_px = 0;
  Eigen::Matrix3d normal;
  for (int iteration = 0; iteration < 30; ++iteration) {
    std::vector<double> errors;
    errors.reserve(rim.size());
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
    const Eigen::Vector3d step = dense::solve_ldlt<3>(normal, right);
    cx += step[0];
    cy += step[1];
    radius += step[2];
    if (step.norm() < 1e-6) break;
  }
  found.center_x_px = cx;
  found.center_y_px = cy;
  found.radius_px = radius;
  // The rays' errors go in waves of about a dozen rays.
  const Eigen::Matrix3d covariance = normal.inverse() * (12 * scale_px * scale_px);
  found.center_sd_px = std::sqrt(0.5 * (covariance(0, 0) + covariance(1, 1)));
  found.radius_sd_px = std::sqrt(covariance(2, 2));

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
  found.explained = spread > 0 ? 1 - left / spread : 0;
  for (int y = 0; y < change.height; ++y)
    for (int x = 0; x < change.width; ++x) {
      const double v = sign * change.smooth[0][static_cast<size_t>(y) * f.width + static_cast<size_t>(x)];
      if (v > 2 * level) (std::hypot(x - cx, y - cy) < 1.3 * radius ? inside : outside) += v;
    }
  found.refusal = ball::coverage_refusal(found, frame, background, mask);
  if (!found.refusal.empty()) return found;
  if (outside > 0.15 * inside)
    found.refusal = "something else is pressed too: " + percent(outside / (inside + outside)) +
                    " of the change lies beside the ball";
  else if (scale_px > 0.12 * radius || found.explained < kLeastExplained)
    found.refusal = "the change is not round: a ball explains " + percent(found.explained) + " of it";
  else
    found.refusal = ball::circle_refusal(found, f, search);
  return found;
}

}  // namespace palpate
