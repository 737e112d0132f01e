#include "engine/fem/large_strain/neo_hookean.h"

#include <algorithm>
#include <cmath>

#include "engine/fem/large_strain/neo_hookean_shapes.h"

namespace palpate::fem {
namespace {

constexpr size_t kPairs = 36;  // of corners, each with itself and those behind it
constexpr size_t kBlockFloats = kPairs * 9 * kLanes;

/// j^(-2/3) by Newton's iteration for j^(-1/3) from 1: exact to rounding for j from 0.3 to 3, and outside
/// that no element is one any more.
PALPATE_INLINE void isochoric(const Lanes& j, Lanes& out) {
  Lanes y = (4.0 - j) / 3.0;
  y = y > 0.3 ? y : Lanes{} + 0.3;
  for (int round = 0; round < 7; ++round) y *= (4.0 - j * y * y * y) / 3.0;
  out = y * y;
}

}  // namespace

NeoHookeanCells::NeoHookeanCells(const CellGrid& grid, double poisson)
    : grid_(grid),
      mu_(0.5 / (1 + poisson)),
      kappa_(1 / (3 * (1 - 2 * poisson))),
      blocks_((grid.cells[0] + kLanes - 1) / kLanes) {
  const double gauss = 1 / std::sqrt(3.0);
  for (const double height : grid.size_z_mm) {
    const double size[] = {grid.size_x_mm, grid.size_y_mm, height};
    NeoHookeanLayer layer{size[0] * size[1] * size[2] / 8, {}};
    for (int point = 0; point < 8; ++point)
      for (int corner = 0; corner < 8; ++corner)
        for (int c = 0; c < 3; ++c) {
          double slope = 1;
          for (int d = 0; d < 3; ++d) {
            const double side = corner >> d & 1 ? 1 : -1, at = point >> d & 1 ? gauss : -gauss;
            slope *= d == c ? side / size[d] : (1 + side * at) / 2;
          }
          layer.gradient[point][3 * corner + c] = slope;
        }
    layers_.push_back(layer);
  }
}

template <template <typename> class Work, typename... Parts>
void NeoHookeanCells::run_on_shapes(const Parts&... parts) const {
  if (grid_.place_mm.empty())
    run_widest(Work<BrickShapes>{*this, parts...});
  else
    run_widest(Work<BentShapes>{*this, parts...});
}

template <typename Shapes>
struct NeoHookeanForces {
  const NeoHookeanCells& cells;
  const double* u;
  double* f;
  const float* young;
  uint32_t k;
  bool upper, lower;
  double* least;  // J, lowered

  PALPATE_INLINE void run() const {
    const CellGrid& grid = cells.grid_;
    const NeoHookeanLayer& layer = cells.layers_[k];
    Lanes low = Lanes{} + *least;
    for (uint32_t row = 0; row < grid.cells[1]; ++row)
      for (uint32_t i = 0; i < grid.cells[0]; i += kLanes) {
        const uint32_t count = std::min(kLanes, grid.cells[0] - i);
        Corners corners;
        gather(grid, u, i, row, k, count, corners);
        const Shapes shapes(grid, layer, i, row, k, count);
        Point points[8];
        Lanes volume = {};
        for (int q = 0; q < 8; ++q) {
          deform(shapes.gradient(q), corners, points[q]);
          volume += shapes.weight(q) * points[q].j;
          low = points[q].j < low ? points[q].j : low;
        }
        Lanes modulus = {};
        for (uint32_t l = 0; l < count; ++l) modulus[l] = double{young[grid.cell(i + l, row, k)]};
        const Lanes pressure = modulus * cells.kappa_ * (volume / shapes.volume() - 1.0);
        const Lanes shear = modulus * cells.mu_;
        Corners out = {};
        for (int q = 0; q < 8; ++q) {
          const Point& p = points[q];
          Lanes squares = {}, factor;
          for (const Lanes& x : p.f) squares += x * x;
          isochoric(p.j, factor);
          factor *= shear * shapes.weight(q);
          const Lanes along = shapes.weight(q) * pressure - factor * squares / (3.0 * p.j);
          Lanes stress[9];  // first Piola-Kirchhoff times the point's volume
          for (int s = 0; s < 9; ++s) stress[s] = factor * p.f[s] + along * p.cofactor[s];
          const auto* g = shapes.gradient(q);
          for (int corner = 0; corner < 8; ++corner)
            for (int c = 0; c < 3; ++c)
              out.value[3 * corner + c] += stress[3 * c] * g[3 * corner] +
                                           stress[3 * c + 1] * g[3 * corner + 1] +
                                           stress[3 * c + 2] * g[3 * corner + 2];
        }
        scatter(grid, f, i, row, k, count, out, upper, lower);
      }
    for (uint32_t l = 0; l < kLanes; ++l) *least = std::min(*least, double{low[l]});
  }
};

double NeoHookeanCells::forces(const double* displacement, double* force, const std::vector<float>& young,
                               WorkTeam& team, uint32_t first, uint32_t last) const {
  last = std::min(last, grid_.cells[2]);
  const size_t plane = size_t{grid_.cells[0] + 1} * (grid_.cells[1] + 1), nodes = grid_.nodes();
  std::vector<double> least(team.members(), HUGE_VAL);
  team.run([&](uint32_t part) {
    const auto [begin, end] = team.share(grid_.cells[2] + 1, part);
    if (begin == end) return;
    for (size_t c = 0; c < 3; ++c) std::fill_n(force + c * nodes + begin * plane, (end - begin) * plane, 0.0);
    // The layer between two parts is worked through by both, each keeping its own plane of nodes.
    for (uint32_t k = std::max(first, begin == 0 ? 0 : begin - 1); k < std::min(end, last); ++k)
      run_on_shapes<NeoHookeanForces>(displacement, force, young.data(), k, k >= begin, k + 1 < end,
                                      &least[part]);
  });
  return *std::min_element(least.begin(), least.end());
}

template <typename Shapes>
struct NeoHookeanTangent {
  const NeoHookeanCells& cells;
  const double* u;
  const double* pressures;
  uint32_t k;
  float* out;

