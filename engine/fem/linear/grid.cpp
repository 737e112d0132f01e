#include "engine/fem/linear/grid.h"

#include <algorithm>
#include <cmath>

namespace palpate::fem {
namespace {

constexpr uint32_t kColumns = 16;  // of a cell, along x and along y

/// Half the length of the vertical line through (x, y) that lies inside; negative where it misses.
double half_height(InclusionShape shape, const std::array<double, 3>& size, double x, double y) {
  const double a = size[0] / 2, b = size[1] / 2, c = size[2] / 2;
  const double u = x * x / (a * a), v = y * y / (b * b);
  switch (shape) {
    case InclusionShape::Sphere:
    case InclusionShape::Ellipsoid:
      return u + v < 1 ? c * std::sqrt(1 - u - v) : -1;
    case InclusionShape::Cylinder:
      return u + v < 1 ? c : -1;
    case InclusionShape::LyingCylinder:
      return u < 1 && v < 1 ? c * std::sqrt(1 - v) : -1;
  }
  return -1;
}

}  // namespace

double share_inside(InclusionShape shape, const std::array<double, 3>& size, const std::array<double, 3>& low,
                    const std::array<double, 3>& high) {
  for (size_t c = 0; c < 3; ++c)
    if (low[c] >= size[c] / 2 || high[c] <= -size[c] / 2) return 0;
  double sum = 0;
  for (uint32_t j = 0; j < kColumns; ++j)
    for (uint32_t i = 0; i < kColumns; ++i) {
      const double x = low[0] + (high[0] - low[0]) * (i + 0.5) / kColumns;
      const double y = low[1] + (high[1] - low[1]) * (j + 0.5) / kColumns;
      const double half = half_height(shape, size, x, y);
      if (half > 0) sum += std::max(0.0, std::min(high[2], half) - std::max(low[2], -half));
    }
  return sum / (kColumns * kColumns) / (high[2] - low[2]);
}

double mixed_modulus(double fraction, double ratio) {
  constexpr double q = 0.8;
  return ratio == 1 ? 1 : 1 + fraction / (1 / (ratio - 1) + q * (1 - fraction));
}

std::vector<uint32_t> pad_layers(const Scene& scene) {
  // As fine as the tissue's cells, two at least: one could not bend.
  const double pitch = scene.block_mm[2] / scene.cells[2];
  std::vector<uint32_t> layers;
  for (auto sheet = scene.pad.rbegin(); sheet != scene.pad.rend(); ++sheet)
    layers.push_back(2 * std::max(1u, static_cast<uint32_t>(std::lround(sheet->thickness_mm / pitch / 2))));
  return layers;
}

uint32_t skin_layers(const Scene& scene) {
  if (!scene.skin) return 0;
  const double sixths = std::max(1.0, std::round(6 * scene.skin->thickness_mm / scene.block_mm[2]));
  return std::max(1u, static_cast<uint32_t>(std::lround(scene.cells[2] * sixths / 6)));
}

double plane_mm(const Scene& scene, uint32_t layer) {
  const uint32_t of_skin = skin_layers(scene);
  if (layer < of_skin) return layer * scene.skin->thickness_mm / of_skin;
  const double skin_mm = scene.skin ? scene.skin->thickness_mm : 0;
  return skin_mm + (layer - of_skin) * (scene.block_mm[2] - skin_mm) / (scene.cells[2] - of_skin);
}

CellGrid voxelise(const Scene& scene, bool quarter) {
  CellGrid grid;
  const std::vector<uint32_t> sheets = pad_layers(scene);
  uint32_t above = 0;
  for (size_t s = 0; s < sheets.size(); ++s) {
    above += sheets[s];
    grid.size_z_mm.insert(grid.size_z_mm.end(), sheets[s],
                          scene.pad[sheets.size() - 1 - s].thickness_mm / sheets[s]);
  }
  if (scene.pad_slides && above > 0) {
    grid.slit = above++;
    grid.size_z_mm.push_back(0);
  }
  const uint32_t of_skin = skin_layers(scene);
  const double skin_mm = scene.skin ? scene.skin->thickness_mm : 0;
  const double height = (scene.block_mm[2] - skin_mm) / (scene.cells[2] - of_skin);
  grid.size_z_mm.insert(grid.size_z_mm.end(), of_skin, skin_mm / std::max(1u, of_skin));
  grid.size_z_mm.insert(grid.size_z_mm.end(), scene.cells[2] - of_skin, height);
  grid.cells = {scene.cells[0] / (quarter ? 2 : 1), scene.cells[1] / (quarter ? 2 : 1),
                scene.cells[2] + above};
  grid.size_x_mm = scene.block_mm[0] / scene.cells[0];
  grid.size_y_mm = scene.block_mm[1] / scene.cells[1];
  grid.young.assign(grid.cell_count(), 1.0f);

  const auto fill = [&](uint32_t k, double young) {
    std::fill_n(grid.young.begin() + static_cast<std::ptrdiff_t>(grid.cell(0, 0, k)),
                size_t{grid.cells[0]} * grid.cells[1], static_cast<float>(young));
  };
  for (uint32_t s = 0, k = 0; s < sheets.size(); ++s)
    for (uint32_t layer = 0; layer < sheets[s]; ++layer)
      fill(k++, scene.pad[sheets.size() - 1 - s].young_Pa / scene.young_Pa);
  if (grid.slit) fill(*grid.slit, 0);
  for (uint32_t k = 0; k < of_skin; ++k) fill(k + above, scene.skin->stiffness_ratio);

  std::vector<Inclusion> lumps = scene.others;
  if (scene.inclusion) lumps.push_back(*scene.inclusion);
  const double left = quarter ? 0 : -scene.block_mm[0] / 2, front = quarter ? 0 : -scene.block_mm[1] / 2;
  for (const Inclusion& lump : lumps) {
    const std::array<double, 3> size = lump.size();
    for (uint32_t k = of_skin; k < scene.cells[2]; ++k)
      for (uint32_t j = 0; j < grid.cells[1]; ++j)
        for (uint32_t i = 0; i < grid.cells[0]; ++i) {
          const std::array<double, 3> low = {left + i * grid.size_x_mm - lump.offset_mm[0],
                                             front + j * grid.size_y_mm - lump.offset_mm[1],
                                             skin_mm + (k - of_skin) * height - lump.depth_mm - size[2] / 2};
          const double inside = share_inside(
              lump.shape, size, low, {low[0] + grid.size_x_mm, low[1] + grid.size_y_mm, low[2] + height});
          if (inside > 0)
            grid.young[grid.cell(i, j, k + above)] =
                static_cast<float>(mixed_modulus(inside, lump.stiffness_ratio));
        }
  }
  return grid;
}

bool symmetric(const Scene& scene) {
  const auto in_middle = [](const Inclusion& lump) { return lump.offset_mm == std::array{0.0, 0.0}; };
  const bool centred = (!scene.inclusion || in_middle(*scene.inclusion)) &&
                       std::all_of(scene.others.begin(), scene.others.end(), in_middle);
  return centred && scene.cells[0] % 2 == 0 && scene.cells[1] % 2 == 0;
}

namespace {

/// Bits that the presser holds at a place of the pressed surface, mm from the block's middle.
uint8_t held_by_presser(const Scene& scene, double x_mm, double y_mm) {
  if (scene.presser != Presser::Flat) return 0;
  if (!scene.pad.empty()) return kFixedAll;
  const auto beside = [&](double at_mm, size_t c) {
    return scene.plate_half_mm && std::abs(at_mm) > (*scene.plate_half_mm)[c] + 1e-6 * scene.block_mm[c];
  };
  if (beside(x_mm, 0) || beside(y_mm, 1)) return 0;
  return scene.plate_sticks ? kFixedAll : kFixedZ;
}

}  // namespace

FixedNodes supports(const Scene& scene, const CellGrid& grid, bool quarter) {
  const auto [nx, ny, nz] = grid.cells;
  FixedNodes fixed(grid.nodes());
  for (uint32_t k = 0; k <= nz; ++k)
    for (uint32_t j = 0; j <= ny; ++j)
      for (uint32_t i = 0; i <= nx; ++i) {
        uint8_t& bits = fixed[grid.node(i, j, k)];
        if (k == nz) bits |= scene.bottom_slides ? kFixedZ : kFixedAll;
        if (k == 0)
          bits |= held_by_presser(scene, i * grid.size_x_mm - (quarter ? 0 : scene.block_mm[0] / 2),
                                  j * grid.size_y_mm - (quarter ? 0 : scene.block_mm[1] / 2));
        if (quarter && i == 0) bits |= kFixedX;
        if (quarter && j == 0) bits |= kFixedY;
      }
  if (scene.bottom_slides && !quarter) {
    // Nothing pushes sideways: two nodes keep the block from drifting and turning.
    fixed[grid.node(nx / 2, ny / 2, nz)] |= kFixedX | kFixedY;
    fixed[grid.node(nx, ny / 2, nz)] |= kFixedY;
  }
  return fixed;
}

std::optional<CellGrid> halve(const CellGrid& fine) {
  const auto halves = [](uint32_t n) { return n % 2 == 0 && n >= 4; };
  const uint32_t above = fine.slit.value_or(0), below = fine.cells[2] - (fine.slit ? above + 1 : 0);
  if (!halves(fine.cells[0]) || !halves(fine.cells[1]) || !halves(below)) return std::nullopt;
  const uint32_t by_above = above % 2 == 0 ? 2 : 1;
  CellGrid coarse;
  coarse.cells = {fine.cells[0] / 2, fine.cells[1] / 2, fine.cells[2] / 2};
  coarse.size_x_mm = 2 * fine.size_x_mm;
  coarse.size_y_mm = 2 * fine.size_y_mm;
  if (fine.slit) {
    coarse.slit = above / by_above;
    coarse.cells[2] = *coarse.slit + 1 + below / 2;
  }
  for (uint32_t k = 0, f = 0; k < coarse.cells[2]; ++k) {
    const uint32_t layers = coarse.slit == k ? 1 : fine.slit && f < above ? by_above : 2;
    coarse.size_z_mm.push_back(0);
    for (uint32_t z = 0; z < layers; ++z) coarse.size_z_mm.back() += fine.size_z_mm[f + z];
    for (uint32_t j = 0; j < coarse.cells[1]; ++j)
      for (uint32_t i = 0; i < coarse.cells[0]; ++i) {
        double sum = 0;
        for (uint32_t z = 0; z < layers; ++z)
          for (uint32_t corner = 0; corner < 4; ++corner)
            sum += double{fine.young[fine.cell(2 * i + (corner & 1), 2 * j + (corner >> 1), f + z)]};
        coarse.young.push_back(static_cast<float>(sum / (4 * layers)));
      }
    f += layers;
  }
  return coarse;
}

FixedNodes halve(const CellGrid& fine, const CellGrid& coarse, const FixedNodes& fixed) {
  const HalvedPlanes planes(fine, coarse);
  FixedNodes kept;
  for (uint32_t k = 0; k <= coarse.cells[2]; ++k)
    for (uint32_t j = 0; j <= fine.cells[1]; j += 2)
      for (uint32_t i = 0; i <= fine.cells[0]; i += 2) kept.push_back(fixed[fine.node(i, j, planes.fine(k))]);
  return kept;
}

HalvedPlanes::HalvedPlanes(const CellGrid& fine, const CellGrid& coarse)
    : fine_above_(fine.slit ? *fine.slit + 1 : 0),
      coarse_above_(coarse.slit ? *coarse.slit + 1 : 0),
      by_above_(fine.slit ? *fine.slit / *coarse.slit : 1) {}

uint32_t HalvedPlanes::fine(uint32_t plane) const {
  return plane < coarse_above_ ? by_above_ * plane : fine_above_ + 2 * (plane - coarse_above_);
}

uint32_t HalvedPlanes::coarse(uint32_t plane) const {
  return plane < fine_above_ ? plane / by_above_ : coarse_above_ + (plane - fine_above_) / 2;
}

}  // namespace palpate::fem
