// The traction stage: pressure of the GPU is that of the processor's solver, on surfaces of exact contacts
// and on others that no contact makes.
#include "engine/stages/traction.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <random>

#include "engine/elasticity/layer.h"
#include "engine/gpu/commands.h"
#include "engine/pad/layer_convolution.h"
#include "palpate/error.h"
#include "tests/support/gpu_fixture.h"
#include "tests/support/pressed_surface.h"
#include "tests/support/thorough.h"

namespace palpate {
namespace {

constexpr Material kGel{0.15, 0.485};

/// A surface that is pressed at places, with what is known of it.
struct Scene : PressedSurface {
  explicit Scene(const TractionGrid& on, const Material& of = kGel, double thick_mm = 5.5, double sd = 0.03)
      : PressedSurface(on), pad{of, thick_mm}, slope_sd(sd), known(depth.size(), 1) {}
  TractionInput input() const { return {.depth_mm = depth, .contact = contact, .known = known}; }

  TractionOptions options(double tolerance = 1e-3) const {
    TractionOptions options;
    options.slope_sd = slope_sd;
    options.tolerance = tolerance;
    options.errors = false;
    return options;
  }
  TractionSolver solver(double tolerance = 1e-3) const { return {pad, grid, options(tolerance)}; }

  Pad pad;
  double slope_sd;
  std::vector<uint8_t> known;
};

/// The gradient that a pressure leaves, relative to that of none: in double precision, by plain sums.
double residual_of(const Scene& scene, std::span<const float> pressure) {
  const uint32_t w = scene.grid.width, h = scene.grid.height;
  const size_t n = scene.depth.size();
  const LayerKernel kernel(scene.pad, scene.grid.cell_mm);
  LayerConvolution layer(kernel, w, h, false);
  const auto normal = [&](const std::vector<double>& map) {
    std::vector<double> out(n), answer;
    for (size_t i = 0; i < n; ++i)
      for (const auto& [has, other] : {std::pair{i % w + 1 < w, i + 1}, std::pair{i / w + 1 < h, i + w}}) {
        if (!has || scene.known[i] == 0 || scene.known[other] == 0) continue;
        out[i] += (map[i] - map[other]) / std::pow(scene.grid.cell_mm, 2);
        out[other] -= (map[i] - map[other]) / std::pow(scene.grid.cell_mm, 2);
      }
    layer.depth_by_pressure(out, answer);
    return answer;
  };
  std::vector<double> depth(n), p(pressure.begin(), pressure.end()), by_pressure;
  for (size_t i = 0; i < n; ++i) depth[i] = scene.known[i] != 0 ? double{scene.depth[i]} : 0;
  layer.depth_by_pressure(p, by_pressure);
  const double prior = std::pow(scene.slope_sd * 2 / effective_modulus_MPa(scene.pad.material), 2);
  const std::vector<double> right = normal(depth), image = normal(by_pressure);
  double left = 0, goal = 0;
  for (size_t i = 0; i < n; ++i) {
    if (scene.contact[i] == 0) continue;
    const double gradient = right[i] - image[i] - prior * p[i];
    goal += right[i] * right[i];
    if (p[i] > 0 || gradient > 0) left += gradient * gradient;
  }
  return goal > 0 ? std::sqrt(left / goal) : 0;
}

class TractionStageTest : public GpuTest {
 protected:
  /// A stage with one slot, recorded once.
  struct Run {
    Run(gpu::Context& in, const Scene& like, uint32_t iterations, double tolerance = 1e-3,
        const TractionStage::Blocks* blocks = nullptr)
        : stage(in, like.pad, like.grid, like.options(tolerance), iterations,
                blocks ? *blocks : TractionStage::blocks_for(in)),
          slot(stage.slot(in)),
          upload(in, "depths", slot.depth.bytes(), gpu::Memory::Upload),
          commands(in) {
      commands.begin();
      commands.copy(upload, slot.depth, slot.depth.bytes());
      commands.barrier();
      stage.record(commands, slot);
      commands.host_barrier();
      commands.end();
    }
    TractionReading operator()(const Scene& scene) {
      std::ranges::copy(scene.depth, upload.as<float>().begin());
      upload.flush();
      stage.write_masks(slot, scene.contact, scene.known);
      commands.submit();
      commands.wait();
      return stage.read(slot);
    }
    TractionStage stage;
    TractionStage::Slot slot;
    gpu::DeviceBuffer upload;
    gpu::Commands commands;
  };

