#include "engine/calibrate/force/fit.h"

#include <Eigen/Core>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>
#include <string>

#include "engine/measure/force.h"
#include "engine/numeric/dense.h"
#include "palpate/error.h"

namespace palpate {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kLeastExponent = 0.2, kLargestExponent = 5;

struct Readings {
  std::span<const double> signal, force_N, weight;
  size_t size() const { return signal.size(); }
  double w(size_t i) const { return weight.empty() ? 1 : weight[i]; }
};

double squares_left(const Readings& r, ForceModel model, const ForceCurve& curve) {
  double squares = 0;
  for (size_t i = 0; i < r.size(); ++i) {
    const double d = r.force_N[i] - force_at(model, curve, r.signal[i]);
    squares += r.w(i) * d * d;
  }
  return squares;
}

/// F = c1 x + c0 with x = s^exponent, about the weighted means.
struct Line {
  double c1 = 0, c0 = 0, x_mean = 0, xx = 0, weight = 0;
};
Line fit_line(const Readings& r, double exponent) {
  Line line;
  double x_sum = 0, f_sum = 0;
  const auto x_at = [&](size_t i) {
    return exponent == 1 ? r.signal[i] : std::pow(std::max(r.signal[i], 0.0), exponent);
  };
  for (size_t i = 0; i < r.size(); ++i) {
    line.weight += r.w(i);
    x_sum += r.w(i) * x_at(i);
    f_sum += r.w(i) * r.force_N[i];
  }
  line.x_mean = x_sum / line.weight;
  const double f_mean = f_sum / line.weight;
  double xf = 0;
  for (size_t i = 0; i < r.size(); ++i) {
    const double x = x_at(i) - line.x_mean;
    line.xx += r.w(i) * x * x;
    xf += r.w(i) * x * (r.force_N[i] - f_mean);
  }
  line.c1 = xf / line.xx;
  line.c0 = f_mean - line.c1 * line.x_mean;
  return line;
}

CurveFit fit_scale(const Readings& r, size_t free) {
  double squares = 0, products = 0;
  for (size_t i = 0; i < r.size(); ++i) {
    squares += r.w(i) * r.signal[i] * r.signal[i];
    products += r.w(i) * r.signal[i] * r.force_N[i];
  }
  CurveFit fit{{products / squares, 0, 1, {}, 0}, {}, 0};
  const double variance = squares_left(r, ForceModel::Scale, fit.curve) / static_cast<double>(free);
  fit.covariance = {0, 0, variance / squares};
  fit.residual_sd_N = std::sqrt(variance);
  return fit;
}

CurveFit fit_power(ForceModel model, const Readings& r, size_t free) {
  const auto curve_at = [&](double exponent) {
    const Line line = fit_line(r, exponent);
    return ForceCurve{line.c1, line.c0, exponent, {}, 0};
  };
  double exponent = 1;
  if (model == ForceModel::Power) {
    // A grid on the logarithm, then golden section about its best.
    const auto cost = [&](double log_exponent) {
      return squares_left(r, ForceModel::Power, curve_at(std::exp(log_exponent)));
    };
    constexpr int kSteps = 24;
    const double low = std::log(kLeastExponent), width = std::log(kLargestExponent) - low;
    int best = 0;
    std::array<double, kSteps + 1> costs{};
    for (int k = 0; k <= kSteps; ++k) {
      costs[k] = cost(low + width * k / kSteps);
      if (costs[k] < costs[best]) best = k;
    }
    double a = low + width * std::max(best - 1, 0) / kSteps,
           b = low + width * std::min(best + 1, kSteps) / kSteps;
    const double golden = 0.5 * (std::sqrt(5.0) - 1);
    for (int k = 0; k < 40; ++k) {
      const double c = b - golden * (b - a), d = a + golden * (b - a);
      (cost(c) < cost(d) ? b : a) = cost(c) < cost(d) ? d : c;
    }
    exponent = std::exp(0.5 * (a + b));
  }
  const Line line = fit_line(r, exponent);
  CurveFit fit{{line.c1, line.c0, exponent, {}, 0}, {}, 0};
  const double variance = squares_left(r, model, fit.curve) / static_cast<double>(free);
  fit.covariance = {variance * (1 / line.weight + line.x_mean * line.x_mean / line.xx),
                    -variance * line.x_mean / line.xx, variance / line.xx};
  fit.residual_sd_N = std::sqrt(variance);
  return fit;
}

/// Knots half evenly over the signal, half where the readings are.
std::vector<double> knot_places(const Readings& r, size_t count) {
  std::vector<double> sorted(r.signal.begin(), r.signal.end());
  std::sort(sorted.begin(), sorted.end());
  std::vector<double> places;
  for (size_t k = 0; k < count; ++k) {
    const double fraction = static_cast<double>(k) / static_cast<double>(count - 1);
    const double even = sorted.front() + fraction * (sorted.back() - sorted.front());
    places.push_back(
        0.5 *
        (even + sorted[static_cast<size_t>(std::lround(fraction * static_cast<double>(sorted.size() - 1)))]));
  }
  return places;
}

/// Values that minimise |J v - y|^2 + ridge |second differences|^2 and do not fall, by coordinate descent on
/// the first value and the steps.
VectorXd rising_least_squares(const MatrixXd& j, const VectorXd& y, const MatrixXd& roughness) {
  const Eigen::Index n = j.cols();
  const MatrixXd steps = MatrixXd::Ones(n, n).triangularView<Eigen::Lower>();
  const MatrixXd a =
      dense::product(dense::product_tn(steps, MatrixXd(dense::product_tn(j, j) + roughness)), steps);
  const VectorXd b = dense::product_tn(steps, dense::product_tn(j, y));
  VectorXd x = VectorXd::Zero(n);
  for (int sweep = 0; sweep < 2000; ++sweep) {
    double change = 0;
    for (Eigen::Index k = 0; k < n; ++k) {
      if (!(a(k, k) > 0)) continue;
      const double free = x(k) + (b(k) - a.row(k).dot(x)) / a(k, k);
      const double next = k == 0 ? free : std::max(free, 0.0);
      change = std::max(change, std::abs(next - x(k)));
      x(k) = next;
    }
    if (change < 1e-12 * (1 + x.cwiseAbs().maxCoeff())) break;
  }
  return steps * x;
}

CurveFit fit_spline(const Readings& r, size_t free) {
  const size_t count = unknowns(ForceModel::Spline, r.size());
  const std::vector<double> places = knot_places(r, count);
  const auto knots = static_cast<Eigen::Index>(count);
  const auto curve_of = [&](const VectorXd& v) {
    ForceCurve curve;
    for (size_t k = 0; k < count; ++k) curve.knots.push_back({places[k], v(static_cast<Eigen::Index>(k))});
    return curve;
  };
  MatrixXd second = MatrixXd::Zero(knots - 2, knots);
  for (Eigen::Index k = 0; k + 2 < knots; ++k) {
    const double h0 = places[k + 1] - places[k], h1 = places[k + 2] - places[k + 1];
    const double scale = places[count - 1] - places[0];
    second(k, k) = scale / h0 / static_cast<double>(knots);
    second(k, k + 1) = -scale / h0 / static_cast<double>(knots) - scale / h1 / static_cast<double>(knots);
    second(k, k + 2) = scale / h1 / static_cast<double>(knots);
  }
  constexpr double kRidge = 1e-4;  // of one reading's weight: only decides where no reading lies
  const MatrixXd roughness = kRidge * static_cast<double>(r.size()) * second.transpose() * second;

  const auto rows = static_cast<Eigen::Index>(r.size());
  const auto values_of = [&](const VectorXd& v) {
    const ForceCurve curve = curve_of(v);
    VectorXd f(rows);
    for (Eigen::Index i = 0; i < rows; ++i) f(i) = force_at(ForceModel::Spline, curve, r.signal[i]);
    return f;
  };
  VectorXd root_weight(rows), target(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    root_weight(i) = std::sqrt(r.w(i));
    target(i) = r.force_N[i];
  }
  // From the straight line.
  const Line line = fit_line(r, 1);
  VectorXd v(knots);
  for (Eigen::Index k = 0; k < knots; ++k) v(k) = std::max(line.c1, 0.0) * places[k] + line.c0;
  const auto cost = [&](const VectorXd& at) {
    return (root_weight.asDiagonal() * (target - values_of(at))).squaredNorm() + at.dot(roughness * at);
  };
  double best = cost(v);
  constexpr int kSteps = 8;
  for (int step = 0; step < kSteps; ++step) {
    const VectorXd f = values_of(v);
    const double h = 1e-4 * std::max(1e-9, std::abs(v(knots - 1) - v(0)));
    MatrixXd j(rows, knots);
    for (Eigen::Index k = 0; k < knots; ++k) {
      VectorXd moved = v;
      moved(k) += h;
      j.col(k) = (values_of(moved) - f) / h;
    }
    const MatrixXd weighted = root_weight.asDiagonal() * j;
    const VectorXd y = root_weight.asDiagonal() * (target - f + j * v);
    const VectorXd to = rising_least_squares(weighted, y, roughness);
    double fraction = 1, reached = best;
    VectorXd next = v;
    for (int half = 0; half < 6; ++half, fraction *= 0.5) {
      next = v + fraction * (to - v);
      reached = cost(next);
      if (reached < best) break;
    }
    if (!(reached < best * (1 - 1e-9))) break;
    best = reached;
    v = next;
  }
  CurveFit fit{curve_of(v), {}, 0};
  fit.residual_sd_N = std::sqrt(squares_left(r, ForceModel::Spline, fit.curve) / static_cast<double>(free));
  return fit;
}

}  // namespace

