#include "engine/stages/surface/surface.h"

#include <algorithm>
#include <random>

#include "engine/gpu/commands.h"
#include "engine/stages/surface/slope.h"
#include "palpate/error.h"
#include "tests/scenes/heights.h"
#include "tests/support/gpu_fixture.h"

namespace palpate {
namespace {

struct HeightMisfit {
  double peak_to_valley = 0;  ///< relative error of the height between the truth's top and valley
  double extremes = 0;        ///< relative error of largest minus smallest height, ringing at kinks included
  double rms = 0;  ///< of the difference without its mean, relative to the truth's RMS about its mean
};

HeightMisfit height_misfit(const std::vector<float>& got, const std::vector<double>& truth) {
  double mean_got = 0, mean_truth = 0;
  for (size_t i = 0; i < truth.size(); ++i) {
    mean_got += double{got[i]};
    mean_truth += truth[i];
  }
  mean_got /= double(truth.size());
  mean_truth /= double(truth.size());
  double wrong = 0, whole = 0;
  for (size_t i = 0; i < truth.size(); ++i) {
    const double t = truth[i] - mean_truth, g = double{got[i]} - mean_got;
    wrong += (g - t) * (g - t);
    whole += t * t;
  }
  // The range between the places of the truth's top and valley. A valley that is a plane (around a cap) is
  // read at its median: where a slope jumps between two pixels their samples cannot show where, and the
  // heights beside the rim ring by a tenth of a pixel.
  const auto [low, high] = std::minmax_element(truth.begin(), truth.end());
  std::vector<double> valley;
  for (size_t i = 0; i < truth.size(); ++i)
    if (truth[i] == *low) valley.push_back(double{got[i]});
  std::nth_element(valley.begin(), valley.begin() + static_cast<std::ptrdiff_t>(valley.size() / 2),
                   valley.end());
  const double range = double{got[static_cast<size_t>(high - truth.begin())]} - valley[valley.size() / 2];
  const auto [got_low, got_high] = std::minmax_element(got.begin(), got.end());
  return {std::abs(range / (*high - *low) - 1),
          std::abs((double{*got_high} - double{*got_low}) / (*high - *low) - 1), std::sqrt(wrong / whole)};
}

std::vector<scenes::HeightField> fields(double width, double height) {
  const double side = std::min(width, height);
  return {scenes::tilt(), scenes::gaussian(width * 0.45, height * 0.55, side / 10, side / 20),
          scenes::broad_press(width, height, side / 20),
          scenes::cap(width * 0.52, height * 0.48, side * 0.4, side * 0.25)};
}

using SurfaceTest = GpuTest;

// Peak-to-valley within 0.1 % of the truth from exact gradients.
TEST_F(SurfaceTest, ConvergedAndExactHitTheTruth) {
  for (const auto& [cols, rows] : {std::pair{640u, 480u}, {1392u, 1042u}, {333u, 251u}}) {
    for (const auto& field : fields(cols, rows)) {
      const auto given = scenes::gradients(field, rows, cols);
      const auto truth = heights(field, rows, cols);
      for (const Solve solver : {Solve::Exact, Solve::Converged, Solve::Live}) {
        const Heights got = integrate_gradients(context(), given, rows, cols, solver);
        const HeightMisfit m = height_misfit(got.values, truth);
        const char* name = solver == Solve::Exact       ? "exact"
                           : solver == Solve::Converged ? "converged"
                                                        : "live";
        std::printf("%4u x %4u %-14s %-9s peak-to-valley %.1e  extremes %.1e  rms %.1e  residual %.1e\n",
                    cols, rows, field.name.c_str(), name, m.peak_to_valley, m.extremes, m.rms,
                    got.statistics.residual);
        // A solve that stops early is within 1e-3 of smooth fields; a kink keeps it a little longer.
        const bool whole = solver == Solve::Exact || solver == Solve::Converged;
        const bool kink = field.name == "spherical cap";
        EXPECT_LT(m.peak_to_valley, 1e-3) << field.name << " " << cols << " " << name;
        EXPECT_LT(m.extremes, whole ? 8e-3 : 1.2e-2) << field.name << " " << cols << " " << name;
        EXPECT_LT(m.rms, !kink ? 1e-3 : whole ? 3e-3 : 4e-3) << field.name << " " << cols << " " << name;
      }
    }
  }
}

// GPU multigrid and CPU cosine transform solve the same equations: they agree on rough data, of all sizes and
// shapes.
TEST_F(SurfaceTest, ConvergedEqualsExactOnNoise) {
  std::mt19937 random(4);
  std::normal_distribution<float> normal(0, 1);
  for (const auto& [cols, rows] : {std::pair{1u, 1u},
                                   {2u, 1u},
                                   {1u, 3u},
                                   {3u, 3u},
                                   {5u, 7u},
                                   {16u, 16u},
                                   {17u, 33u},
                                   {64u, 48u},
                                   {101u, 37u},
                                   {257u, 129u},
                                   {640u, 480u},
                                   {1000u, 3u},
                                   {3u, 1000u},
                                   {2048u, 16u}}) {
    std::vector<float> given(size_t{2} * rows * cols);
    for (float& g : given) g = normal(random);
    const Heights exact = integrate_gradients(context(), given, rows, cols, Solve::Exact);
    const Heights converged = integrate_gradients(context(), given, rows, cols, Solve::Converged);
    const double range = exact.statistics.peak_to_valley;
    double worst = 0;
    for (size_t i = 0; i < exact.values.size(); ++i)
      worst = std::max(worst, std::abs(double{exact.values[i]} - double{converged.values[i]}));
    std::printf("%4u x %4u worst difference %.1e of the range, residual %.1e\n", cols, rows,
                range > 0 ? worst / range : worst, converged.statistics.residual);
    EXPECT_LE(worst, 1e-3 * std::max(range, 1e-9)) << cols << " x " << rows;
  }
}

// Slopes in, heights out, on one surface stage for frame after frame.
class Frames {
 public:
  Frames(gpu::Context& context, uint32_t cols, uint32_t rows, Solve solve, const Tuning& tuning)
      : grid_(grid_for(cols, rows)),
        surface_(context, cols, rows, solve, tuning),
        slope_(context, cols, rows, surface_.right_sides(), tuning),
        p_(context, "d/dx", grid_),
        q_(context, "d/dy", grid_),
        depth_(context, "heights", grid_),
        staging_p_(context, "d/dx upload", grid_.bytes(), gpu::Memory::Upload),
        staging_q_(context, "d/dy upload", grid_.bytes(), gpu::Memory::Upload),
        heights_(context, "readback", grid_.bytes(), gpu::Memory::Readback),
        commands_(context) {
    for (const gpu::DeviceBuffer* staging : {&staging_p_, &staging_q_})
      std::ranges::fill(staging->as<float>(), 0.0f);
    commands_.begin();
    commands_.copy(staging_p_, p_.buffer, grid_.bytes());
    commands_.copy(staging_q_, q_.buffer, grid_.bytes());
    commands_.barrier();
    slope_.record_given(commands_, p_, q_, surface_);
    surface_.record(commands_, depth_);
    commands_.copy(depth_.buffer, heights_, grid_.bytes());
    commands_.host_barrier();
    commands_.end();
  }

