#include "capture/synthetic/slope_noise.h"

#include <algorithm>
#include <cmath>

#include "engine/numeric/poisson_dct.h"

namespace palpate {

void add_slope_noise(std::vector<float>& depth_mm, const TractionGrid& grid, double sd,
                     std::mt19937& random) {
  const uint32_t w = grid.width, h = grid.height;
  std::normal_distribution<double> normal(0, sd * grid.cell_mm);
  std::vector<double> z(depth_mm.size());
  for (uint32_t y = 0; y < h; ++y)
    for (uint32_t x = 0; x < w; ++x) {
      const size_t i = size_t{y} * w + x;
      const auto step = [&](size_t to) {
        const double difference = normal(random);
        z[to] += difference;
        z[i] -= difference;
      };
      if (x + 1 < w) step(i + 1);
      if (y + 1 < h) step(i + w);
    }
  PoissonDct(w, h).solve(z.data(), z.data(), w);
  for (size_t i = 0; i < depth_mm.size(); ++i) depth_mm[i] += static_cast<float>(z[i]);
}

}  // namespace palpate
