// The traction stage: pressure of the GPU is that of the processor's solver, on surfaces of exact contacts
// and on others that no contact makes.
#include "engine/stages/traction.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <random>

#include "engine/elasticity/layer.h"
#include "engine/elasticity/layer_convolution.h"
#include "engine/gpu/commands.h"
#include "palpate/error.h"
#include "tests/support/gpu_fixture.h"

namespace palpate {
namespace {

constexpr Material kGel{0.15, 0.485};

/// A surface that is pressed at places, with what is known of it.
struct Scene {
  explicit Scene(const TractionGrid& on, const Material& of = kGel, double thick_mm = 5.5, double sd = 0.03)
      : grid(on),
        layer(of),
        thickness_mm(thick_mm),
        slope_sd(sd),
        depth(size_t{on.width} * on.height),
        contact(depth.size()),
        known(depth.size(), 1) {}
  void add(const LayerContact& press, double at_x, double at_y) {
    constexpr int kParts = 4;
    for (size_t i = 0; i < depth.size(); ++i) {
      const double x = x_of(i) - at_x, y = y_of(i) - at_y;
      double sum = 0;
      for (int a = 0; a < kParts; ++a)
        for (int b = 0; b < kParts; ++b)
          sum += press.deflection_mm(std::hypot(x + ((a + 0.5) / kParts - 0.5) * grid.cell_mm,
                                                y + ((b + 0.5) / kParts - 0.5) * grid.cell_mm));
      depth[i] += static_cast<float>(sum / (kParts * kParts));
      if (std::hypot(x, y) < press.summary().radius_mm + 0.7 * grid.cell_mm) contact[i] = 1;
    }
  }
  double x_of(size_t i) const {
    return (static_cast<double>(i % grid.width) + 0.5 - grid.width / 2.0) * grid.cell_mm;
  }
  double y_of(size_t i) const {
    return (static_cast<double>(i / grid.width) + 0.5 - grid.height / 2.0) * grid.cell_mm;
  }
  TractionInput input() const { return {.depth_mm = depth, .contact = contact, .known = known}; }

  TractionOptions options(double tolerance = 1e-3) const {
    TractionOptions options;
    options.slope_sd = slope_sd;
    options.tolerance = tolerance;
    options.errors = false;
    return options;
  }
  TractionSolver solver(double tolerance = 1e-3) const {
    return {layer, thickness_mm, grid, options(tolerance)};
  }

  TractionGrid grid;
  Material layer;
  double thickness_mm, slope_sd;
  std::vector<float> depth;
  std::vector<uint8_t> contact, known;
};

/// The gradient that a pressure leaves, relative to that of none: in double precision, by plain sums.
double residual_of(const Scene& scene, std::span<const float> pressure) {
  const uint32_t w = scene.grid.width, h = scene.grid.height;
  const size_t n = scene.depth.size();
  const LayerKernel kernel(scene.layer, scene.thickness_mm, scene.grid.cell_mm);
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
  const double prior = std::pow(scene.slope_sd * 2 / effective_modulus_MPa(scene.layer), 2);
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
    Run(gpu::Context& in, const Scene& like, uint32_t iterations, double tolerance = 1e-3)
        : stage(in, like.layer, like.thickness_mm, like.grid, like.options(tolerance), iterations),
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
               double force_part = 1e-3, double peak_part = 1e-2) {
    const Traction& wanted = solver.solve(scene.input());
    const double peak = double{*std::ranges::max_element(wanted.pressure_MPa)};
    const double force = wanted.wrench.force_N[2];
    EXPECT_TRUE(found.converged) << found.residual;
    EXPECT_NEAR(found.force_N, force, force_part * force);
    const double side = scene.grid.cell_mm * std::max(scene.grid.width, scene.grid.height);
    EXPECT_NEAR(found.moment_x_Nmm, wanted.wrench.moment_Nmm[0], force_part * force * side);
    EXPECT_NEAR(found.moment_y_Nmm, wanted.wrench.moment_Nmm[1], force_part * force * side);
    EXPECT_NEAR(found.slope_rms, wanted.slope_rms, 1e-3 * wanted.slope_rms + 1e-5);
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

TEST_F(TractionStageTest, TimeOfAFrame) {
  for (const uint32_t iterations : {4u, 8u, 12u, 16u}) {
    Scene scene({80, 60, 0.25});
    scene.add(Layer(kGel, 5.5).press_sphere(1, 8), 1.1, -0.6);
    Run run(context(), scene, iterations, 1e-9);
    TractionOptions options = scene.options(1e-9);
    options.most_iterations = iterations;
    TractionSolver solver(kGel, 5.5, scene.grid, options);
    std::vector<double> gpu, cpu;
    for (int i = 0; i < 21; ++i) {
      run.stage.forget(context());
      solver.forget();
      const auto t0 = std::chrono::steady_clock::now();
      run(scene);
      const auto t1 = std::chrono::steady_clock::now();
      solver.solve(scene.input());
      const auto t2 = std::chrono::steady_clock::now();
      gpu.push_back(std::chrono::duration<double, std::milli>(t1 - t0).count());
      cpu.push_back(std::chrono::duration<double, std::milli>(t2 - t1).count());
    }
    std::ranges::sort(gpu);
    std::ranges::sort(cpu);
    std::printf("%2u iterations: GPU %.2f ms (best %.2f), processor %.2f ms (best %.2f)\n", iterations,
                gpu[10], gpu[0], cpu[10], cpu[0]);
  }
}

}  // namespace
}  // namespace palpate
