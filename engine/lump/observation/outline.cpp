#include "engine/lump/observation/outline.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <optional>
#include <random>

#include "engine/base/normal.h"
#include "engine/base/text.h"
#include "engine/numeric/dense.h"
#include "engine/tissue/map_sampling.h"
#include "palpate/error.h"

namespace palpate::lump {
namespace {

constexpr double kInner = 0.9;  // of the block's sides
constexpr double kLeastSignificance = 6;
constexpr double kBlockFraction = 0.03;  // of its own pressure: error of even powers as a block's shape
constexpr int kRays = 120;
constexpr Eigen::Index kBlockTerms = 8;

using Five = Eigen::Matrix<double, 5, 1>;  // centre x, y, ln of both widths, angle

struct Point {
  double x, y, value;
};

/// The smooth block: tilt and even powers, in halves of its sides.
Eigen::Matrix<double, kBlockTerms, 1> block_terms(double x, double y) {
  const double xx = x * x, yy = y * y;
  return (Eigen::Matrix<double, kBlockTerms, 1>() << 1, x, y, xx, yy, xx * xx, xx * yy, yy * yy).finished();
}

double gaussian(const Five& p, double x, double y) {
  const double c = std::cos(p(4)), s = std::sin(p(4)), dx = x - p(0), dy = y - p(1);
  const double u = (c * dx + s * dy) * std::exp(-p(2)), v = (c * dy - s * dx) * std::exp(-p(3));
  return std::exp(-0.5 * (u * u + v * v));
}

struct FittedBump {
  Five bump = Five::Zero();
  Eigen::VectorXd linear = Eigen::VectorXd::Zero(kBlockTerms + 1);  // block, then the bump's height
  double squares = std::numeric_limits<double>::infinity();
  double height_variance = 0;  // for noise of variance 1
};

class BumpFit {
 public:
  BumpFit(const Observation& observation)
      : half_x_(observation.block_mm[0] / 2), half_y_(observation.block_mm[1] / 2) {
    const PressureMap& map = observation.pressure_Pa.back();
    for (uint32_t j = 0; j < map.height; ++j)
      for (uint32_t i = 0; i < map.width; ++i) {
        const double x = observation.window_mm[0] + (i - (map.width - 1) / 2.0) * map.pitch_mm[0],
                     y = observation.window_mm[1] + (j - (map.height - 1) / 2.0) * map.pitch_mm[1];
        const double value = static_cast<double>(map.at(i, j));
        if (std::isfinite(value) && std::abs(x) <= kInner * half_x_ && std::abs(y) <= kInner * half_y_)
          points_.push_back({x, y, value});
      }
    if (points_.size() < 60)
      throw Error(Failure::Input, "60 or more seen places of the block", std::to_string(points_.size()),
                  "more presses, or a finer map");
    narrowest_ = std::log(0.7 * map.pitch_mm[0]);
    widest_ = std::log(0.45 * std::min(half_x_, half_y_) * 2 * kInner / 1.5);
  }

  const std::vector<Point>& points() const { return points_; }
  double block(const FittedBump& fit, double x, double y) const {
    return fit.linear.head<kBlockTerms>().dot(block_terms(x / half_x_, y / half_y_));
  }

  /// Heights for a place and widths of the bump.
  FittedBump with_best_heights(const Five& bump, const std::vector<double>& values) const {
    Eigen::Matrix<double, kBlockTerms + 1, kBlockTerms + 1> normal;
    Eigen::Matrix<double, kBlockTerms + 1, 1> right, row;
    normal.setZero();
    right.setZero();
    double sum = 0;
    for (size_t k = 0; k < points_.size(); ++k) {
      const Point& p = points_[k];
      row << block_terms(p.x / half_x_, p.y / half_y_), gaussian(bump, p.x, p.y);
      normal += row * row.transpose();
      right += row * values[k];
      sum += values[k] * values[k];
    }
    FittedBump fit;
    fit.bump = bump;
    const auto solver = normal.ldlt();
    fit.linear = solver.solve(right);
    fit.squares = std::max(0.0, sum - right.dot(fit.linear));
    Eigen::Matrix<double, kBlockTerms + 1, 1> last;
    last.setZero();
    last(kBlockTerms) = 1;
    fit.height_variance = solver.solve(last)(kBlockTerms);
    return fit;
  }

