#include "engine/motion/repeats.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <vector>

#include "engine/numeric/dense.h"

namespace palpate {
namespace {

using Level = ContactSurface::Level;

constexpr double kWidest_px = 64;

const Level& relief_level(const ContactSurface& surface) {
  size_t k = 0;
  while (k + 1 < surface.levels().size() &&
         2 * surface.radius_mm() > kWidest_px * surface.levels()[k].pitch_mm)
    ++k;
  return surface.levels()[k];
}

/// What a paraboloid leaves of the depth, NaN outside of the contact.
std::vector<float> bare_relief(const Level& level, double radius_px) {
  using Terms = Eigen::Matrix<double, 6, 1>;
  const double middle_x = level.width / 2.0, middle_y = level.height / 2.0;
  const auto terms = [&](size_t k) {
    const double x = (double{level.column[k]} - middle_x) / radius_px,
                 y = (double{level.row[k]} - middle_y) / radius_px;
    return Terms(1, x, y, x * x, x * y, y * y);
  };
  Eigen::MatrixXd square = Eigen::MatrixXd::Zero(6, 6), right = Eigen::MatrixXd::Zero(6, 1);
  for (size_t k = 0; k < level.inside.size(); ++k) {
    const Terms row = terms(k);
    square += row * row.transpose();
    right += row * double{level.depth[level.inside[k]]};
  }
  const Eigen::MatrixXd smooth = dense::Ldlt(square).solve(right);
  std::vector<float> out(level.mask.size(), std::numeric_limits<float>::quiet_NaN());
  for (size_t k = 0; k < level.inside.size(); ++k)
    out[level.inside[k]] =
        level.depth[level.inside[k]] - static_cast<float>(terms(k).dot(Terms(smooth.col(0))));
  return out;
}

/// SelfCorrelations of a relief with itself over shifts of up to `reach` px; those to the left are those to
/// the right.
class SelfCorrelations {
 public:
  SelfCorrelations(const Level& level, const std::vector<float>& relief, int reach)
      : reach_(reach), side_(2 * reach + 1), value_(size_t(side_) * size_t(reach + 1)) {
    for (int dy = 0; dy <= reach; ++dy)
      for (int dx = -reach; dx <= reach; ++dx) at(dx, dy) = correlation(level, relief, dx, dy);
  }
  /// The largest that is not joined to no shift at all by others of no less than `least`.
  double largest_apart(double least) {
    std::vector<std::pair<int, int>> waiting = {{0, 0}};
    at(0, 0) = 0;
    while (!waiting.empty()) {
      const auto [x, y] = waiting.back();
      waiting.pop_back();
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) {
          if (std::abs(x + dx) > reach_ || std::abs(y + dy) > reach_ || at(x + dx, y + dy) < least) continue;
          at(x + dx, y + dy) = 0;
          waiting.emplace_back(x + dx, y + dy);
        }
    }
    return *std::ranges::max_element(value_);
  }

 private:
  double& at(int dx, int dy) {
    if (dy < 0 || (dy == 0 && dx < 0)) return at(-dx, -dy);
    return value_[size_t(dy) * size_t(side_) + size_t(dx + reach_)];
  }
  double correlation(const Level& level, const std::vector<float>& relief, int dx, int dy) const {
    constexpr double kShared = 0.5;
    constexpr size_t kSamples = 1500;  // pixels that stand for all
    if (dx * dx + dy * dy > reach_ * reach_) return 0;
    const size_t stride = std::max<size_t>(level.inside.size() / kSamples, 1);
    double product = 0, here = 0, there = 0, shared = 0, all = 0;
    for (size_t k = 0; k < level.inside.size(); k += stride) {
      const uint32_t pixel = level.inside[k];
      const int x = int(pixel % level.width) + dx, y = int(pixel / level.width) + dy;
      ++all;
      if (x < 0 || y < 0 || x >= int(level.width) || y >= int(level.height)) continue;
      const double a = double{relief[pixel]}, b = double{relief[size_t(y) * level.width + size_t(x)]};
      if (std::isnan(b)) continue;
      ++shared;
      product += a * b;
      here += a * a;
      there += b * b;
    }
    if (shared < kShared * all || here <= 0 || there <= 0) return 0;
    return std::max(product / std::sqrt(here * there), 0.0);
  }

  int reach_, side_;
  std::vector<double> value_;
};

}  // namespace

double fits_elsewhere(const ContactSurface& surface, double most_mm, double least_slope) {
  const Level& level = relief_level(surface);
  if (level.inside.size() < 60) return 0;
  const std::vector<float> relief = bare_relief(level, surface.radius_mm() / level.pitch_mm);
  double squares = 0, count = 0;
  for (const uint32_t step : {1u, level.width})
    for (const uint32_t pixel : level.inside) {
      const size_t other = size_t{pixel} + step;
      if (other >= relief.size() || std::isnan(relief[other])) continue;
      squares += std::pow(double{relief[other]} - double{relief[pixel]}, 2);
      ++count;
    }
  if (count == 0 || std::sqrt(2 * squares / count) < least_slope * level.pitch_mm) return 0;
  const int reach = static_cast<int>(most_mm / level.pitch_mm);
  return SelfCorrelations(level, relief, reach).largest_apart(kRepeats);
}

}  // namespace palpate
