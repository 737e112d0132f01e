#include "perf/lab/rivals/traction_study.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <tuple>

#include "capture/synthetic/slope_noise.h"
#include "engine/base/text.h"
#include "engine/elasticity/layer.h"
#include "engine/gpu/commands.h"
#include "engine/numeric/poisson_dct.h"
#include "engine/pad/traction.h"
#include "engine/stages/traction.h"
#include "perf/measure.h"

namespace palpate::perf {
namespace {

constexpr double kYoung_MPa = 0.15;
constexpr double kSlopeSd = 0.02;  // stated

/// A sphere off the middle: each cell's mean depth and mean pressure.
struct Sphere {
  Sphere(const Material& pad, double thickness_mm, const TractionGrid& on, double contact_mm,
         double radius_mm)
      : grid(on), press(Layer(pad, thickness_mm).press_sphere_to_radius(contact_mm, radius_mm)) {
    constexpr int kParts = 6;
    const double at_x = 0.13 * contact_mm, at_y = -0.07 * contact_mm;
    for (uint32_t y = 0; y < grid.height; ++y)
      for (uint32_t x = 0; x < grid.width; ++x) {
        double sum = 0, carried = 0;
        for (int a = 0; a < kParts; ++a)
          for (int b = 0; b < kParts; ++b) {
            const double r = std::hypot((x + (a + 0.5) / kParts - grid.width / 2.0) * grid.cell_mm - at_x,
                                        (y + (b + 0.5) / kParts - grid.height / 2.0) * grid.cell_mm - at_y);
            sum += press.deflection_mm(r);
            carried += press.pressure_MPa(r);
          }
        depth.push_back(static_cast<float>(sum / (kParts * kParts)));
        pressure.push_back(carried / (kParts * kParts));
        const double r = std::hypot((x + 0.5 - grid.width / 2.0) * grid.cell_mm - at_x,
                                    (y + 0.5 - grid.height / 2.0) * grid.cell_mm - at_y);
        contact.push_back(r < contact_mm + 0.7 * grid.cell_mm ? 1 : 0);
      }
  }
  double force_N() const { return press.summary().force_N; }
  double peak_MPa() const { return *std::max_element(pressure.begin(), pressure.end()); }
  double peak_error(std::span<const float> found_MPa) const {
    return double{*std::max_element(found_MPa.begin(), found_MPa.end())} / peak_MPa() - 1;
  }

