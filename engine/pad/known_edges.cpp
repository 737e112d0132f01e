#include "engine/pad/known_edges.h"

#include <algorithm>
#include <array>
#include <cstddef>

namespace palpate {
namespace {

/// In the order of their first cells, along the row first.
template <typename Visit>
void visit_edges(const std::vector<uint8_t>& known, uint32_t width, const Visit& visit) {
  const size_t rows = known.size() / width;
  for (size_t y = 0; y < rows; ++y)
    for (size_t x = 0; x < width; ++x) {
      const size_t i = y * width + x;
      if (known[i] == 0) continue;
      if (x + 1 < width && known[i + 1] != 0) visit(i, i + 1);
      if (y + 1 < rows && known[i + width] != 0) visit(i, i + width);
    }
}

}  // namespace

void known_laplacian(const std::vector<uint8_t>& known, uint32_t width, double cell_mm, bool any_tilt,
                     const std::vector<double>& of, std::vector<double>& out) {
  std::ranges::fill(out, 0);
  std::array<double, 2> tilt{}, edges{};  // along rows, along columns
  if (any_tilt) {
    visit_edges(known, width, [&](size_t a, size_t b) {
      tilt[b != a + 1] += of[b] - of[a];
      ++edges[b != a + 1];
    });
    for (const size_t k : {0, 1}) tilt[k] /= std::max(edges[k], 1.0);
  }
  visit_edges(known, width, [&](size_t a, size_t b) {
    const double difference = of[b] - of[a] - tilt[b != a + 1];
    out[b] += difference;
    out[a] -= difference;
  });
  const double scale = 1 / (cell_mm * cell_mm);
  for (double& value : out) value *= scale;
}

double known_edges(const std::vector<uint8_t>& known, uint32_t width) {
  double count = 0;
  visit_edges(known, width, [&](size_t, size_t) { ++count; });
  return count;
}

}  // namespace palpate
