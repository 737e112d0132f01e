#include "engine/stages/surface/weighted_surface.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "engine/gpu/commands.h"
#include "engine/numeric/islands.h"
#include "engine/numeric/weighted_poisson.h"
#include "palpate/error.h"
#include "tests/scenes/heights.h"
#include "tests/support/gpu_fixture.h"
#include "tests/support/thorough.h"

namespace palpate {
namespace {

using scenes::HeightField;

struct Mask {
  std::string name;
  std::vector<float> weights;
  double live =
      0;  ///< relative RMS error that four iterations may leave; infinity: they are not enough, and say so
};

std::vector<Mask> masks(uint32_t cols, uint32_t rows) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(0, 1);
  const auto make = [&](const std::string& name, double live, auto weight) {
    Mask mask{name, {}, live};
    for (uint32_t y = 0; y < rows; ++y)
      for (uint32_t x = 0; x < cols; ++x)
        mask.weights.push_back(static_cast<float>(weight(double(x), double(y))));
    return mask;
  };
  constexpr double kTooFew = std::numeric_limits<double>::infinity();
  const double w = cols, h = rows, side = std::min(w, h);
  return {
      make("all 1", 5e-3, [](double, double) { return 1.0; }),
      make("10 % random unknown", 5e-3, [&](double, double) { return uniform(random) < 0.1 ? 0.0 : 1.0; }),
      make(
          "saturated disc", 5e-3,
          [&](double x, double y) { return std::hypot(x - 0.5 * w, y - 0.5 * h) < 0.12 * side ? 0.0 : 1.0; }),
      make("half the frame", 5e-3, [&](double x, double) { return x < w / 2 ? 0.0 : 1.0; }),
      make(
          "islands", 1e-2,
          [&](double x, double y) { return std::fmod(x, w / 5) < 2 || std::fmod(y, h / 4) < 2 ? 0.0 : 1.0; }),
      make(
          "round pad", 5e-3,
          [&](double x, double y) { return std::hypot(x - 0.5 * w, y - 0.5 * h) > 0.48 * side ? 0.0 : 1.0; }),
      make("1e-3 .. 1 random", kTooFew, [&](double, double) { return std::pow(10, -3 * uniform(random)); }),
      make("1e-6 .. 1 smooth", kTooFew,
           [&](double x, double y) {
             return std::pow(10, -3 + 3 * std::cos(12 * x / w) * std::cos(12 * y / h));
           }),
  };
}

/// Largest and RMS error against the truth where something is known, each island by itself, relative to the
/// truth's range and RMS.
struct IslandMisfit {
  double worst = 0;
  double rms = 0;
};

IslandMisfit misfit_by_island(const std::vector<float>& got, const std::vector<double>& truth,
                              const std::vector<float>& weights, uint32_t cols, uint32_t rows) {
  std::vector<uint8_t> known;
  for (const float w : weights) known.push_back(w > 0 ? 1 : 0);
  std::vector<uint32_t> label;
  const Islands islands = find_islands(known, cols, rows, {}, &label);
  std::vector<double> offset(islands.count + 1), count(islands.count + 1);
  for (size_t i = 0; i < truth.size(); ++i) {
    offset[label[i]] += double{got[i]} - truth[i];
    count[label[i]] += 1;
  }
  double low = 1e300, high = -1e300, mean = 0;
  for (const double t : truth) {
    low = std::min(low, t);
    high = std::max(high, t);
    mean += t / double(truth.size());
  }
  double wrong = 0, whole = 0, worst = 0;
  for (size_t i = 0; i < truth.size(); ++i) {
    if (label[i] == 0) continue;
    const double e = double{got[i]} - truth[i] - offset[label[i]] / count[label[i]];
    worst = std::max(worst, std::abs(e));
    wrong += e * e;
    whole += (truth[i] - mean) * (truth[i] - mean);
  }
  if (!(high > low)) return {worst, std::sqrt(wrong)};
  return {worst / (high - low), std::sqrt(wrong / whole)};
}

std::vector<float> noise(uint32_t rows, uint32_t cols, uint32_t seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal(0, 1);
  std::vector<float> given(size_t{2} * rows * cols);
  for (float& g : given) g = normal(random);
  return given;
}

/// The normal equations, solved directly. Each island's first pixel is held, which costs nothing: its
/// equation is the sum of the others'.
std::vector<float> direct(const WeightedFaces& f, const std::vector<uint32_t>& label, uint32_t islands) {
  const auto n = static_cast<Eigen::Index>(f.across.size());
  std::vector<Eigen::Triplet<double>> entries;
  const auto couple = [&](Eigen::Index i, Eigen::Index j, double w) {
    if (!(w > 0)) return;
    entries.emplace_back(i, i, w);
    entries.emplace_back(j, j, w);
    entries.emplace_back(i, j, -w);
    entries.emplace_back(j, i, -w);
  };
  std::vector<char> held(islands + 1, 0);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto at = static_cast<size_t>(i);
    couple(i, i + 1, at % f.width + 1 < f.width ? f.across_weight[at] : 0);
    couple(i, i + f.width, at / f.width + 1 < f.height ? f.down_weight[at] : 0);
    if (label[at] == 0 || !held[label[at]]) entries.emplace_back(i, i, 1);
    held[label[at]] = 1;
  }
  Eigen::SparseMatrix<double> a(n, n);
  a.setFromTriplets(entries.begin(), entries.end());
  const std::vector<double> right = right_side(f);
  const Eigen::VectorXd z = Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(a).solve(
      Eigen::Map<const Eigen::VectorXd>(right.data(), n));
  std::vector<float> out;
  for (Eigen::Index i = 0; i < n; ++i) out.push_back(static_cast<float>(z[i]));
  return out;
}