  /// Gauss-Newton with Levenberg's damping on the five, the heights always the best.
  FittedBump search(const Five& start, const std::vector<double>& values, int most_rounds) const {
    FittedBump best = with_best_heights(inside(start), values);
    double damping = 1e-2;
    for (int round = 0; round < most_rounds && damping < 1e6; ++round) {
      const Eigen::VectorXd r = residual(best, values);
      Eigen::MatrixXd slope(r.size(), 5);
      for (Eigen::Index c = 0; c < 5; ++c) {
        Five moved = best.bump;
        const double step = 1e-4;
        moved(c) += step;
        slope.col(c) = (residual(with_best_heights(moved, values), values) - r) / step;
      }
      Eigen::Matrix<double, 5, 5> normal = dense::product_tn(slope, slope);
      normal.diagonal() *= 1 + damping;
      normal.diagonal().array() += 1e-12 * normal.trace() + 1e-300;
      const Five step = dense::solve_ldlt<5>(normal, -(slope.transpose() * r));
      if (!step.allFinite()) break;
      const FittedBump next = with_best_heights(inside(best.bump + step), values);
      if (next.squares < best.squares) {
        const bool done = best.squares - next.squares < 1e-9 * best.squares;
        best = next;
        damping = std::max(1e-7, damping / 5);
        if (done) break;
      } else {
        damping *= 6;
      }
    }
    return best;
  }

  std::vector<double> values() const {
    std::vector<double> all;
    for (const Point& p : points_) all.push_back(p.value);
    return all;
  }
  /// Held within what the map can show; a height below 0 is a soft place.
  Five inside(Five p) const {
    p(0) = std::clamp(p(0), -kInner * half_x_, kInner * half_x_);
    p(1) = std::clamp(p(1), -kInner * half_y_, kInner * half_y_);
    p(2) = std::clamp(p(2), narrowest_, widest_);
    p(3) = std::clamp(p(3), narrowest_, widest_);
    return p;
  }
  double widest() const { return widest_; }

 private:
  Eigen::VectorXd residual(const FittedBump& fit, const std::vector<double>& values) const {
    Eigen::VectorXd r(static_cast<Eigen::Index>(points_.size()));
    for (size_t k = 0; k < points_.size(); ++k) {
      const Point& p = points_[k];
      r(static_cast<Eigen::Index>(k)) =
          block(fit, p.x, p.y) + fit.linear(kBlockTerms) * gaussian(fit.bump, p.x, p.y) - values[k];
    }
    return r;
  }

