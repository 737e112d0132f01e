// Who is who: rows to columns at the least total cost (the Hungarian method by shortest augmenting paths).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace palpate {

/// The column of each row, all different, at the least sum of `cost` (rows x columns, row by row, finite;
/// rows <= columns). O(rows^2 columns). Equal costs are decided the same way on every machine.
std::vector<uint32_t> assign(std::span<const double> cost, uint32_t rows, uint32_t columns);

}  // namespace palpate
