// A gradient field with weights to heights: the weighted surface stage without a camera.
#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "engine/numeric/weighted_poisson.h"
#include "engine/stages/frame/contact.h"
#include "engine/stages/surface/weighted_surface.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr int kMostRounds = 12;
constexpr double kRoundTolerance = 1e-9;  // relative residual in double precision

std::string place(size_t pixel, uint32_t cols) {
  return "row " + std::to_string(pixel / cols) + ", column " + std::to_string(pixel % cols);
}

void check(std::span<const float> gradients, std::span<const float> weights, uint32_t rows, uint32_t cols) {
  const uint64_t cells = uint64_t{rows} * cols;
  if (cells == 0 || rows > kMaxSide_px || cols > kMaxSide_px || cells > kMaxPixels ||
      gradients.size() != 2 * cells) {
    throw Error(Failure::Input,
                "a gradient field of rows x cols x 2, sides from 1 to " + std::to_string(kMaxSide_px) +
                    " and at most " + std::to_string(kMaxPixels) + " cells",
                std::to_string(gradients.size()) + " values for " + std::to_string(rows) + " x " +
                    std::to_string(cols),
                "splitting the field");
  }
  if (weights.size() != cells) {
    throw Error(Failure::Input,
                "one weight for each of " + std::to_string(rows) + " x " + std::to_string(cols) + " pixels",
                std::to_string(weights.size()), "weights of rows x cols");
  }
  for (size_t i = 0; i < cells; ++i) {
    if (!(weights[i] >= 0 && std::isfinite(weights[i])))
      throw Error(Failure::Input, "finite weights of at least 0",
                  std::to_string(weights[i]) + " at " + place(i, cols), "0 for what is not known");
    if (weights[i] > 0 && !(std::isfinite(gradients[2 * i]) && std::isfinite(gradients[2 * i + 1])))
      throw Error(Failure::Input, "finite gradients where the weight is not 0",
                  "another at " + place(i, cols), "weight 0 there");
  }
}

// The GPU stage with its maps in host memory.
class HostSolve {
 public:
  HostSolve(gpu::Context& context, uint32_t rows, uint32_t cols, uint32_t iterations)
      : context_(context),
        rows_(rows),
        cols_(cols),
        surface_(context, cols, rows, 1, iterations),
        depth_(context, "heights", surface_.grid()),
        heights_(context, "heights readback", surface_.grid().bytes(), gpu::Memory::Readback),
        scalars_(context, "weighted scalars", WeightedSurface::scalar_bytes(), gpu::Memory::Readback) {}

  void solve(const WeightedFaces& faces, std::span<const double> right, std::vector<double>& z) {
    const auto stored = [](double weight, bool inside) {
      return !inside ? 0.0f : weight > 0 ? static_cast<float>(weight) : -shared::kUnknownFace;
    };
    const auto b = upload([&](size_t i) { return static_cast<float>(right[i]); });
    const auto across =
        upload([&](size_t i) { return stored(faces.across_weight[i], i % cols_ + 1 < cols_); });
    const auto down = upload([&](size_t i) { return stored(faces.down_weight[i], i / cols_ + 1 < rows_); });
    run(z, [&](gpu::Commands& commands) {
      commands.copy(b, surface_.right_side().buffer, b.bytes());
      commands.copy(across, surface_.across().buffer, across.bytes());
      commands.copy(down, surface_.down().buffer, down.bytes());
      commands.barrier();
      surface_.record_given(commands, depth_, scalars_);
    });
  }
  void correct(std::span<const double> residual, std::vector<double>& z) {
    // Single precision knows no number below 1e-38: what is left is scaled to 1 and back.
    double largest = 0;
    for (const double r : residual) largest = std::max(largest, std::abs(r));
    const auto right = upload([&](size_t i) { return static_cast<float>(residual[i] / largest); });
    std::vector<double> change(z.size());
    run(change, [&](gpu::Commands& commands) {
      commands.copy(right, surface_.right_side().buffer, right.bytes());
      commands.barrier();
      surface_.record_again(commands, depth_, scalars_);
    });
    for (size_t i = 0; i < z.size(); ++i) z[i] += largest * change[i];
  }
  /// Fills what is unknown; `z` is rounded to single precision there.
  void fill(std::span<const uint8_t> known, std::vector<double>& z, int rounds) {
    const auto heights = upload([&](size_t i) { return static_cast<float>(z[i]); });
    std::vector<double> filled(z.size());
    run(filled, [&](gpu::Commands& commands) {
      commands.copy(heights, depth_.buffer, heights.bytes());
      commands.barrier();
      for (int round = 0; round < rounds; ++round) surface_.record_fill(commands, depth_);
    });
    for (size_t i = 0; i < z.size(); ++i)
      if (!known[i]) z[i] = filled[i];
  }
  WeightedStatistics statistics() const { return WeightedSurface::statistics(scalars_); }

