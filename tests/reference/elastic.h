// Plain CPU version of the elastic stage: the pyramid of ElasticPlan in double precision, and the convolution
// as it is defined.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "engine/pad/elastic_plan.h"

namespace palpate::reference {

/// One level's cells with shared::kElasticReach cells around; 0 beyond.
class ElasticCells {
 public:
  ElasticCells(int width, int height)
      : width_(width),
        height_(height),
        values_(static_cast<size_t>(width + 2 * kReach) * (height + 2 * kReach)) {}

  static constexpr int kReach = static_cast<int>(shared::kElasticReach);
  int width() const { return width_; }
  int height() const { return height_; }
  double at(int x, int y) const { return holds(x, y) ? values_[index(x, y)] : 0; }
  void set(int x, int y, double value) { values_[index(x, y)] = value; }

 private:
  bool holds(int x, int y) const {
    return x >= -kReach && y >= -kReach && x < width_ + kReach && y < height_ + kReach;
  }
  size_t index(int x, int y) const {
    return static_cast<size_t>(y + kReach) * static_cast<size_t>(width_ + 2 * kReach) +
           static_cast<size_t>(x + kReach);
  }
  int width_, height_;
  std::vector<double> values_;
};

inline constexpr double kSpline[7] = {1.0 / 32,  6.0 / 32, 15.0 / 32, 20.0 / 32,
                                      15.0 / 32, 6.0 / 32, 1.0 / 32};

/// Deflection, mm, by pressure, MPa; height x width.
inline std::vector<double> elastic(const ElasticPlan& plan, const std::vector<double>& pressure) {
  std::vector<ElasticCells> p;
  for (const ElasticLevel& level : plan.levels)
    p.emplace_back(static_cast<int>(level.width), static_cast<int>(level.height));
  const int w = p[0].width(), h = p[0].height();
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) p[0].set(x, y, pressure[static_cast<size_t>(y) * w + x]);
  constexpr int kReach = ElasticCells::kReach, kRadius = static_cast<int>(shared::kElasticRadius);
  for (size_t l = 1; l < p.size(); ++l) {
    for (int y = -kReach; y < p[l].height() + kReach; ++y) {
      for (int x = -kReach; x < p[l].width() + kReach; ++x) {
        double sum = 0;
        for (int j = -3; j <= 3; ++j)
          for (int i = -3; i <= 3; ++i)
            sum += kSpline[i + 3] * kSpline[j + 3] * p[l - 1].at(2 * x + i, 2 * y + j);
        p[l].set(x, y, sum);
      }
    }
  }
  ElasticCells answer(p.back().width(), p.back().height());
  for (int y = -kReach; y < answer.height() + kReach; ++y) {
    for (int x = -kReach; x < answer.width() + kReach; ++x) {
      double sum = 0;
      for (int j = -kReach; j < answer.height() + kReach; ++j)
        for (int i = -kReach; i < answer.width() + kReach; ++i)
          sum +=
              p.back().at(i, j) * double{plan.table[static_cast<size_t>(std::abs(y - j)) * plan.table_width +
                                                    static_cast<size_t>(std::abs(x - i))]};
      answer.set(x, y, sum);
    }
  }
  for (size_t l = p.size() - 1; l-- > 0;) {
    ElasticCells finer(p[l].width(), p[l].height());
    for (int y = -kReach; y < finer.height() + kReach; ++y) {
      for (int x = -kReach; x < finer.width() + kReach; ++x) {
        double sum = 0;
        for (int j = -kRadius; j <= kRadius; ++j) {
          for (int i = -kRadius; i <= kRadius; ++i) {
            const auto a = static_cast<size_t>(std::max(std::abs(i), std::abs(j)));
            const auto b = static_cast<size_t>(std::min(std::abs(i), std::abs(j)));
            sum += p[l].at(x + i, y + j) * double{plan.levels[l].stencil[a * (a + 1) / 2 + b]};
          }
        }
        const int cx = static_cast<int>(std::floor(x / 2.0)), cy = static_cast<int>(std::floor(y / 2.0));
        for (int j = cy - 1; j <= cy + 2; ++j)
          for (int i = cx - 1; i <= cx + 2; ++i)
            if (std::abs(x - 2 * i) <= 3 && std::abs(y - 2 * j) <= 3)
              sum += kSpline[x - 2 * i + 3] * kSpline[y - 2 * j + 3] * answer.at(i, j);
        finer.set(x, y, sum);
      }
    }
    answer = finer;
  }
  std::vector<double> out;
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) out.push_back(answer.at(x, y));
  return out;
}

/// The same as it is defined: every pixel's answer to every loaded pixel.
inline std::vector<double> elastic_sum(const LayerKernel& kernel, const std::vector<double>& pressure,
                                       int width, int height) {
  std::vector<double> table;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) table.push_back(kernel.depth(x, y));
  std::vector<double> out(pressure.size(), 0.0);
  for (int j = 0; j < height; ++j) {
    for (int i = 0; i < width; ++i) {
      const double load = pressure[static_cast<size_t>(j) * width + i];
      if (load == 0) continue;
      for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
          out[static_cast<size_t>(y) * width + x] +=
              load * table[static_cast<size_t>(std::abs(y - j)) * width + std::abs(x - i)];
    }
  }
  return out;
}

}  // namespace palpate::reference
