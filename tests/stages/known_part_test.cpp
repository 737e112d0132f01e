// Surfaces of a part of the frame that is the same in every frame: the plain solver with sources on the
// part's edge equals double precision on the CPU, which knows nothing of the rest.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "engine/gpu/commands.h"
#include "engine/gpu/tuning.h"
#include "engine/numeric/islands.h"
#include "engine/numeric/weighted_poisson.h"
#include "engine/stages/surface/surface.h"
#include "tests/support/gpu_fixture.h"

namespace palpate {
namespace {

struct KnownShape {
  const char* name;
  std::function<bool(double x, double y)> known;
};

class KnownPartTest : public GpuTest {
 protected:
  /// Heights of a right side, height x width, by the plain solver; of a part where `known` is not empty.
  std::vector<float> solve(uint32_t width, uint32_t height, Solve solver, const std::vector<double>& right,
                           const std::vector<uint8_t>& known) {
    Surface surface(context(), width, height, solver, load_tuning(context()).tuning);
    if (!known.empty()) {
      EXPECT_TRUE(surface.set_known(context(), known));
    }
    const bool cells = surface.right_sides() == RightSides::Cells;
    const FloatMap& to = cells ? surface.coarse_right_side() : surface.right_side();
    const uint32_t side = cells ? 2 : 1;
    const Grid finest = surface.grid(), grid = cells ? coarser(finest) : finest;
    gpu::DeviceBuffer upload(context(), "right side", grid.bytes(), gpu::Memory::Upload),
        download(context(), "heights", finest.bytes(), gpu::Memory::Readback);
    std::ranges::fill(upload.as<float>(), 0.0f);
    for (uint32_t y = 0; y < height; ++y)
      for (uint32_t x = 0; x < width; ++x)
        upload.as<float>()[size_t{y / side} * grid.pitch * 4 + x / side] +=
            static_cast<float>(right[size_t{y} * width + x]);
    upload.flush();
    const FloatMap depth(context(), "depth", finest);
    gpu::Commands commands(context());
    commands.begin();
    commands.copy(upload, to.buffer, grid.bytes());
    commands.barrier();
    if (!cells) surface.record_coarse_right_side(commands);
    surface.record(commands, depth);
    commands.copy(depth.buffer, download, finest.bytes());
    commands.host_barrier();
    commands.end();
    commands.submit();
    commands.wait();
    download.invalidate();
    std::vector<float> z;
    for (uint32_t y = 0; y < height; ++y)
      for (uint32_t x = 0; x < width; ++x)
        z.push_back(download.as<const float>()[size_t{y} * finest.pitch * 4 + x]);
    return z;
  }
};

/// RMS where something is known, each island about its mean, relative to that of the exact heights.
double apart(const std::vector<float>& got, const std::vector<double>& exact,
             const std::vector<uint32_t>& label, uint32_t islands) {
  std::vector<double> offset(islands + 1), mean(islands + 1), count(islands + 1);
  for (size_t i = 0; i < exact.size(); ++i) {
    offset[label[i]] += double{got[i]} - exact[i];
    mean[label[i]] += exact[i];
    count[label[i]] += 1;
  }
  double wrong = 0, whole = 0;
  for (size_t i = 0; i < exact.size(); ++i) {
    if (label[i] == 0) continue;
    wrong += std::pow(double{got[i]} - exact[i] - offset[label[i]] / count[label[i]], 2);
    whole += std::pow(exact[i] - mean[label[i]] / count[label[i]], 2);
  }
  return std::sqrt(wrong / whole);
}

// A bump that the part's edge cuts, and slopes with noise, which no surface explains.
TEST_F(KnownPartTest, EqualsDoublePrecisionOfThePartAlone) {
  std::mt19937 random(9);
  std::normal_distribution<double> normal(0, 0.02);
  for (const auto& [width, height] : {std::pair{320u, 240u}, {379u, 277u}, {160u, 333u}}) {
    const double w = width, h = height, side = std::min(w, h);
    const std::vector<KnownShape> masks{
        {"round pad", [=](double x, double y) { return std::hypot(x - w / 2, y - h / 2) < 0.45 * side; }},
        {"specks",
         [=](double x, double y) {
           return std::hypot(x - 0.4 * w, y - 0.5 * h) > 4 && std::hypot(x - 0.7 * w, y - 0.3 * h) > 2;
         }},
        {"all", [](double, double) { return true; }}};
    std::vector<float> gradients;
    for (uint32_t y = 0; y < height; ++y)
      for (uint32_t x = 0; x < width; ++x) {
        const double u = (x - 0.3 * w) / (0.15 * side), v = (y - 0.45 * h) / (0.15 * side);
        const double bump = -2 / (0.15 * side) * 0.1 * side * std::exp(-u * u - v * v);
        gradients.push_back(static_cast<float>(bump * u + normal(random)));
        gradients.push_back(static_cast<float>(bump * v + normal(random)));
      }
    for (const KnownShape& mask : masks) {
      std::vector<uint8_t> known;
      for (uint32_t y = 0; y < height; ++y)
        for (uint32_t x = 0; x < width; ++x) known.push_back(mask.known(x, y) ? 1 : 0);
      const std::vector<float> weights(known.begin(), known.end());
      const WeightedFaces faces = weighted_faces(gradients, weights, width, height);
      const std::vector<double> exact = solve_weighted(faces).z, right = right_side(faces);
      std::vector<uint32_t> label;
      const uint32_t islands = find_islands(known, width, height, {}, &label).count;
      for (const Solve solver : {Solve::Live, Solve::Converged}) {
        const bool live = solver == Solve::Live;
        const double with = apart(solve(width, height, solver, right, known), exact, label, islands);
        const double without = apart(solve(width, height, solver, right, {}), exact, label, islands);
        std::printf("%u x %u %-12s %-9s %.1e of the exact solve, %.1e without sources\n", width, height,
                    mask.name, live ? "live" : "converged", with, without);
        EXPECT_LT(with, live ? 1.2e-2 : 1e-3) << mask.name;
        EXPECT_LE(with, without) << mask.name;
      }
    }
  }
}

// Known pixels in several parts, or with too long an edge, are refused.
TEST_F(KnownPartTest, SaysWhatItCannotSolve) {
  Surface surface(context(), 320, 240, Solve::Live, load_tuning(context()).tuning);
  std::vector<uint8_t> known(320 * 240, 1);
  EXPECT_TRUE(surface.set_known(context(), known));
  EXPECT_FALSE(surface.solves_known_part());  // all of it
  known[160 + 120 * 320] = 0;
  EXPECT_TRUE(surface.set_known(context(), known));
  EXPECT_TRUE(surface.solves_known_part());
  for (uint32_t y = 0; y < 240; ++y) known[y * 320 + 100] = known[y * 320 + 101] = 0;
  EXPECT_FALSE(surface.set_known(context(), known));
  EXPECT_FALSE(surface.solves_known_part());
  for (size_t i = 0; i < known.size(); ++i) known[i] = i % 7 != 0;
  EXPECT_FALSE(surface.set_known(context(), known));
}

}  // namespace
}  // namespace palpate