using WeightedSurfaceTest = GpuTest;

// The method against the truth, from exact slopes: whatever the mask, what is known comes out right.
TEST_F(WeightedSurfaceTest, HitsTheTruthUnderEveryMask) {
  std::vector<std::pair<uint32_t, uint32_t>> sizes{{333, 251}};
  if (thorough()) sizes.emplace_back(640, 480);
  for (const auto& [cols, rows] : sizes) {
    const double side = std::min(cols, rows);
    for (const HeightField& field :
         {scenes::tilt(), scenes::gaussian(cols * 0.45, rows * 0.55, side / 10, side / 20),
          scenes::cap(cols * 0.52, rows * 0.48, side * 0.4, side * 0.25)}) {
      if (cols > 400 && field.name != "Gaussian") continue;
      const bool kink = field.name == "spherical cap";
      const std::vector<double> truth = heights(field, rows, cols);
      for (const Mask& mask : masks(cols, rows)) {
        std::vector<float> given = scenes::gradients(field, rows, cols);
        for (size_t i = 0; i < mask.weights.size(); ++i)
          if (mask.weights[i] == 0) given[2 * i] = given[2 * i + 1] = std::numeric_limits<float>::quiet_NaN();
        for (const Solve solver : {Solve::Live, Solve::Converged, Solve::Exact}) {
          if (solver == Solve::Exact && cols > 400) continue;
          const bool live = solver == Solve::Live;
          const WeightedHeights got = integrate_weighted(context(), given, mask.weights, rows, cols, solver);
          const IslandMisfit m = misfit_by_island(got.values, truth, mask.weights, cols, rows);
          std::printf(
              "%4u x %4u %-13s %-20s %-9s rms %.1e worst %.1e residual %.1e misfit %.1e iterations %u "
              "islands %u\n",
              cols, rows, field.name.c_str(), mask.name.c_str(),
              live                     ? "live"
              : solver == Solve::Exact ? "exact"
                                       : "converged",
              m.rms, m.worst, got.statistics.residual, got.statistics.unexplained, got.statistics.iterations,
              got.islands.count);
          for (const float z : got.values) ASSERT_TRUE(std::isfinite(z));
          EXPECT_LT(m.rms, (live ? mask.live : 1e-4) + (kink ? 8e-3 : 0)) << field.name << ", " << mask.name;
          EXPECT_LT(got.statistics.residual, live ? 0.5 : 1e-6) << field.name << ", " << mask.name;
          EXPECT_TRUE(live || got.statistics.converged) << field.name << ", " << mask.name;
        }
      }
    }
  }
}

