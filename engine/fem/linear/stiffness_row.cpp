#include "engine/fem/linear/stiffness_row.h"
#include "engine/base/simd.h"

#include <algorithm>

namespace palpate::fem {
namespace {

constexpr uint32_t kChunk = 128;          // cells along x at a time: their forces stay in the first cache
constexpr uint32_t kPitch = kChunk + 16;  // with a zero cell before the first and behind the last
constexpr uint32_t kForces = 21;          // per cell: seven moments of three components

/// One component at the four edges of a row of cells, as sums and differences across y and z.
template <typename Real>
struct Across {
  Real one, y, z, yz;
};
template <typename Real>
PALPATE_INLINE Across<Real> across(const Real* at, size_t row, size_t plane, size_t i) {
  const Real a = at[i], b = at[row + i], c = at[plane + i], d = at[plane + row + i];
  const Real low = a + b, high = c + d, low_y = b - a, high_y = d - c;
  return {low + high, low_y + high_y, high - low, high_y - low_y};
}

/// The moments of one component in a cell: of the left face's values and the right face's.
template <typename Real>
struct Moments {
  Real x, y, z, xy, xz, yz, xyz;
};
template <typename Real>
PALPATE_INLINE Moments<Real> moments(const Real* at, size_t row, size_t plane, size_t i) {
  const Across<Real> l = across(at, row, plane, i), r = across(at, row, plane, i + 1);
  return {r.one - l.one, r.y + l.y, r.z + l.z, r.y - l.y, r.z - l.z, r.yz + l.yz, r.yz - l.yz};
}

/// Reaction to the moments of a row's cells: `out` has a row of kPitch for each.
template <typename Real>
PALPATE_INLINE void push_back(const LayerStiffness<Real>& s, const float* young, const Real* ux,
                              const Real* uy, const Real* uz, size_t row, size_t plane, uint32_t cells,
                              Real* __restrict out) {
  const Real third = Real(1) / 3, ninth = Real(1) / 9, f43 = Real(4) / 3, f23 = Real(2) / 3;
  const Real x_xy = third * (f43 * s.xx + s.yy), x_xz = third * (f43 * s.xx + s.zz);
  const Real y_xy = third * (f43 * s.yy + s.xx), y_yz = third * (f43 * s.yy + s.zz);
  const Real z_xz = third * (f43 * s.zz + s.xx), z_yz = third * (f43 * s.zz + s.yy);
  const Real c_xy = third * f23 * s.xy, c_xz = third * f23 * s.xz, c_yz = third * f23 * s.yz;
  const Real t_xy = third * s.xy, t_xz = third * s.xz, t_yz = third * s.yz;
  const Real x_yz = third * (s.yy + s.zz), y_xz = third * (s.xx + s.zz), z_xy = third * (s.xx + s.yy);
  const Real x_xyz = ninth * (f43 * s.xx + s.yy + s.zz), y_xyz = ninth * (f43 * s.yy + s.xx + s.zz),
             z_xyz = ninth * (f43 * s.zz + s.xx + s.yy);
  PALPATE_INDEPENDENT
  for (uint32_t i = 0; i < cells; ++i) {
    const Moments<Real> u = moments(ux, row, plane, i), v = moments(uy, row, plane, i),
                        w = moments(uz, row, plane, i);
    const Real e = static_cast<Real>(young[i]);
    const Real xx = s.gx * u.x, yy = s.gy * v.y, zz = s.gz * w.z;
    const Real pressure = s.bulk * ((xx + yy) + zz);
    Real* o = out + i;
    o[0 * kPitch] = e * (s.gx * (pressure + s.twice_mu * xx));
    o[1 * kPitch] = e * (s.yy * u.y + s.xy * v.x);
    o[2 * kPitch] = e * (s.zz * u.z + s.xz * w.x);
    o[3 * kPitch] = e * (x_xy * u.xy - c_xz * w.yz);
    o[4 * kPitch] = e * (x_xz * u.xz - c_xy * v.yz);
    o[5 * kPitch] = e * (x_yz * u.yz + t_xy * v.xz + t_xz * w.xy);
    o[6 * kPitch] = e * (x_xyz * u.xyz);
    o[7 * kPitch] = e * (s.xy * u.y + s.xx * v.x);
    o[8 * kPitch] = e * (s.gy * (pressure + s.twice_mu * yy));
    o[9 * kPitch] = e * (s.zz * v.z + s.yz * w.y);
    o[10 * kPitch] = e * (y_xy * v.xy - c_yz * w.xz);
    o[11 * kPitch] = e * (y_xz * v.xz + t_xy * u.yz + t_yz * w.xy);
    o[12 * kPitch] = e * (y_yz * v.yz - c_xy * u.xz);
    o[13 * kPitch] = e * (y_xyz * v.xyz);
    o[14 * kPitch] = e * (s.xz * u.z + s.xx * w.x);
    o[15 * kPitch] = e * (s.yz * v.z + s.yy * w.y);
    o[16 * kPitch] = e * (s.gz * (pressure + s.twice_mu * zz));
    o[17 * kPitch] = e * (z_xy * w.xy + t_xz * u.yz + t_yz * v.xz);
    o[18 * kPitch] = e * (z_xz * w.xz - c_yz * v.xy);
    o[19 * kPitch] = e * (z_yz * w.yz - c_xz * u.xy);
    o[20 * kPitch] = e * (z_xyz * w.xyz);
  }
}

/// The cells' moments of one component to the nodes of the row's four edges. `in` points at the first cell;
/// the cell before it and the one behind the last hold zeros.
template <typename Real>
PALPATE_INLINE void gather(const Real* __restrict in, uint32_t nodes, size_t row, size_t plane,
                           Real* __restrict f, bool upper, bool lower) {
  const auto both = [&](int moment, uint32_t i) {
    return in[moment * int{kPitch} + int(i)] + in[moment * int{kPitch} + int(i) - 1];
  };
  const auto step = [&](int moment, uint32_t i) {
    return in[moment * int{kPitch} + int(i) - 1] - in[moment * int{kPitch} + int(i)];
  };
  if (upper) {
    PALPATE_INDEPENDENT
    for (uint32_t i = 0; i < nodes; ++i) {
      const Real one = step(0, i), y = both(1, i) + step(3, i), z = both(2, i) + step(4, i),
                 yz = both(5, i) + step(6, i);
      f[i] += (one - z) - (y - yz);
      f[row + i] += (one - z) + (y - yz);
    }
  }
  if (lower) {
    PALPATE_INDEPENDENT
    for (uint32_t i = 0; i < nodes; ++i) {
      const Real one = step(0, i), y = both(1, i) + step(3, i), z = both(2, i) + step(4, i),
                 yz = both(5, i) + step(6, i);
      f[plane + i] += (one + z) - (y + yz);
      f[plane + row + i] += (one + z) + (y + yz);
    }
  }
}

template <typename Real>
PALPATE_INLINE void add_layer_as(const LayerStiffness<Real>& s, const CellGrid& grid, uint32_t k,
                                 const Real* u, Real* f, bool upper, bool lower) {
  const auto [nx, ny, nz] = grid.cells;
  const size_t row = nx + 1, plane = row * (ny + 1), nodes = grid.nodes();
  alignas(64) Real forces[size_t{kForces} * kPitch];
  Real* first = forces + 8;  // room for the zero cell before it
  for (uint32_t j = 0; j < ny; ++j)
    for (uint32_t x = 0; x < nx; x += kChunk) {
      const uint32_t cells = std::min(kChunk, nx - x);
      const size_t at = grid.node(x, j, k);
      push_back(s, grid.young.data() + grid.cell(x, j, k), u + at, u + nodes + at, u + 2 * nodes + at, row,
                plane, cells, first);
      for (uint32_t m = 0; m < kForces; ++m) first[m * kPitch + cells] = first[int(m * kPitch) - 1] = 0;
      // Moments 1 and 2 of v and w stand where their names say: x, y, z, xy, xz, yz, xyz throughout.
      for (uint32_t c = 0; c < 3; ++c)
        gather(first + size_t{c} * 7 * kPitch, cells + 1, row, plane, f + c * nodes + at, upper, lower);
    }
}

template <typename Real>
void plain(const LayerStiffness<Real>& s, const CellGrid& grid, uint32_t k, const Real* u, Real* f,
           bool upper, bool lower) {
  add_layer_as(s, grid, k, u, f, upper, lower);
}
#ifdef PALPATE_WIDE
template <typename Real>
PALPATE_AVX2 void wide(const LayerStiffness<Real>& s, const CellGrid& grid, uint32_t k, const Real* u,
                       Real* f, bool upper, bool lower) {
  add_layer_as(s, grid, k, u, f, upper, lower);
}
template <typename Real>
PALPATE_AVX512 void widest(const LayerStiffness<Real>& s, const CellGrid& grid, uint32_t k, const Real* u,
                           Real* f, bool upper, bool lower) {
  add_layer_as(s, grid, k, u, f, upper, lower);
}
#endif

template <typename Real>
using AddLayer = void (*)(const LayerStiffness<Real>&, const CellGrid&, uint32_t, const Real*, Real*, bool,
                          bool);
template <typename Real>
AddLayer<Real> best() {
#ifdef PALPATE_WIDE
  if (vector_units::avx512()) return widest<Real>;
  if (vector_units::avx2()) return wide<Real>;
#endif
  return plain<Real>;
}

}  // namespace

void add_layer(const LayerStiffness<float>& s, const CellGrid& grid, uint32_t k, const float* u, float* f,
               bool upper, bool lower) {
  static const AddLayer<float> chosen = best<float>();
  chosen(s, grid, k, u, f, upper, lower);
}
void add_layer(const LayerStiffness<double>& s, const CellGrid& grid, uint32_t k, const double* u, double* f,
               bool upper, bool lower) {
  static const AddLayer<double> chosen = best<double>();
  chosen(s, grid, k, u, f, upper, lower);
}

}  // namespace palpate::fem
