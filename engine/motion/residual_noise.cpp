#include "engine/motion/residual_noise.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

namespace palpate {
namespace {

constexpr size_t kReaches = ScoreNoise::kReaches;
using Cells = ReachSums::Cells;

struct Variogram {
  std::vector<uint32_t> way_px;
  std::vector<double> half_square;
};

std::vector<float> on_map(const ScoreField& field) {
  std::vector<float> at(size_t{field.width} * field.height, NAN);
  for (size_t i = 0; i < field.pixel.size(); ++i) at[field.pixel[i]] = field.score[i];
  return at;
}

Variogram variogram(const ScoreField& field, double most_px) {
  const std::vector<float> at = on_map(field);
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
  // Whole rows for each neighbour: what lies side by side is added side by side.
  const auto add = [&](uint32_t from, uint32_t to, uint32_t cells, float weight) {
    const float* const source = in.at(from);
    float* const sum = out.at(to);
    for (size_t i = 0; i < size_t{6} * cells; ++i) sum[i] += weight * source[i];
  };
  for (uint32_t row = 0; row < in.height; ++row)
    for (int k = -kFar; k <= kFar; ++k) {
      const auto way = static_cast<uint32_t>(std::abs(k));
      const float weight = kernel[way];
      const uint32_t here = row * in.width;
      if (!along_x) {
        const bool within = k < 0 ? way <= row : row + way < in.height;
        if (within) add(k < 0 ? here - way * in.width : here + way * in.width, here, in.width, weight);
      } else if (way < in.width) {
        add(k < 0 ? here : here + way, k < 0 ? here + way : here, in.width - way, weight);
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

/// Where the smallest rectangle that holds the pixels begins and ends.
struct PixelBounds {
  uint32_t left, right, top, bottom;
};
PixelBounds bounds_of(const ScoreField& field) {
  PixelBounds box{field.width, 0, field.height, 0};
  for (const uint32_t pixel : field.pixel) {
    box.left = std::min(box.left, pixel % field.width);
    box.right = std::max(box.right, pixel % field.width);
    box.top = std::min(box.top, pixel / field.width);
    box.bottom = std::max(box.bottom, pixel / field.width);
  }
  return box;
}

Cells rows_in(const PixelBounds& box, const ScoreField& field) {
  Cells out{.width = box.right - box.left + 1, .height = box.bottom - box.top + 1, .value = {}};
  out.value.resize(size_t{6} * out.width * out.height);
  for (size_t i = 0; i < field.pixel.size(); ++i) {
    const uint32_t x = field.pixel[i] % field.width - box.left, y = field.pixel[i] / field.width - box.top;
    std::copy(field.row[i].begin(), field.row[i].end(), out.at(size_t{y} * out.width + x));
  }
  return out;
}

/// Of Gaussian noise before any fit.
double whole_half_square(size_t k, double way_px) {
  const double reach = ScoreNoise::reach_px(k);
  return k == 0 ? 1 : 1 - std::exp(-way_px * way_px / (2 * reach * reach));
}

}  // namespace

ReachSums::ReachSums(const ScoreField& field) : field_(field) {
  of_unit_.fill(Matrix6d::Zero());
  if (field.pixel.empty()) return;
  const PixelBounds box = bounds_of(field);
  left_px_ = box.left;
  top_px_ = box.top;
  Cells cells = rows_in(box, field);
  for (size_t k = 0; k < kReaches; ++k) {
    if (k > 1) cells = halved(cells);
    carried_[k] = k == 0 ? cells : spread(spread(cells, true), false);
    add_products(of_unit_[k], cells, carried_[k], 1);
    of_unit_[k] = ((of_unit_[k] + of_unit_[k].transpose()) / 2).eval();
  }
}

Matrix6d ReachSums::covariance(const ScoreNoise& noise) const {
  Matrix6d sum = Matrix6d::Zero();
  for (size_t k = 0; k < kReaches; ++k) sum += noise.variance[k] * of_unit_[k];
  return sum;
}

// Half the mean square of differences that noise of variance 1 leaves once the fit has taken its part: with K
// the noise's covariance and H = rows inverse rows^T, of K - H K - K H^T + H K H^T.
std::vector<ReachSums::Left> ReachSums::left_over(const std::vector<uint32_t>& ways_px,
                                                  const Matrix6d& inverse) const {
  constexpr size_t kSamples = 250;  // pixels that stand for all
  using Row = Eigen::Matrix<float, 6, 1>;
  std::vector<uint32_t> place(size_t{field_.width} * field_.height, UINT32_MAX);
  for (size_t i = 0; i < field_.pixel.size(); ++i) place[field_.pixel[i]] = static_cast<uint32_t>(i);
  const Eigen::Matrix<float, 6, 6> solve = inverse.cast<float>();
  const auto row_of = [&](size_t i) { return Eigen::Map<const Row>(field_.row[i].data()); };
  const auto carried = [&](size_t k, uint32_t pixel) {
    const uint32_t shift = k > 1 ? static_cast<uint32_t>(k - 1) : 0;
    const uint32_t x = (pixel % field_.width - left_px_) >> shift,
                   y = (pixel / field_.width - top_px_) >> shift;
    return Eigen::Map<const Row>(carried_[k].at(size_t{y} * carried_[k].width + x));
  };
  const size_t stride = std::max<size_t>(field_.pixel.size() / kSamples, 1);
  std::vector<Left> out;
  for (const uint32_t way : ways_px) {
    Matrix6d squares = Matrix6d::Zero();
    Left taken{};
    double pairs = 0;
    const auto add = [&](bool within, size_t i, uint32_t other) {
      if (!within || place[other] == UINT32_MAX) return;
      const Row moved = solve * (row_of(i) - row_of(place[other]));
      for (size_t k = 0; k < kReaches; ++k)
        taken[k] += double{moved.dot(carried(k, field_.pixel[i]) - carried(k, other))};
      squares += (moved * moved.transpose()).cast<double>();
      ++pairs;
    };
    for (size_t i = 0; i < field_.pixel.size(); i += stride) {
      const uint32_t pixel = field_.pixel[i];
      add(pixel % field_.width + way < field_.width, i, pixel + way);
      add(pixel / field_.width + way < field_.height, i, pixel + way * field_.width);
    }
    Left& line = out.emplace_back();
    for (size_t k = 0; k < kReaches; ++k)
      line[k] = whole_half_square(k, way) -
                (pairs > 0 ? (taken[k] - squares.cwiseProduct(of_unit_[k]).sum() / 2) / pairs : 0);
  }
  return out;
}

ScoreNoise ReachSums::noise(const Matrix6d& inverse, double most_px) const {
  constexpr double kShown = 0.2;   // of a reach's variance, over the longest way, for one of its own
  constexpr double kLeast = 1e-3;  // of it; of less the variance would be a guess
  ScoreNoise noise;
  const Variogram seen = variogram(field_, most_px);
  if (seen.way_px.empty()) return noise;
  std::vector<Left> basis = left_over(seen.way_px, inverse);
  size_t longest = 1;
  while (longest + 1 < kReaches && basis.back()[longest + 1] >= kShown) ++longest;
  std::vector<double> weight;
  for (size_t i = 0; i < basis.size(); ++i) {
    for (size_t k = 0; k < kReaches; ++k) basis[i][k] = std::max(basis[i][k], kLeast);
    for (size_t k = longest + 1; k < kReaches; ++k) basis[i][longest] += std::exchange(basis[i][k], 0);
    weight.push_back(1 / std::pow(std::max(seen.half_square[i], 1e-30), 2));
  }
  noise.variance = nonnegative_fit(basis, seen.half_square, weight);
  std::fill(noise.variance.begin() + static_cast<std::ptrdiff_t>(longest), noise.variance.end(),
            noise.variance[longest]);
  return noise;
}

}  // namespace palpate