// Rough slopes that no surface has, rough weights, awkward sizes: the least-squares answer is that of a
// direct solver, on the GPU and on the CPU, and both say how much of the slopes no surface explains.
TEST_F(WeightedSurfaceTest, EqualsDirectSolverOnInconsistentSlopes) {
  for (const auto& [cols, rows] : {std::pair{1u, 1u},
                                   {2u, 1u},
                                   {1u, 3u},
                                   {3u, 3u},
                                   {4u, 3u},
                                   {5u, 7u},
                                   {17u, 33u},
                                   {64u, 48u},
                                   {101u, 37u},
                                   {130u, 71u},
                                   {700u, 3u},
                                   {3u, 700u}}) {
    const std::vector<float> given = noise(rows, cols, 3);
    for (const Mask& mask : masks(cols, rows)) {
      std::vector<uint8_t> known;
      for (const float w : mask.weights) known.push_back(w > 0 ? 1 : 0);
      std::vector<uint32_t> label;
      const Islands islands = find_islands(known, cols, rows, {}, &label);
      const float heaviest = *std::max_element(mask.weights.begin(), mask.weights.end());
      std::vector<float> scaled = mask.weights;
      if (heaviest > 0)
        for (float& w : scaled) w /= heaviest;
      const WeightedFaces faces = weighted_faces(given, scaled, cols, rows);
      const std::vector<float> wanted = direct(faces, label, islands.count);
      const std::vector<double> exact(wanted.begin(), wanted.end());
      const double left_over = unexplained(faces, exact);
      for (const Solve solver : {Solve::Converged, Solve::Exact}) {
        const WeightedHeights got = integrate_weighted(context(), given, mask.weights, rows, cols, solver);
        const IslandMisfit m = misfit_by_island(got.values, exact, mask.weights, cols, rows);
        const std::string scene = std::to_string(cols) + " x " + std::to_string(rows) + ", " + mask.name +
                                  (solver == Solve::Exact ? ", exact" : ", converged");
        std::printf("%-45s worst %.1e misfit %.4f residual %.1e iterations %u\n", scene.c_str(), m.worst,
                    got.statistics.unexplained, got.statistics.residual, got.statistics.iterations);
        EXPECT_EQ(got.islands.count, islands.count) << scene;
        EXPECT_NEAR(got.statistics.unexplained, left_over, 1e-4) << scene;
        EXPECT_TRUE(got.statistics.converged) << scene;
        EXPECT_LT(m.worst, 1e-4) << scene;
      }
    }
  }
}

