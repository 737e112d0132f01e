// Maps between their nodes, and maps on other nodes.
#pragma once

#include <array>
#include <cstdint>

#include "engine/tissue/pressure_map.h"

namespace palpate {

/// Nodes around a place along one side and their weights: Lagrange's polynomial through three on either side;
/// two next to the border's cells, in which it is a straight line.
struct MapTaps {
  uint32_t first = 0, count = 0;
  std::array<double, 6> weight{};
};
/// `place` in nodes from the first one, held within them. Two nodes or more.
MapTaps map_taps(double place, uint32_t nodes);

/// The map at a place from its middle, mm; places beyond the outer nodes have the value of the border. NaN
/// where a node that counts is NaN.
double map_at(const PressureMap& map, double x_mm, double y_mm);

/// Nodes `pitch_mm` apart, one of them in the middle of `window_mm` around `center_mm` (from the map's
/// middle) and as many as fit with their cells; each the mean over its cell, from `samples` x `samples`
/// places of it. NaN for nodes whose cell lies over the map's border.
PressureMap node_means(const PressureMap& map, std::array<double, 2> center_mm,
                       std::array<double, 2> window_mm, double pitch_mm, uint32_t samples = 4);

/// Nodes along one side of a window whose cells lie in it: odd, as one lies in the middle.
uint32_t window_nodes(double window_mm, double pitch_mm);

}  // namespace palpate
