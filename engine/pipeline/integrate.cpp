// Any user's gradient field to heights: the slope and surface stages without a camera.
#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "engine/numeric/poisson_dct.h"
#include "engine/pipeline/choose_solve.h"
#include "engine/stages/frame/contact.h"
#include "engine/stages/surface/slope.h"
#include "engine/stages/surface/surface.h"
#include "palpate/error.h"

namespace palpate {
namespace {

// Residual of the normal equations, on the host and in double precision, so that the statistics does not
// share the solver's rounding.
double relative_residual(std::span<const float> right, std::span<const double> z, const Grid& grid) {
  const uint32_t w = grid.width, h = grid.height, pitch = grid.pitch * 4;
  double mean = 0;
  for (uint32_t y = 0; y < h; ++y)
    for (uint32_t x = 0; x < w; ++x) mean += double{right[size_t{y} * pitch + x]};
  mean /= double(w) * h;
  double left_over = 0, whole = 0;
  for (uint32_t y = 0; y < h; ++y) {
    for (uint32_t x = 0; x < w; ++x) {
      const auto at = [&](uint32_t i, uint32_t j) { return z[size_t{j} * w + i]; };
      double applied = 0;
      if (x > 0) applied += at(x, y) - at(x - 1, y);
      if (x + 1 < w) applied += at(x, y) - at(x + 1, y);
      if (y > 0) applied += at(x, y) - at(x, y - 1);
      if (y + 1 < h) applied += at(x, y) - at(x, y + 1);
      const double f = double{right[size_t{y} * pitch + x]} - mean;
      left_over += (f - applied) * (f - applied);
      whole += f * f;
    }
  }
  return whole > 0 ? std::sqrt(left_over / whole) : 0;
}

/// Integral of the cubic through a row's or column's slopes from pixel i to i + 1, as the slope stage takes
/// it; a missing sample is extrapolated linearly.
template <typename Sample>
double step(const Sample& at, uint32_t i, uint32_t n) {
  const double b = at(i), c = at(i + 1);
  const double a = i >= 1 ? at(i - 1) : 2 * b - c;
  const double d = i + 2 < n ? at(i + 2) : 2 * c - b;
  return (-a + 13 * b + 13 * c - d) / 24;
}

// Part of the gradients that no height map explains, relative to all: 0 for the gradients of a surface,
// towards 1 for a field that only turns.
double inconsistency(std::span<const float> gradients, double scale, std::span<const double> z, uint32_t w,
                     uint32_t h) {
  const auto slope = [&](uint32_t x, uint32_t y, size_t part) {
    return double{gradients[2 * (size_t{y} * w + x) + part]} * scale;
  };
  double left_over = 0, whole = 0;
  const auto add = [&](double wanted, double got) {
    left_over += (wanted - got) * (wanted - got);
    whole += wanted * wanted;
  };
  for (uint32_t y = 0; y < h; ++y) {
    for (uint32_t x = 0; x < w; ++x) {
      const size_t at = size_t{y} * w + x;
      if (x + 1 < w) add(step([&](uint32_t i) { return slope(i, y, 0); }, x, w), z[at + 1] - z[at]);
      if (y + 1 < h) add(step([&](uint32_t i) { return slope(x, i, 1); }, y, h), z[at + w] - z[at]);
    }
  }
  return whole > 0 ? std::sqrt(left_over / whole) : 0;
}

/// The largest of the values' sizes; throws where one is no number.
float largest_of(std::span<const float> gradients, uint32_t cols) {
  float largest = 0;
  for (size_t i = 0; i < gradients.size(); ++i) {
    if (!std::isfinite(gradients[i])) {
      const size_t pixel = i / 2;
      throw Error(
          Failure::Input, "finite gradients",
          std::string(std::isnan(gradients[i]) ? "NaN" : "infinity") + " at row " +
              std::to_string(pixel / cols) + ", column " + std::to_string(pixel % cols) + ", " +
              (i % 2 ? "dz/dy" : "dz/dx"),
          "weights that are 0 there: --weights FILE.npy (numpy.isfinite(slopes).all(axis=-1)), weights= "
          "in Python");
    }
    largest = std::max(largest, std::abs(gradients[i]));
  }
  return largest;
}

gpu::DeviceBuffer readback(gpu::Context& context, const Grid& grid) {
  return {context, "heights readback", grid.bytes(), gpu::Memory::Readback};
}

void check_shape(std::span<const float> gradients, uint32_t rows, uint32_t cols) {
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
}

/// The field on its way to the device: each component by itself, in the grid's rows, divided by 2^exponent.
struct StagedGradients {
  gpu::DeviceBuffer p, q;

