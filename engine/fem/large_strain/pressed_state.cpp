#include "engine/fem/large_strain/pressed_state.h"

#include <algorithm>

namespace palpate::fem {
namespace {

using Cells = std::array<uint32_t, 3>;

/// Nodes of one side of a grid between which a place lies.
struct Between {
  uint32_t first;
  double second_part;
};

std::vector<Between> places(uint32_t from, uint32_t to) {
  std::vector<Between> all;
  for (uint32_t n = 0; n <= to; ++n) {
    const uint32_t first = std::min(n * from / to, from - 1);
    all.push_back({first, static_cast<double>(n) * from / to - first});
  }
  return all;
}

size_t nodes(const Cells& cells) {
  return size_t{cells[0] + 1} * (cells[1] + 1) * (cells[2] + 1);
}

void add(double factor, const std::vector<double>& other, std::vector<double>& to) {
  for (size_t n = 0; n < to.size(); ++n) to[n] += factor * other[n];
}

/// One component on the finer nodes, linear along one side after the other.
double between(const double* values, const Cells& cells, const Between& x, const Between& y,
               const Between& z) {
  const size_t row = cells[0] + 1, plane = row * (cells[1] + 1);
  const double* const corner = values + z.first * plane + y.first * row + x.first;
  const auto along_x = [&](size_t at) { return corner[at] + x.second_part * (corner[at + 1] - corner[at]); };
  const auto in_plane = [&](size_t at) {
    const double low = along_x(at);
    return low + y.second_part * (along_x(at + row) - low);
  };
  const double upper = in_plane(0);
  return upper + z.second_part * (in_plane(plane) - upper);
}

}  // namespace

void PressedState::add(double factor, const PressedState& other) {
  press_mm += factor * other.press_mm;
  fem::add(factor, other.displacement, displacement);
  fem::add(factor, other.pressure, pressure);
}

void PressedState::scale(double factor) {
  press_mm *= factor;
  for (double& u : displacement) u *= factor;
  for (double& p : pressure) p *= factor;
}

PressedState on_cells(const PressedState& state, const Cells& from, const Cells& to) {
  if (from == to) return state;
  PressedState there{state.press_mm, {}, {}};
  const std::vector<Between> x = places(from[0], to[0]), y = places(from[1], to[1]),
                             z = places(from[2], to[2]);
  there.displacement.reserve(3 * nodes(to));
  for (size_t c = 0; c < 3; ++c)
    for (const Between& k : z)
      for (const Between& j : y)
        for (const Between& i : x)
          there.displacement.push_back(between(state.displacement.data() + c * nodes(from), from, i, j, k));
  const auto holding = [](uint32_t cell, uint32_t of, uint32_t in) { return (2 * cell + 1) * in / (2 * of); };
  for (uint32_t k = 0; k < to[2]; ++k)
    for (uint32_t j = 0; j < to[1]; ++j)
      for (uint32_t i = 0; i < to[0]; ++i)
        there.pressure.push_back(
            state.pressure[(size_t{holding(k, to[2], from[2])} * from[1] + holding(j, to[1], from[1])) *
                               from[0] +
                           holding(i, to[0], from[0])]);
  return there;
}

}  // namespace palpate::fem
