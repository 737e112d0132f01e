#include "engine/fem/linear/transfer.h"

#include <algorithm>
#include <array>
#include <vector>

namespace palpate::fem {
namespace {

/// Weight of the coarse plane above an odd plane of fine nodes: its place between the two.
float upper_fraction(const CellGrid& fine, uint32_t odd_plane) {
  const double above = fine.size_z_mm[odd_plane - 1], below = fine.size_z_mm[odd_plane];
  return static_cast<float>(below / (above + below));
}

}  // namespace

void restrict_to(const CellGrid& fine, const CellGrid& coarse, const FixedNodes& coarse_fixed,
                 const float* fine_values, float* coarse_values, WorkTeam& team) {
  const auto [nx, ny, nz] = coarse.cells;
  const HalvedPlanes planes(fine, coarse);
  const size_t fine_row = fine.cells[0] + 1, fine_nodes = fine.nodes(), coarse_nodes = coarse.nodes();
  team.run([&, nx = nx, ny = ny, nz = nz](uint32_t part) {
    std::vector<float> sum(fine_row + 2);  // with a zero before and behind
    const auto [begin, end] = team.share(nz + 1, part);
    for (size_t c = 0; c < 3; ++c)
      for (uint32_t k = begin; k < end; ++k)
        for (uint32_t j = 0; j <= ny; ++j) {
          std::fill(sum.begin(), sum.end(), 0.0f);
          float* s = sum.data() + 1;
          for (int dk = -1; dk <= 1; ++dk)
            for (int dj = -1; dj <= 1; ++dj) {
              const uint32_t fk = planes.fine(k) + dk, fj = 2 * j + dj;
              if (fk > fine.cells[2] || fj > fine.cells[1]) continue;  // also those below zero
              if (dk != 0 && !planes.between(fk)) continue;
              const float along_z = dk == 0   ? 1.0f
                                    : dk == 1 ? upper_fraction(fine, fk)
                                              : 1 - upper_fraction(fine, fk);
              const float weight = along_z * (dj == 0 ? 1.0f : 0.5f);
              const float* from = fine_values + c * fine_nodes + fine.node(0, fj, fk);
              for (size_t i = 0; i < fine_row; ++i) s[i] += weight * from[i];
            }
          float* to = coarse_values + c * coarse_nodes + coarse.node(0, j, k);
          const uint8_t* bits = coarse_fixed.data() + coarse.node(0, j, k);
          for (size_t i = 0; i <= nx; ++i) {
            const float* t = s + 2 * i;
            to[i] = (bits[i] >> c & 1) != 0 ? 0.0f : t[0] + 0.5f * (t[-1] + t[1]);
          }
        }
  });
  share_across_slit(coarse, coarse_values);
}

void prolong_add(const CellGrid& fine, const CellGrid& coarse, const FixedNodes& fine_fixed,
                 const float* coarse_values, float* fine_values, WorkTeam& team) {
  const auto [nx, ny, nz] = fine.cells;
  const HalvedPlanes planes(fine, coarse);
  const size_t coarse_row = coarse.cells[0] + 1, fine_nodes = fine.nodes(), coarse_nodes = coarse.nodes();
  team.run([&, ny = ny, nz = nz](uint32_t part) {
    std::vector<float> mean(coarse_row);
    const auto [begin, end] = team.share(nz + 1, part);
    for (size_t c = 0; c < 3; ++c)
      for (uint32_t k = begin; k < end; ++k)
        for (uint32_t j = 0; j <= ny; ++j) {
          const bool between = planes.between(k);
          const float upper = between ? upper_fraction(fine, k) : 1.0f;
          const float near = (j & 1) == 0 ? 1.0f : 0.5f;
          const float* from[2][2];
          for (uint32_t dk = 0; dk < 2; ++dk)
            for (uint32_t dj = 0; dj < 2; ++dj)
              from[dk][dj] =
                  coarse_values + c * coarse_nodes +
                  coarse.node(0, j / 2 + ((j & 1) != 0 ? dj : 0), planes.coarse(k) + (between ? dk : 0));
          const float a = upper * near, b = upper * (1 - near), d = (1 - upper) * near,
                      e = (1 - upper) * (1 - near);
          for (size_t i = 0; i < coarse_row; ++i)
            mean[i] = a * from[0][0][i] + b * from[0][1][i] + d * from[1][0][i] + e * from[1][1][i];
          float* to = fine_values + c * fine_nodes + fine.node(0, j, k);
          const uint8_t* bits = fine_fixed.data() + fine.node(0, j, k);
          for (size_t i = 0; i + 1 < coarse_row; ++i) {
            to[2 * i] += (bits[2 * i] >> c & 1) != 0 ? 0.0f : mean[i];
            to[2 * i + 1] += (bits[2 * i + 1] >> c & 1) != 0 ? 0.0f : 0.5f * (mean[i] + mean[i + 1]);
          }
          const size_t last = 2 * (coarse_row - 1);
          to[last] += (bits[last] >> c & 1) != 0 ? 0.0f : mean[coarse_row - 1];
        }
  });
}

}  // namespace palpate::fem