  double half_x_, half_y_, narrowest_ = 0, widest_ = 0;
  std::vector<Point> points_;
};

/// The line at half height around the bump, on map minus block. Empty where it leaves what was seen.
std::vector<std::array<double, 2>> contour(const Observation& observation, const PressureMap& bump,
                                           const FittedBump& fit, double half_Pa) {
  std::vector<std::array<double, 2>> points;
  const double cx = fit.bump(0), cy = fit.bump(1), step = bump.pitch_mm[0] / 4;
  const double reach_x = bump.pitch_mm[0] * (bump.width - 1) / 2,
               reach_y = bump.pitch_mm[1] * (bump.height - 1) / 2;
  const double far = 4 * std::exp(std::max(fit.bump(2), fit.bump(3)));
  for (int ray = 0; ray < kRays; ++ray) {
    const double angle = 2 * std::numbers::pi * ray / kRays, c = std::cos(angle), s = std::sin(angle);
    double before = 0;
    bool crossed = false;
    for (double r = 0; r <= far; r += step) {
      const double x = cx + r * c - observation.window_mm[0], y = cy + r * s - observation.window_mm[1];
      if (std::abs(x) > reach_x || std::abs(y) > reach_y) return {};
      const double value = map_at(bump, x, y) / half_Pa;
      if (!std::isfinite(value)) return {};
      if (r > 0 && before >= 1 && value < 1) {
        const double at = r - step * (1 - value) / (before - value);
        points.push_back({cx + at * c, cy + at * s});
        crossed = true;
        break;
      }
      before = value;
    }
    if (!crossed) return {};
  }
  return points;
}

double area_of(const std::vector<std::array<double, 2>>& points) {
  double twice = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    const auto &a = points[i], &b = points[(i + 1) % points.size()];
    twice += a[0] * b[1] - a[1] * b[0];
  }
  return std::abs(twice) / 2;
}

/// The middle nine tenths of repeats, moved to lie around the value itself.
Value interval(double value, const std::vector<double>& repeats) {
  if (repeats.size() < 5)
    return {value, -std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  double mean = 0, squares = 0;
  for (const double v : repeats) mean += v / static_cast<double>(repeats.size());
  for (const double v : repeats) squares += (v - mean) * (v - mean);
  // A normal distribution's 90 %; repeats are too few for their own tails.
  const double reach = kNormal90 * std::sqrt(squares / (static_cast<double>(repeats.size()) - 1));
  return {value, value - reach, value + reach};
}

/// A centre in the block: that in the window, and where the window lies.
Value placed(Value centre, double place_sd_mm) {
  const double reach_mm = std::hypot(centre.high - centre.value, kNormal90 * place_sd_mm);
  return {centre.value, centre.value - reach_mm, centre.value + reach_mm};
}

PressureMap minus_block(const Observation& observation, const BumpFit& fitter, const FittedBump& fit,
                        PressureMap* block) {
  PressureMap bump = observation.pressure_Pa.back();
  if (block) *block = bump;
  for (uint32_t j = 0; j < bump.height; ++j)
    for (uint32_t i = 0; i < bump.width; ++i) {
      const double x = observation.window_mm[0] + (i - (bump.width - 1) / 2.0) * bump.pitch_mm[0],
                   y = observation.window_mm[1] + (j - (bump.height - 1) / 2.0) * bump.pitch_mm[1];
      const double smooth = fitter.block(fit, x, y);
      const size_t node = size_t{j} * bump.width + i;
      bump.values[node] = static_cast<float>(static_cast<double>(bump.values[node]) - smooth);
      if (block) block->values[node] = static_cast<float>(smooth);
    }
  return bump;
}

/// From the places that stand out most of the smooth block, and two widths each.
FittedBump best_fit(const BumpFit& fitter, const std::vector<double>& values) {
  const std::vector<Point>& points = fitter.points();
  std::vector<Five> starts;
  Five far;
  far << 1e3, 1e3, 0, 0, 0;  // no bump
  const FittedBump bare = fitter.with_best_heights(far, values);
  size_t most = 0, least = 0;
  std::vector<double> off(points.size());
  for (size_t k = 0; k < points.size(); ++k) {
    off[k] = values[k] - fitter.block(bare, points[k].x, points[k].y);
    if (off[k] > off[most]) most = k;
    if (off[k] < off[least]) least = k;
  }
  for (const double width : {0.35, 0.7})
    for (const size_t k : {most, least}) {
      Five start;
      start << points[k].x, points[k].y, fitter.widest() + std::log(width), fitter.widest() + std::log(width),
          0.1;
      starts.push_back(start);
    }
  FittedBump best;
  for (const Five& start : starts) {
    const FittedBump fit = fitter.search(start, values, 40);
    if (fit.squares < best.squares) best = fit;
  }
  return best;
}

}  // namespace

Outline outline_lump(const Observation& observation, uint64_t seed, uint32_t repeats) {
  if (observation.pressure_Pa.empty())
    throw Error(Failure::Input, "a pressure map to outline a lump on", "none", "one load or more");
  const BumpFit fitter(observation);
  const std::vector<double> values = fitter.values();
  FittedBump fit = best_fit(fitter, values);
  if (fit.bump(2) < fit.bump(3)) {
    std::swap(fit.bump(2), fit.bump(3));
    fit.bump(4) += std::numbers::pi / 2;
  }
  Outline out;
  const PressureMap bump = minus_block(observation, fitter, fit, &out.block_Pa);
  const double height = fit.linear(kBlockTerms);
  out.residual_Pa = std::sqrt(fit.squares / (static_cast<double>(values.size()) - kBlockTerms - 6));
  out.half_widths_mm = {std::exp(fit.bump(2)), std::exp(fit.bump(3))};
  out.angle_rad = std::remainder(fit.bump(4), std::numbers::pi);
  const double error_Pa = std::max(out.residual_Pa, observation.noise_Pa) * std::sqrt(fit.height_variance);
  out.significance = error_Pa > 0 ? std::abs(height) / error_Pa : std::numeric_limits<double>::infinity();
  out.height_Pa = {height, height - kNormal90 * error_Pa, height + kNormal90 * error_Pa};
  if (std::exp(std::max(fit.bump(2), fit.bump(3))) > 0.999 * std::exp(fitter.widest())) {
    out.reason = "the raised area is as wide as the block and cannot be separated from it";
    return out;
  }
  if (out.significance < kLeastSignificance) {
    const std::string line = text("no bump: the highest is %.1f times its standard error", out.significance);
    out.reason = line;
    return out;
  }
  const double under_Pa = std::abs(fitter.block(fit, fit.bump(0), fit.bump(1)));
  if (std::abs(height) < kBlockFraction * under_Pa) {
    const std::string line =
        text("no bump: the highest is %.1f %% of the block's own pressure, whose shape is known to %.0f %%",
             100 * std::abs(height) / under_Pa, 100 * kBlockFraction);
    out.reason = line;
    return out;
  }
  out.found = true;
  out.x_mm.value = fit.bump(0);
  out.y_mm.value = fit.bump(1);
  out.points_mm = contour(observation, bump, fit, height / 2);
  out.closed = !out.points_mm.empty();
  if (!out.closed) out.reason = "the line at half height leaves what was seen of the block";

  std::mt19937_64 random(seed);
  std::normal_distribution<double> deviate(0, 1);
  std::vector<double> xs, ys, heights, areas, widths;
  Observation noisy = observation;
  noisy.pressure_Pa = {observation.pressure_Pa.back()};
  for (uint32_t k = 0; k < repeats && observation.noise_Pa > 0; ++k) {
    for (size_t i = 0; i < noisy.pressure_Pa[0].values.size(); ++i)
      noisy.pressure_Pa[0].values[i] =
          static_cast<float>(static_cast<double>(observation.pressure_Pa.back().values[i]) +
                             observation.noise_Pa * deviate(random));
    const BumpFit again(noisy);
    const FittedBump other = again.search(fit.bump, again.values(), 4);
    xs.push_back(other.bump(0));
    ys.push_back(other.bump(1));
    heights.push_back(other.linear(kBlockTerms));
    const auto points = contour(noisy, minus_block(noisy, again, other, nullptr), other, heights.back() / 2);
    if (points.empty()) continue;
    areas.push_back(area_of(points));
    widths.push_back(2 * std::sqrt(areas.back() / std::numbers::pi));
  }
  out.x_mm = placed(interval(fit.bump(0), xs), observation.place_sd_mm);
  out.y_mm = placed(interval(fit.bump(1), ys), observation.place_sd_mm);
  out.height_Pa = interval(height, heights);
  if (out.closed) {
    const double area = area_of(out.points_mm);
    out.area_mm2 = interval(area, areas);
    out.width_mm = interval(2 * std::sqrt(area / std::numbers::pi), widths);
  }
  return out;
}

}  // namespace palpate::lump