size_t unknowns(ForceModel model, size_t readings) {
  switch (model) {
    case ForceModel::Scale:
      return 1;
    case ForceModel::Line:
      return 2;
    case ForceModel::Power:
      return 3;
    case ForceModel::Spline:
      return std::clamp<size_t>(readings / 10, 4, 8);
  }
  return 2;
}

CurveFit fit_curve(ForceModel model, std::span<const double> signal, std::span<const double> force_N,
                   std::span<const double> weight) {
  assert(signal.size() == force_N.size() && (weight.empty() || weight.size() == signal.size()));
  // Readings of no weight must neither count nor carry knots.
  std::vector<double> s, f, w;
  for (size_t i = 0; i < signal.size(); ++i) {
    if (!weight.empty() && !(weight[i] > 0)) continue;
    s.push_back(signal[i]);
    f.push_back(force_N[i]);
    if (!weight.empty()) w.push_back(weight[i]);
  }
  const Readings r{s, f, w};
  const size_t wanted = unknowns(model, r.size()) + 1;
  if (r.size() < wanted)
    throw Error(Failure::Input,
                "at least " + std::to_string(wanted) + " readings of signal and force for model '" +
                    to_string(model) + "'",
                std::to_string(r.size()), "a recording with more presses");
  const auto [low, high] = std::minmax_element(s.begin(), s.end());
  const auto [least, most] = std::minmax_element(f.begin(), f.end());
  if (!(*high > *low) || !(*most > *least))
    throw Error(Failure::Input, "readings at different forces", "the same reading every time",
                "a recording with more presses");
  if (!(fit_line(r, 1).c1 > 0))
    throw Error(
        Failure::Input, "a signal that grows with force", "one that does not",
        "checking the sensor's signal (brighter, darker), and that the gauge counts pressing as positive");
  const size_t free = r.size() - unknowns(model, r.size());
  CurveFit fit = model == ForceModel::Spline  ? fit_spline(r, free)
                 : model == ForceModel::Scale ? fit_scale(r, free)
                                              : fit_power(model, r, free);
  fit.curve.residual_sd_N = fit.residual_sd_N;
  return fit;
}

ForceCalibration line_calibration(std::span<const double> gray_sum, std::span<const double> force_N) {
  const CurveFit fit = fit_curve(ForceModel::Line, gray_sum, force_N);
  const auto [low, high] = std::minmax_element(gray_sum.begin(), gray_sum.end());
  const double n = static_cast<double>(force_N.size());
  const double mean_N = std::accumulate(force_N.begin(), force_N.end(), 0.0) / n;
  double about = 0;
  for (const double f : force_N) about += (f - mean_N) * (f - mean_N);
  ForceCalibration c{.c1_N_per_gray = fit.curve.c1,
                     .c0_N = fit.curve.c0_N,
                     .residual_sd_N = fit.residual_sd_N,
                     .covariance = fit.covariance,
                     .gray_min = *low,
                     .gray_max = *high};
  c.r_squared = 1 - fit.residual_sd_N * fit.residual_sd_N * (n - 2) / about;
  return c;
}

}  // namespace palpate
