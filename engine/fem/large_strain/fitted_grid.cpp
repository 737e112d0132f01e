#include "engine/fem/large_strain/fitted_grid.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace palpate::fem {
namespace {

using Place = std::array<double, 3>;

constexpr long kAbove = 2;  // least layers of cells above a lump: what the plate feels passes through them
constexpr double kMiddle = 0.25;  // cells that a lump may lie off the block's middle and have cells in it

/// Axes of a lump's round faces; all three of a ball.
std::array<bool, 3> round_axes(InclusionShape shape) {
  return {shape != InclusionShape::LyingCylinder, true, shape != InclusionShape::Cylinder};
}

bool ball(InclusionShape shape) {
  return shape == InclusionShape::Sphere || shape == InclusionShape::Ellipsoid;
}

/// Width of the box of a lump's volume over the lump's.
Place box_fraction(InclusionShape shape) {
  const double fraction = ball(shape) ? std::cbrt(std::numbers::pi / 6) : std::sqrt(std::numbers::pi / 4);
  Place fractions{};
  for (size_t c = 0; c < 3; ++c) fractions[c] = round_axes(shape)[c] ? fraction : 1;
  return fractions;
}

/// Where a point of the cube from -1 to 1 is taken, in the lump's half sizes: the cube's faces to the lump's.
Place rounded(InclusionShape shape, const Place& q) {
  Place to = q;
  if (ball(shape)) {
    for (size_t c = 0; c < 3; ++c) {
      const double a = q[(c + 1) % 3] * q[(c + 1) % 3], b = q[(c + 2) % 3] * q[(c + 2) % 3];
      to[c] *= std::sqrt(std::max(0.0, 1 - a / 2 - b / 2 + a * b / 3));
    }
    return to;
  }
  const size_t a = shape == InclusionShape::Cylinder ? 0 : 1, b = shape == InclusionShape::Cylinder ? 1 : 2;
  to[a] *= std::sqrt(1 - q[b] * q[b] / 2);
  to[b] *= std::sqrt(1 - q[a] * q[a] / 2);
  return to;
}

/// Least part of a cell's volume at one of its Gauss points, and the whole; corners as cells count them.
std::array<double, 2> volumes(const std::array<Place, 8>& corners) {
  const double gauss = 1 / std::sqrt(3.0);
  double least = HUGE_VAL, sum = 0;
  for (int point = 0; point < 8; ++point) {
    std::array<Place, 3> along{};  // along[d]: change of the place along the cell's own axis d
    for (int corner = 0; corner < 8; ++corner)
      for (int d = 0; d < 3; ++d) {
        double slope = 1;
        for (int e = 0; e < 3; ++e) {
          const double side = corner >> e & 1 ? 1 : -1, at = point >> e & 1 ? gauss : -gauss;
          slope *= e == d ? side : (1 + side * at) / 2;
        }
        for (size_t c = 0; c < 3; ++c)
          along[static_cast<size_t>(d)][c] += slope * corners[static_cast<size_t>(corner)][c];
      }
    const auto& [x, y, z] = along;
    const double volume = (x[0] * (y[1] * z[2] - y[2] * z[1]) - x[1] * (y[0] * z[2] - y[2] * z[0]) +
                           x[2] * (y[0] * z[1] - y[1] * z[0])) /
                          8;
    least = std::min(least, volume);
    sum += volume;
  }
  return {least, sum};
}

/// How much the round sizes of flat cells must grow to enclose the volume of the rounded cube.
double enclosing(InclusionShape shape, const InclusionCells& cells) {
  double sum = 0;
  std::array<double, 3> count{};
  for (size_t c = 0; c < 3; ++c) count[c] = cells.last[c] - cells.first[c];
  for (double k = 0; k < count[2]; ++k)
    for (double j = 0; j < count[1]; ++j)
      for (double i = 0; i < count[0]; ++i) {
        std::array<Place, 8> corners;
        for (int n = 0; n < 8; ++n)
          corners[static_cast<size_t>(n)] =
              rounded(shape, {2 * (i + (n & 1)) / count[0] - 1, 2 * (j + (n >> 1 & 1)) / count[1] - 1,
                              2 * (k + (n >> 2)) / count[2] - 1});
        sum += volumes(corners)[1];
      }
  return ball(shape) ? std::cbrt(4 * std::numbers::pi / 3 / sum) : std::sqrt(2 * std::numbers::pi / sum);
}

/// Moves the places of an even grid so that the box of the lump's cells becomes the lump. A skin stays as it
/// is.
class Bend {
 public:
  Bend(const Scene& scene, const InclusionCells& cells)
      : lump_(*scene.inclusion), skin_mm_(scene.skin ? scene.skin->thickness_mm : 0) {
    const double grown = enclosing(lump_.shape, cells);
    const std::array<bool, 3> round = round_axes(lump_.shape);
    const std::array<double, 3> size = lump_.size();
    for (size_t c = 0; c < 3; ++c) {
      const double pitch = scene.block_mm[c] / scene.cells[c], half_mm = scene.block_mm[c] / 2;
      wall_[c] = c < 2 ? std::array{-half_mm, half_mm} : std::array{skin_mm_, scene.block_mm[2]};
      box_[c] = c < 2 ? std::array{cells.first[c] * pitch - half_mm, cells.last[c] * pitch - half_mm}
                      : std::array{plane_mm(scene, cells.first[2]), plane_mm(scene, cells.last[2])};
      centre_[c] = c < 2 ? lump_.offset_mm[c] : lump_.depth_mm + size[2] / 2;
      half_[c] = size[c] / 2 * (round[c] ? grown : 1);
    }
  }

