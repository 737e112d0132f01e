#include "engine/calibrate/photometric/normal_table.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "engine/numeric/sparse.h"

namespace palpate {
namespace {

// Where a linear normal lies in the grid: the node up and left of it and the fraction of the way to the next.
struct Place {
  uint32_t i, j;
  double a, b, beyond_x, beyond_y;
};

Place place_of(double nx, double ny, uint32_t side, double reach) {
  const double steps = (side - 1) / (2 * reach);
  const double x = std::clamp(nx, -reach, reach), y = std::clamp(ny, -reach, reach);
  const double u = (x + reach) * steps, v = (y + reach) * steps;
  const uint32_t i = std::min(static_cast<uint32_t>(u), side - 2),
                 j = std::min(static_cast<uint32_t>(v), side - 2);
  return {i, j, u - i, v - j, nx - x, ny - y};
}

constexpr double kShrink = 0.02;  // of a node's size, relative to the mean support of a node
constexpr double kLevel = 100;    // at the level normal

}  // namespace

std::array<double, 2> corrected_normal(const NormalTable& t, double nx, double ny) {
  const Place p = place_of(nx, ny, t.side, t.reach);
  const size_t at = size_t{p.j} * t.side + p.i;
  const auto mix = [&](const std::vector<double>& v) {
    return (1 - p.b) * ((1 - p.a) * v[at] + p.a * v[at + 1]) +
           p.b * ((1 - p.a) * v[at + t.side] + p.a * v[at + t.side + 1]);
  };
  return {mix(t.nx) + p.beyond_x, mix(t.ny) + p.beyond_y};
}

NormalTableFit::NormalTableFit(uint32_t side, double reach)
    : side_(side),
      reach_(reach),
      gram_(size_t{side} * side * 9),
      to_x_(size_t{side} * side),
      to_y_(size_t{side} * side) {
  assert(side % 2 == 1 && side >= 3 && reach > 0 && reach <= 1);
}

void NormalTableFit::add(double linear_x, double linear_y, double true_x, double true_y) {
  if (std::abs(linear_x) > reach_ || std::abs(linear_y) > reach_) return;
  const Place p = place_of(linear_x, linear_y, side_, reach_);
  const std::array<double, 4> fraction = {(1 - p.a) * (1 - p.b), p.a * (1 - p.b), (1 - p.a) * p.b, p.a * p.b};
  for (int m = 0; m < 4; ++m) {
    const size_t node =
        (p.j + static_cast<uint32_t>(m / 2)) * size_t{side_} + p.i + static_cast<uint32_t>(m % 2);
    to_x_[node] += fraction[static_cast<size_t>(m)] * (true_x - linear_x);
    to_y_[node] += fraction[static_cast<size_t>(m)] * (true_y - linear_y);
    for (int k = 0; k < 4; ++k) {
      const int dx = k % 2 - m % 2, dy = k / 2 - m / 2;
      gram_[node * 9 + static_cast<size_t>((dy + 1) * 3 + dx + 1)] +=
          fraction[static_cast<size_t>(m)] * fraction[static_cast<size_t>(k)];
    }
  }
  samples_ += 1;
}

NormalTable NormalTableFit::solve(double smoothing) const {
  const auto side = static_cast<int>(side_);
  const int nodes = side * side;
  const double support = std::max(samples_ / nodes, 1.0);
  std::vector<sparse::Entry> entries;
  for (int n = 0; n < nodes; ++n)
    for (int k = 0; k < 9; ++k) {
      const double value = gram_[static_cast<size_t>(n) * 9 + static_cast<size_t>(k)];
      if (value != 0) entries.emplace_back(n, n + (k / 3 - 1) * side + k % 3 - 1, value);
    }
  // Second differences along rows, along columns and across.
  const auto hold = [&](const std::array<std::pair<int, double>, 4>& terms, double weight) {
    for (const auto& [a, va] : terms)
      for (const auto& [b, vb] : terms)
        if (va != 0 && vb != 0) entries.emplace_back(a, b, weight * va * vb);
  };
  const double bend = smoothing * support;
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < side; ++i) {
      const int n = j * side + i;
      if (i > 0 && i + 1 < side) hold({{{n - 1, 1}, {n, -2}, {n + 1, 1}, {n, 0}}}, bend);
      if (j > 0 && j + 1 < side) hold({{{n - side, 1}, {n, -2}, {n + side, 1}, {n, 0}}}, bend);
      if (i + 1 < side && j + 1 < side)
        hold({{{n, 1}, {n + 1, -1}, {n + side, -1}, {n + side + 1, 1}}}, 2 * bend);
      entries.emplace_back(n, n, kShrink * support * (n == nodes / 2 ? kLevel / kShrink : 1));
    }
  const sparse::Factor solver(sparse::Factor::Kind::Ldlt, nodes, entries);
  const Eigen::VectorXd x = solver.solve(Eigen::Map<const Eigen::VectorXd>(to_x_.data(), nodes));
  const Eigen::VectorXd y = solver.solve(Eigen::Map<const Eigen::VectorXd>(to_y_.data(), nodes));
  NormalTable table;
  table.reach = reach_;
  table.side = side_;
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < side; ++i) {
      const int n = j * side + i;
      table.nx.push_back(std::clamp(reach_ * (2.0 * i / (side - 1) - 1) + x[n], -1.0, 1.0));
      table.ny.push_back(std::clamp(reach_ * (2.0 * j / (side - 1) - 1) + y[n], -1.0, 1.0));
    }
  return table;
}

}  // namespace palpate