 private:
  template <typename Value>
  gpu::DeviceBuffer upload(const Value& value) {
    const Grid& grid = surface_.grid();
    gpu::DeviceBuffer staging(context_, "weighted field upload", grid.bytes(), gpu::Memory::Upload);
    const std::span<float> to = staging.as<float>();
    std::fill(to.begin(), to.end(), 0.0f);
    for (uint32_t y = 0; y < rows_; ++y)
      for (uint32_t x = 0; x < cols_; ++x) to[size_t{y} * grid.pitch * 4 + x] = value(size_t{y} * cols_ + x);
    staging.flush();
    return staging;
  }
  template <typename Record>
  void run(std::vector<double>& z, const Record& record) {
    const Grid& grid = surface_.grid();
    gpu::run_once(context_, [&](gpu::Commands& commands) {
      record(commands);
      commands.copy(depth_.buffer, heights_, grid.bytes());
      commands.host_barrier();
    });
    heights_.invalidate();
    const std::span<const float> raw = heights_.as<const float>();
    for (uint32_t y = 0; y < rows_; ++y)
      std::copy_n(raw.begin() + static_cast<std::ptrdiff_t>(size_t{y} * grid.pitch * 4), cols_,
                  z.begin() + static_cast<std::ptrdiff_t>(size_t{y} * cols_));
  }

  gpu::Context& context_;
  uint32_t rows_, cols_;
  WeightedSurface surface_;
  FloatMap depth_;
  gpu::DeviceBuffer heights_, scalars_;
};

double norm(std::span<const double> v) {
  double squares = 0;
  for (const double x : v) squares += x * x;
  return std::sqrt(squares);
}

std::vector<double> left_over(const WeightedFaces& faces, std::span<const double> right,
                              std::span<const double> z) {
  std::vector<double> rest = apply(faces, z);
  for (size_t i = 0; i < rest.size(); ++i) rest[i] = right[i] - rest[i];
  return rest;
}

}  // namespace

WeightedHeights integrate_weighted(gpu::Context& context, std::span<const float> gradients,
                                   std::span<const float> weights, uint32_t rows, uint32_t cols, Solve solver,
                                   bool kinks) {
  check(gradients, weights, rows, cols);
  const size_t cells = weights.size();
  // Only ratios of weights matter, and of gradients: both are scaled to at most 1, so that nothing over- or
  // underflows.
  const float heaviest = *std::max_element(weights.begin(), weights.end());
  std::vector<float> w(weights.begin(), weights.end());
  float steepest = 0;
  for (size_t i = 0; i < cells; ++i) {
    if (heaviest > 0) w[i] /= heaviest;
    if (w[i] > 0) steepest = std::max({steepest, std::abs(gradients[2 * i]), std::abs(gradients[2 * i + 1])});
  }
  std::vector<float> g(2 * cells, 0.0f);
  if (steepest > 0)
    for (size_t i = 0; i < 2 * cells; ++i) g[i] = w[i / 2] > 0 ? gradients[i] / steepest : 0.0f;

  WeightedHeights result;
  result.solve = solver;
  std::vector<uint8_t> known(cells);
  for (size_t i = 0; i < cells; ++i) known[i] = w[i] > 0 ? 1 : 0;
  result.islands = find_islands(known, cols, rows);

  WeightedFaces faces = weighted_faces(g, w, cols, rows);
  if (kinks) result.kinks = cut_kinks(faces, g, w);
  std::vector<double> z(cells, 0.0);
  WeightedStatistics& statistics = result.statistics;
  if (solver == Solve::Exact) {
    WeightedSolution exact = solve_weighted(faces);
    z = std::move(exact.z);
    statistics.residual = exact.residual;
    statistics.iterations = exact.iterations;
    statistics.converged = exact.converged;
  } else {
    const bool live = solver == Solve::Live;
    const std::vector<double> right = right_side(faces);
    const double whole = norm(right);
    HostSolve gpu(context, rows, cols,
                  live ? WeightedSurface::kLiveIterations : WeightedSurface::kConvergedIterations);
    gpu.solve(faces, right, z);
    statistics.iterations = gpu.statistics().iterations;
    std::vector<double> rest = left_over(faces, right, z);
    statistics.residual = whole > 0 ? norm(rest) / whole : 0;
    for (int round = 1; !live && round < kMostRounds && statistics.residual > kRoundTolerance; ++round) {
      std::vector<double> better = z;
      gpu.correct(rest, better);
      const std::vector<double> less = left_over(faces, right, better);
      statistics.iterations += gpu.statistics().iterations;
      const double residual = norm(less) / whole;
      if (!(residual < statistics.residual)) break;
      statistics.residual = residual;
      z = std::move(better);
      rest = less;
    }
    statistics.converged = statistics.residual <= double{kWeightedTolerance};
    if (result.islands.unknown_px > 0) gpu.fill(known, z, live ? 1 : 4);
  }
  statistics.unexplained = unexplained(faces, z);
  double mean = 0, low = std::numeric_limits<double>::max(), high = std::numeric_limits<double>::lowest();
  for (double& value : z) {
    value *= double{steepest};
    mean += value / static_cast<double>(cells);
    low = std::min(low, value);
    high = std::max(high, value);
  }
  result.peak_to_valley = high - low;
  result.values.reserve(cells);
  for (const double value : z) result.values.push_back(static_cast<float>(value - mean));
  return result;
}

WeightedHeights integrate_weighted(gpu::Context& context, std::span<const float> gradients,
                                   std::span<const float> weights, uint32_t rows, uint32_t cols,
                                   SurfaceSolver solver, bool kinks) {
  const bool live = solver == SurfaceSolver::Live;
  WeightedHeights found = integrate_weighted(context, gradients, weights, rows, cols,
                                             live ? Solve::Live : Solve::Converged, kinks);
  if (live || found.statistics.converged) return found;
  return integrate_weighted(context, gradients, weights, rows, cols, Solve::Exact, kinks);
}

}  // namespace palpate