  Place operator()(const Place& from) const {
    if (skin_mm_ > 0 && from[2] <= skin_mm_) return from;
    Place held, q;
    double fraction = 1;
    for (size_t c = 0; c < 3; ++c) {
      const auto [low, high] = box_[c];
      held[c] = std::clamp(from[c], low, high);
      q[c] = (2 * held[c] - low - high) / (high - low);
      if (from[c] < low) fraction *= (from[c] - wall_[c][0]) / (low - wall_[c][0]);
      if (from[c] > high) fraction *= (wall_[c][1] - from[c]) / (wall_[c][1] - high);
    }
    const Place to = rounded(lump_.shape, q);
    Place place;
    for (size_t c = 0; c < 3; ++c) place[c] = from[c] + fraction * (centre_[c] + half_[c] * to[c] - held[c]);
    return place;
  }

 private:
  const Inclusion& lump_;
  double skin_mm_;
  std::array<std::array<double, 2>, 3> wall_{}, box_{};
  Place centre_{}, half_{};
};

bool upright(const CellGrid& grid) {
  const size_t nodes = grid.nodes();
  for (uint32_t k = 0; k < grid.cells[2]; ++k)
    for (uint32_t j = 0; j < grid.cells[1]; ++j)
      for (uint32_t i = 0; i < grid.cells[0]; ++i) {
        std::array<Place, 8> corners;
        for (uint32_t n = 0; n < 8; ++n)
          for (size_t c = 0; c < 3; ++c)
            corners[n][c] = grid.place_mm[c * nodes + grid.node(i + (n & 1), j + (n >> 1 & 1), k + (n >> 2))];
        if (!(volumes(corners)[0] > 0)) return false;
      }
  return true;
}

/// Where the faces of the best box lie, in cells from the block's sides.
std::array<std::array<double, 2>, 3> best_box(const Scene& scene) {
  const Inclusion& lump = *scene.inclusion;
  const std::array<double, 3> size = lump.size(), fraction = box_fraction(lump.shape);
  std::array<std::array<double, 2>, 3> box{};
  for (size_t c = 0; c < 3; ++c) {
    const double centre = c < 2 ? lump.offset_mm[c] + scene.block_mm[c] / 2 : lump.depth_mm + size[2] / 2;
    const double half = size[c] / 2 * fraction[c];
    const uint32_t of_skin = c < 2 ? 0 : skin_layers(scene);
    const double from_mm = of_skin > 0 ? scene.skin->thickness_mm : 0;
    const double per_mm = (scene.cells[c] - of_skin) / (scene.block_mm[c] - from_mm);
    box[c] = {of_skin + (centre - half - from_mm) * per_mm, of_skin + (centre + half - from_mm) * per_mm};
  }
  return box;
}

}  // namespace

