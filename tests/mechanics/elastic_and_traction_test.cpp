// Pressures go to depths by LayerConvolution, as a waveguide's do, and depths to pressures by TractionSolver,
// as a gel's do: there and back is where it began.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/pad/layer_convolution.h"
#include "engine/pad/traction.h"

namespace palpate {
namespace {

using Field = std::vector<double>;

constexpr uint32_t kWidth = 48, kHeight = 40;
constexpr double kCell_mm = 0.25;

double dot(const Field& a, const Field& b) {
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

/// Norm of the difference over that of `wanted`.
template <typename Found>
double difference(const Found& found, const Field& wanted) {
  double sum = 0;
  for (size_t i = 0; i < wanted.size(); ++i) sum += std::pow(static_cast<double>(found[i]) - wanted[i], 2);
  return std::sqrt(sum / dot(wanted, wanted));
}

double x_of(size_t i) {
  return (static_cast<double>(i % kWidth) + 0.5 - kWidth / 2.0) * kCell_mm;
}
double y_of(size_t i) {
  return (static_cast<double>(i / kWidth) + 0.5 - kHeight / 2.0) * kCell_mm;
}

/// Two bumps, each without an edge.
Field bumps(double height) {
  Field field(size_t{kWidth} * kHeight);
  for (size_t i = 0; i < field.size(); ++i)
    for (const auto& [x, y, reach] : {std::array{-2.0, 0.5, 2.5}, std::array{2.2, -1.0, 1.8}}) {
      const double q = 1 - (std::pow(x_of(i) - x, 2) + std::pow(y_of(i) - y, 2)) / (reach * reach);
      if (q > 0) field[i] += height * q * q;
    }
  return field;
}

// With next to no errors of slopes: what single precision makes of depths.
TEST(ElasticAndTraction, SolverInverts) {
  for (const double poisson : {0.3, 0.485, 0.5})
    for (const double thickness : {1.0, 5.5, 40.0}) {
      SCOPED_TRACE("nu " + std::to_string(poisson) + ", " + std::to_string(thickness) + " mm");
      const Pad pad{{0.2, poisson}, thickness};
      LayerConvolution layer(LayerKernel(pad, kCell_mm), kWidth, kHeight, false);
      const Field pressure = bumps(0.05);
      Field depth, again;
      layer.depth_by_pressure(pressure, depth);
      const std::vector<float> seen(depth.begin(), depth.end());
      // Slopes do not know a constant; that nothing presses between the bumps settles it.
      std::vector<uint8_t> contact(pressure.size());
      for (size_t i = 0; i < contact.size(); ++i) contact[i] = pressure[i] > 0 ? 1 : 0;
      TractionOptions options;
      options.slope_sd = 1e-7;
      options.tolerance = 1e-12;
      options.most_iterations = 3000;
      options.errors = false;
      TractionSolver solver(pad, {kWidth, kHeight, kCell_mm}, options);
      const Traction& found = solver.solve({.depth_mm = seen, .contact = contact});
      EXPECT_TRUE(found.converged) << found.residual;
      const Field back(found.pressure_MPa.begin(), found.pressure_MPa.end());
      layer.depth_by_pressure(back, again);
      EXPECT_LE(difference(again, depth), 1e-6);
      EXPECT_LE(difference(back, pressure), 1e-6);
    }
}

}  // namespace
}  // namespace palpate
