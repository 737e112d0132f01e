#include "engine/numeric/matching/contexts.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

namespace palpate {
namespace {

using Eigen::Index;
using Eigen::MatrixXf;

constexpr int kRings = 5, kLayers = 3;
// Rings by log2 of distance over scale: centres from 1/8 to 2, and nothing beyond 3.9.
constexpr float kInnermost = -3, kRingStep = 1;
constexpr float kOutside = kRings - 1 + 0.99f;

// Vectorised by the compiler; both are right to 1e-4, a hundredth of a cell.
float log2_of(float x) {
  const auto bits = std::bit_cast<int32_t>(x);
  const float exponent = static_cast<float>((bits >> 23) - 127);
  const float m = std::bit_cast<float>((bits & 0x7fffff) | 0x3f800000);
  return exponent + (-2.505615f + m * (4.049617f + m * (-2.099402f + m * (0.635511f - 0.080010f * m))));
}

float turn_of(float y, float x) {  // 0 to 1
  const float ax = std::abs(x), ay = std::abs(y);
  const float t = std::min(ax, ay) / (std::max(ax, ay) + 1e-30f), q = t * t;
  float a = t * (0.999879f + q * (-0.330406f + q * (0.180413f + q * (-0.085408f + 0.020932f * q))));
  a = ay > ax ? std::numbers::pi_v<float> / 2 - a : a;
  a = x < 0 ? std::numbers::pi_v<float> - a : a;
  a = y < 0 ? 2 * std::numbers::pi_v<float> - a : a;
  return a * (0.5f / std::numbers::pi_v<float>);
}

}  // namespace

ContextCells::ContextCells(const MatrixXf& centres, const MatrixXf& others, float scale)
    : centres_(centres.rows()),
      others_(others.rows()),
      layers_(centres.cols() > 2 ? kLayers : 1),
      cells_(static_cast<size_t>(centres_ * others_)) {
  const float per_scale = 1 / (scale * scale);
  std::vector<float> turn(static_cast<size_t>(others_)), ring(turn.size()), height(turn.size(), 0.f);
  for (Index i = 0; i < centres_; ++i) {
    const float cx = centres(i, 0), cy = centres(i, 1);
    const float *px = others.data(), *py = px + others_;
    for (size_t j = 0; j < turn.size(); ++j) {
      const float dx = px[j] - cx, dy = py[j] - cy;
      ring[j] = dx * dx + dy * dy;
      turn[j] = turn_of(dy, dx);
    }
    if (layers_ > 1) {
      const float* pz = py + others_;
      const float cz = centres(i, 2);
      for (size_t j = 0; j < turn.size(); ++j) {
        const float dz = pz[j] - cz;
        ring[j] += dz * dz;
        height[j] = 0.5f * (dz / std::sqrt(ring[j] + 1e-30f) + 1) * (kLayers - 1);
      }
    }
    Cell* row = cells_.data() + static_cast<size_t>(i) * turn.size();
    for (size_t j = 0; j < turn.size(); ++j) {
      const float there = (0.5f * log2_of(ring[j] * per_scale + 1e-20f) - kInnermost) / kRingStep;
      const float direction = turn[j] * kContextDirections, inside = std::max(there, 0.f);
      const int d = static_cast<int>(direction), r = std::min(static_cast<int>(inside), kRings);
      const bool counts = there <= kOutside && ring[j] > 0;
      row[j] = {static_cast<int16_t>(d % kContextDirections), static_cast<int16_t>(counts ? r : -1),
                direction - static_cast<float>(d), inside - static_cast<float>(r), height[j]};
    }
  }
}

MatrixXf ContextCells::histograms(const Eigen::VectorXf& weight) const {
  // One ring more than is kept takes what lies between the last ring and nothing.
  const int layer_cells = kContextDirections * (kRings + 1);
  MatrixXf sums(layer_cells * layers_, centres_);
  std::vector<float> one(static_cast<size_t>(layer_cells * (layers_ + 1)));
  for (Index i = 0; i < centres_; ++i) {
    std::fill(one.begin(), one.end(), 0.f);
    const Cell* row = cells_.data() + static_cast<size_t>(i * others_);
    for (Index j = 0; j < others_; ++j) {
      const Cell& c = row[j];
      if (c.ring < 0) continue;
      const int after = c.direction + 1 == kContextDirections ? 0 : c.direction + 1;
      const float near = weight[j] * (1 - c.next_ring), far = weight[j] * c.next_ring;
      const int layer = static_cast<int>(c.height);
      const float up = c.height - static_cast<float>(layer);
      float* at = one.data() + layer * layer_cells + c.ring * kContextDirections;
      for (int l = 0; l < (layers_ > 1 ? 2 : 1); ++l, at += layer_cells) {
        const float fraction = l == 0 ? 1 - up : up;
        at[c.direction] += fraction * near * (1 - c.next_direction);
        at[after] += fraction * near * c.next_direction;
        at[kContextDirections + c.direction] += fraction * far * (1 - c.next_direction);
        at[kContextDirections + after] += fraction * far * c.next_direction;
      }
    }
    float total = 0;
    for (int l = 0; l < layers_; ++l) {
      std::fill_n(one.data() + l * layer_cells + kContextDirections * kRings, kContextDirections, 0.f);
      for (int k = 0; k < layer_cells; ++k) total += one[l * layer_cells + k];
    }
    const float per = total > 0 ? 1 / total : 0.f;
    sums.col(i) =
        (Eigen::Map<const Eigen::VectorXf>(one.data(), sums.rows()) * per).cwiseMax(0.f).cwiseSqrt();
  }
  return sums;
}

MatrixXf turned(const MatrixXf& histograms, int steps) {
  MatrixXf result(histograms.rows(), histograms.cols());
  for (Index cell = 0; cell < histograms.rows(); cell += kContextDirections) {
    result.middleRows(cell + steps, kContextDirections - steps) =
        histograms.middleRows(cell, kContextDirections - steps);
    result.middleRows(cell, steps) = histograms.middleRows(cell + kContextDirections - steps, steps);
  }
  return result;
}

float mean_distance(const MatrixXf& points) {
  const Index step = std::max<Index>(1, points.rows() / 150);
  double sum = 0;
  int64_t pairs = 0;
  for (Index i = 0; i < points.rows(); i += step)
    for (Index j = 0; j < i; j += step, ++pairs) sum += (points.row(i) - points.row(j)).norm();
  return pairs > 0 ? static_cast<float>(sum / static_cast<double>(pairs)) : 1.f;
}

}  // namespace palpate
