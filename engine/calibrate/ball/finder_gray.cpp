#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "engine/base/statistics.h"
#include "engine/calibrate/ball/finder.h"
#include "engine/calibrate/ball/press.h"
#include "engine/numeric/dense.h"

namespace palpate {
namespace {

using ball::Change, ball::percent, ball::tenths, ball::kLeastExplained;

constexpr int kRays = 180;

// The change of a gray picture, positive where the gel is pressed.
class PressedChange {
 public:
  PressedChange(const Change& change, const FrameFormat& format, Signal signal)
      : change_(change), format_(format), sign_(signal == Signal::Darker ? -1.0f : 1.0f) {}

  int width() const { return change_.width; }
  int height() const { return change_.height; }
  double value(int x, int y) const {
    return sign_ * change_.smooth[0][static_cast<size_t>(y) * format_.width + static_cast<size_t>(x)];
  }
  // Between pixels.
  double at(double x, double y) const {
    const double u = std::clamp(x, 0.0, format_.width - 1.001),
                 v = std::clamp(y, 0.0, format_.height - 1.001);
    const auto i = static_cast<size_t>(u), j = static_cast<size_t>(v);
    const double a = u - static_cast<double>(i), b = v - static_cast<double>(j);
    const auto p = [&](size_t m, size_t n) {
      return static_cast<double>(change_.smooth[0][n * format_.width + m]);
    };
    return sign_ * ((1 - b) * ((1 - a) * p(i, j) + a * p(i + 1, j)) +
                    b * ((1 - a) * p(i, j + 1) + a * p(i + 1, j + 1)));
  }
  double noise() const {
    std::vector<double> all;
    for (size_t i = 0; i < change_.size2.size(); i += 7) all.push_back(std::abs(change_.smooth[0][i]));
    return median(all);
  }
  double peak() const {
    double peak = 0;
    for (const float v : change_.smooth[0]) peak = std::max(peak, static_cast<double>(sign_ * v));
    return peak;
  }