  StagedGradients(gpu::Context& context, std::span<const float> gradients, uint32_t rows, uint32_t cols,
                  const Grid& grid, int exponent)
      : p(context, "d/dx upload", grid.bytes(), gpu::Memory::Upload),
        q(context, "d/dy upload", grid.bytes(), gpu::Memory::Upload) {
    const std::span<float> host_p = p.as<float>(), host_q = q.as<float>();
    std::fill(host_p.begin(), host_p.end(), 0.0f);
    std::fill(host_q.begin(), host_q.end(), 0.0f);
    for (uint32_t y = 0; y < rows; ++y) {
      for (uint32_t x = 0; x < cols; ++x) {
        const size_t from = 2 * (size_t{y} * cols + x), to = size_t{y} * grid.pitch * 4 + x;
        host_p[to] = std::ldexp(gradients[from], -exponent);
        host_q[to] = std::ldexp(gradients[from + 1], -exponent);
      }
    }
    p.flush();
    q.flush();
  }
};

/// Results of the device: the normal equations' right side, and heights that solve them (none where the host
/// solves).
struct Solved {
  gpu::DeviceBuffer right, heights;
};

Solved solve_on_device(gpu::Context& context, const StagedGradients& staged, const Grid& grid, uint32_t rows,
                       uint32_t cols, Solve solver) {
  const Tuning tuning = load_tuning(context).tuning;
  // The statistics is about pixels, whatever the solver reads.
  const Surface surface(context, cols, rows, solver, tuning, true);
  const Slope slope(context, cols, rows, surface.right_sides(), tuning);
  const FloatMap p(context, "d/dx", grid), q(context, "d/dy", grid), depth(context, "heights", grid);
  Solved solved{readback(context, grid), readback(context, grid)};
  gpu::run_once(context, [&](gpu::Commands& commands) {
    commands.copy(staged.p, p.buffer, grid.bytes());
    commands.copy(staged.q, q.buffer, grid.bytes());
    commands.barrier();
    slope.record_given(commands, p, q, surface);
    // The solver reuses the coarser right sides only; the finest is still there afterwards.
    if (solver != Solve::Exact) surface.record(commands, depth);
    commands.copy(surface.right_side().buffer, solved.right, grid.bytes());
    commands.copy(depth.buffer, solved.heights, grid.bytes());
    commands.host_barrier();
  });
  solved.right.invalidate();
  solved.heights.invalidate();
  return solved;
}

/// Heights without the padding of the grid's rows.
std::vector<double> unpadded_heights(const Solved& solved, const Grid& grid, uint32_t rows, uint32_t cols,
                                     Solve solver) {
  std::vector<double> z(size_t{rows} * cols);
  const auto copy_rows = [&](const auto& padded) {
    for (uint32_t y = 0; y < rows; ++y)
      std::copy_n(padded.begin() + size_t{y} * grid.pitch * 4, cols, z.begin() + size_t{y} * cols);
  };
  if (solver == Solve::Exact) {
    const std::span<const float> f = solved.right.as<const float>();
    std::vector<double> padded(f.begin(), f.end());
    PoissonDct(cols, rows).solve(padded.data(), padded.data(), grid.pitch * 4);
    copy_rows(padded);
  } else {
    copy_rows(solved.heights.as<const float>());
  }
  return z;
}

/// Mean, least and greatest of heights.
struct Range {
  double mean = 0, low = std::numeric_limits<double>::max(), high = std::numeric_limits<double>::lowest();

  explicit Range(const std::vector<double>& z) {
    for (const double value : z) {
      mean += value;
      low = std::min(low, value);
      high = std::max(high, value);
    }
    mean /= static_cast<double>(z.size());
  }
};

}  // namespace

Heights integrate_gradients(gpu::Context& context, std::span<const float> gradients, uint32_t rows,
                            uint32_t cols, Solve solver) {
  check_shape(gradients, rows, cols);
  // A power of two brings the steepest gradient to about 1: exact, and single precision never meets its ends
  // on the way.
  const float largest = largest_of(gradients, cols);
  const int exponent = largest > 0 ? std::ilogb(largest) : 0;
  const Grid grid = grid_for(cols, rows);
  const StagedGradients staged(context, gradients, rows, cols, grid, exponent);
  const Solved solved = solve_on_device(context, staged, grid, rows, cols, solver);
  const std::vector<double> z = unpadded_heights(solved, grid, rows, cols, solver);
  const auto [mean, low, high] = Range(z);
  if (std::ldexp(std::max(high - mean, mean - low), exponent) > double{std::numeric_limits<float>::max()}) {
    throw Error(Failure::Input, "gradients whose heights fit single precision",
                "gradients up to 10^" + std::to_string(std::lround(std::log10(double{largest}))),
                "dividing the field by a constant");
  }

  Heights result;
  result.solve = solver;
  result.values.reserve(z.size());
  for (const double value : z)
    result.values.push_back(static_cast<float>(std::ldexp(value - mean, exponent)));
  result.statistics.residual = relative_residual(solved.right.as<const float>(), z, grid);
  result.statistics.inconsistency = inconsistency(gradients, std::ldexp(1.0, -exponent), z, cols, rows);
  result.statistics.peak_to_valley = std::ldexp(high - low, exponent);
  return result;
}

Heights integrate_gradients(gpu::Context& context, std::span<const float> gradients, uint32_t rows,
                            uint32_t cols, SurfaceSolver solver) {
  return integrate_gradients(context, gradients, rows, cols,
                             choose_solve(solver, SolveBy::Auto, {.processor = context.is_software()}));
}

}  // namespace palpate
