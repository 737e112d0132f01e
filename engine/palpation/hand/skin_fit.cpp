#include "engine/palpation/hand/skin_fit.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "engine/base/statistics.h"
#include "engine/numeric/dense.h"

namespace palpate {
namespace {

constexpr std::array<double, 2> kFitFine_mm = {0.25, 0.12}, kFitSlow_mm = {0.9, 0.5};
constexpr int kMostFitSteps = 20;
constexpr double kStill_mm = 0.002;
constexpr double kRanOff_mm = 1.5, kMostStretch = 0.1;
constexpr size_t kLeastPixels = 300;
constexpr double kLeastCorrelation = 0.35;

Eigen::Vector2d swing(const SkinFit& fit, const Eigen::Vector2d& p) {
  const double c = std::cos(fit.turn_rad), s = std::sin(fit.turn_rad);
  const Eigen::Vector2d from = p - fit.from_mm;
  return {fit.stretch * (c * from[0] - s * from[1]), fit.stretch * (s * from[0] + c * from[1])};
}

/// What one pixel of the first relief says.
struct Compared {
  double first, second;
  Eigen::Vector4d slope;  ///< of the second's value, by shift along x and y, turn and stretch
};

Eigen::Vector2d middle_of(const TextureMap& map, int x, int y) {
  return Eigen::Vector2d(x - (map.width - 1) / 2.0, y - (map.height - 1) / 2.0) * map.pitch_mm;
}

bool between(const TextureMap& map, const Eigen::Vector2d& at_mm, float& value) {
  return texture_between(map, at_mm[0] / map.pitch_mm + (map.width - 1) / 2.0,
                         at_mm[1] / map.pitch_mm + (map.height - 1) / 2.0, value);
}

/// Central differences over a pixel to either side; false where one is not seen.
bool slope_at(const TextureMap& map, const Eigen::Vector2d& at_mm, Eigen::Vector2d& slope) {
  for (int c = 0; c < 2; ++c) {
    const Eigen::Vector2d step = Eigen::Vector2d::Unit(c) * map.pitch_mm;
    float before = 0, behind = 0;
    if (!between(map, at_mm - step, before) || !between(map, at_mm + step, behind)) return false;
    slope[c] = double{behind - before} / (2 * map.pitch_mm);
  }
  return true;
}

std::vector<Compared> compare(const TextureMap& first, const TextureMap& second, const SkinFit& fit) {
  std::vector<Compared> out;
  const double c = std::cos(fit.turn_rad), s = std::sin(fit.turn_rad);
  for (int y = 1; y + 1 < first.height; ++y)
    for (int x = 1; x + 1 < first.width; ++x) {
      const size_t n = first.at(x, y);
      if (!first.seen[n]) continue;
      const Eigen::Vector2d here = middle_of(first, x, y), arm = swing(fit, here);
      const Eigen::Vector2d there = arm + fit.at_mm;
      float value = 0;
      Eigen::Vector2d own, other;
      if (!between(second, there, value) || !slope_at(second, there, other) || !slope_at(first, here, own))
        continue;
      // The mean of both reliefs' slopes makes the steps those of second order.
      const Eigen::Vector2d mean =
          0.5 * (other + Eigen::Vector2d(c * own[0] - s * own[1], s * own[0] + c * own[1]));
      out.push_back({double{first.value[n]},
                     double{value},
                     {mean[0], mean[1], mean[1] * arm[0] - mean[0] * arm[1], mean.dot(arm)}});
    }
  return out;
}

struct Step {
  Eigen::Vector4d step;
  Eigen::Matrix4d covariance;
  double correlation = 0;
};

/// Cauchy's weights about the differences' median; `alike`: pixels that err alike.
Step solve(const std::vector<Compared>& pixels, double alike) {
  double product = 0, first = 0, second = 0;
  for (const Compared& p : pixels) {
    product += p.first * p.second;
    first += p.first * p.first;
    second += p.second * p.second;
  }
  Step out;
  out.correlation = first > 0 && second > 0 ? product / std::sqrt(first * second) : 0;
  const double height = second > 0 ? std::sqrt(first / second) : 1;
  std::vector<double> off;
  off.reserve(pixels.size());
  for (const Compared& p : pixels) off.push_back(std::abs(p.first - height * p.second));
  const double spread = std::max(1.4826 * median(off), 1e-9);
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  Eigen::Vector4d right = Eigen::Vector4d::Zero();
  double square = 0, weights = 0;
  for (const Compared& p : pixels) {
    const double difference = p.first - height * p.second;
    const double weight = 1 / (1 + std::pow(difference / (2 * spread), 2));
    normal += weight * p.slope * p.slope.transpose();
    right += weight * difference * p.slope;
    square += weight * difference * difference;
    weights += weight;
  }
  normal.diagonal().array() += 1e-9;
  const Eigen::Matrix4d inverse = dense::inverse(normal);
  out.step = inverse * right;
  out.covariance = alike * square / weights * inverse;
  return out;
}

/// On one level; false where it runs off.
bool settle(const TextureMap& first, const TextureMap& second, double fine_mm, SkinFit& fit) {
  // Means by a Gauss function err alike over 4 pi of its variance.
  const double alike = std::max(1.0, 4 * std::numbers::pi * std::pow(fine_mm / first.pitch_mm, 2));
  const Eigen::Vector2d start = fit.at_mm;
  for (int round = 0; round < kMostFitSteps; ++round) {
    const std::vector<Compared> pixels = compare(first, second, fit);
    if (pixels.size() < kLeastPixels) return false;
    const Step last = solve(pixels, alike);
    fit.at_mm += last.step.head<2>();
    fit.turn_rad += last.step[2];
    fit.stretch *= 1 + std::clamp(last.step[3], -0.02, 0.02);
    fit.covariance = last.covariance;
    fit.correlation = last.correlation;
    if ((fit.at_mm - start).norm() > kRanOff_mm || std::abs(fit.stretch - 1) > kMostStretch) return false;
    if (last.step.head<2>().norm() < kStill_mm && std::abs(last.step[2]) < kStill_mm / 10) return true;
  }
  return false;
}

/// Middle and number of the first relief's pixels that the second sees too.
size_t shared(const TextureMap& first, const TextureMap& second, const RigidMotion& motion,
              Eigen::Vector2d& middle) {
  size_t count = 0;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (int y = 0; y < first.height; ++y)
    for (int x = 0; x < first.width; ++x) {
      const Eigen::Vector2d here = middle_of(first, x, y);
      const Eigen::Vector3d there = motion * Eigen::Vector3d(here[0], here[1], 0);
      float unused = 0;
      if (!first.seen[first.at(x, y)] || !between(second, there.head<2>(), unused)) continue;
      ++count;
      sum += here;
    }
  if (count > 0) middle = sum / static_cast<double>(count);
  return count;
}

}  // namespace

SkinLevels::SkinLevels(const SkinRelief& relief)
    : texture{skin_texture(relief, kFitFine_mm[0], kFitSlow_mm[0]),
              skin_texture(relief, kFitFine_mm[1], kFitSlow_mm[1])} {}

RigidMotion SkinFit::motion() const {
  RigidMotion out{turn_of({0, 0, turn_rad}), {at_mm[0], at_mm[1], 0}};
  out.shift_mm -= out.turn * Eigen::Vector3d(from_mm[0], from_mm[1], 0);
  return out;
}

std::optional<SkinFit> fit_skin(const SkinLevels& first, const SkinLevels& second, const RigidMotion& start) {
  const TextureMap &a = first.texture.back(), &b = second.texture.back();
  SkinFit fit;
  const size_t count = shared(a, b, start, fit.from_mm);
  if (count < kLeastPixels) return std::nullopt;
  fit.at_mm = (start * Eigen::Vector3d(fit.from_mm[0], fit.from_mm[1], 0)).head<2>();
  fit.turn_rad = turn_vector(start.turn)[2];
  for (size_t level = 0; level < first.texture.size(); ++level)
    if (!settle(first.texture[level], second.texture[level], kFitFine_mm[level], fit)) return std::nullopt;
  if (fit.correlation < kLeastCorrelation) return std::nullopt;
  const auto seen = [](const TextureMap& of) { return std::ranges::count(of.seen, uint8_t{1}); };
  fit.overlap = static_cast<double>(count) / static_cast<double>(std::min(seen(a), seen(b)));
  return fit;
}

}  // namespace palpate
