// A waveguide's pressures go to depths by ElasticConvolution, a gel's depths to pressures by LayerConvolution
// and TractionSolver: there and back is where it began.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/pad/elastic_convolution.h"
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

struct Both {
  explicit Both(double poisson, double thickness)
      : pad(pad_of(poisson, thickness)),
        elastic(ElasticKernel(pad, kCell_mm), kWidth, kHeight),
        layer(LayerKernel({pad.young_MPa, poisson}, thickness, kCell_mm), kWidth, kHeight, false) {}
  static ElasticCalibration pad_of(double poisson, double thickness) {
    ElasticCalibration pad;
    pad.young_MPa = 0.2;
    pad.poisson = poisson;
    pad.thickness_mm = thickness;
    return pad;
  }
  Field depth_by(const Field& pressure) {
    Field depth(pressure.size());
    elastic.solve(pressure.data(), kWidth, depth.data(), kWidth);
    return depth;
  }
  /// The pressure whose depth by LayerConvolution is this, by conjugate gradients: its matrix is symmetric
  /// and positive.
  Field pressure_by(const Field& depth) {
    Field pressure(depth.size()), rest = depth, along = depth, image;
    const double goal = dot(depth, depth);
    double squares = goal;
    for (int i = 0; i < 2000 && squares > 1e-24 * goal; ++i) {
      layer.depth_by_pressure(along, image);
      const double step = squares / dot(along, image), before = squares;
      for (size_t k = 0; k < depth.size(); ++k) {
        pressure[k] += step * along[k];
        rest[k] -= step * image[k];
      }
      squares = dot(rest, rest);
      for (size_t k = 0; k < depth.size(); ++k) along[k] = rest[k] + squares / before * along[k];
    }
    return pressure;
  }
  ElasticCalibration pad;
  ElasticConvolution elastic;
  LayerConvolution layer;
};

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

TEST(ElasticAndTraction, ThereAndBack) {
  for (const double poisson : {0.0, 0.3, 0.485, 0.5})
    for (const double thickness : {0.0, 1.0, 5.5, 40.0}) {
      SCOPED_TRACE("nu " + std::to_string(poisson) + ", " + std::to_string(thickness) + " mm");
      Both both(poisson, thickness);
      const Field pressure = bumps(0.05);
      const double to_pressure = difference(both.pressure_by(both.depth_by(pressure)), pressure);
      EXPECT_LE(to_pressure, 1e-9);
      const Field depth = bumps(0.3);
      const double to_depth = difference(both.depth_by(both.pressure_by(depth)), depth);
      EXPECT_LE(to_depth, 1e-9);
    }
}

// The constrained solver on the same way, told of next to no errors: what single precision makes of depths.
TEST(ElasticAndTraction, SolverInverts) {
  for (const double poisson : {0.3, 0.485, 0.5})
    for (const double thickness : {1.0, 5.5, 40.0}) {
      SCOPED_TRACE("nu " + std::to_string(poisson) + ", " + std::to_string(thickness) + " mm");
      Both both(poisson, thickness);
      const Field pressure = bumps(0.05), depth = both.depth_by(pressure);
      const std::vector<float> seen(depth.begin(), depth.end());
      // Slopes do not know a constant; that nothing presses beside the bumps settles it.
      std::vector<uint8_t> contact(pressure.size());
      for (size_t i = 0; i < contact.size(); ++i) contact[i] = pressure[i] > 0 ? 1 : 0;
      TractionOptions options;
      options.slope_sd = 1e-7;
      options.tolerance = 1e-12;
      options.most_iterations = 3000;
      options.errors = false;
      TractionSolver solver({both.pad.young_MPa, poisson}, thickness, {kWidth, kHeight, kCell_mm}, options);
      const Traction& found = solver.solve({.depth_mm = seen, .contact = contact});
      EXPECT_TRUE(found.converged) << found.residual;
      const Field back(found.pressure_MPa.begin(), found.pressure_MPa.end());
      EXPECT_LE(difference(both.depth_by(back), depth), 1e-6);
      EXPECT_LE(difference(back, pressure), 1e-6);
    }
}

}  // namespace
}  // namespace palpate