  /// Both solvers go far below the tolerances that they are compared with; what is left is what single
  /// precision makes of sums of some thousand products, 1e-5 of the right side, and the problem of it.
  void compare(const Scene& scene, const TractionReading& found, TractionSolver&& solver,
               double force_part = 1e-3, double peak_part = 1e-2, double slope_part = 1e-3) {
    const Traction& wanted = solver.solve(scene.input());
    const double peak = double{*std::ranges::max_element(wanted.pressure_MPa)};
    const double force = wanted.wrench.force_N[2];
    EXPECT_TRUE(found.converged) << found.residual;
    EXPECT_NEAR(found.force_N, force, force_part * force);
    const double side = scene.grid.cell_mm * std::max(scene.grid.width, scene.grid.height);
    EXPECT_NEAR(found.mx_Nmm, wanted.wrench.moment_Nmm[0], force_part * force * side);
    EXPECT_NEAR(found.my_Nmm, wanted.wrench.moment_Nmm[1], force_part * force * side);
    EXPECT_NEAR(found.slope_rms, wanted.slope_rms, slope_part * wanted.slope_rms + 1e-5);
    double worst = 0;
    for (size_t i = 0; i < wanted.pressure_MPa.size(); ++i) {
      worst = std::max(worst, std::abs(double{found.pressure_MPa[i]} - double{wanted.pressure_MPa[i]}));
      if (scene.contact[i] == 0) {
        EXPECT_EQ(found.pressure_MPa[i], 0);
      }
    }
    EXPECT_LE(worst, peak_part * peak);
    EXPECT_NEAR(found.residual, residual_of(scene, found.pressure_MPa), 1e-2 * found.residual + 2e-5);
    std::printf("  %u x %u: %.5f N (%.5f), pressure within %.1e of the peak, %u iterations (%u), %.1e\n",
                scene.grid.width, scene.grid.height, found.force_N, force, peak > 0 ? worst / peak : 0,
                found.iterations, wanted.iterations, found.residual);
  }
};

TEST_F(TractionStageTest, SpheresOnLayers) {
  for (const double thickness : {1.5, 5.5, 40.0}) {
    Scene scene({80, 60, 0.25}, kGel, thickness);
    scene.add(Layer(kGel, thickness).press_sphere(1, 8), 1.1, -0.6);
    for (float& depth : scene.depth) depth += 2.5f;
    Run run(context(), scene, 100);
    compare(scene, run(scene), scene.solver());
  }
}

TEST_F(TractionStageTest, TwoContacts) {
  const Layer layer(kGel, 5.5);
  Scene scene({91, 63, 0.22});
  scene.add(layer.press_sphere(1.5, 8), -5, 2);
  scene.add(layer.press_flat(0.4, 1.1), 6, -3);
  Run run(context(), scene, 200, 1e-4);
  compare(scene, run(scene), scene.solver(1e-4));
}

TEST_F(TractionStageTest, ContactAtTheBorderIsSaid) {
  Scene scene({60, 50, 0.4});
  scene.add(Layer(kGel, 5.5).press_sphere(2, 8), 11.5, 0);
  Run run(context(), scene, 100);
  const TractionReading found = run(scene);
  EXPECT_TRUE(found.at_border);
  compare(scene, found, scene.solver());
  Scene inside({60, 50, 0.4});
  inside.add(Layer(kGel, 5.5).press_sphere(2, 8), 0, 0);
  EXPECT_FALSE(run(inside).at_border);
}

// Surfaces that no contact makes, where any cell may be pressed or unknown: bumps and noise. Solved further,
// since two pressures that leave 1e-3 need not be alike.
TEST_F(TractionStageTest, RandomSurfacesAndMasks) {
  std::mt19937 random(5);
  std::normal_distribution<float> normal;
  std::uniform_real_distribution<double> uniform;
  for (const auto& [width, height] :
       {std::pair{2u, 2u}, std::pair{2u, 9u}, std::pair{7u, 2u}, std::pair{8u, 8u}, std::pair{33u, 17u},
        std::pair{57u, 64u}, std::pair{81u, 61u}, std::pair{130u, 41u}})
    for (const double present : {1.0, 0.7, 0.1}) {
      Scene scene({width, height, 0.3}, {0.15, 0.45}, 4);
      const double side = 0.3 * std::min(width, height);
      for (int bump = 0; bump < 5; ++bump) {
        const double x0 = (uniform(random) - 0.5) * side, y0 = (uniform(random) - 0.5) * side;
        const double r = (0.05 + 0.3 * uniform(random)) * side, deep = normal(random);
        for (size_t i = 0; i < scene.depth.size(); ++i)
          scene.depth[i] += static_cast<float>(
              0.2 * r * deep *
              std::exp(-std::pow(std::hypot(scene.x_of(i) - x0, scene.y_of(i) - y0) / r, 2)));
      }
      for (size_t i = 0; i < scene.depth.size(); ++i) {
        scene.depth[i] += 0.01f * normal(random);
        scene.contact[i] = uniform(random) < present ? 1 : 0;
        scene.known[i] = uniform(random) < 0.85 ? 1 : 0;
        if (scene.known[i] == 0) scene.depth[i] = std::numeric_limits<float>::quiet_NaN();
      }
      Run run(context(), scene, 300, 2e-5);
      compare(scene, run(scene), scene.solver(2e-5));
    }
}

// Known cells whose depth is no number count as if they were not known.
TEST_F(TractionStageTest, DepthsThatAreNoNumbersAreNotKnown) {
  Scene scene({64, 48, 0.3});
  scene.add(Layer(kGel, 5.5).press_sphere(2, 8), 0, 0);
  Scene told = scene;
  Run run(context(), scene, 60);
  for (size_t i = 0; i < scene.depth.size(); i += 13) {
    told.known[i] = 0;
    scene.depth[i] = std::numeric_limits<float>::infinity() * (i % 2 == 0 ? 1.0f : -1.0f);
    if (i % 3 == 0) scene.depth[i] = std::numeric_limits<float>::quiet_NaN();
    if (i % 5 == 0) scene.depth[i] = 1e30f;
  }
  compare(told, run(scene), told.solver());
}

TEST_F(TractionStageTest, NothingFromNothing) {
  Scene scene({40, 30, 0.5});
  Run run(context(), scene, 12);
  const auto none = [&](const TractionReading& found) {
    EXPECT_TRUE(found.converged);
    EXPECT_EQ(found.iterations, 0u);
    EXPECT_EQ(found.force_N, 0);
    EXPECT_EQ(found.residual, 0);
    EXPECT_FALSE(found.at_border);
    for (const float p : found.pressure_MPa) ASSERT_EQ(p, 0);
  };
  // Flat.
  std::ranges::fill(scene.depth, 2.5f);
  std::ranges::fill(scene.contact, 1);
  TractionReading found = run(scene);
  none(found);
  EXPECT_EQ(found.slope_rms, 0);
  // Nothing touches, after a frame in which something did.
  Scene pressed({40, 30, 0.5});
  pressed.add(Layer(kGel, 5.5).press_sphere(2, 8), 0, 0);
  EXPECT_GT(run(pressed).force_N, 1);
  std::mt19937 random(3);
  std::normal_distribution<float> normal;
  for (float& value : scene.depth) value += 0.01f * normal(random);
  std::ranges::fill(scene.contact, 0);
  found = run(scene);
  none(found);
  EXPECT_NEAR(found.slope_rms, scene.solver().solve(scene.input()).slope_rms, 1e-4 * found.slope_rms);
  // Nothing known.
  std::ranges::fill(scene.contact, 1);
  std::ranges::fill(scene.known, 0);
  none(run(scene));
}

// A frame begins where the last one ended, whichever slot that had, and comes to the same.
TEST_F(TractionStageTest, FollowsFrames) {
  const Layer layer(kGel, 5.5);
  Scene like({60, 50, 0.4});
  Run run(context(), like, TractionStage::kIterations);
  TractionStage::Slot other = run.stage.slot(context());
  gpu::Commands commands(context());
  commands.begin();
  commands.copy(run.upload, other.depth, other.depth.bytes());
  commands.barrier();
  run.stage.record(commands, other);
  commands.host_barrier();
  commands.end();
  uint32_t first = 0, later = 0;
  for (int frame = 0; frame < 8; ++frame) {
    Scene scene({60, 50, 0.4});
    scene.add(layer.press_sphere(1 + 0.1 * frame, 8), 0.05 * frame, 0);
    TractionReading found;
    if (frame % 2 == 0) {
      found = run(scene);
    } else {
      std::ranges::copy(scene.depth, run.upload.as<float>().begin());
      run.upload.flush();
      run.stage.write_masks(other, scene.contact, scene.known);
      commands.submit();
      commands.wait();
      found = run.stage.read(other);
    }
    // From another start to the same tolerance: as far apart as that lets them be.
    compare(scene, found, scene.solver(1e-4), 3e-3, 2e-2, 0.1);
    (frame == 0 ? first : later) += found.iterations;
  }
  EXPECT_LE(later, 7 * first);
  Scene again({60, 50, 0.4});
  again.add(layer.press_sphere(1.7, 8), 0.35, 0);
  EXPECT_EQ(run(again).iterations, 0u);
  run.stage.forget(context());
  EXPECT_GT(run(again).iterations, 1u);
}

// A converged solution stays as it is, however many iterations were recorded; one that is not says so.
TEST_F(TractionStageTest, ConvergedIsLeftAlone) {
  Scene scene({80, 60, 0.25});
  scene.add(Layer(kGel, 5.5).press_sphere(1, 8), 1.1, -0.6);
  Run few(context(), scene, 10), many(context(), scene, 40), one(context(), scene, 1);
  const TractionReading a = few(scene), b = many(scene), c = one(scene);
  EXPECT_TRUE(a.converged);
  EXPECT_EQ(a.iterations, b.iterations);
  EXPECT_EQ(a.residual, b.residual);
  EXPECT_TRUE(std::ranges::equal(a.pressure_MPa, b.pressure_MPa));
  EXPECT_FALSE(c.converged);
  EXPECT_EQ(c.iterations, 1u);
  EXPECT_GT(c.residual, 1e-3);
  EXPECT_NEAR(c.residual, residual_of(scene, c.pressure_MPa), 1e-3 * c.residual);
}

// As a graphics card's work is cut, and others.
TEST_F(TractionStageTest, BlocksDoNotMatter) {
  Scene scene({77, 59, 0.25});
  scene.add(Layer(kGel, 5.5).press_sphere(1, 8), -2.1, 3.6);
  for (size_t i = 0; i < scene.known.size(); i += 17) scene.known[i] = 0;
  for (const TractionStage::Blocks& blocks :
       {TractionStage::Blocks{64, 128, 1, 2}, {32, 64, 2, 1}, {8, 8, 4, 8}, {128, 128, 8, 4}}) {
    Run run(context(), scene, 60, 1e-4, &blocks);
    compare(scene, run(scene), scene.solver(1e-4));
  }
}

// From no Poisson's ratio to incompressible, from less than a cell to a half space, from exact slopes to bad
// ones, soft and hard: what is found is what the processor finds, and the residual is true.
TEST_F(TractionStageTest, LayersAndErrors) {
  std::mt19937 random(9);
  std::normal_distribution<float> normal;
  for (const double poisson : {0.0, 0.3, 0.485, 0.5})
    for (const double thickness : {0.5, 3.0, 40.0})
      for (const double slope_sd : part_of<double>({1e-3, 1e-2, 1e-1}, 2)) {
        const Material layer{poisson < 0.2 ? 200.0 : 0.02, poisson};
        Scene scene({50, 44, 0.3}, layer, thickness, slope_sd);
        const Layer pad(layer, thickness);
        scene.add(pad.press_sphere(5 * layer.young_MPa, 12), 0.6, -0.4);
        for (float& depth : scene.depth) depth += 0.1f * static_cast<float>(slope_sd) * normal(random);
        Run run(context(), scene, 60);
        std::printf("nu %.3f, %.1f mm, sd %.3f:", poisson, thickness, slope_sd);
        compare(scene, run(scene), scene.solver(), 1e-3, 1e-2);
      }
}

TEST_F(TractionStageTest, RefusesWhatIsNoProblem) {
  const TractionGrid grid{20, 10, 0.5};
  EXPECT_THROW(TractionStage(context(), {kGel, 5.5}, {1, 10, 0.5}, {}), Error);
  EXPECT_THROW(TractionStage(context(), {kGel, -1}, grid, {}), Error);
  EXPECT_THROW(TractionStage(context(), {kGel, 5.5}, grid, {}, 0), Error);
  EXPECT_THROW(TractionStage(context(), {kGel, 5.5}, grid, {.slope_sd = 0}), Error);
  const TractionStage stage(context(), {kGel, 5.5}, grid, {});
  const TractionStage::Slot slot = stage.slot(context());
  const std::vector<uint8_t> wrong(199);
  EXPECT_THROW(stage.write_masks(slot, wrong, {}), Error);
  EXPECT_THROW(stage.write_masks(slot, {}, wrong), Error);
}

}  // namespace
}  // namespace palpate
