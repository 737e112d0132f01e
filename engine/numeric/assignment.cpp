#include "engine/numeric/assignment.h"

#include <cassert>
#include <limits>

namespace palpate {

std::vector<uint32_t> assign(std::span<const double> cost, uint32_t rows, uint32_t columns) {
  assert(rows <= columns && cost.size() == size_t{rows} * columns);
  constexpr double kFar = std::numeric_limits<double>::infinity();
  constexpr uint32_t kFree = UINT32_MAX;
  std::vector<double> row_price(rows), column_price(columns), distance(columns);
  std::vector<uint32_t> row_of(columns, kFree), came_from(columns);
  std::vector<char> done(columns);
  for (uint32_t start = 0; start < rows; ++start) {
    distance.assign(columns, kFar);
    done.assign(columns, 0);
    uint32_t row = start, before = kFree, end = kFree;
    double reached = 0;
    while (true) {
      uint32_t nearest = kFree;
      for (uint32_t column = 0; column < columns; ++column) {
        if (done[column]) continue;
        const double along =
            reached + cost[size_t{row} * columns + column] - row_price[row] - column_price[column];
        if (along < distance[column]) {
          distance[column] = along;
          came_from[column] = before;
        }
        if (nearest == kFree || distance[column] < distance[nearest]) nearest = column;
      }
      done[nearest] = 1;
      reached = distance[nearest];
      if (row_of[nearest] == kFree) {
        end = nearest;
        break;
      }
      before = nearest;
      row = row_of[nearest];
    }
    // Prices keep every reduced cost at 0 or more, and those on the path at 0.
    row_price[start] += reached;
    for (uint32_t column = 0; column < columns; ++column) {
      if (!done[column] || column == end) continue;
      column_price[column] -= reached - distance[column];
      row_price[row_of[column]] += reached - distance[column];
    }
    while (came_from[end] != kFree) {
      row_of[end] = row_of[came_from[end]];
      end = came_from[end];
    }
    row_of[end] = start;
  }
  std::vector<uint32_t> column_of(rows);
  for (uint32_t column = 0; column < columns; ++column)
    if (row_of[column] != kFree) column_of[row_of[column]] = column;
  return column_of;
}

}  // namespace palpate