// The whole stage on the GPU, slopes in and heights out, against double precision on the CPU: rough slopes
// and weights, NaN where the weight is 0.
TEST_F(WeightedSurfaceTest, StageEqualsCpu) {
  std::mt19937 random(17);
  std::normal_distribution<float> normal(0, 1);
  std::uniform_real_distribution<float> uniform(0, 1);
  for (const auto& [cols, rows] : {std::pair{1u, 1u},
                                   {2u, 1u},
                                   {1u, 3u},
                                   {3u, 3u},
                                   {4u, 3u},
                                   {5u, 7u},
                                   {17u, 33u},
                                   {64u, 48u},
                                   {101u, 37u},
                                   {130u, 71u}}) {
    const WeightedSurface surface(context(), cols, rows, 0.5, 30);
    const Grid& grid = surface.grid();
    std::vector<float> gradients(size_t{2} * cols * rows), weights(size_t{cols} * rows);
    for (float& g : gradients) g = normal(random);
    for (float& w : weights) w = uniform(random) < 0.15f ? 0 : 0.2f + 0.8f * uniform(random);
    const auto upload = [&, cols = cols, rows = rows](const auto& value) {
      gpu::DeviceBuffer buffer(context(), "upload", grid.bytes(), gpu::Memory::Upload);
      for (float& to : buffer.as<float>()) to = std::numeric_limits<float>::quiet_NaN();
      for (uint32_t i = 0; i < cols * rows; ++i)
        buffer.as<float>()[i / cols * grid.pitch * 4 + i % cols] = value(i);
      buffer.flush();
      return buffer;
    };
    constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
    const auto p = upload([&](uint32_t i) { return weights[i] > 0 ? gradients[2 * i] : kNaN; });
    const auto q = upload([&](uint32_t i) { return weights[i] > 0 ? gradients[2 * i + 1] : kNaN; });
    const auto w = upload([&](uint32_t i) { return weights[i]; });
    const FloatMap depth(context(), "depth", grid);
    const gpu::DeviceBuffer host(context(), "readback", grid.bytes(), gpu::Memory::Readback);
    const gpu::DeviceBuffer scalars(context(), "scalars", WeightedSurface::scalar_bytes(),
                                    gpu::Memory::Readback);
    gpu::Commands commands(context());
    commands.begin();
    commands.copy(p, surface.slope_x().buffer, p.bytes());
    commands.copy(q, surface.slope_y().buffer, q.bytes());
    commands.copy(w, surface.weights().buffer, w.bytes());
    commands.barrier();
    surface.record(commands, depth, scalars);
    surface.record_fill(commands, depth);
    commands.copy(depth.buffer, host, grid.bytes());
    commands.host_barrier();
    commands.end();
    commands.submit();
    commands.wait();
    host.invalidate();
    const WeightedFaces faces = weighted_faces(gradients, weights, cols, rows);
    const WeightedSolution exact = solve_weighted(faces);
    std::vector<float> got;
    std::vector<double> wanted;
    for (uint32_t i = 0; i < cols * rows; ++i) {
      got.push_back(host.as<const float>()[i / cols * grid.pitch * 4 + i % cols]);
      wanted.push_back(0.5 * exact.z[i]);
      ASSERT_TRUE(std::isfinite(got.back()));
    }
    const std::string scene = std::to_string(cols) + " x " + std::to_string(rows);
    const WeightedStatistics statistics = WeightedSurface::statistics(scalars);
    const IslandMisfit m = misfit_by_island(got, wanted, weights, cols, rows);
    std::printf("stage, %s: worst %.1e, misfit %.4f of %.4f, residual %.1e, iterations %u\n", scene.c_str(),
                m.worst, statistics.unexplained, unexplained(faces, exact.z), statistics.residual,
                statistics.iterations);
    EXPECT_LT(m.worst, 1e-3) << scene;
    EXPECT_NEAR(statistics.unexplained, unexplained(faces, exact.z), 2e-3) << scene;
    EXPECT_LT(statistics.residual, 1e-5) << scene;
  }
}

// Weights that are all the same are no weights.
TEST_F(WeightedSurfaceTest, EqualWeightsEqualTheUnweightedSolver) {
  for (const auto& [cols, rows] : {std::pair{640u, 480u}, {101u, 37u}, {3u, 3u}}) {
    const std::vector<float> given = noise(rows, cols, 5);
    const Heights plain = integrate_gradients(context(), given, rows, cols, Solve::Exact);
    for (const float weight : {1.0f, 1e-30f, 1e30f}) {
      const std::vector<float> weights(size_t{rows} * cols, weight);
      const WeightedHeights got = integrate_weighted(context(), given, weights, rows, cols, Solve::Converged);
      double worst = 0;
      for (size_t i = 0; i < plain.values.size(); ++i)
        worst = std::max(worst, std::abs(double{plain.values[i]} - double{got.values[i]}));
      EXPECT_LT(worst, 1e-5 * plain.statistics.peak_to_valley)
          << cols << " x " << rows << ", weight " << weight;
    }
  }
}

