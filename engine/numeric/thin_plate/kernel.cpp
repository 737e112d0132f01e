#include "engine/numeric/thin_plate/kernel.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "engine/base/simd.h"

namespace palpate {
namespace {

constexpr size_t kBlock = 64;  // places at a time: what belongs to them stays in the first cache

/// Natural logarithm of a positive normal number, in steps that vectorise: the exponent, and 2 atanh of the
/// rest, whose series in t^2 <= 0.0295 is cut where the next term is below 1e-17.
PALPATE_INLINE double log_of(double x) {
  constexpr uint64_t kRootHalf = 0x3fe6a09e667f3bcd;
  constexpr uint64_t kBias = uint64_t{1024} << 52;  // keeps the difference positive: shifts may be unsigned
  const uint64_t bits = std::bit_cast<uint64_t>(x), above = bits - kRootHalf + kBias, step = above >> 52;
  const double exponent = std::bit_cast<double>(step | 0x4330000000000000) - (4503599627370496.0 + 1024);
  const double m = std::bit_cast<double>(bits - (step << 52) + kBias);
  const double t = (m - 1) / (m + 1), u = t * t;
  double series = 2.0 / 21;
  series = series * u + 2.0 / 19;
  series = series * u + 2.0 / 17;
  series = series * u + 2.0 / 15;
  series = series * u + 2.0 / 13;
  series = series * u + 2.0 / 11;
  series = series * u + 2.0 / 9;
  series = series * u + 2.0 / 7;
  series = series * u + 2.0 / 5;
  series = series * u + 2.0 / 3;
  return exponent * 0.6931471805599453 + (t * 2 + t * u * series);
}

/// The kernel's value and, of s = r^2: 2 d/ds and 4 d2/ds2, by which gradient = first * d and Hessian = first
/// * I + second * d d^T.
struct Radial {
  double value, first, second;
  double bend;  ///< first, or what a point does to the Hessian at itself: without bound but for Cubic
};
template <PlateKernel kKernel, int kOrder>
PALPATE_INLINE Radial radial(double s) {
  constexpr double kTiny = std::numeric_limits<double>::min(),
                   kNoBound = -std::numeric_limits<double>::infinity();
  if constexpr (kKernel == PlateKernel::Log) {
    const double log = log_of(std::max(s, kTiny));
    const double first = 2 * (log + 1);
    return {s * log, first, kOrder > 1 ? 4 / std::max(s, 4 * kTiny) : 0, s > 0 ? first : kNoBound};
  } else {
    const double r = std::sqrt(s);
    const double inverse = kOrder > 0 ? (s > 0 ? 1 / r : 0) : 0;
    if constexpr (kKernel == PlateKernel::Linear)
      return {-r, -inverse, inverse * inverse * inverse, s > 0 ? -inverse : kNoBound};
    return {s * r, 3 * r, 3 * inverse, 3 * r};
  }
}

template <PlateKernel kKernel, uint32_t kAxes, int kOrder>
PALPATE_INLINE void sums_as(const PlateTerms& terms, const double* places, size_t n, double* out) {
  constexpr size_t kOutputs = plate_outputs(kAxes, kOrder);
  alignas(64) double where[kAxes * kBlock], part[kOutputs * kBlock];
  std::vector<double> sum(terms.fields * kOutputs * kBlock);
  double* const sums = sum.data();
  for (size_t start = 0; start < n; start += kBlock) {
    const size_t width = std::min(kBlock, n - start);
    for (uint32_t a = 0; a < kAxes; ++a)
      for (size_t i = 0; i < kBlock; ++i)
        where[a * kBlock + i] = places[a * n + start + std::min(i, width - 1)];
    std::fill(sum.begin(), sum.end(), 0.0);
    for (size_t j = 0; j < terms.count; ++j) {
      double at[kAxes];
      for (uint32_t a = 0; a < kAxes; ++a) at[a] = terms.at[a * terms.count + j];
      PALPATE_INDEPENDENT
      for (size_t i = 0; i < kBlock; ++i) {
        double d[kAxes], s = 0;
        for (uint32_t a = 0; a < kAxes; ++a) {
          d[a] = where[a * kBlock + i] - at[a];
          s += d[a] * d[a];
        }
        const Radial k = radial<kKernel, kOrder>(s);
        part[i] = k.value;
        if constexpr (kOrder > 0)
          for (uint32_t a = 0; a < kAxes; ++a) part[(1 + a) * kBlock + i] = k.first * d[a];
        if constexpr (kOrder > 1) {
          double* second = part + (1 + kAxes) * kBlock + i;
          second[0] = k.second * d[0] * d[0] + k.bend;
          if constexpr (kAxes > 1) {
            second[kBlock] = k.second * d[0] * d[1];
            second[(kAxes == 2 ? 2 : 3) * kBlock] = k.second * d[1] * d[1] + k.bend;
          }
          if constexpr (kAxes > 2) {
            second[2 * kBlock] = k.second * d[0] * d[2];
            second[4 * kBlock] = k.second * d[1] * d[2];
            second[5 * kBlock] = k.second * d[2] * d[2] + k.bend;
          }
        }
      }
      for (size_t field = 0; field < terms.fields; ++field) {
        const double w = terms.weight[field * terms.count + j];
        double* const to = sums + field * kOutputs * kBlock;
        if (kOrder > 1 && w == 0) continue;  // 0 times what has no bound
        PALPATE_INDEPENDENT
        for (size_t i = 0; i < kOutputs * kBlock; ++i) to[i] += w * part[i];
      }
    }
    for (size_t k = 0; k < terms.fields * kOutputs; ++k)
      std::copy_n(sums + k * kBlock, width, out + k * n + start);
  }
}

/// Row by row from the diagonal on; the other half is its mirror image.
template <PlateKernel kKernel, uint32_t kAxes>
PALPATE_INLINE void matrix_as(const double* at, size_t count, double* out) {
  for (size_t row = 0; row < count; ++row) {
    double* const to = out + row * count;
    PALPATE_INDEPENDENT
    for (size_t i = 0; i < row; ++i) {
      double s = 0;
      for (uint32_t a = 0; a < kAxes; ++a) {
        const double d = at[a * count + i] - at[a * count + row];
        s += d * d;
      }
      to[i] = radial<kKernel, 0>(s).value;
    }
    to[row] = 0;
    for (size_t i = 0; i < row; ++i) out[i * count + row] = to[i];
  }
}

/// Calls `use` with kernel and axes as constants.
template <typename Use>
PALPATE_INLINE void with_constants(PlateKernel kernel, uint32_t axes, const Use& use) {
  const auto with_axes = [&]<PlateKernel kKernel>() __attribute__((always_inline)) {
    if (axes == 1) use.template operator()<kKernel, 1>();
    if (axes == 2) use.template operator()<kKernel, 2>();
    if (axes == 3) use.template operator()<kKernel, 3>();
  };
  if (kernel == PlateKernel::Log) with_axes.template operator()<PlateKernel::Log>();
  if (kernel == PlateKernel::Linear) with_axes.template operator()<PlateKernel::Linear>();
  if (kernel == PlateKernel::Cubic) with_axes.template operator()<PlateKernel::Cubic>();
}

struct Sums {
  const PlateTerms& terms;
  const double* places;
  size_t n;
  int order;
  double* out;
  PALPATE_INLINE void run() const {
    with_constants(
        terms.kernel,
        terms.axes, [this]<PlateKernel kKernel, uint32_t kAxes>() __attribute__((always_inline)) {
          if (order == 0) sums_as<kKernel, kAxes, 0>(terms, places, n, out);
          if (order == 1) sums_as<kKernel, kAxes, 1>(terms, places, n, out);
          if (order == 2) sums_as<kKernel, kAxes, 2>(terms, places, n, out);
        });
  }
};
struct Matrix {
  PlateKernel kernel;
  uint32_t axes;
  const double* at;
  size_t count;
  double* out;
  PALPATE_INLINE void run() const {
    with_constants(
        kernel, axes, [this]<PlateKernel kKernel, uint32_t kAxes>() __attribute__((always_inline)) {
          matrix_as<kKernel, kAxes>(at, count, out);
        });
  }
};

}  // namespace

void plate_sums(const PlateTerms& terms, std::span<const double> places, int order, std::span<double> sums) {
  if (terms.axes == 0) return;
  run_widest(Sums{terms, places.data(), places.size() / terms.axes, order, sums.data()});
}

void plate_matrix(PlateKernel kernel, uint32_t axes, std::span<const double> at, size_t count,
                  std::span<double> matrix) {
  if (axes == 0) return;
  run_widest(Matrix{kernel, axes, at.data(), count, matrix.data()});
}

}  // namespace palpate
