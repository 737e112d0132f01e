#include "engine/motion/pad_error.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace palpate {

PadError::PadError(double slope_sd, double reach_mm, double way_mm, double pitch_mm, double radius_mm)
    : slope_sd_(slope_sd), pitch_mm_(pitch_mm), radius_mm_(radius_mm), way_mm_(way_mm) {
  if (reach_mm <= 0) return;
  while (first_ + 1 < end_ && std::numbers::sqrt2 * ScoreNoise::reach_px(first_) * pitch_mm < reach_mm)
    ++first_;
  end_ = first_ + 1;
}

/// Of a reach's covariance after the way.
double PadError::left(size_t reach) const {
  const double reach_mm = ScoreNoise::reach_px(reach) * pitch_mm_;
  return std::exp(-way_mm_ * way_mm_ / (2 * reach_mm * reach_mm));
}

double PadError::mean_left() const {
  double sum = 0;
  for (size_t k = first_; k < end_; ++k) sum += left(k);
  return sum / double(end_ - first_);
}

/// How many pieces of the contact err independently of each other, at least 1: its area over that of the
/// square of the errors' correlation.
double PadError::pieces() const {
  double square_px2 = 0;
  for (size_t i = first_; i < end_; ++i)
    for (size_t j = first_; j < end_; ++j) {
      const double a = std::pow(ScoreNoise::reach_px(i), 2), b = std::pow(ScoreNoise::reach_px(j), 2);
      square_px2 += 2 * a * b / (a + b);
    }
  square_px2 /= std::pow(double(end_ - first_), 2);
  return std::max(std::pow(radius_mm_ / pitch_mm_, 2) / square_px2, 1.0);
}

double PadError::slope_of_place() const {
  constexpr double kSure = 2;  // standard deviations of the mean square
  return slope_sd_ * std::sqrt(1 + kSure * mean_left() * std::sqrt(2 / pieces()));
}

ScoreNoise PadError::noise(double precision) const {
  ScoreNoise noise;
  for (size_t k = first_; k < end_; ++k) {
    const double depth_sd_mm = slope_sd_ * ScoreNoise::reach_px(k) * pitch_mm_;
    noise.variance[k] = 2 * (1 - left(k)) * depth_sd_mm * depth_sd_mm * precision / double(end_ - first_);
  }
  return noise;
}

}  // namespace palpate
