// Assignment of rows to columns at the least total cost (Hungarian method, shortest augmenting paths).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace palpate {

/// Keeps its working memory, so that one call a frame allocates nothing.
class Assignment {
 public:
  /// The column of each row, all different, at the least sum of `cost` (rows x columns, row by row, finite;
  /// rows <= columns). O(rows^2 columns). Equal costs are decided the same way on every machine. The answer
  /// holds until the next call.
  const std::vector<uint32_t>& solve(std::span<const double> cost, uint32_t rows, uint32_t columns);

 private:
  std::vector<double> row_price_, column_price_, distance_;
  std::vector<uint32_t> row_of_, came_from_, column_of_;
  std::vector<char> done_;
};

/// The same once.
std::vector<uint32_t> assign(std::span<const double> cost, uint32_t rows, uint32_t columns);

}  // namespace palpate
