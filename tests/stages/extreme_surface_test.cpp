// Stiff and extreme surfaces: gradient fields of any size, steepness and consistency, and whole pipelines on
// extreme images. Results are free of NaN, and wrong numbers are reported. perf/results/stiff_and_extreme.md
// has the table that these tests print.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "engine/base/text.h"
#include "engine/numeric/poisson_dct.h"
#include "engine/stages/surface/surface.h"
#include "palpate/error.h"
#include "palpate/pipeline.h"
#include "tests/reference/slope.h"
#include "tests/scenes/heights.h"
#include "tests/support/gpu_fixture.h"
#include "tests/support/memory_left.h"
#include "tests/support/stage_run.h"

namespace palpate {
namespace {

using Gradients = std::vector<float>;

const char* name_of(Solve solver) {
  return solver == Solve::Live ? "live" : solver == Solve::Converged ? "converged" : "exact";
}
constexpr std::array kSolvers = {Solve::Live, Solve::Converged, Solve::Exact};
/// Stops before it has converged: less time for some error, more on what is as narrow as pixels.
constexpr bool stops_early(Solve solver) {
  return solver == Solve::Live;
}

template <typename Slope>
Gradients field(uint32_t cols, uint32_t rows, const Slope& slope) {
  Gradients out;
  out.reserve(size_t{2} * rows * cols);
  for (uint32_t y = 0; y < rows; ++y) {
    for (uint32_t x = 0; x < cols; ++x) {
      const std::pair<double, double> g = slope(static_cast<double>(x), static_cast<double>(y));
      out.push_back(static_cast<float>(g.first));
      out.push_back(static_cast<float>(g.second));
    }
  }
  return out;
}

Gradients gaussian(uint32_t cols, uint32_t rows, double scale = 1) {
  const auto hill =
      scenes::gaussian(0.45 * cols, 0.55 * rows, 0.1 * std::min(cols, rows), 0.05 * std::min(cols, rows));
  return field(cols, rows, [&](double x, double y) {
    const auto [p, q] = hill.gradient(x, y);
    // Its tails would leave single precision before the rest does.
    const auto cut = [](double v) { return std::abs(v) < 1e-6 ? 0.0 : v; };
    return std::pair{cut(p) * scale, cut(q) * scale};
  });
}

/// RMS and largest difference from `truth` without the means, relative to the truth's range.
struct Misfit {
  double rms = 0, worst = 0, range = 0;
};
template <typename Truth>
Misfit misfit(const std::vector<float>& got, const std::vector<Truth>& truth) {
  double mean = 0;
  for (size_t i = 0; i < truth.size(); ++i) mean += double{got[i]} - double{truth[i]};
  mean /= static_cast<double>(truth.size());
  Misfit m;
  for (size_t i = 0; i < truth.size(); ++i) {
    const double wrong = double{got[i]} - double{truth[i]} - mean;
    m.rms += wrong * wrong;
    m.worst = std::max(m.worst, std::abs(wrong));
  }
  const auto [low, high] = std::minmax_element(truth.begin(), truth.end());
  m.range = double{*high} - double{*low};
  const double scale = m.range > 0 ? m.range : 1;
  m.rms = std::sqrt(m.rms / static_cast<double>(truth.size())) / scale;
  m.worst /= scale;
  return m;
}

void expect_finite(const std::vector<float>& values, const std::string& what) {
  const auto bad = std::find_if(values.begin(), values.end(), [](float v) { return !std::isfinite(v); });
  EXPECT_TRUE(bad == values.end()) << what << " at " << bad - values.begin();
}

class ExtremeSurface : public GpuTest {
 protected:
  static Heights solve(const Gradients& g, uint32_t cols, uint32_t rows, Solve solver) {
    const Heights heights = integrate_gradients(context(), g, rows, cols, solver);
    expect_finite(heights.values, std::string(name_of(solver)) + " heights");
    EXPECT_TRUE(std::isfinite(heights.statistics.residual) &&
                std::isfinite(heights.statistics.inconsistency) &&
                std::isfinite(heights.statistics.peak_to_valley));
    return heights;
  }
  /// One line of the table, on paper and in the test's record.
  static void tell(const std::string& what, Solve solver, const Misfit& m, const SurfaceStatistics& e) {
    const std::string line = text("rms %.1e worst %.1e of range %.3g, residual %.1e, inconsistency %.1e",
                                  m.rms, m.worst, m.range, e.residual, e.inconsistency);
    std::printf("  %-34s %-9s %s\n", what.c_str(), name_of(solver), line.c_str());
    RecordProperty(what + " " + name_of(solver), line);
  }
};

// All nine smallest shapes against a dense least-squares solution.
TEST_F(ExtremeSurface, FramesOfOneToThreePixelsASide) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  for (uint32_t rows = 1; rows <= 3; ++rows) {
    for (uint32_t cols = 1; cols <= 3; ++cols) {
      const Gradients g = field(cols, rows, [&](double, double) {
        return std::pair{normal(random), normal(random)};
      });
      reference::Slopes slopes;
      for (size_t i = 0; i < g.size(); i += 2) {
        slopes.p.push_back(double{g[i]});
        slopes.q.push_back(double{g[i + 1]});
      }
      const std::vector<double> f = reference::right_side(slopes, cols, rows, 1);
      const auto n = static_cast<Eigen::Index>(f.size());
      Eigen::MatrixXd a = Eigen::MatrixXd::Zero(n, n);
      const auto couple = [&](Eigen::Index i, Eigen::Index k) {
        a(i, i) += 1;
        a(k, k) += 1;
        a(i, k) -= 1;
        a(k, i) -= 1;
      };
      for (Eigen::Index y = 0; y < rows; ++y) {
        for (Eigen::Index x = 0; x < cols; ++x) {
          if (x + 1 < cols) couple(y * cols + x, y * cols + x + 1);
          if (y + 1 < rows) couple(y * cols + x, (y + 1) * cols + x);
        }
      }
      const Eigen::VectorXd z =
          a.completeOrthogonalDecomposition().solve(Eigen::Map<const Eigen::VectorXd>(f.data(), n));
      const std::vector<double> truth(z.begin(), z.end());
      for (const Solve solver : kSolvers) {
        const Heights got = solve(g, cols, rows, solver);
        const Misfit m = misfit(got.values, truth);
        if (rows == cols)
          tell(std::to_string(cols) + " x " + std::to_string(rows), solver, m, got.statistics);
        EXPECT_LT(m.worst, 1e-5) << cols << " x " << rows << " " << name_of(solver);
        if (rows * cols == 1) {
          EXPECT_EQ(got.values[0], 0) << "a single pixel has no height";
        }
      }
    }
  }
}

// Long strips: half a cosine along the strip, the slowest field there is, and noise against the exact
// solution.
TEST_F(ExtremeSurface, Strips) {
  for (const auto& [cols, rows] : {std::pair{16384u, 16u}, {16u, 16384u}, {16384u, 1u}}) {
    const bool wide = cols > rows;
    const double length = wide ? cols : rows, k = std::numbers::pi / length;
    const auto along = [=](double s) { return -100 * k * std::sin(k * (s + 0.5)); };
    const Gradients slow = field(cols, rows, [&](double x, double y) {
      return wide ? std::pair{along(x), 0.0} : std::pair{0.0, along(y)};
    });
    std::vector<double> truth;
    for (uint32_t y = 0; y < rows; ++y)
      for (uint32_t x = 0; x < cols; ++x) truth.push_back(100 * std::cos(k * ((wide ? x : y) + 0.5)));
    std::mt19937 random(2);
    std::normal_distribution<double> normal;
    const Gradients noise = field(cols, rows, [&](double, double) {
      return std::pair{normal(random), normal(random)};
    });
    const Heights exact = solve(noise, cols, rows, Solve::Exact);
    const std::string size = std::to_string(cols) + " x " + std::to_string(rows);
    for (const Solve solver : kSolvers) {
      const Heights got = solve(slow, cols, rows, solver);
      const Misfit m = misfit(got.values, truth);
      tell(size + " half cosine", solver, m, got.statistics);
      EXPECT_LT(m.worst, stops_early(solver) ? 1e-2 : 1e-3) << size << " " << name_of(solver);
      const Heights rough = solve(noise, cols, rows, solver);
      const Misfit apart = misfit(rough.values, exact.values);
      tell(size + " noise, against exact", solver, apart, rough.statistics);
      EXPECT_LT(apart.worst, stops_early(solver) ? 0.6 : 1e-3) << size << " " << name_of(solver);
    }
  }
}

// 67 million pixels.
TEST_F(ExtremeSurface, LargestFrame) {
  constexpr double kNeeded_GiB = 8;
  if (memory_left_GiB() < kNeeded_GiB)
    GTEST_SKIP() << "NOT CHECKED at 8192 x 8192: " << memory_left_GiB() << " GiB of memory left, needs "
                 << kNeeded_GiB;
  constexpr uint32_t kSide = 8192;
  constexpr double kPeak = 400;
  std::vector<double> c(kSide), s(kSide);
  const double k = std::numbers::pi / kSide;
  for (uint32_t i = 0; i < kSide; ++i) {
    c[i] = std::cos(k * (i + 0.5));
    s[i] = std::sin(k * (i + 0.5));
  }
  Gradients g;
  g.reserve(size_t{2} * kSide * kSide);
  for (uint32_t y = 0; y < kSide; ++y) {
    for (uint32_t x = 0; x < kSide; ++x) {
      g.push_back(static_cast<float>(-kPeak * k * s[x] * c[y]));
      g.push_back(static_cast<float>(-kPeak * k * c[x] * s[y]));
    }
  }
  // Lavapipe states 128 MiB for what a kernel may write to at once and holds more: a message of the
  // validation layer, which is left out here. A GPU that states less than it would need refuses the frame
  // (Commands::dispatch).
  gpu::Context plain(gpu::ContextOptions{});
  const Heights got = integrate_gradients(plain, g, kSide, kSide, Solve::Converged);
  expect_finite(got.values, "heights");
  double squares = 0, worst = 0;
  for (uint32_t y = 0; y < kSide; ++y) {
    for (uint32_t x = 0; x < kSide; ++x) {
      const double wrong = double{got.values[size_t{y} * kSide + x]} - kPeak * c[x] * c[y];
      squares += wrong * wrong;
      worst = std::max(worst, std::abs(wrong));
    }
  }
  const Misfit m{std::sqrt(squares) / kSide / (2 * kPeak), worst / (2 * kPeak), 2 * kPeak};
  tell("8192 x 8192 broad press", Solve::Converged, m, got.statistics);
  EXPECT_LT(m.worst, 1e-3);
}

// Walls: one column's slope carries the whole height. The step's height is right however steep it is; where
// it lies between two pixels no sample shows, so the columns next to it are left out.
TEST_F(ExtremeSurface, SteepestWalls) {
  constexpr uint32_t kCols = 320, kRows = 240, kWall = 160;
  for (const double height : {1.0, 1e3, 1e6}) {
    const Gradients g = field(kCols, kRows, [&](double x, double) {
      return std::pair{x == kWall ? height : 0.0, 0.0};
    });
    for (const Solve solver : kSolvers) {
      const Heights got = solve(g, kCols, kRows, solver);
      double worst = 0;
      for (uint32_t y = 0; y < kRows; ++y) {
        for (uint32_t x = 0; x < kCols; ++x) {
          if (x + 3 > kWall && x < kWall + 4) continue;
          worst = std::max(
              worst, std::abs(double{got.values[size_t{y} * kCols + x]} / height - (x < kWall ? -0.5 : 0.5)));
        }
      }
      const Misfit m{0, worst, height};
      tell("wall of slope " + std::to_string(static_cast<int>(height)), solver, m, got.statistics);
      EXPECT_LT(worst, stops_early(solver) ? 0.2 : 4e-3) << height << " " << name_of(solver);
    }
  }
  // Walls all round: a square pit.
  const Gradients pit = field(kCols, kRows, [](double x, double y) {
    const bool inside_x = x > 100 && x<200, inside_y = y> 60 && y < 160;
    return std::pair{inside_y ? (x == 100   ? 1e4
                                 : x == 200 ? -1e4
                                            : 0.0)
                              : 0.0,
                     inside_x ? (y == 60    ? 1e4
                                 : y == 160 ? -1e4
                                            : 0.0)
                              : 0.0};
  });
  const Heights exact = solve(pit, kCols, kRows, Solve::Exact);
  for (const Solve solver : kSolvers) {
    const Heights got = solve(pit, kCols, kRows, solver);
    const double depth = double{got.values[110 * kCols + 150]} - double{got.values[20 * kCols + 20]};
    const Misfit apart = misfit(got.values, exact.values);
    tell("pit with walls of 1e4, against exact", solver, apart, got.statistics);
    EXPECT_NEAR(depth, 1e4, stops_early(solver) ? 5000 : 200) << name_of(solver);
    EXPECT_LT(apart.worst, stops_early(solver) ? 0.6 : 1e-4) << name_of(solver);
  }
}

// Gradients at the ends of single precision give the same surface as gradients of 1: to the last bit for a
// power of two.
TEST_F(ExtremeSurface, TinyAndHugeGradients) {
  constexpr uint32_t kCols = 203, kRows = 151;
  for (const Solve solver : kSolvers) {
    const Heights plain = solve(gaussian(kCols, kRows), kCols, kRows, solver);
    for (const int exponent : {-100, 100}) {  // 1e-30 and 1e30
      const double scale = std::ldexp(1.0, exponent);
      const Heights scaled = solve(gaussian(kCols, kRows, scale), kCols, kRows, solver);
      for (size_t i = 0; i < plain.values.size(); ++i)
        ASSERT_EQ(scaled.values[i], std::ldexp(plain.values[i], exponent)) << name_of(solver) << " at " << i;
      EXPECT_EQ(scaled.statistics.residual, plain.statistics.residual);
      EXPECT_EQ(scaled.statistics.peak_to_valley, plain.statistics.peak_to_valley * scale);
    }
    for (const double scale : {1e-30, 1e30}) {
      const Heights scaled = solve(gaussian(kCols, kRows, scale), kCols, kRows, solver);
      std::vector<float> back;
      for (const float v : scaled.values) back.push_back(static_cast<float>(double{v} / scale));
      const Misfit m = misfit(back, plain.values);
      tell("gradients of " + std::to_string(std::lround(std::log10(scale))) + " powers of ten", solver, m,
           scaled.statistics);
      EXPECT_LT(m.worst, 1e-6) << name_of(solver) << " " << scale;
    }
  }
  // One gigantic gradient among tiny ones: the tiny ones are below its rounding, nothing is worse than that.
  Gradients mixed = gaussian(kCols, kRows, 1e-30);
  mixed[2 * (75 * kCols + 100)] = 1e30f;
  for (const Solve solver : kSolvers) solve(mixed, kCols, kRows, solver);
}

TEST_F(ExtremeSurface, HeightsBeyondSinglePrecisionAreRefused) {
  const Gradients g(size_t{2} * 64 * 64, 3e38f);
  for (const Solve solver : kSolvers) {
    try {
      integrate_gradients(context(), g, 64, 64, solver);
      ADD_FAILURE() << name_of(solver) << " gave heights that do not fit";
    } catch (const Error& e) {
      EXPECT_EQ(e.failure(), Failure::Input);
      EXPECT_NE(std::string(e.what()).find("single precision"), std::string::npos) << e.what();
    }
  }
}

TEST_F(ExtremeSurface, NanAndInfinityAreRefusedWithTheirPlace) {
  for (const float bad :
       {std::nanf(""), std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity()}) {
    for (const Solve solver : kSolvers) {
      Gradients g = gaussian(30, 20);
      g[2 * (7 * 30 + 11) + 1] = bad;
      try {
        integrate_gradients(context(), g, 20, 30, solver);
        ADD_FAILURE() << bad << " was accepted";
      } catch (const Error& e) {
        EXPECT_EQ(e.failure(), Failure::Input);
        for (const char* word : {"row 7", "column 11", "dz/dy", std::isnan(bad) ? "NaN" : "infinity"})
          EXPECT_NE(std::string(e.what()).find(word), std::string::npos) << e.what();
      }
    }
  }
}

// A field that turns in circles belongs to no surface. The answer is the nearest surface, and the statistics
// says how far the field is from it: what is explained and what is not add up as squares.
TEST_F(ExtremeSurface, FieldsThatTurnSaySo) {
  constexpr uint32_t kCols = 240, kRows = 180;
  const Gradients turning = field(kCols, kRows, [](double x, double y) {
    return std::pair{-(y - 89.5) / 90, (x - 119.5) / 90};
  });
  // Vortex inside, still at the rim: nothing of it is a surface.
  const Gradients vortex = field(kCols, kRows, [](double x, double y) {
    const double dx = x - 119.5, dy = y - 89.5, g = std::exp(-(dx * dx + dy * dy) / 800);
    return std::pair{-dy * g, dx * g};
  });
  const auto rms_step = [](const Gradients& g) {
    reference::Slopes s;
    for (size_t i = 0; i < g.size(); i += 2) {
      s.p.push_back(double{g[i]});
      s.q.push_back(double{g[i + 1]});
    }
    double sum = 0;
    for (uint32_t y = 0; y < kRows; ++y)
      for (int x = 0; x + 1 < int{kCols}; ++x)
        sum += std::pow(reference::pair_integral(
                            [&](int i) { return s.p[size_t{y} * kCols + static_cast<size_t>(i)]; }, x, kCols),
                        2);
    for (uint32_t x = 0; x < kCols; ++x)
      for (int y = 0; y + 1 < int{kRows}; ++y)
        sum += std::pow(reference::pair_integral(
                            [&](int i) { return s.q[static_cast<size_t>(i) * kCols + x]; }, y, kRows),
                        2);
    return std::sqrt(sum);
  };
  for (const auto& [what, g, least] : {std::tuple{"turning plate", turning, 0.3}, {"vortex", vortex, 0.99}}) {
    const Heights exact = solve(g, kCols, kRows, Solve::Exact);
    double explained = 0;
    for (uint32_t y = 0; y < kRows; ++y) {
      for (uint32_t x = 0; x < kCols; ++x) {
        const float* z = &exact.values[size_t{y} * kCols + x];
        if (x + 1 < kCols) explained += std::pow(double{z[1]} - double{z[0]}, 2);
        if (y + 1 < kRows) explained += std::pow(double{z[kCols]} - double{z[0]}, 2);
      }
    }
    EXPECT_NEAR(std::pow(exact.statistics.inconsistency, 2) + explained / std::pow(rms_step(g), 2), 1, 1e-4)
        << what;
    for (const Solve solver : kSolvers) {
      const Heights got = solve(g, kCols, kRows, solver);
      const Misfit m = misfit(got.values, exact.values);
      tell(std::string(what) + ", against exact", solver, m, got.statistics);
      EXPECT_GT(got.statistics.inconsistency, least) << what << " " << name_of(solver);
      if (got.statistics.inconsistency < 0.99) {
        EXPECT_LT(m.worst, stops_early(solver) ? 3e-2 : 1e-4) << what;
      }
    }
  }
  EXPECT_LT(solve(gaussian(kCols, kRows), kCols, kRows, Solve::Converged).statistics.inconsistency, 1e-3);
}

// Slopes that change sign from pixel to pixel: between two pixels they cancel, and so does the surface.
TEST_F(ExtremeSurface, CheckerboardGradients) {
  constexpr uint32_t kCols = 130, kRows = 98;
  const Gradients g = field(kCols, kRows, [](double x, double y) {
    const double sign = std::fmod(x + y, 2) == 0 ? 1 : -1;
    return std::pair{sign, -sign};
  });
  const Heights exact = solve(g, kCols, kRows, Solve::Exact);
  for (const Solve solver : kSolvers) {
    const Heights got = solve(g, kCols, kRows, solver);
    const Misfit m = misfit(got.values, exact.values);
    tell("checkerboard, against exact", solver, m, got.statistics);
    EXPECT_LT(m.worst * m.range, stops_early(solver) ? 0.2 : 1e-4) << name_of(solver);
    EXPECT_LT(got.statistics.peak_to_valley, 2) << name_of(solver);
  }
}

// Error of half precision: slopes, right sides or heights rounded to 16 bits, solved exactly otherwise.
TEST_F(ExtremeSurface, HalfPrecisionStorage) {
  constexpr uint32_t kCols = 640, kRows = 480;
  const auto half = [](double value) {
    return double{static_cast<float>(Eigen::half(static_cast<float>(value)))};
  };
  const auto side = double{std::min(kCols, kRows)};
  for (const auto& scene : {scenes::gaussian(0.45 * kCols, 0.55 * kRows, side / 10, side / 20),
                            scenes::broad_press(kCols, kRows, side / 20),
                            scenes::cap(0.52 * kCols, 0.48 * kRows, side * 0.4, side * 0.25)}) {
    const auto slopes_of = [&](const auto& rounding) {
      reference::Slopes s;
      for (uint32_t y = 0; y < kRows; ++y) {
        for (uint32_t x = 0; x < kCols; ++x) {
          const auto [p, q] = scene.gradient(x, y);
          s.p.push_back(rounding(p));
          s.q.push_back(rounding(q));
        }
      }
      return s;
    };
    PoissonDct dct(kCols, kRows);
    const auto heights = [&](std::vector<double> f) {
      dct.solve(f.data(), f.data(), kCols);
      return f;
    };
    const auto plain = [](double v) { return v; };
    const auto single = [](double v) { return double{static_cast<float>(v)}; };
    const std::vector<double> f = reference::right_side(slopes_of(plain), kCols, kRows, 1);
    const std::vector<double> truth = heights(f);
    const auto tell_difference = [&](const char* what, const std::vector<double>& z) {
      const Misfit m = misfit(std::vector<float>(z.begin(), z.end()), truth);
      std::printf("  %-14s %-30s rms %.1e worst %.1e of the range\n", scene.name.c_str(), what, m.rms,
                  m.worst);
      RecordProperty(scene.name + " " + what, std::to_string(m.worst));
      return m;
    };
    std::vector<double> right = f, rounded = truth, right32 = f;
    for (double& v : right) v = half(v);
    for (double& v : right32) v = single(v);
    for (double& v : rounded) v = half(v);
    const Misfit slopes16 = tell_difference("slopes in 16 bits",
                                            heights(reference::right_side(slopes_of(half), kCols, kRows, 1)));
    const Misfit right16 = tell_difference("right sides in 16 bits", heights(right));
    const Misfit heights16 = tell_difference("heights in 16 bits", rounded);
    const Misfit single32 = tell_difference("right sides in 32 bits", heights(right32));
    EXPECT_LT(single32.worst, 1e-5);
    EXPECT_LT(slopes16.worst, 5e-3);
    EXPECT_LT(heights16.worst, 1e-3);
    EXPECT_GT(right16.worst, 10 * single32.worst) << "16 bits are not free";
  }
}

}  // namespace
}  // namespace palpate
