// The inner loops of thin-plate splines, made for the widest vectors that the processor has.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace palpate {

/// How far one point reaches. All are conditionally positive definite once multiplied with the sign given
/// here.
enum class PlateKernel : uint8_t {
  Log,     ///< r^2 log r^2: the thin plate's own in the plane; second derivatives are infinite at the points
  Linear,  ///< -r: the thin plate's own in space; the gradient has a kink at the points
  Cubic,   ///< r^3: second derivatives are continuous
};

/// Points with a weight each per field: the part of a spline that is not a polynomial.
struct PlateTerms {
  PlateKernel kernel = PlateKernel::Log;
  uint32_t axes = 0;  ///< 1 to 3; 0: there is none
  size_t count = 0;
  size_t fields = 0;
  std::vector<double> at;      ///< axes x count: all first coordinates, then all second ones, ...
  std::vector<double> weight;  ///< fields x count
};

/// Outputs of plate_sums per field: the value, then `axes` first derivatives, then the second ones (xx, or
/// xx, xy, yy, or xx, xy, xz, yy, yz, zz), as far as `order` (0 to 2) asks.
constexpr size_t plate_outputs(uint32_t axes, int order) {
  return 1 + (order > 0 ? axes : 0) + (order > 1 ? axes * (axes + 1) / 2 : 0);
}

/// Sums of `terms` at `places` (axes x n). `sums`: fields x plate_outputs x n. At a point itself Linear's own
/// gradient counts as 0, the mean of all directions, and second derivatives of Log and Linear are infinite.
/// Logarithms are good to 1e-15 relative.
void plate_sums(const PlateTerms& terms, std::span<const double> places, int order, std::span<double> sums);

/// The kernel between all pairs of `count` points (axes x count): count x count, symmetric.
void plate_matrix(PlateKernel kernel, uint32_t axes, std::span<const double> at, size_t count,
                  std::span<double> matrix);

}  // namespace palpate
