// Maps between their nodes, and maps on other nodes.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

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

/// The map at places in rows, each with the same columns: map_at's values but for rounding, at a fraction of
/// its work.
class MapRows {
 public:
  /// `x_mm`: the columns, from the map's middle. The map must outlive this.
  MapRows(const PressureMap& map, std::span<const double> x_mm);
  /// A row at `y_mm` from the map's middle: `out[i]` at column i, as many as there are columns.
  void read(double y_mm, std::span<double> out);

 private:
  const PressureMap& map_;
  std::vector<MapTaps> taps_;   // of each column
  std::vector<double> at_row_;  // the map's nodes between their rows
};

/// Nodes `pitch_mm` apart, one of them in the middle of `window_mm` around `center_mm` (from the map's
/// middle) and as many as fit with their cells; each the mean over its cell, from `samples` x `samples`
/// places of it. NaN for nodes whose cell lies over the map's border.
PressureMap node_means(const PressureMap& map, std::array<double, 2> center_mm,
                       std::array<double, 2> window_mm, double pitch_mm, uint32_t samples = 4);

/// Nodes along one side of a window whose cells lie in it: odd, as one lies in the middle.
uint32_t window_nodes(double window_mm, double pitch_mm);

}  // namespace palpate