InclusionCells InclusionCells::times(uint32_t finer) const {
  InclusionCells more = *this;
  for (size_t c = 0; c < 3; ++c) {
    more.first[c] *= finer;
    more.last[c] *= finer;
  }
  return more;
}

bool InclusionCells::in_middle(const std::array<uint32_t, 3>& of) const {
  return first[0] + last[0] == of[0] && first[1] + last[1] == of[1];
}

InclusionCells inclusion_cells(const Scene& scene) {
  InclusionCells cells;
  const auto box = best_box(scene);
  const long above = std::max(kAbove, static_cast<long>(skin_layers(scene)) + (scene.skin ? 1 : 0));
  for (size_t c = 0; c < 3; ++c) {
    const auto [low, high] = box[c];
    const bool middle =
        c < 2 && scene.cells[c] % 2 == 0 && std::abs(low + high - scene.cells[c]) <= 2 * kMiddle;
    const auto all = static_cast<long>(scene.cells[c]);
    long count = middle ? 2 * std::lround((high - low) / 2) : std::lround(high - low);
    count = std::clamp(count, 2L, all - 1 - (c < 2 ? 1 : above));
    const long first =
        middle ? (all - count) / 2 : std::lround((low + high - static_cast<double>(count)) / 2);
    cells.first[c] = static_cast<uint32_t>(std::clamp(first, c < 2 ? 1L : above, all - 1 - count));
    cells.last[c] = cells.first[c] + static_cast<uint32_t>(count);
  }
  return cells;
}

bool matches(const InclusionCells& cells, const Scene& scene) {
  const auto box = best_box(scene);
  const InclusionCells best = inclusion_cells(scene);
  for (size_t c = 0; c < 3; ++c)
    if ((std::abs(box[c][0] - cells.first[c]) > 1 && best.first[c] != cells.first[c]) ||
        (std::abs(box[c][1] - cells.last[c]) > 1 && best.last[c] != cells.last[c]))
      return false;
  return true;
}

std::optional<CellGrid> fit(const Scene& scene, const InclusionCells& cells, bool quarter) {
  if (quarter && !cells.in_middle(scene.cells)) return std::nullopt;
  Scene tissue = scene;
  tissue.inclusion.reset();
  CellGrid grid = voxelise(tissue, quarter);
  const std::array<uint32_t, 3> skipped = {scene.cells[0] - grid.cells[0], scene.cells[1] - grid.cells[1], 0};
  const auto inside = [&](const std::array<uint32_t, 3>& at) {
    bool in = true;
    for (size_t c = 0; c < 3; ++c)
      in = in && at[c] + skipped[c] >= cells.first[c] && at[c] + skipped[c] < cells.last[c];
    return in;
  };
  const Bend bend(scene, cells);
  const size_t nodes = grid.nodes();
  grid.place_mm.resize(3 * nodes);
  for (uint32_t k = 0; k <= grid.cells[2]; ++k)
    for (uint32_t j = 0; j <= grid.cells[1]; ++j)
      for (uint32_t i = 0; i <= grid.cells[0]; ++i) {
        const Place place =
            bend({(i + skipped[0]) * grid.size_x_mm - scene.block_mm[0] / 2,
                  (j + skipped[1]) * grid.size_y_mm - scene.block_mm[1] / 2, plane_mm(scene, k)});
        for (size_t c = 0; c < 3; ++c) grid.place_mm[c * nodes + grid.node(i, j, k)] = place[c];
        if (i < grid.cells[0] && j < grid.cells[1] && k < grid.cells[2] && inside({i, j, k}))
          grid.young[grid.cell(i, j, k)] = static_cast<float>(scene.inclusion->stiffness_ratio);
      }
  if (!upright(grid)) return std::nullopt;
  return grid;
}

}  // namespace palpate::fem
