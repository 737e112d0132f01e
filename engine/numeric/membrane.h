// Membrane: values known in some cells of a grid, continued harmonically over the others.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace palpate {

/// Laplace's equation where nothing is known, known values held, no flux through the border: from coarse
/// grids to fine ones, some Gauss-Seidel sweeps on each. Allocates nothing once it is made.
class Membrane {
 public:
  Membrane(uint32_t width, uint32_t height);

  /// `values` and `known` row by row; where known is 0 the value is replaced. Without a known cell nothing
  /// changes.
  void fill(std::span<float> values, std::span<const uint8_t> known);

 private:
  struct Run {
    uint32_t begin = 0, end = 0;
  };
  struct Level {
    uint32_t width = 0, height = 0;
    std::vector<float> values;
    std::vector<uint8_t> known;
    std::vector<Run> unknown;  // of each row: from its first unknown cell to its last
  };
  static void find_unknown(Level& level);
  static void restrict_to(const Level& fine, Level& coarse);
  static void interpolate(const Level& coarse, Level& fine);
  static void sweep(Level& level, int count);
  static void relax(Level& level, uint32_t x, uint32_t y);

  std::vector<Level> levels_;  // finest first
};

}  // namespace palpate
