#include "engine/calibrate/ball/ramp.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "engine/base/statistics.h"
#include "engine/numeric/dense.h"

namespace palpate {
namespace {

constexpr size_t kEnoughForPlace = 18;
constexpr int kRampRounds = 20;
constexpr double kSmallest = 0.02;  // difference of logarithms up to which all count alike
constexpr double kLeastRamp = 1e-9;

}  // namespace

std::vector<double> usual_ramps(std::span<const FoundBall> balls, const FrameFormat& format) {
  std::vector<double> ramps;
  for (const FoundBall& ball : balls) ramps.push_back(std::max(ball.ramp_per_px, kLeastRamp));
  if (ramps.size() < kEnoughForPlace) {
    if (!ramps.empty()) ramps.assign(ramps.size(), median(ramps));
    return ramps;
  }
  const auto n = static_cast<Eigen::Index>(ramps.size());
  Eigen::MatrixXd places(n, 6);
  Eigen::VectorXd logs(n), left(n), weights = Eigen::VectorXd::Ones(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const FoundBall& ball = balls[static_cast<size_t>(i)];
    const double x = 2 * ball.center_x_px / format.width - 1, y = 2 * ball.center_y_px / format.height - 1;
    places.row(i) << 1, x, y, x * x, x * y, y * y;
    logs[i] = std::log(ramps[static_cast<size_t>(i)]);
  }
  for (int round = 0; round < kRampRounds; ++round) {
    const Eigen::VectorXd terms =
        dense::least_squares(weights.asDiagonal() * places, weights.cwiseProduct(logs));
    left = dense::minus_product(logs, places, terms);
    weights = left.cwiseAbs().cwiseMax(kSmallest).cwiseInverse().cwiseSqrt();
  }
  for (Eigen::Index i = 0; i < n; ++i) ramps[static_cast<size_t>(i)] = std::exp(logs[i] - left[i]);
  return ramps;
}

}  // namespace palpate
