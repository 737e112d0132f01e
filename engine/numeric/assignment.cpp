#include "engine/numeric/assignment.h"

#include <cassert>
#include <limits>

namespace palpate {

const std::vector<uint32_t>& Assignment::solve(std::span<const double> cost, uint32_t rows,
                                               uint32_t columns) {
  assert(rows <= columns && cost.size() == size_t{rows} * columns);
  constexpr double kFar = std::numeric_limits<double>::infinity();
  constexpr uint32_t kFree = UINT32_MAX;
  row_price_.assign(rows, 0);
  column_price_.assign(columns, 0);
  row_of_.assign(columns, kFree);
  came_from_.assign(columns, 0);
  for (uint32_t start = 0; start < rows; ++start) {
    distance_.assign(columns, kFar);
    done_.assign(columns, 0);
    uint32_t row = start, before = kFree, end = kFree;
    double reached = 0;
    while (true) {
      uint32_t nearest = kFree;
      for (uint32_t column = 0; column < columns; ++column) {
        if (done_[column]) continue;
        const double along =
            reached + cost[size_t{row} * columns + column] - row_price_[row] - column_price_[column];
        if (along < distance_[column]) {
          distance_[column] = along;
          came_from_[column] = before;
        }
        if (nearest == kFree || distance_[column] < distance_[nearest]) nearest = column;
      }
      done_[nearest] = 1;
      reached = distance_[nearest];
      if (row_of_[nearest] == kFree) {
        end = nearest;
        break;
      }
      before = nearest;
      row = row_of_[nearest];
    }
    // Prices keep every reduced cost at 0 or more, and those on the path at 0.
    row_price_[start] += reached;
    for (uint32_t column = 0; column < columns; ++column) {
      if (!done_[column] || column == end) continue;
      column_price_[column] -= reached - distance_[column];
      row_price_[row_of_[column]] += reached - distance_[column];
    }
    while (came_from_[end] != kFree) {
      row_of_[end] = row_of_[came_from_[end]];
      end = came_from_[end];
    }
    row_of_[end] = start;
  }
  column_of_.assign(rows, 0);
  for (uint32_t column = 0; column < columns; ++column)
    if (row_of_[column] != kFree) column_of_[row_of_[column]] = column;
  return column_of_;
}

std::vector<uint32_t> assign(std::span<const double> cost, uint32_t rows, uint32_t columns) {
  return Assignment().solve(cost, rows, columns);
}

}  // namespace palpate