  PALPATE_INLINE void run() const {
    const CellGrid& grid = cells.grid_;
    const NeoHookeanLayer& layer = cells.layers_[k];
    float* to = out;
    for (uint32_t row = 0; row < grid.cells[1]; ++row)
      for (uint32_t i = 0; i < grid.cells[0]; i += kLanes, to += kBlockFloats) {
        const uint32_t count = std::min(kLanes, grid.cells[0] - i);
        Corners corners;
        gather(grid, u, i, row, k, count, corners);
        const Shapes shapes(grid, layer, i, row, k, count);
        Lanes modulus = {}, cell_pressure;
        for (uint32_t l = 0; l < count; ++l) modulus[l] = double{grid.young[grid.cell(i + l, row, k)]};
        load(pressures + grid.cell(i, row, k), count, cell_pressure);
        const Lanes shear = modulus * cells.mu_;
        alignas(64) Lanes k_sum[kPairs * 9] = {};
        Lanes swell[24] = {};  // derivative of V Jm
        for (int q = 0; q < 8; ++q) {
          const auto* g = shapes.gradient(q);
          Point p;
          deform(g, corners, p);
          const Lanes pressure = cell_pressure * shapes.weight(q);
          Lanes squares = {}, factor;
          for (const Lanes& x : p.f) squares += x * x;
          isochoric(p.j, factor);
          factor *= shear * shapes.weight(q);
          // dP = factor [dF - 2/3 (G:dF) F - 2/3 (F:dF) G + 2/9 I1 (G:dF) G + I1/3 G dF^T G]
          //      + pressure J [(G:dF) G - G dF^T G],  G = F^-T
          const Lanes per_j = 1.0 / p.j;
          const Lanes twist = factor * squares / 3.0 - pressure * p.j;
          const Lanes half = (factor * squares * (2.0 / 9) + pressure * p.j) / 2.0;
          Lanes b[24], s[24], t[24];
          for (int corner = 0; corner < 8; ++corner)
            for (int c = 0; c < 3; ++c) {
              const auto* at = g + 3 * corner;
              const Lanes cofactor =
                  p.cofactor[3 * c] * at[0] + p.cofactor[3 * c + 1] * at[1] + p.cofactor[3 * c + 2] * at[2];
              const Lanes a = p.f[3 * c] * at[0] + p.f[3 * c + 1] * at[1] + p.f[3 * c + 2] * at[2];
              const int n = 3 * corner + c;
              swell[n] += cofactor * shapes.weight(q);
              b[n] = cofactor * per_j;
              s[n] = half * b[n] - factor * a * (2.0 / 3);
              t[n] = twist * b[n];
            }
          Lanes* entry = k_sum;
          for (int a = 0; a < 8; ++a)
            for (int c = a; c < 8; ++c, entry += 9) {
              const auto dot =
                  g[3 * a] * g[3 * c] + g[3 * a + 1] * g[3 * c + 1] + g[3 * a + 2] * g[3 * c + 2];
              const Lanes straight = factor * dot;
              for (int x = 0; x < 3; ++x)
                for (int y = 0; y < 3; ++y) {
                  Lanes sum =
                      s[3 * a + x] * b[3 * c + y] + b[3 * a + x] * s[3 * c + y] + b[3 * c + x] * t[3 * a + y];
                  if (x == y) sum += straight;
                  entry[3 * x + y] += sum;
                }
            }
        }
        const Lanes bulk = modulus * cells.kappa_ / shapes.volume();
        const Lanes* entry = k_sum;
        float* block = to;
        for (int a = 0; a < 8; ++a)
          for (int c = a; c < 8; ++c)
            for (int x = 0; x < 3; ++x)
              for (int y = 0; y < 3; ++y, ++entry, block += kLanes) {
                const Lanes sum = *entry + bulk * swell[3 * a + x] * swell[3 * c + y];
                const NarrowLanes narrow = __builtin_convertvector(sum, NarrowLanes);
                std::memcpy(block, &narrow, sizeof narrow);
              }
      }
  }
};

template <typename Shapes>
struct NeoHookeanPressure {
  const NeoHookeanCells& cells;
  const double* u;
  const double* change;
  uint32_t k;
  double* out;