// Slopes of 1e-30 and 1e+30 are slopes like others, and so are mixtures of them under weights.
TEST_F(WeightedSurfaceTest, ScalesOfSlopesDoNotMatter) {
  const uint32_t cols = 130, rows = 71;
  const HeightField field = scenes::gaussian(60, 40, 15, 6);
  const std::vector<double> truth = heights(field, rows, cols);
  const Mask mask = masks(cols, rows)[2];
  for (const float scale : {1e-30f, 1e+30f}) {
    std::vector<float> given = scenes::gradients(field, rows, cols);
    for (float& g : given) g *= scale;
    std::vector<float> got =
        integrate_weighted(context(), given, mask.weights, rows, cols, Solve::Converged).values;
    for (float& z : got) z /= scale;
    EXPECT_LT(misfit_by_island(got, truth, mask.weights, cols, rows).rms, 1e-4) << scale;
  }
}

TEST_F(WeightedSurfaceTest, NothingKnownIsFlat) {
  const uint32_t cols = 33, rows = 21;
  const std::vector<float> given(size_t{2} * rows * cols, std::numeric_limits<float>::infinity());
  const std::vector<float> weights(size_t{rows} * cols, 0.0f);
  for (const Solve solver : {Solve::Live, Solve::Converged, Solve::Exact}) {
    const WeightedHeights got = integrate_weighted(context(), given, weights, rows, cols, solver);
    for (const float z : got.values) EXPECT_EQ(z, 0.0f);
    EXPECT_EQ(got.islands.count, 0u);
    EXPECT_EQ(got.islands.unknown_px, size_t{rows} * cols);
  }
}

// The rim of a ball: samples do not show where between two pixels the slope jumps. Cut there, top to bottom
// comes out right, and smooth fields and noise have nothing to be cut.
TEST_F(WeightedSurfaceTest, KinksAreCut) {
  const uint32_t cols = 640, rows = 480;
  const double side = rows;
  const std::vector<float> ones(size_t{rows} * cols, 1.0f);
  for (const HeightField& field : {scenes::cap(cols * 0.52, rows * 0.48, side * 0.4, side * 0.25),
                                   scenes::gaussian(cols * 0.45, rows * 0.55, side / 10, side / 20),
                                   scenes::gaussian(cols * 0.45, rows * 0.55, 6, 12)}) {
    const bool kink = field.name == "spherical cap";
    const std::vector<float> given = scenes::gradients(field, rows, cols);
    const std::vector<double> truth = heights(field, rows, cols);
    const auto [low, high] = std::minmax_element(truth.begin(), truth.end());
    const double spread = *high - *low;
    for (const Solve solver : {Solve::Converged, Solve::Exact}) {
      if (solver == Solve::Exact && !kink) continue;
      const WeightedHeights plain = integrate_weighted(context(), given, ones, rows, cols, solver);
      const WeightedHeights cut = integrate_weighted(context(), given, ones, rows, cols, solver, true);
      const auto extremes = [&](const WeightedHeights& h) { return std::abs(h.peak_to_valley / spread - 1); };
      const double rms_plain = misfit_by_island(plain.values, truth, ones, cols, rows).rms;
      const double rms_cut = misfit_by_island(cut.values, truth, ones, cols, rows).rms;
      std::printf(
          "%-13s %llu kinks: extremes %.1e -> %.1e, rms %.1e -> %.1e, iterations %u -> %u, residual %.1e\n",
          field.name.c_str(), static_cast<unsigned long long>(cut.kinks), extremes(plain), extremes(cut),
          rms_plain, rms_cut, plain.statistics.iterations, cut.statistics.iterations,
          cut.statistics.residual);
      EXPECT_TRUE(cut.statistics.converged);
      if (kink) {
        EXPECT_GT(extremes(plain), 3e-3);
        EXPECT_LT(extremes(cut), 1e-3);
        EXPECT_LT(rms_cut, 0.5 * rms_plain);
      } else {
        EXPECT_EQ(cut.kinks, 0u);
        EXPECT_EQ(cut.values, plain.values);
      }
    }
  }
  const WeightedHeights rough = integrate_weighted(
      context(), noise(120, 160, 9), std::vector<float>(120 * 160, 1.0f), 120, 160, Solve::Live, true);
  EXPECT_LT(rough.kinks, 20u);
}

