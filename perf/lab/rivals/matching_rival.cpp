#include "perf/lab/rivals/matching_rival.h"

#include <Eigen/Dense>
#include <cmath>
#include <numbers>
#include <vector>

#include "capture/synthetic/bent_points.h"
#include "engine/base/text.h"
#include "perf/lab/say.h"
#include "perf/measure.h"

namespace palpate::perf {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

MatrixXd matrix_of(const PointSet& set) {
  return Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
      set.coordinates.data(), static_cast<Index>(set.size()), static_cast<Index>(set.axes));
}

MatrixXd squared_distances(const MatrixXd& a, const MatrixXd& b) {
  MatrixXd d = -2 * a * b.transpose();
  d.colwise() += a.rowwise().squaredNorm();
  d.rowwise() += b.rowwise().squaredNorm().transpose();
  return d.cwiseMax(0);
}

struct Tally {
  double miss = 0;
  int failures = 0;
  std::vector<double> ms;

  void add(const PointSet& warped, const PointSet& truth) {
    const double d = mean_miss(warped, truth);
    miss += d;
    failures += d > 0.05;
  }
};

}  // namespace

PointSet drift_points(const PointSet& from, const PointSet& to) {
  constexpr double kWidth = 2, kWeight = 3, kOutliers = 0.1, kSettled = 1e-5;
  MatrixXd y = matrix_of(from), x = matrix_of(to);
  const RowVectorXd y_centre = y.colwise().mean(), x_centre = x.colwise().mean();
  y.rowwise() -= y_centre;
  x.rowwise() -= x_centre;
  const auto m = static_cast<double>(y.rows()), n = static_cast<double>(x.rows()),
             axes = static_cast<double>(y.cols());
  const double y_scale = std::sqrt(y.squaredNorm() / m), x_scale = std::sqrt(x.squaredNorm() / n);
  y /= y_scale;
  x /= x_scale;
  const MatrixXd kernel = (squared_distances(y, y) / (-2 * kWidth * kWidth)).array().exp();
  MatrixXd t = y, w = MatrixXd::Zero(y.rows(), y.cols());
  double variance = squared_distances(t, x).sum() / (axes * m * n), last = 0;
  for (int k = 0; k < 150 && variance > 1e-8; ++k) {
    MatrixXd p = (squared_distances(t, x) / (-2 * variance)).array().exp();
    const double uniform =
        std::pow(2 * std::numbers::pi * variance, axes / 2) * kOutliers / (1 - kOutliers) * m / n;
    const RowVectorXd sums = p.colwise().sum().array() + uniform;
    p.array().rowwise() /= sums.array();
    const VectorXd found = p.rowwise().sum();
    const MatrixXd pull = p * x;
    const double energy = -sums.array().log().sum() + n * axes * std::log(variance) / 2 +
                          kWeight / 2 * (w.transpose() * kernel * w).trace();
    if (k > 0 && std::abs((energy - last) / energy) < kSettled) break;
    last = energy;
    MatrixXd left = found.asDiagonal() * kernel;
    left.diagonal().array() += kWeight * variance;
    w = left.partialPivLu().solve(pull - found.asDiagonal() * y);
    t = y + kernel * w;
    const double all = found.sum();
    variance = std::abs(p.colwise().sum().dot(x.rowwise().squaredNorm()) - 2 * pull.cwiseProduct(t).sum() +
                        found.dot(t.rowwise().squaredNorm())) /
               (all * axes);
  }
  const MatrixXd placed = (t * x_scale).rowwise() + x_centre;
  PointSet warped{from.axes, {}};
  for (Index i = 0; i < placed.rows(); ++i)
    for (Index c = 0; c < placed.cols(); ++c) warped.coordinates.push_back(placed(i, c));
  return warped;
}

std::string compare_matching(int trials) {
  struct Level {
    const char* name;
    BentScene scene;
  };
  const Level levels[] = {{"bend 0.03", {.bend = 0.03}},
                          {"bend 0.06", {.bend = 0.06}},
                          {"bend 0.08", {.bend = 0.08}},
                          {"noise 0.03", {.noise_sd = 0.03}},
                          {"noise 0.05", {.noise_sd = 0.05}},
                          {"strangers 1 to 1", {.outlier_ratio = 1}},
                          {"strangers 2 to 1", {.outlier_ratio = 2}},
                          {"a third missing", {.missing_fraction = 0.33}},
                          {"turned by 30 deg", {.turn_deg = 30}},
                          {"turned by 135 deg", {.turn_deg = 135}},
                          {"in space", {.axes = 3}}};
  std::string csv =
      "level,trials,template_points,ours_mean_distance,rival_mean_distance,ours_above_0.05,rival_above_0.05,"
      "ours_reliable,ours_cpu_median_ms,rival_cpu_median_ms\n";
  for (const auto& [name, scene] : levels) {
    Tally ours, rival;
    int reliable = 0;
    size_t count = 0;
    for (int trial = 0; trial < trials; ++trial) {
      BentScene one = scene;
      one.seed = static_cast<uint32_t>(1 + trial);
      const BentPoints points = bent(one);
      count = points.from.size();
      MatchResult result;
      ours.ms.push_back(time_runs([&] { result = match_points(points.from, points.to); }, 1).cpu_ms);
      PointSet drifted;
      rival.ms.push_back(time_runs([&] { drifted = drift_points(points.from, points.to); }, 1).cpu_ms);
      ours.add(result.warped, points.truth);
      rival.add(drifted, points.truth);
      reliable += result.reliable();
    }
    const std::string row =
        text("%s,%d,%zu,%.5f,%.5f,%.3f,%.3f,%.3f,%.2f,%.2f\n", name, trials, count, ours.miss / trials,
             rival.miss / trials, static_cast<double>(ours.failures) / trials,
             static_cast<double>(rival.failures) / trials, static_cast<double>(reliable) / trials,
             quartiles(ours.ms).median, quartiles(rival.ms).median);
    say(row);
    csv += row;
  }
  return csv;
}

}  // namespace palpate::perf