  TractionGrid grid;
  LayerContact press;
  std::vector<float> depth;
  std::vector<double> pressure;
  std::vector<uint8_t> contact;
};

constexpr Material kPad{kYoung_MPa, 0.485};
constexpr double kThickness_mm = 5.5;
constexpr uint32_t kDeviceIterations = 20;

TractionOptions options_of(double tolerance) {
  TractionOptions options;
  options.slope_sd = 1e-3;
  options.tolerance = tolerance;
  options.errors = false;
  return options;
}

/// `solve` returns force, pressures and iterations of a cold start.
template <typename Solve>
TractionCost cost(const Sphere& sphere, double tolerance, const char* precision, int repetitions,
                  const Solve& solve) {
  TractionCost row{.width = sphere.grid.width, .height = sphere.grid.height, .cell_mm = sphere.grid.cell_mm};
  row.tolerance = tolerance;
  row.precision = precision;
  const auto [force_N, pressure_MPa, iterations] = solve();
  row.iterations = iterations;
  row.force_error = force_N / sphere.force_N() - 1;
  row.peak_error = sphere.peak_error(pressure_MPa);
  double squares = 0, cells = 0;
  for (size_t i = 0; i < sphere.pressure.size(); ++i) {
    if (sphere.contact[i] == 0) continue;
    squares += std::pow(double{pressure_MPa[i]} - sphere.pressure[i], 2);
    ++cells;
  }
  row.pressure_error = std::sqrt(squares / cells) / sphere.peak_MPa();
  std::vector<double> ms;
  for (int i = 0; i < repetitions; ++i) ms.push_back(time_runs([&] { solve(); }, 1).wall_ms);
  row.ms = ms.empty() ? 0 : quartiles(ms).median;
  return row;
}

using Solved = std::tuple<double, std::span<const float>, uint32_t>;

TractionCost processor_cost(const Sphere& sphere, double tolerance, int repetitions) {
  TractionSolver solver({kPad, kThickness_mm}, sphere.grid, options_of(tolerance));
  return cost(sphere, tolerance, "double", repetitions, [&] {
    solver.forget();
    const Traction& found = solver.solve({.depth_mm = sphere.depth, .contact = sphere.contact});
    return Solved{found.wrench.force_N[2], found.pressure_MPa, found.iterations};
  });
}

TractionCost device_cost(gpu::Context& device, const Sphere& sphere, double tolerance, int repetitions) {
  const TractionStage stage(device, {kPad, kThickness_mm}, sphere.grid, options_of(tolerance),
                            kDeviceIterations);
  const TractionStage::Slot slot = stage.slot(device);
  const gpu::DeviceBuffer upload(device, "depths", slot.depth.bytes(), gpu::Memory::Upload);
  gpu::Commands commands(device);
  commands.begin();
  commands.copy(upload, slot.depth, slot.depth.bytes());
  commands.barrier();
  stage.record(commands, slot);
  commands.host_barrier();
  commands.end();
  std::ranges::copy(sphere.depth, upload.as<float>().begin());
  upload.flush();
  stage.write_masks(slot, sphere.contact, {});
  return cost(sphere, tolerance, "single", repetitions, [&] {
    stage.forget(device);
    commands.submit();
    commands.wait();
    const TractionReading found = stage.read(slot);
    return Solved{found.force_N, found.pressure_MPa, found.iterations};
  });
}

}  // namespace

std::vector<TractionCost> traction_costs(int repetitions, gpu::Context* device) {
  constexpr double kContact_mm = 4;
  std::vector<TractionCost> rows;
  for (const uint32_t height : {30u, 60u, 120u}) {
    const Sphere sphere(kPad, kThickness_mm, {height * 4 / 3, height, 15.0 / height}, kContact_mm, 12);
    for (const double tolerance : {1e-1, 1e-2, 1e-3, 1e-4, 1e-6}) {
      rows.push_back(processor_cost(sphere, tolerance, repetitions));
      // Beyond it single precision has nothing to say.
      if (device && tolerance >= 1e-4) rows.push_back(device_cost(*device, sphere, tolerance, repetitions));
    }
  }
  return rows;
}

std::string traction_costs_csv(std::span<const TractionCost> rows) {
  std::string csv =
      "width,height,cell_mm,tolerance,precision,iterations,ms,force_error,peak_error,pressure_error\n";
  for (const TractionCost& r : rows)
    csv += text("%u,%u,%g,%g,%s,%u,%.3g,%.2e,%.2e,%.2e\n", r.width, r.height, r.cell_mm, r.tolerance,
                r.precision, r.iterations, r.ms, r.force_error, r.peak_error, r.pressure_error);
  return csv;
}

std::vector<TractionStability> traction_stability() {
  const TractionGrid grid{56, 48, 0.25};
  std::vector<TractionStability> rows;
  std::mt19937 random(5);
  for (const double poisson : {0.0, 0.3, 0.485, 0.4999, 0.5})
    for (const double thickness_cells : {3.0, 10.0, 22.0, 100.0, 1e4}) {
      const double thickness_mm = thickness_cells * grid.cell_mm;
      const Sphere sphere({kYoung_MPa, poisson}, thickness_mm, grid, 2.5, 8);
      TractionOptions options;
      options.slope_sd = kSlopeSd;
      TractionSolver solver({{kYoung_MPa, poisson}, thickness_mm}, grid, options);
      for (const double noise : {0.0, 0.3, 1.0, 3.0}) {
        TractionStability row{.poisson = poisson, .thickness_cells = thickness_cells, .noise = noise};
        row.trials = noise == 0 ? 1 : 6;
        double sum = 0, squares = 0, peaks = 0;
        for (uint32_t trial = 0; trial < row.trials; ++trial) {
          std::vector<float> depth = sphere.depth;
          if (noise > 0) add_slope_noise(depth, grid, noise * kSlopeSd, random);
          solver.forget();
          const Traction& found = solver.solve({.depth_mm = depth, .contact = sphere.contact});
          const double error = found.wrench.force_N[2] / sphere.force_N() - 1;
          sum += error;
          squares += error * error;
          peaks += std::pow(sphere.peak_error(found.pressure_MPa), 2);
          row.stated_sd += found.wrench.force_sd_N[2] / sphere.force_N() / row.trials;
          row.converged += found.converged ? 1 : 0;
        }
        row.force_error = sum / row.trials;
        row.force_spread = std::sqrt(std::max(0.0, squares / row.trials - std::pow(sum / row.trials, 2)));
        row.peak_error = std::sqrt(peaks / row.trials);
        rows.push_back(row);
      }
    }
  return rows;
}

std::string traction_stability_csv(std::span<const TractionStability> rows) {
  std::string csv =
      "poisson,thickness_cells,noise,force_error,force_spread,stated_sd,peak_error,converged,trials\n";
  for (const TractionStability& r : rows)
    csv += text("%g,%g,%g,%.2e,%.2e,%.2e,%.2e,%u,%u\n", r.poisson, r.thickness_cells, r.noise, r.force_error,
                r.force_spread, r.stated_sd, r.peak_error, r.converged, r.trials);
  return csv;
}

}  // namespace palpate::perf
