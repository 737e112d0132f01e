#include "engine/lump/observation/fixed_pattern.h"

#include <cmath>

#include "engine/numeric/dense.h"

namespace palpate::lump {
namespace {

// Matrix that makes values of unit variance, correlated over a length, of white noise on nodes beyond both
// ends.
Eigen::MatrixXd smoothing(uint32_t nodes, Eigen::Index beyond, double length) {
  Eigen::MatrixXd taps(nodes, nodes + 2 * beyond);
  for (Eigen::Index i = 0; i < taps.rows(); ++i) {
    for (Eigen::Index j = 0; j < taps.cols(); ++j) {
      const double off = static_cast<double>(i + beyond - j) / length;
      taps(i, j) = std::exp(-off * off);
    }
    taps.row(i).normalize();
  }
  return taps;
}

}  // namespace

Eigen::MatrixXd fixed_pattern(uint32_t width, uint32_t height, double pitch_mm, double length_mm,
                              std::mt19937_64& random) {
  const double length = length_mm / pitch_mm;
  const auto beyond = static_cast<Eigen::Index>(std::ceil(2.5 * length));
  std::normal_distribution<double> normal;
  Eigen::MatrixXd white(height + 2 * beyond, width + 2 * beyond);
  for (Eigen::Index j = 0; j < white.rows(); ++j)
    for (Eigen::Index i = 0; i < white.cols(); ++i) white(j, i) = normal(random);
  if (length < 1e-3) return white.block(beyond, beyond, height, width);
  return dense::product_nt(dense::product(smoothing(height, beyond, length), white),
                           smoothing(width, beyond, length));
}

PatternKind any_pattern(std::mt19937_64& random) {
  std::uniform_real_distribution<double> share(0, 1);
  PatternKind kind;
  const double white = share(random), length = share(random);
  if (white > 0.25) kind.length_mm = std::pow(12.0, length);
  kind.gain = share(random) < 0.5;
  return kind;
}

}  // namespace palpate::lump
