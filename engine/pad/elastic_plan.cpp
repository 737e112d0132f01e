#include "engine/pad/elastic_plan.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/base/numbers.h"
#include "engine/numeric/dense.h"

namespace palpate {
namespace {

constexpr int kRadius = static_cast<int>(shared::kElasticRadius);
constexpr uint32_t kMaxCoarsestCells = 400;
// Variance of a level's narrower Gaussian, cells^2. Smaller aliases more, larger leaves more beyond the
// stencils.
constexpr double kNarrow = 1.2;
constexpr int kTailRadius = 14;  // cells; what a stencil leaves out is gone by then

/// weight exp(-r^2 / (2 variance)), px.
struct Gaussian {
  double variance = 1;
  double weight = 0;
  int level = 1;
};

int level_of(double variance) {
  return std::max(1, static_cast<int>(std::floor(std::log2(variance / kNarrow) / 2 + 1e-9)));
}

/// The Gaussians that make up the kernel together with what is compact, per px of 1/r.
std::vector<Gaussian> gaussians(const LayerKernel& kernel) {
  constexpr int kHalfOctaves = 48;  // up to 2^25 px; what is wider still is flat over the largest frame
  const double step = std::numbers::ln2 / 2, unit = std::sqrt(2 / kPi) * step;
  const double thickness = kernel.thickness_cells(), widest = 6 * thickness;
  std::vector<Gaussian> near, far;
  for (int j = 0; j < kHalfOctaves; ++j) {
    const double variance = 4 * kNarrow * std::ldexp(1.0, j), sd = std::sqrt(variance);
    const double wider =
        j + 1 < kHalfOctaves ? 1 : 1 / (1 - 1 / std::numbers::sqrt2);  // with all that follow
    const Gaussian g{variance, unit / sd * wider, level_of(variance)};
    (sd > widest ? far : near).push_back(g);
  }
  if (std::isinf(thickness)) return near;

  // The loss less the half space's wide Gaussians vanishes some thicknesses away; fitted per area, hence the
  // weight.
  std::vector<Gaussian> layer;
  const double first = std::max(thickness / 8, std::sqrt(4 * kNarrow));
  for (double sd = first; sd <= 1.01 * widest; sd *= std::pow(2.0, 0.25))
    layer.push_back({sd * sd, 0, level_of(sd * sd)});
  constexpr int kPoints = 1024;
  constexpr double kFarthest = 16;  // thicknesses, as far as the loss is known
  Eigen::MatrixXd basis(kPoints, static_cast<Eigen::Index>(layer.size()));
  Eigen::VectorXd target(kPoints);
  for (int i = 0; i < kPoints; ++i) {
    const double fraction = (i + 0.5) / kPoints, r = kFarthest * thickness * fraction * fraction;
    const double weight = fraction * std::sqrt(fraction);  // r dr, as a square root
    double value = kernel.depth_loss(r);
    for (const Gaussian& g : far) value -= g.weight * std::exp(-r * r / (2 * g.variance));
    target[i] = weight * value;
    for (size_t j = 0; j < layer.size(); ++j)
      basis(i, static_cast<Eigen::Index>(j)) = weight * std::exp(-r * r / (2 * layer[j].variance));
  }
  const Eigen::VectorXd weights = dense::least_squares(basis, target, 1e-9);
  for (size_t j = 0; j < layer.size(); ++j) layer[j].weight = -weights[static_cast<Eigen::Index>(j)];
  near.insert(near.end(), layer.begin(), layer.end());
  return near;
}

/// Response of a level's cell along one axis, 0 .. count - 1 cells away, with which after restriction and
/// interpolation a pixel's load gives a Gaussian of unit mass: the Gaussian's spectrum over that of the
/// B-splines of all levels between.
std::vector<double> axis_response(double variance_px, int level, int count) {
  const double cell = std::ldexp(1.0, level), variance = variance_px / (cell * cell);
  const double top = std::min(kPi, 9 / std::sqrt(variance));
  constexpr int kSteps = 512;  // even; Simpson
  std::vector<double> out(count, 0.0);
  for (int i = 0; i <= kSteps; ++i) {
    const double k = top * i / kSteps;
    double spectrum = std::exp(-variance * k * k / 2);
    if (k > 0) {
      const double pixel = k / (2 * cell);
      spectrum *= std::sin(pixel) / pixel;  // the mean over the loaded pixel
      if (level > 0) spectrum /= std::pow(std::sin(k / 2) / (cell * std::sin(pixel)), 12);
    }
    const double weight = (i == 0 || i == kSteps ? 1 : i % 2 ? 4 : 2) * top / kSteps / (3 * kPi);
    for (int n = 0; n < count; ++n) out[n] += weight * spectrum * std::cos(k * n);
  }
  return out;
}

/// Adds the Gaussian's answer on a level to a square table.
void add_response(const Gaussian& g, int level, double sign, Eigen::MatrixXd& table) {
  const double mass = 2 * kPi * g.weight * g.variance / std::ldexp(1.0, 2 * level);
  const std::vector<double> axis =
      axis_response(g.variance, level, static_cast<int>(std::max(table.rows(), table.cols())));
  for (Eigen::Index y = 0; y < table.rows(); ++y)
    for (Eigen::Index x = 0; x < table.cols(); ++x)
      table(y, x) += sign * mass * axis[static_cast<size_t>(x)] * axis[static_cast<size_t>(y)];
}

/// The inner part of a wide stencil, with the mass and the second moment of the whole: what lies beyond is
/// spread over the two outermost rings.
std::array<float, shared::kElasticOrbits> stencil_of(Eigen::MatrixXd wide, double scale) {
  const auto copies = [](int x, int y) { return (x ? 2.0 : 1.0) * (y ? 2.0 : 1.0); };
  double mass = 0, second = 0;
  Eigen::Matrix2d rings = Eigen::Matrix2d::Zero();
  for (int y = 0; y < wide.rows(); ++y) {
    for (int x = 0; x < wide.cols(); ++x) {
      const int ring = std::max(x, y);
      const double r2 = double(x) * x + double(y) * y;
      if (ring > kRadius) {
        mass += copies(x, y) * wide(y, x);
        second += copies(x, y) * wide(y, x) * r2;
      } else if (ring > kRadius - 2) {
        rings(0, ring - kRadius + 1) += copies(x, y);
        rings(1, ring - kRadius + 1) += copies(x, y) * r2;
      }
    }
  }
  const Eigen::Vector2d spread = rings.inverse() * Eigen::Vector2d(mass, second);
  std::array<float, shared::kElasticOrbits> out{};
  size_t entry = 0;
  for (int i = 0; i <= kRadius; ++i)
    for (int j = 0; j <= i; ++j)
      out[entry++] =
          static_cast<float>(scale * (wide(i, j) + (i > kRadius - 2 ? spread[i - kRadius + 1] : 0)));
  return out;
}

}  // namespace

ElasticPlan::ElasticPlan(const LayerKernel& kernel, uint32_t width, uint32_t height) {
  levels.push_back({width, height, {}});
  while (uint64_t{levels.back().width} * levels.back().height > kMaxCoarsestCells || levels.size() == 1) {
    const ElasticLevel& fine = levels.back();
    levels.push_back({(fine.width - 1) / 2 + 1, (fine.height - 1) / 2 + 1, {}});
  }
  const int last = static_cast<int>(levels.size()) - 1;
  const double scale = kernel.depth_scale_mm_per_MPa();
  const std::vector<Gaussian> all = gaussians(kernel);

  Eigen::MatrixXd pixel(kTailRadius + 1, kTailRadius + 1);
  for (int y = 0; y <= kTailRadius; ++y)
    for (int x = 0; x <= kTailRadius; ++x) pixel(y, x) = kernel.depth(x, y) / scale;
  for (const Gaussian& g : all) add_response(g, 0, -1, pixel);
  levels[0].stencil = stencil_of(pixel, scale);
  for (int l = 1; l < last; ++l) {
    Eigen::MatrixXd wide = Eigen::MatrixXd::Zero(kTailRadius + 1, kTailRadius + 1);
    for (const Gaussian& g : all)
      if (g.level == l) add_response(g, l, 1, wide);
    levels[static_cast<size_t>(l)].stencil = stencil_of(wide, scale);
  }
  const uint32_t reach = 2 * shared::kElasticReach;
  table_width = levels.back().width + reach;
  Eigen::MatrixXd coarsest = Eigen::MatrixXd::Zero(levels.back().height + reach, table_width);
  for (const Gaussian& g : all)
    if (g.level >= last) add_response(g, last, 1, coarsest);
  for (Eigen::Index y = 0; y < coarsest.rows(); ++y)
    for (Eigen::Index x = 0; x < coarsest.cols(); ++x)
      table.push_back(static_cast<float>(scale * coarsest(y, x)));
}

}  // namespace palpate
