#include "engine/lump/observation/gaussian_profile.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "engine/base/statistics.h"
#include "engine/numeric/dense.h"
#include "palpate/error.h"

namespace palpate::lump {
namespace {

using Four = Eigen::Vector4d;  // amplitude, centre, width, offset

double gaussian(const Four& p, double x) {
  const double t = (x - p(1)) / p(2);
  return p(0) * std::exp(-0.5 * t * t) + p(3);
}

double square_sum(const Profile& profile, const Four& p) {
  double sum = 0;
  for (size_t i = 0; i < profile.x_mm.size(); ++i) {
    const double r = profile.value[i] - gaussian(p, profile.x_mm[i]);
    sum += r * r;
  }
  return sum;
}

/// Amplitude and offset are linear: the best ones for a centre and a width.
Four with_best_height(const Profile& profile, double center, double width) {
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  for (size_t i = 0; i < profile.x_mm.size(); ++i) {
    const double t = (profile.x_mm[i] - center) / width;
    const Eigen::Vector2d row(std::exp(-0.5 * t * t), 1);
    normal += row * row.transpose();
    right += row * profile.value[i];
  }
  const Eigen::Vector2d best = dense::solve_ldlt<2>(normal, right);
  return {best(0), center, width, best(1)};
}

struct Normal {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Zero();
  Four right = Four::Zero();
};
Normal normal_equations(const Profile& profile, const Four& p) {
  Normal n;
  for (size_t i = 0; i < profile.x_mm.size(); ++i) {
    const double t = (profile.x_mm[i] - p(1)) / p(2), e = std::exp(-0.5 * t * t);
    const Four slope(e, p(0) * e * t / p(2), p(0) * e * t * t / p(2), 1);
    n.matrix += slope * slope.transpose();
    n.right += slope * (profile.value[i] - gaussian(p, profile.x_mm[i]));
  }
  return n;
}

}  // namespace

double GaussianFit::at(double x) const {
  return gaussian({amplitude, center_mm, width_mm, offset}, x);
}

std::array<double, 2> bump_center_mm(const PressureMap& map, double fraction) {
  const auto level = static_cast<double>(median(map.values));
  const double middle_x = (map.width - 1) / 2.0, middle_y = (map.height - 1) / 2.0;
  double sum = 0, x = 0, y = 0, largest = 0;
  const auto visit = [&](auto&& take) {
    for (uint32_t j = 0; j < map.height; ++j)
      for (uint32_t i = 0; i < map.width; ++i)
        if (std::abs(i - middle_x) <= fraction * middle_x && std::abs(j - middle_y) <= fraction * middle_y)
          take(i - middle_x, j - middle_y, std::abs(static_cast<double>(map.at(i, j)) - level));
  };
  visit([&](double, double, double bump) { largest = std::max(largest, bump); });
  visit([&](double i, double j, double bump) {
    if (bump < 0.5 * largest) return;  // the flanks of the bump, not the block's own slope
    sum += bump;
    x += bump * i;
    y += bump * j;
  });
  if (!(sum > 0)) return {0, 0};
  return {x / sum * map.pitch_mm[0], y / sum * map.pitch_mm[1]};
}

Profile profile_along_x(const PressureMap& map, double y_mm) {
  const double row = std::clamp(y_mm / map.pitch_mm[1] + (map.height - 1) / 2.0, 0.0, map.height - 1.0);
  const auto j = std::min(static_cast<uint32_t>(row), map.height - 2);
  const double t = row - j;
  Profile profile;
  for (uint32_t i = 0; i < map.width; ++i) {
    profile.x_mm.push_back((i - (map.width - 1) / 2.0) * map.pitch_mm[0]);
    profile.value.push_back((1 - t) * static_cast<double>(map.at(i, j)) +
                            t * static_cast<double>(map.at(i, j + 1)));
  }
  return profile;
}

Profile inner_part(const Profile& profile, double half_width_mm) {
  Profile part;
  for (size_t i = 0; i < profile.x_mm.size(); ++i)
    if (std::abs(profile.x_mm[i]) <= half_width_mm) {
      part.x_mm.push_back(profile.x_mm[i]);
      part.value.push_back(profile.value[i]);
    }
  return part;
}

GaussianFit fit_gaussian(const Profile& profile) {
  const size_t count = profile.x_mm.size();
  if (count < 6)
    throw Error(Failure::Input, "six points or more to fit a Gaussian to", std::to_string(count),
                "a longer profile");
  double mean = 0;
  for (size_t i = 0; i < count; ++i) {
    if (!std::isfinite(profile.x_mm[i]) || !std::isfinite(profile.value[i]))
      throw Error(Failure::Input, "numbers in a profile", "one that is not finite", "another map");
    mean += profile.value[i] / static_cast<double>(count);
  }
  const double length = profile.x_mm.back() - profile.x_mm.front();
  const double step = length / static_cast<double>(count - 1);

  // A coarse search finds the valley, so that a dip or an off-centre bump is not missed.
  Four best = with_best_height(profile, profile.x_mm[count / 2], length / 4);
  double error = square_sum(profile, best);
  for (size_t i = 0; i < count; i += std::max<size_t>(1, count / 24))
    for (const double width : {2 * step, length / 16, length / 8, length / 4, length / 2}) {
      const Four p = with_best_height(profile, profile.x_mm[i], width);
      if (const double e = square_sum(profile, p); e < error) {
        best = p;
        error = e;
      }
    }
  double damping = 1e-3;
  bool ended = false;
  for (int round = 0; round < 200 && !ended; ++round) {
    const Normal n = normal_equations(profile, best);
    Eigen::Matrix4d damped = n.matrix;
    damped.diagonal() *= 1 + damping;
    const Four step_by = dense::solve_ldlt<4>(damped, n.right);
    Four next = best + step_by;
    next(2) = std::abs(next(2));
    const double e = next.allFinite() && next(2) > 0 ? square_sum(profile, next) : HUGE_VAL;
    if (e <= error) {
      ended = error - e <= 1e-14 * error || error == 0;
      best = next;
      error = e;
      damping = std::max(damping / 10, 1e-12);
    } else {
      damping *= 10;
      ended = damping > 1e12;
    }
  }

  GaussianFit fit;
  fit.amplitude = best(0);
  fit.center_mm = best(1);
  fit.width_mm = best(2);
  fit.offset = best(3);
  fit.residual_rms = std::sqrt(error / static_cast<double>(count - 4));
  double spread = 0;
  for (const double v : profile.value) spread += (v - mean) * (v - mean);
  fit.r_squared = spread > 0 ? 1 - error / spread : 0;
  const Eigen::FullPivLU<Eigen::Matrix4d> normal(normal_equations(profile, best).matrix);
  const bool determined = normal.isInvertible();
  if (determined) {
    const Eigen::Matrix4d covariance = normal.inverse() * fit.residual_rms * fit.residual_rms;
    for (int i = 0; i < 4; ++i) fit.sd[i] = std::sqrt(std::max(0.0, covariance(i, i)));
  } else {
    fit.sd.fill(HUGE_VAL);
  }
  fit.found = ended && determined && fit.width_mm > 0.5 * step && fit.width_mm < length &&
              std::abs(fit.center_mm) < length && std::abs(fit.amplitude) > 3 * fit.sd[0] &&
              std::abs(fit.amplitude) > 1e-9 * std::abs(fit.offset);
  return fit;
}

}  // namespace palpate::lump
