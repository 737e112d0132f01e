// Traction on a bonded elastic layer from the shape of its surface: contact as a problem of least squares
// with pressure >= 0, solved by conjugate gradients with constraints (compare I. A. Polonsky and L. M. Keer,
// Wear 231 (1999) 206). The reference of the traction stage, and what a processor's own driver uses.
//
// What is compared are the slopes of the depth, which a camera sees; a rest level or a tilt's constant that
// is not known then costs nothing, and short waves, whose depth a pressure hardly changes, no more than long
// ones:
//   minimise over p >= 0, 0 where nothing touches:  |grad(C p - depth)|^2 / sd^2 + |p|^2 / sd_p^2,
// C the layer's answer, sd the standard error of slopes, sd_p = E*/2, a pressure whose slopes are 1. Shear is
// what moves the surface along itself beyond what the pressure does, with |t|^2 / G^2 added.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "engine/pad/pad.h"

namespace palpate {

/// Share of the largest pressure: cells that carry less have no shear, since friction holds none there, and
/// no ratio of shear to pressure. Of a sphere's contact that is the outer thousandth of its radius.
inline constexpr double kLeastPressureShare = 0.05;

/// Cells of the traction's maps.
struct TractionGrid {
  uint32_t width = 0;
  uint32_t height = 0;
  double cell_mm = 0;
};

struct TractionOptions {
  double slope_sd = 0.03;      ///< standard error of the depth's slopes, > 0
  double error_length_mm = 0;  ///< over which errors of slopes are alike; 0: over a cell
  double shift_sd_mm = 0.01;   ///< standard error of the surface's shift along itself, > 0
  double tolerance = 1e-3;     ///< of the gradient that is left, relative to that of no traction
  uint32_t most_iterations = 300;
  bool errors = true;  ///< of the wrench: three more solves
};

/// Known surface; each map is height x width cells.
struct TractionInput {
  std::span<const float> depth_mm{};  ///< into the layer, up to a constant
  /// Where it is known already: only shear is solved for; with depth_mm the solution of those depths, whose
  /// errors are stated, without it measured by itself.
  std::span<const float> pressure_MPa{};
  /// 0: nothing presses there; empty: everywhere may be pressed. Errors of slopes then make pressure all over
  /// the grid (2 kPa of a gel of 150 kPa at 0.02); the standard errors include it.
  std::span<const uint8_t> contact{};
  std::span<const uint8_t> known{};     ///< 0: depth is not known there; empty: everywhere it is
  std::span<const float> shift_x_mm{};  ///< along the surface, since it was untouched; empty: not known
  std::span<const float> shift_y_mm{};
  std::span<const uint8_t> shift_known{};  ///< where; empty: everywhere
  /// Pressure in the outermost cells goes on beyond the grid, as it is there: for a thickness, half of the
  /// grid or a third of the border that `contact` covers, whichever is least. Tilts of the whole surface then
  /// count for nothing. Otherwise nothing presses beyond.
  bool goes_on = false;
};

/// Forces on the layer: x right, y down, z into it; moments r x F about the middle of the grid at the
/// surface, N mm: (y p, -x p, x t_y - y t_x).
struct Wrench {
  std::array<double, 3> force_N{};
  std::array<double, 3> moment_Nmm{};
  std::array<double, 3>
      force_sd_N{};  ///< by the slopes' and the shift's errors alone; the modulus' comes on top
  std::array<double, 3> moment_sd_Nmm{};
};

struct Traction {
  std::vector<float> pressure_MPa;              ///< >= 0
  std::vector<float> shear_x_MPa, shear_y_MPa;  ///< on the layer; empty where the shift is not known
  Wrench wrench;
  uint32_t iterations = 0;
  double residual = 0;   ///< gradient that is left, as TractionOptions::tolerance
  double slope_rms = 0;  ///< of the depth's slopes that no traction explains
  bool converged = false;
  /// Pressure or contact in the outermost cells, or a contact that goes on. Normal force and its moments then
  /// include what goes on beyond the grid, with its error; shear and its moment are those of the grid. A flat
  /// face over all of the grid has no slopes, so its force is not measured and 0 stands for it; the standard
  /// error of a contact that goes on is that of a pressure of E*/2.
  bool at_border = false;
};

/// Throws Error(Failure::Input) on an empty grid or options out of range.
void check_traction(const TractionGrid& grid, const TractionOptions& options);

/// Constants of the problem, the same wherever it is solved.
struct TractionWeights {
  double prior = 0;       ///< of |p|^2 relative to the squared slopes, 1 / MPa^2
  double first_step = 0;  ///< MPa^2: of cells that enter where there is no curvature to go by
};
TractionWeights traction_weights(const Material& material, const TractionOptions& options);

/// Memory is made once. Frames that follow each other begin where the last one ended. Not thread safe.
class TractionSolver {
 public:
  /// Throws Error(Failure::Input) as LayerKernel, and on an empty grid or options out of range.
  TractionSolver(const Pad& pad, const TractionGrid& grid, const TractionOptions& options);
  ~TractionSolver();
  TractionSolver(TractionSolver&&) noexcept;

  const TractionGrid& grid() const;
  /// Throws Error(Failure::Input) where a map has another size, or a known depth is not finite.
  const Traction& solve(const TractionInput& input);
  /// The next solve begins from nothing.
  void forget();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate
