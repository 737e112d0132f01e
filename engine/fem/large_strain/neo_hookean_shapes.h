// Common part of the kernels of neo-Hookean cells: eight cells of a row at a time, each in a lane.
#pragma once

#include <array>
#include <cmath>
#include <cstring>

#include "engine/base/simd.h"
#include "engine/fem/large_strain/neo_hookean_layer.h"
#include "engine/fem/linear/grid.h"

namespace palpate::fem {

inline constexpr uint32_t kLanes = 8;
using Lanes = double __attribute__((vector_size(kLanes * sizeof(double))));
using NarrowLanes = float __attribute__((vector_size(kLanes * sizeof(float))));

/// `count` of the eight numbers at `from`, zeros behind.
PALPATE_INLINE void load(const double* from, uint32_t count, Lanes& to) {
  to = Lanes{};
  if (count == kLanes)
    std::memcpy(&to, from, sizeof to);
  else
    std::memcpy(&to, from, count * sizeof(double));
}

struct Corners {
  Lanes value[24];
};

/// Displacements at the corners of a block's cells, 3 x corner + component.
PALPATE_INLINE void gather(const CellGrid& grid, const double* u, uint32_t i, uint32_t j, uint32_t k,
                           uint32_t count, Corners& out) {
  const size_t nodes = grid.nodes();
  for (uint32_t corner = 0; corner < 8; ++corner) {
    const size_t n = grid.node(i + (corner & 1), j + (corner >> 1 & 1), k + (corner >> 2));
    for (uint32_t c = 0; c < 3; ++c) load(u + c * nodes + n, count, out.value[3 * corner + c]);
  }
}

/// Adds the corners' forces to the nodes of the planes above and below that are wanted.
PALPATE_INLINE void scatter(const CellGrid& grid, double* f, uint32_t i, uint32_t j, uint32_t k,
                            uint32_t count, const Corners& in, bool upper, bool lower) {
  const size_t nodes = grid.nodes();
  for (uint32_t corner = 0; corner < 8; ++corner) {
    if (!(corner < 4 ? upper : lower)) continue;
    const size_t n = grid.node(i + (corner & 1), j + (corner >> 1 & 1), k + (corner >> 2));
    for (uint32_t c = 0; c < 3; ++c) {
      double* to = f + c * nodes + n;
      Lanes sum;
      load(to, count, sum);
      sum += in.value[3 * corner + c];
      std::memcpy(to, &sum, count * sizeof(double));
    }
  }
}

/// Deformation at a Gauss point.
struct Point {
  Lanes f[9];         // F, row by row
  Lanes cofactor[9];  // J F^-T
  Lanes j;
};

/// The cofactors of a 3 x 3 matrix, row by row, and its determinant.
PALPATE_INLINE void cofactors(const Lanes (&f)[9], Lanes (&cofactor)[9], Lanes& determinant) {
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) {
      const int r1 = (r + 1) % 3, r2 = (r + 2) % 3, c1 = (c + 1) % 3, c2 = (c + 2) % 3;
      cofactor[3 * r + c] = f[3 * r1 + c1] * f[3 * r2 + c2] - f[3 * r1 + c2] * f[3 * r2 + c1];
    }
  determinant = f[0] * cofactor[0] + f[1] * cofactor[1] + f[2] * cofactor[2];
}

/// F = (`rest` ? 1 : 0) + grad u.
template <typename Number>
PALPATE_INLINE void deform(const Number* gradient, const Corners& u, Point& p, bool rest = true) {
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) {
      Lanes sum = Lanes{} + (rest && r == c ? 1.0 : 0.0);
      for (int corner = 0; corner < 8; ++corner) sum += u.value[3 * corner + r] * gradient[3 * corner + c];
      p.f[3 * r + c] = sum;
    }
  cofactors(p.f, p.cofactor, p.j);
}

/// Gradients of the corners' shapes (3 x corner + component) and volumes of the Gauss points of a block's
/// cells. Of bricks: a layer's are alike.
class BrickShapes {
 public:
  PALPATE_INLINE BrickShapes(const CellGrid& /*grid*/, const NeoHookeanLayer& layer, uint32_t /*i*/,
                             uint32_t /*j*/, uint32_t /*k*/, uint32_t /*count*/)
      : layer_(layer) {}
  PALPATE_INLINE const double* gradient(int point) const { return layer_.gradient[point].data(); }
  PALPATE_INLINE double weight(int /*point*/) const { return layer_.weight; }
  PALPATE_INLINE double volume() const { return 8 * layer_.weight; }

 private:
  const NeoHookeanLayer& layer_;
};

/// The same of cells whose corners lie where the grid's place_mm says.
class BentShapes {
 public:
  PALPATE_INLINE BentShapes(const CellGrid& grid, const NeoHookeanLayer& layer, uint32_t i, uint32_t j,
                            uint32_t k, uint32_t count) {
    Corners place;
    gather(grid, grid.place_mm.data(), i, j, k, count, place);
    for (int q = 0; q < 8; ++q) {
      // By way of the brick, from which the cell's own shape is one more deformation.
      const std::array<double, 24>& brick = layer.gradient[q];
      Point bent;
      deform(brick.data(), place, bent, false);
      const Lanes per_j = 1.0 / (bent.j == 0.0 ? Lanes{} + 1.0 : bent.j);  // lanes without a cell
      weight_[q] = bent.j * layer.weight;
      volume_ += weight_[q];
      for (int corner = 0; corner < 8; ++corner)
        for (int c = 0; c < 3; ++c) {
          const double* at = brick.data() + 3 * corner;
          gradient_[q][3 * corner + c] =
              per_j * (bent.cofactor[3 * c] * at[0] + bent.cofactor[3 * c + 1] * at[1] +
                       bent.cofactor[3 * c + 2] * at[2]);
        }
    }
    volume_ = volume_ == 0.0 ? Lanes{} + 1.0 : volume_;
  }
  PALPATE_INLINE const Lanes* gradient(int point) const { return gradient_[point]; }
  PALPATE_INLINE const Lanes& weight(int point) const { return weight_[point]; }
  PALPATE_INLINE const Lanes& volume() const { return volume_; }

 private:
  Lanes gradient_[8][24], weight_[8], volume_ = {};
};

}  // namespace palpate::fem