  PALPATE_INLINE void run() const {
    const CellGrid& grid = cells.grid_;
    for (uint32_t row = 0; row < grid.cells[1]; ++row)
      for (uint32_t i = 0; i < grid.cells[0]; i += kLanes) {
        const uint32_t count = std::min(kLanes, grid.cells[0] - i);
        Corners corners, moved;
        gather(grid, u, i, row, k, count, corners);
        gather(grid, change, i, row, k, count, moved);
        const Shapes shapes(grid, cells.layers_[k], i, row, k, count);
        Lanes volume = {};
        for (int q = 0; q < 8; ++q) {
          const auto* gradient = shapes.gradient(q);
          Point p;
          deform(gradient, corners, p);
          Lanes grown = p.j;
          for (int r = 0; r < 3; ++r)
            for (int c = 0; c < 3; ++c) {
              Lanes slope = {};
              for (int corner = 0; corner < 8; ++corner)
                slope += moved.value[3 * corner + r] * gradient[3 * corner + c];
              grown += p.cofactor[3 * r + c] * slope;
            }
          volume += grown * shapes.weight(q);
        }
        const Lanes strain = volume / shapes.volume() - 1.0;
        for (uint32_t l = 0; l < count; ++l) {
          const size_t cell = grid.cell(i + l, row, k);
          out[cell] = double{grid.young[cell]} * cells.kappa_ * strain[l];
        }
      }
  }
};

void NeoHookeanCells::pressures(const double* displacement, const double* change,
                                std::vector<double>& pressure, WorkTeam& team) const {
  pressure.resize(grid_.cell_count());
  team.run([&](uint32_t part) {
    const auto [begin, end] = team.share(grid_.cells[2], part);
    for (uint32_t k = begin; k < end; ++k)
      run_on_shapes<NeoHookeanPressure>(displacement, change, k, pressure.data());
  });
}

void NeoHookeanCells::form_tangent(const double* displacement, const std::vector<double>& pressure,
                                   WorkTeam& team) {
  const size_t layer_floats = size_t{grid_.cells[1]} * blocks_ * kBlockFloats;
  tangent_.resize(layer_floats * grid_.cells[2]);
  team.run([&](uint32_t part) {
    const auto [begin, end] = team.share(grid_.cells[2], part);
    for (uint32_t k = begin; k < end; ++k)
      run_on_shapes<NeoHookeanTangent>(displacement, pressure.data(), k, tangent_.data() + k * layer_floats);
  });
}

struct NeoHookeanProduct {
  const CellGrid& grid;
  const float* tangent;
  const double* u;
  double* f;
  uint32_t k;
  bool upper, lower;

  PALPATE_INLINE void run() const {
    const float* block = tangent;
    for (uint32_t row = 0; row < grid.cells[1]; ++row)
      for (uint32_t i = 0; i < grid.cells[0]; i += kLanes) {
        const uint32_t count = std::min(kLanes, grid.cells[0] - i);
        Corners in, out = {};
        gather(grid, u, i, row, k, count, in);
        for (int a = 0; a < 8; ++a)
          for (int c = a; c < 8; ++c)
            for (int x = 0; x < 3; ++x)
              for (int y = 0; y < 3; ++y, block += kLanes) {
                NarrowLanes narrow;
                std::memcpy(&narrow, block, sizeof narrow);
                const Lanes entry = __builtin_convertvector(narrow, Lanes);
                out.value[3 * a + x] += entry * in.value[3 * c + y];
                if (c != a) out.value[3 * c + y] += entry * in.value[3 * a + x];
              }
        scatter(grid, f, i, row, k, count, out, upper, lower);
      }
  }
};

void NeoHookeanCells::apply(const double* displacement, double* force, const FixedNodes* fixed,
                            WorkTeam& team) const {
  const size_t plane = size_t{grid_.cells[0] + 1} * (grid_.cells[1] + 1), nodes = grid_.nodes();
  const size_t layer_floats = size_t{grid_.cells[1]} * blocks_ * kBlockFloats;
  team.run([&](uint32_t part) {
    const auto [begin, end] = team.share(grid_.cells[2] + 1, part);
    if (begin == end) return;
    for (size_t c = 0; c < 3; ++c) std::fill_n(force + c * nodes + begin * plane, (end - begin) * plane, 0.0);
    for (uint32_t k = begin == 0 ? 0 : begin - 1; k < std::min(end, grid_.cells[2]); ++k)
      run_widest(NeoHookeanProduct{grid_, tangent_.data() + k * layer_floats, displacement, force, k,
                                   k >= begin, k + 1 < end});
    if (fixed == nullptr) return;
    for (size_t c = 0; c < 3; ++c)
      for (size_t n = begin * plane; n < end * plane; ++n)
        if (((*fixed)[n] >> c & 1) != 0) force[c * nodes + n] = 0;
  });
}

}  // namespace palpate::fem