  std::vector<float> solve(const std::vector<float>& gradients) {
    for (uint32_t y = 0; y < grid_.height; ++y) {
      for (uint32_t x = 0; x < grid_.width; ++x) {
        const size_t from = 2 * (size_t{y} * grid_.width + x), to = size_t{y} * grid_.pitch * 4 + x;
        staging_p_.as<float>()[to] = gradients[from];
        staging_q_.as<float>()[to] = gradients[from + 1];
      }
    }
    staging_p_.flush();
    staging_q_.flush();
    commands_.submit();
    commands_.wait();
    heights_.invalidate();
    std::vector<float> out;
    for (uint32_t y = 0; y < grid_.height; ++y)
      for (uint32_t x = 0; x < grid_.width; ++x)
        out.push_back(heights_.as<const float>()[size_t{y} * grid_.pitch * 4 + x]);
    return out;
  }
  /// Of the surface stage alone.
  uint32_t dispatches() const {
    for (const gpu::ScopeTraffic& scope : commands_.traffic())
      if (scope.name == "surface") return scope.dispatches;
    return 0;
  }

 private:
  Grid grid_;
  Surface surface_;
  Slope slope_;
  FloatMap p_, q_, depth_;
  gpu::DeviceBuffer staging_p_, staging_q_, heights_;
  gpu::Commands commands_;
};

// The two forms of the kernels solve alike, whatever the size: sides of one cell, odd ones, tiles cut by the
// frame.
TEST_F(SurfaceTest, TilesAndStripsAgree) {
  std::mt19937 random(5);
  std::normal_distribution<float> normal(0, 1);
  for (const auto& [cols, rows] : {std::pair{33u, 17u}, {1u, 170u}, {161u, 119u}}) {
    const scenes::HeightField field = scenes::gaussian(cols * 0.45, rows * 0.55, 12, 9);
    std::vector<float> given = scenes::gradients(field, rows, cols);
    for (float& g : given) g += 0.05f * normal(random);
    for (const Solve solver : {Solve::Live, Solve::Converged}) {
      std::array<std::vector<float>, 2> heights;
      for (const uint32_t tiles : {0u, 1u}) {
        Tuning tuning = default_tuning(context());
        tuning.surface_tiles = tiles;
        tuning.coarsest_cells = 40;
        heights[tiles] = Frames(context(), cols, rows, solver, tuning).solve(given);
      }
      double worst = 0, range = 0;
      for (size_t i = 0; i < heights[0].size(); ++i) {
        ASSERT_TRUE(std::isfinite(heights[1][i])) << cols << " x " << rows;
        worst = std::max(worst, std::abs(double{heights[0][i]} - double{heights[1][i]}));
        range = std::max(range, std::abs(double{heights[0][i]} - double{heights[0][0]}));
      }
      EXPECT_LE(worst, 3e-6 * range) << cols << " x " << rows << " " << static_cast<int>(solver);
    }
  }
}

// What a card waits for is its dispatches: the coarsest levels of usual frames are one, and come to what they
// come to one by one.
TEST_F(SurfaceTest, CoarseLevelsOfUsualFramesAreOneDispatch) {
  struct Usual {
    uint32_t cols, rows, most_dispatches;
    uint32_t words;  ///< of the levels that are one: the finest's cells, and twice those of the others
  };
  for (const Usual& usual : {Usual{640, 480, 9, 80 * 60 + 2 * (40 * 30 + 20 * 15)},
                             Usual{1392, 1042, 16, 87 * 66 + 2 * (44 * 33 + 22 * 17 + 11 * 9)}}) {
    const auto [cols, rows, most_dispatches, words] = usual;
    Tuning tuning = default_tuning(context());
    tuning.surface_tiles = 1;
    const bool fits = context().properties().limits.maxComputeSharedMemorySize >= words * sizeof(float);
    std::mt19937 random(6);
    std::normal_distribution<float> normal(0, 1);
    std::vector<float> given =
        scenes::gradients(scenes::gaussian(cols * 0.45, rows * 0.55, rows / 10., rows / 20.), rows, cols);
    for (float& g : given) g += 0.05f * normal(random);
    Frames tiles(context(), cols, rows, Solve::Live, tuning);
    tuning.surface_tiles = 0;
    Frames strips(context(), cols, rows, Solve::Live, tuning);
    std::printf("%u x %u: %u dispatches in tiles, %u in strips\n", cols, rows, tiles.dispatches(),
                strips.dispatches());
    EXPECT_GT(tiles.dispatches(), 0u);
    if (fits) {
      EXPECT_LE(tiles.dispatches(), most_dispatches);
    }
    const std::vector<float> got = tiles.solve(given), wanted = strips.solve(given);
    const auto [low, high] = std::ranges::minmax_element(wanted);
    for (size_t i = 0; i < got.size(); ++i) ASSERT_NEAR(got[i], wanted[i], 1e-6 * (*high - *low)) << i;
  }
}

TEST_F(SurfaceTest, RefusesWhatIsNoField) {
  const std::vector<float> none;
  EXPECT_THROW(integrate_gradients(context(), none, 0, 0, Solve::Live), Error);
  const std::vector<float> few(6);
  EXPECT_THROW(integrate_gradients(context(), few, 2, 2, Solve::Live), Error);
}

}  // namespace
}  // namespace palpate