// Unknown pixels are filled from around: between the lowest and the highest height of its rim.
TEST_F(WeightedSurfaceTest, UnknownIsFilledSmoothly) {
  const uint32_t cols = 200, rows = 150;
  const HeightField field = scenes::tilt();
  std::vector<float> given = scenes::gradients(field, rows, cols);
  std::vector<float> weights(size_t{rows} * cols, 1.0f);
  const auto inside = [](double x, double y) { return std::hypot(x - 110, y - 70) < 30; };
  for (uint32_t y = 0; y < rows; ++y)
    for (uint32_t x = 0; x < cols; ++x)
      if (inside(x, y)) weights[size_t{y} * cols + x] = 0;
  for (const Solve solver : {Solve::Live, Solve::Converged, Solve::Exact}) {
    const WeightedHeights got = integrate_weighted(context(), given, weights, rows, cols, solver);
    const double offset = double{got.values[0]} - field.height(0, 0);
    const double range = 60 * std::hypot(0.1, 0.05);
    double worst = 0;
    for (uint32_t y = 0; y < rows; ++y)
      for (uint32_t x = 0; x < cols; ++x)
        if (inside(x, y))  // a plane around is a plane within
          worst = std::max(worst,
                           std::abs(double{got.values[size_t{y} * cols + x]} - offset - field.height(x, y)));
    std::printf("fill of a plane: worst %.3f of its range\n", worst / range);
    EXPECT_LT(worst, 0.02 * range);
  }
}

TEST_F(WeightedSurfaceTest, RefusesWhatIsNoWeight) {
  const std::vector<float> given(2 * 12, 0.0f);
  const auto refused = [&](std::vector<float> weights, const std::string& what) {
    try {
      integrate_weighted(context(), given, weights, 3, 4, Solve::Live);
      ADD_FAILURE() << what << " was taken";
    } catch (const Error& error) {
      EXPECT_EQ(error.failure(), Failure::Input);
      EXPECT_NE(std::string(error.what()).find(what), std::string::npos) << error.what();
    }
  };
  refused(std::vector<float>(11, 1.0f), "11");
  std::vector<float> weights(12, 1.0f);
  weights[6] = -1;
  refused(weights, "row 1, column 2");
  weights[6] = std::numeric_limits<float>::quiet_NaN();
  refused(weights, "row 1, column 2");
  weights[6] = 1;
  std::vector<float> broken = given;
  broken[13] = std::numeric_limits<float>::infinity();
  EXPECT_THROW(integrate_weighted(context(), broken, weights, 3, 4, Solve::Live), Error);
}

TEST(IslandsTest, CountsWhatHangsTogether) {
  const std::vector<std::string> picture{"##..#", "..#.#", "###.#", ".....", "#.#.#"};
  std::vector<uint8_t> known;
  for (const std::string& row : picture)
    for (const char c : row) known.push_back(c == '#' ? 1 : 0);
  std::vector<uint32_t> label;
  const Islands found = find_islands(
      known, 5, 5, [](uint32_t x, uint32_t y) { return x == 4 && y < 3; }, &label);
  EXPECT_EQ(found.count, 6u);  // corners do not join
  EXPECT_EQ(found.touched, 1u);
  EXPECT_EQ(found.unknown_px, 13u);
  EXPECT_EQ(label[0], label[1]);
  EXPECT_EQ(label[7], label[10]);
  EXPECT_NE(label[0], label[10]);
  EXPECT_TRUE(found.apart());
}

}  // namespace
}  // namespace palpate
