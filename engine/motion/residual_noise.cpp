#include "engine/motion/residual_noise.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <span>

namespace palpate {
namespace {

constexpr size_t kReaches = ScoreNoise::kReaches;

struct Variogram {
  std::vector<double> way_px, half_square, pairs;
};

Variogram variogram(const ScoreField& field, double most_px) {
  std::vector<float> at(size_t{field.width} * field.height, NAN);
  for (size_t i = 0; i < field.pixel.size(); ++i) at[field.pixel[i]] = field.score[i];
  Variogram out;
  for (const uint32_t way : {1u, 2u, 3u, 4u, 6u, 8u, 12u, 16u, 24u, 32u, 48u}) {
    if (way > std::max(most_px, 6.0)) break;
    double sum = 0, pairs = 0;
    for (size_t i = 0; i < field.pixel.size(); ++i) {
      const uint32_t pixel = field.pixel[i];
      const auto add = [&](bool within, size_t other) {
        if (!within || std::isnan(at[other])) return;
        const double difference = double{at[pixel]} - double{at[other]};
        sum += difference * difference / 2;
        pairs += 1;
      };
      add(pixel % field.width + way < field.width, size_t{pixel} + way);
      add(pixel / field.width + way < field.height, pixel + size_t{way} * field.width);
    }
    if (pairs < 30) break;
    out.way_px.push_back(way);
    out.half_square.push_back(sum / pairs);
    out.pairs.push_back(pairs);
  }
  return out;
}

/// Minimises |weight (basis x - right)|^2 over x >= 0, one coordinate at a time.
std::array<double, kReaches> nonnegative_fit(const std::vector<std::array<double, kReaches>>& basis,
                                             const std::vector<double>& right,
                                             const std::vector<double>& weight) {
  std::array<double, kReaches> x{};
  std::array<std::array<double, kReaches>, kReaches> square{};
  std::array<double, kReaches> gradient{};  // of half the sum, at x = 0 less
  for (size_t i = 0; i < right.size(); ++i)
    for (size_t a = 0; a < kReaches; ++a) {
      gradient[a] += weight[i] * basis[i][a] * right[i];
      for (size_t b = 0; b < kReaches; ++b) square[a][b] += weight[i] * basis[i][a] * basis[i][b];
    }
  for (int sweep = 0; sweep < 2000; ++sweep)
    for (size_t a = 0; a < kReaches; ++a) {
      if (square[a][a] <= 0) continue;
      double left = gradient[a];
      for (size_t b = 0; b < kReaches; ++b)
        if (b != a) left -= square[a][b] * x[b];
      x[a] = std::max(left / square[a][a], 0.0);
    }
  return x;
}

/// Six fields, one after another, on cells of a map.
struct Cells {
  uint32_t width = 0, height = 0;
  std::vector<float> value;  ///< six to a cell

