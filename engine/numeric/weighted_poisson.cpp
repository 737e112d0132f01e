#include "engine/numeric/weighted_poisson.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "engine/numeric/jacobi_weights.h"
#include "shaders/shared/weighted.h"

namespace palpate {
namespace {

// Right and lower faces' weights of one level, and the level's operator.
struct Level {
  uint32_t width, height;
  std::vector<double> across, down, diagonal;
  std::vector<double> right, x, next;

  Level(uint32_t w, uint32_t h)
      : width(w),
        height(h),
        across(size_t{w} * h),
        down(across.size()),
        diagonal(across.size()),
        right(across.size()),
        x(across.size()),
        next(across.size()) {}

  size_t cells() const { return across.size(); }
  void make_diagonal() {
    for (uint32_t y = 0; y < height; ++y) {
      for (uint32_t x0 = 0; x0 < width; ++x0) {
        const size_t i = size_t{y} * width + x0;
        diagonal[i] = across[i] + down[i] + (x0 > 0 ? across[i - 1] : 0) + (y > 0 ? down[i - width] : 0);
      }
    }
  }
  void apply(std::span<const double> z, std::span<double> out) const {
    for (uint32_t y = 0; y < height; ++y) {
      const size_t row = size_t{y} * width;
      for (uint32_t x0 = 0; x0 < width; ++x0) {
        const size_t i = row + x0;
        double a = 0;
        if (x0 > 0) a += across[i - 1] * (z[i] - z[i - 1]);
        if (x0 + 1 < width) a += across[i] * (z[i] - z[i + 1]);
        if (y > 0) a += down[i - width] * (z[i] - z[i - width]);
        if (y + 1 < height) a += down[i] * (z[i] - z[i + width]);
        out[i] = a;
      }
    }
  }
  /// x += step (right - A x) / diagonal
  void sweep(double step) {
    apply(x, next);
    for (size_t i = 0; i < cells(); ++i)
      if (diagonal[i] > 0) x[i] += step * (right[i] - next[i]) / diagonal[i];
  }
};

constexpr uint64_t kMaxCoarsestCells = 8;
constexpr double kStep0 = 1 / jacobi::kLowerRoot, kStep1 = 1 / jacobi::kUpperRoot;

Level coarsen(const Level& fine) {
  Level coarse((fine.width + 1) / 2, (fine.height + 1) / 2);
  for (uint32_t y = 0; y < fine.height; ++y) {
    for (uint32_t x = 0; x < fine.width; ++x) {
      const size_t from = size_t{y} * fine.width + x, to = size_t{y / 2} * coarse.width + x / 2;
      if (x % 2 == 1) coarse.across[to] += 0.5 * fine.across[from];
      if (y % 2 == 1) coarse.down[to] += 0.5 * fine.down[from];
    }
  }
  coarse.make_diagonal();
  return coarse;
}

void cycle(std::vector<Level>& levels, size_t l) {
  Level& v = levels[l];
  std::fill(v.x.begin(), v.x.end(), 0.0);
  if (l + 1 == levels.size()) {
    // A few cells one after the other, there and back again. No solution has a mean, and no right side may:
    // what rounding leaves of it would grow without bound.
    const auto remove_mean = [](std::vector<double>& values) {
      const double mean =
          std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
      for (double& value : values) value -= mean;
    };
    remove_mean(v.right);
    const auto relax = [&](size_t i) {
      const size_t x = i % v.width, y = i / v.width;
      double rest = v.right[i];
      if (x > 0) rest += v.across[i - 1] * v.x[i - 1];
      if (x + 1 < v.width) rest += v.across[i] * v.x[i + 1];
      if (y > 0) rest += v.down[i - v.width] * v.x[i - v.width];
      if (y + 1 < v.height) rest += v.down[i] * v.x[i + v.width];
      v.x[i] = v.diagonal[i] > 0 ? rest / v.diagonal[i] : 0;
    };
    for (int sweep = 0; sweep < 3; ++sweep) {
      for (size_t i = 0; i < v.cells(); ++i) relax(i);
      for (size_t i = v.cells(); i-- > 0;) relax(i);
    }
    remove_mean(v.x);
    return;
  }
  v.sweep(kStep0);
  v.sweep(kStep1);
  Level& coarse = levels[l + 1];
  v.apply(v.x, v.next);
  std::fill(coarse.right.begin(), coarse.right.end(), 0.0);
  for (uint32_t y = 0; y < v.height; ++y)
    for (uint32_t x = 0; x < v.width; ++x) {
      const size_t i = size_t{y} * v.width + x;
      coarse.right[size_t{y / 2} * coarse.width + x / 2] += v.right[i] - v.next[i];
    }
  cycle(levels, l + 1);
  for (uint32_t y = 0; y < v.height; ++y)
    for (uint32_t x = 0; x < v.width; ++x)
      v.x[size_t{y} * v.width + x] += coarse.x[size_t{y / 2} * coarse.width + x / 2];
  v.sweep(kStep1);
  v.sweep(kStep0);
}

double dot(std::span<const double> a, std::span<const double> b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

// Cells without any known face follow their neighbours: a few cycles towards heights that are harmonic there.
void fill_unknown(const WeightedFaces& f, std::vector<Level>& levels, std::vector<double>& z) {
  Level& finest = levels.front();
  const auto known = [&](size_t i, uint32_t x, uint32_t y) {
    return f.across_weight[i] > 0 || f.down_weight[i] > 0 || (x > 0 && f.across_weight[i - 1] > 0) ||
           (y > 0 && f.down_weight[i - f.width] > 0);
  };
  for (int round = 0; round < 4; ++round) {
    std::fill(finest.right.begin(), finest.right.end(), 0.0);
    const auto flow = [&](size_t i, size_t j, double weight) {
      if (weight > 0) return;
      const double amount = double{shared::kUnknownFace} * (z[i] - z[j]);
      finest.right[i] -= amount;
      finest.right[j] += amount;
    };
    for (uint32_t y = 0; y < f.height; ++y) {
      for (uint32_t x = 0; x < f.width; ++x) {
        const size_t i = size_t{y} * f.width + x;
        if (x + 1 < f.width) flow(i, i + 1, f.across_weight[i]);
        if (y + 1 < f.height) flow(i, i + f.width, f.down_weight[i]);
      }
    }
    cycle(levels, 0);
    for (uint32_t y = 0; y < f.height; ++y)
      for (uint32_t x = 0; x < f.width; ++x)
        if (const size_t i = size_t{y} * f.width + x; !known(i, x, y)) z[i] += finest.x[i];
  }
}

// The integral from b to c of the cubic through a, b, c, d; an outer sample counts as far as it is known as
// well as the pair.
double between(double a, double b, double c, double d, double wa, double wd, double w) {
  const double ka = std::min(wa / w, 1.0), kd = std::min(wd / w, 1.0);
  a = (1 - ka) * (2 * b - c) + ka * a;
  d = (1 - kd) * (2 * c - b) + kd * d;
  return (13 * (b + c) - a - d) / 24;
}

}  // namespace

WeightedFaces weighted_faces(std::span<const float> gradients, std::span<const float> weights, uint32_t width,
                             uint32_t height) {
  WeightedFaces f;
  f.width = width;
  f.height = height;
  const size_t cells = size_t{width} * height;
  f.across.resize(cells);
  f.down.resize(cells);
  f.across_weight.resize(cells);
  f.down_weight.resize(cells);
  const auto along = [&](size_t at, size_t step, uint32_t place, uint32_t count, size_t part,
                         double& difference, double& weight) {
    if (place + 1 >= count) return;
    const auto w = [&](size_t i) { return double{weights[i]}; };
    const auto slope = [&](size_t i) { return weights[i] > 0 ? double{gradients[2 * i + part]} : 0.0; };
    const size_t b = at, c = at + step;
    weight = std::min(w(b), w(c));
    if (!(weight > 0)) {
      weight = 0;
      return;
    }
    const bool first = place == 0, last = place + 2 >= count;
    difference = between(first ? 0 : slope(b - step), slope(b), slope(c), last ? 0 : slope(c + step),
                         first ? 0 : w(b - step), last ? 0 : w(c + step), weight);
  };
  for (uint32_t y = 0; y < height; ++y) {
    for (uint32_t x = 0; x < width; ++x) {
      const size_t i = size_t{y} * width + x;
      along(i, 1, x, width, 0, f.across[i], f.across_weight[i]);
      along(i, width, y, height, 1, f.down[i], f.down_weight[i]);
    }
  }
  return f;
}

uint64_t cut_kinks(WeightedFaces& f, std::span<const float> gradients, std::span<const float> weights) {
  const size_t cells = f.across.size();
  // One direction of faces: cell i's face joins it with cell i + step, `place` of `count` along the line.
  struct Direction {
    size_t step, part;
    std::vector<double>& difference;
    std::vector<double>& weight;
  };
  double steepest = 0;
  for (size_t i = 0; i < cells; ++i)
    if (weights[i] > 0)
      steepest =
          std::max({steepest, std::abs(double{gradients[2 * i]}), std::abs(double{gradients[2 * i + 1]})});
  uint64_t cut = 0;
  for (const Direction& d :
       {Direction{1, 0, f.across, f.across_weight}, Direction{f.width, 1, f.down, f.down_weight}}) {
    const auto place = [&](size_t i) { return d.part == 0 ? i % f.width : i / f.width; };
    const size_t count = d.part == 0 ? f.width : f.height;
    const auto slope = [&](size_t i) { return double{gradients[2 * i + d.part]}; };
    std::vector<float> jump(cells, 0.0f);
    std::vector<float> usual;
    for (size_t i = 0; i < cells; ++i) {
      if (place(i) == 0 || place(i) + 2 >= count) continue;
      const size_t a = i - d.step, c = i + d.step, e = c + d.step;
      if (!(weights[a] > 0 && weights[i] > 0 && weights[c] > 0 && weights[e] > 0)) continue;
      const double left = slope(i) + (slope(i) - slope(a)) / 2, right = slope(c) - (slope(e) - slope(c)) / 2;
      jump[i] = static_cast<float>(std::abs(left - right));
      usual.push_back(jump[i]);
    }
    if (usual.empty()) continue;
    const auto middle = usual.begin() + static_cast<std::ptrdiff_t>(usual.size() / 2);
    std::nth_element(usual.begin(), middle, usual.end());
    const double limit = std::max(kKinkFraction * steepest, 8.0 * double{*middle});
    std::vector<uint8_t> kink(cells, 0);
    for (size_t i = 0; i < cells; ++i) {
      if (!(double{jump[i]} > limit)) continue;
      const bool most = jump[i] >= jump[i - d.step] && jump[i] >= jump[i + d.step];
      kink[i] = most ? 1 : 0;
      cut += kink[i];
    }
    for (size_t i = 0; i < cells; ++i) {
      if (place(i) + 1 >= count || !(d.weight[i] > 0)) continue;
      const size_t c = i + d.step;
      const bool from_left = place(i) > 0 && kink[i - d.step], from_right = kink[c] != 0;
      if (kink[i]) {
        d.difference[i] = (slope(i) + slope(c)) / 2;
        d.weight[i] *= kKinkWeight;
      } else if (from_left || from_right) {
        const bool has_a = place(i) > 0 && !from_left, has_d = place(i) + 2 < count && !from_right;
        const double wa = has_a ? double{weights[i - d.step]} : 0,
                     wd = has_d ? double{weights[c + d.step]} : 0;
        d.difference[i] = between(wa > 0 ? slope(i - d.step) : 0, slope(i), slope(c),
                                  wd > 0 ? slope(c + d.step) : 0, wa, wd, d.weight[i]);
      }
    }
  }
  return cut;
}

std::vector<double> apply(const WeightedFaces& f, std::span<const double> z) {
  std::vector<double> out(z.size());
  for (uint32_t y = 0; y < f.height; ++y) {
    for (uint32_t x = 0; x < f.width; ++x) {
      const size_t i = size_t{y} * f.width + x;
      const auto couple = [&](size_t j, double w) {
        const double flow = w * (z[i] - z[j]);
        out[i] += flow;
        out[j] -= flow;
      };
      if (x + 1 < f.width) couple(i + 1, f.across_weight[i]);
      if (y + 1 < f.height) couple(i + f.width, f.down_weight[i]);
    }
  }
  return out;
}

std::vector<double> right_side(const WeightedFaces& f) {
  std::vector<double> out(f.across.size());
  for (uint32_t y = 0; y < f.height; ++y) {
    for (uint32_t x = 0; x < f.width; ++x) {
      const size_t i = size_t{y} * f.width + x;
      if (x + 1 < f.width) {
        out[i] -= f.across_weight[i] * f.across[i];
        out[i + 1] += f.across_weight[i] * f.across[i];
      }
      if (y + 1 < f.height) {
        out[i] -= f.down_weight[i] * f.down[i];
        out[i + f.width] += f.down_weight[i] * f.down[i];
      }
    }
  }
  return out;
}

double unexplained(const WeightedFaces& f, std::span<const double> z) {
  double wrong = 0, whole = 0;
  for (uint32_t y = 0; y < f.height; ++y) {
    for (uint32_t x = 0; x < f.width; ++x) {
      const size_t i = size_t{y} * f.width + x;
      if (x + 1 < f.width) {
        wrong += f.across_weight[i] * std::pow(z[i + 1] - z[i] - f.across[i], 2);
        whole += f.across_weight[i] * f.across[i] * f.across[i];
      }
      if (y + 1 < f.height) {
        wrong += f.down_weight[i] * std::pow(z[i + f.width] - z[i] - f.down[i], 2);
        whole += f.down_weight[i] * f.down[i] * f.down[i];
      }
    }
  }
  return whole > 0 ? std::sqrt(wrong / whole) : 0;
}

WeightedSolution solve_weighted(const WeightedFaces& f, double tolerance, uint32_t most_iterations) {
  WeightedSolution s;
  s.z.assign(f.across.size(), 0.0);
  std::vector<double> residual = right_side(f);
  const double whole = dot(residual, residual);
  if (!(whole > 0)) {
    s.converged = true;
    return s;
  }
  std::vector<Level> levels;
  levels.emplace_back(f.width, f.height);
  Level& finest = levels.front();
  for (uint32_t y = 0; y < f.height; ++y) {
    for (uint32_t x = 0; x < f.width; ++x) {
      const size_t i = size_t{y} * f.width + x;
      const auto reach = [](double w) { return w > 0 ? w : double{shared::kUnknownFace}; };
      if (x + 1 < f.width) finest.across[i] = reach(f.across_weight[i]);
      if (y + 1 < f.height) finest.down[i] = reach(f.down_weight[i]);
    }
  }
  finest.make_diagonal();
  while (levels.back().cells() > kMaxCoarsestCells) levels.push_back(coarsen(levels.back()));

  std::vector<double> direction(residual.size());
  double rho = 0;
  s.residual = 1;
  while (s.iterations < most_iterations && s.residual > tolerance) {
    levels.front().right = residual;
    cycle(levels, 0);
    const std::vector<double>& y = levels.front().x;
    const double rho_next = dot(residual, y);
    if (!(rho_next > 0)) break;
    const double beta = rho > 0 ? rho_next / rho : 0;
    rho = rho_next;
    for (size_t i = 0; i < y.size(); ++i) direction[i] = y[i] + beta * direction[i];
    const std::vector<double> applied = palpate::apply(f, direction);
    const double length = dot(direction, applied);
    if (!(length > 0)) break;
    const double alpha = rho / length;
    for (size_t i = 0; i < y.size(); ++i) {
      s.z[i] += alpha * direction[i];
      residual[i] -= alpha * applied[i];
    }
    s.residual = std::sqrt(dot(residual, residual) / whole);
    ++s.iterations;
  }
  s.converged = s.residual <= tolerance;
  fill_unknown(f, levels, s.z);
  return s;
}

}  // namespace palpate