 private:
  const Change& change_;
  const FrameFormat& format_;
  float sign_;
};

struct Circle {
  double x = 0, y = 0, radius = 0;
};

// The part that changes by half as much as the most: its centre of mass, and the radius that its area has.
Circle strong_part(const PressedChange& change, double peak) {
  double sum = 0, sum_x = 0, sum_y = 0, area = 0;
  for (int y = 0; y < change.height(); ++y)
    for (int x = 0; x < change.width(); ++x) {
      const double v = change.value(x, y);
      if (v < 0.5 * peak) continue;
      sum += v;
      sum_x += v * x;
      sum_y += v * y;
      area += 1;
    }
  return {sum_x / sum, sum_y / sum, std::sqrt(area / std::numbers::pi)};
}

struct Rim {
  std::vector<std::pair<double, double>> points;
  int open = 0;  // rays that reach the frame's border first
};

// Along each ray, where the change first falls below the level outside of the strong part.
Rim trace_rim(const PressedChange& change, const FrameFormat& f, double cx, double cy, double level) {
  Rim rim;
  for (int k = 0; k < kRays; ++k) {
    const double a = 2 * std::numbers::pi * k / kRays, dx = std::cos(a), dy = std::sin(a);
    double before = change.at(cx, cy);
    for (double r = 1;; r += 1) {
      const double x = cx + r * dx, y = cy + r * dy;
      if (x < 1 || y < 1 || x > f.width - 2.0 || y > f.height - 2.0) {
        ++rim.open;
        break;
      }
      const double here = change.at(x, y);
      if (here < level && before >= level) {
        const double back = (level - here) / (before - here);
        rim.points.emplace_back(cx + (r - back) * dx, cy + (r - back) * dy);
        break;
      }
      before = here;
    }
  }
  return rim;
}

struct CircleFit {
  Circle circle;
  Eigen::Matrix3d normal;
  double scale_px = 0;  // of the rim's distances from the circle
};

// Circle by Gauss-Newton on distances, Huber's weights.
CircleFit fit_circle(const std::vector<std::pair<double, double>>& rim, const Circle& start) {
  CircleFit fit{start, {}, 0};
  auto& [cx, cy, radius] = fit.circle;
  for (int iteration = 0; iteration < 30; ++iteration) {
    std::vector<double> errors;
    errors.reserve(rim.size());
    for (const auto& [x, y] : rim) errors.push_back(std::abs(std::hypot(x - cx, y - cy) - radius));
    fit.scale_px = std::max(1.4826 * median(errors), 0.02);
    fit.normal.setZero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (const auto& [x, y] : rim) {
      const double r = std::max(std::hypot(x - cx, y - cy), 1e-6), error = r - radius;
      const double w = std::abs(error) > 1.5 * fit.scale_px ? 1.5 * fit.scale_px / std::abs(error) : 1;
      const Eigen::Vector3d j((x - cx) / r, (y - cy) / r, 1);
      fit.normal += w * j * j.transpose();
      right += w * error * j;
    }
    const Eigen::Vector3d step = dense::solve_ldlt<3>(fit.normal, right);
    cx += step[0];
    cy += step[1];
    radius += step[2];
    if (step.norm() < 1e-6) break;
  }
  return fit;
}

void place(const Circle& circle, FoundBall& found) {
  found.center_x_px = circle.x;
  found.center_y_px = circle.y;
  found.radius_px = circle.radius;
}

// The fraction of the change inside the circle that the distance from its centre alone explains: all of it
// for a ball.
double roundness(const PressedChange& change, const Circle& circle) {
  const auto [cx, cy, radius] = circle;
  std::vector<double> ring_sum(static_cast<size_t>(radius) + 2), ring_count(ring_sum.size());
  const auto each = [&, cx = cx, cy = cy, radius = radius](const auto& visit) {
    for (int y = std::max(0, static_cast<int>(cy - radius));
         y <= std::min(change.height() - 1, static_cast<int>(cy + radius)); ++y)
      for (int x = std::max(0, static_cast<int>(cx - radius));
           x <= std::min(change.width() - 1, static_cast<int>(cx + radius)); ++x) {
        const double r = std::hypot(x - cx, y - cy);
        if (r < radius) visit(static_cast<size_t>(r), change.value(x, y));
      }
  };
  double mean = 0, count = 0, spread = 0, left = 0;
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
  return spread > 0 ? 1 - left / spread : 0;
}

struct GraySides {
  double inside = 0, outside = 0;
};

// Pixels that change well above the level, inside the circle and around it.
GraySides change_beside(const PressedChange& change, const Circle& circle, double level) {
  GraySides sides;
  for (int y = 0; y < change.height(); ++y)
    for (int x = 0; x < change.width(); ++x) {
      const double v = change.value(x, y);
      if (v > 2 * level)
        (std::hypot(x - circle.x, y - circle.y) < 1.3 * circle.radius ? sides.inside : sides.outside) += v;
    }
  return sides;
}

}  // namespace

FoundBall find_gray_ball(const Frame& frame, const Frame& background, std::span<const uint8_t> mask,
                         Signal signal, const BallSearch& search) {
  ball::check_pair(frame, background, 1, mask);
  const FrameFormat& f = frame.format;
  const Change smoothed = ball::change_of(frame, background, mask);
  const PressedChange change(smoothed, f, signal);
  FoundBall found;
  const double noise = change.noise(), peak = change.peak();
  const double level = std::max({search.threshold_gray, 3 * noise, 0.04 * peak});
  if (peak < 4 * level) {
    found.refuse(BallRefusal::Untouched, "nothing is pressed: the image changes by " + tenths(peak) +
                                             " gray at most, by " + tenths(noise) + " all over");
    return found;
  }
  const Circle start = strong_part(change, peak);
  const Rim rim = trace_rim(change, f, start.x, start.y, level);
  place(start, found);
  if (rim.open > kRays / 20 || rim.points.size() < 20) {
    found.refuse(BallRefusal::AtBorder, "the contact reaches the frame's border");
    return found;
  }
  const CircleFit fit = fit_circle(rim.points, start);
  const Circle& circle = fit.circle;
  place(circle, found);
  // The rays' errors go in waves of about a dozen rays.
  const Eigen::Matrix3d covariance = fit.normal.inverse() * (12 * fit.scale_px * fit.scale_px);
  found.center_sd_px = std::sqrt(0.5 * (covariance(0, 0) + covariance(1, 1)));
  found.radius_sd_px = std::sqrt(covariance(2, 2));
  found.explained = roundness(change, circle);
  const auto [inside, outside] = change_beside(change, circle, level);
  ball::check_coverage(found, frame, background, mask);
  if (!found.good()) return found;
  if (outside > 0.15 * inside)
    found.refuse(BallRefusal::MoreThanOne,
                 "something else is pressed too: " + percent(outside / (inside + outside)) +
                     " of the change lies beside the ball");
  else if (fit.scale_px > 0.12 * circle.radius || found.explained < kLeastExplained)
    found.refuse(BallRefusal::MoreThanOne,
                 "the change is not round: a ball explains " + percent(found.explained) + " of it");
  else
    ball::check_contact(found, f, search);
  return found;
}

}  // namespace palpate