  float* at(size_t cell) { return value.data() + 6 * cell; }
  const float* at(size_t cell) const { return value.data() + 6 * cell; }
};

Cells halved(const Cells& fine) {
  Cells out{.width = (fine.width + 1) / 2, .height = (fine.height + 1) / 2, .value = {}};
  out.value.resize(size_t{6} * out.width * out.height);
  for (uint32_t row = 0; row < fine.height; ++row)
    for (uint32_t column = 0; column < fine.width; ++column) {
      const float* from = fine.at(size_t{row} * fine.width + column);
      float* to = out.at(size_t{row / 2} * out.width + column / 2);
      for (int k = 0; k < 6; ++k) to[k] += from[k];
    }
  return out;
}

/// Each cell is the sum of its neighbours along x or y, by a Gaussian of 1.5 cells whose middle is 1.
Cells spread(const Cells& in, bool along_x) {
  constexpr int kFar = 5;
  std::array<float, kFar + 1> kernel{};
  for (size_t k = 0; k <= kFar; ++k)
    kernel[k] = static_cast<float>(std::exp(-double(k * k) / (2 * 1.5 * 1.5)));
  Cells out{.width = in.width, .height = in.height, .value = std::vector<float>(in.value.size())};
  const int length = static_cast<int>(along_x ? in.width : in.height);
  const int step = along_x ? 1 : static_cast<int>(in.width);
  for (uint32_t row = 0; row < in.height; ++row)
    for (uint32_t column = 0; column < in.width; ++column) {
      const auto here = static_cast<std::ptrdiff_t>(size_t{row} * in.width + column);
      const int place = static_cast<int>(along_x ? column : row);
      float* to = out.at(static_cast<size_t>(here));
      for (int k = std::max(-kFar, -place); k <= std::min(kFar, length - 1 - place); ++k) {
        const float* from = in.at(static_cast<size_t>(here + std::ptrdiff_t{k} * step));
        const float weight = kernel[static_cast<size_t>(std::abs(k))];
        for (int c = 0; c < 6; ++c) to[c] += weight * from[c];
      }
    }
  return out;
}

void add_products(Matrix6d& sum, const Cells& a, const Cells& b, double factor) {
  using Columns = Eigen::Map<const Eigen::Matrix<float, 6, Eigen::Dynamic>>;
  const auto cells = static_cast<Eigen::Index>(size_t{a.width} * a.height);
  const Columns left(a.value.data(), 6, cells), right(b.value.data(), 6, cells);
  constexpr Eigen::Index kPart = 1024;  // of single precision, before it goes into double
  for (Eigen::Index first = 0; first < cells; first += kPart) {
    const Eigen::Index part = std::min(kPart, cells - first);
    const Eigen::Matrix<float, 6, 6> products =
        left.middleCols(first, part) * right.middleCols(first, part).transpose();
    sum += factor * products.cast<double>();
  }
}

/// The rows on the smallest rectangle that holds them.
Cells rows_on_map(const ScoreField& field) {
  uint32_t left = field.width, right = 0, top = field.height, bottom = 0;
  for (const uint32_t pixel : field.pixel) {
    left = std::min(left, pixel % field.width);
    right = std::max(right, pixel % field.width);
    top = std::min(top, pixel / field.width);
    bottom = std::max(bottom, pixel / field.width);
  }
  Cells out{.width = right - left + 1, .height = bottom - top + 1, .value = {}};
  out.value.resize(size_t{6} * out.width * out.height);
  for (size_t i = 0; i < field.pixel.size(); ++i) {
    const uint32_t x = field.pixel[i] % field.width - left, y = field.pixel[i] / field.width - top;
    std::copy(field.row[i].begin(), field.row[i].end(), out.at(size_t{y} * out.width + x));
  }
  return out;
}

/// Half square of differences over a way that noise of variance 1 and that reach leaves on a round contact,
/// once the fit has taken away its tilt.
double seen_of(double reach_px, double way_px, double radius_px) {
  if (reach_px <= 0) return 1;
  constexpr double kLeast = 0.2;  // part of it; of less the variance would be a guess
  const double whole = 1 - std::exp(-way_px * way_px / (2 * reach_px * reach_px));
  // Of noise that is short beside the contact; of long noise the slope itself.
  const double tilt_square =
      std::min(8 * std::pow(reach_px, 2) / std::pow(radius_px, 4), std::pow(reach_px, -2));
  return std::max(whole - tilt_square * way_px * way_px / 2, kLeast * whole);
}

}  // namespace

ScoreNoise score_noise(const ScoreField& field, double most_px) {
  ScoreNoise noise;
  const Variogram seen = variogram(field, most_px);
  std::vector<std::array<double, kReaches>> basis;
  std::vector<double> weight;
  for (size_t i = 0; i < seen.way_px.size(); ++i) {
    std::array<double, kReaches> line{};
    for (size_t k = 0; k < kReaches; ++k) {
      line[k] = seen_of(ScoreNoise::reach_px(k), seen.way_px[i], most_px);
    }
    basis.push_back(line);
    const double size = std::max(seen.half_square[i], 1e-30);
    weight.push_back(1 / (size * size));
  }
  noise.variance = nonnegative_fit(basis, seen.half_square, weight);
  return noise;
}

Matrix6d gradient_covariance(const ScoreField& field, const ScoreNoise& noise) {
  Matrix6d sum = Matrix6d::Zero();
  if (field.pixel.empty()) return sum;
  Cells cells = rows_on_map(field);
  if (noise.variance[0] > 0) add_products(sum, cells, cells, noise.variance[0]);
  for (size_t k = 1; k < kReaches; ++k) {
    if (k > 1) cells = halved(cells);
    if (noise.variance[k] <= 0) continue;
    add_products(sum, cells, spread(spread(cells, true), false), noise.variance[k]);
  }
  return (sum + sum.transpose()) / 2;
}

}  // namespace palpate
