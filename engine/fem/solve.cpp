#include "engine/fem/solve.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <mutex>
#include <thread>

#include "engine/base/text.h"
#include "engine/fem/large_strain/extrapolation.h"
#include "engine/fem/large_strain/large_strain.h"
#include "engine/fem/model.h"
#include "palpate/error.h"

namespace palpate::fem {
namespace {

constexpr double kBallForceError = 1e-5;  // relative, of a force that is asked for under a ball
constexpr int kMostPresses = 30;

/// Presses a ball until its force is the one wanted: F goes about with way^1.5.
void press_to_force(ContactModel& model, const Scene& scene, Result& result) {
  const double young = scene.young_Pa * 1e-6 / (1 - scene.poisson * scene.poisson);
  double way = std::pow(0.75 * *scene.force_N / (young * std::sqrt(scene.ball_radius_mm)), 2.0 / 3);
  way = std::min(way, 0.5 * std::min(scene.ball_radius_mm, scene.block_mm[2]));
  double last_way = 0, last_force = 0, power = 1.5;
  for (int i = 0; i < kMostPresses; ++i) {
    model.press(way, result);
    if (!result.converged) return;
    model.measure(1, result);
    if (std::abs(result.force_N / *scene.force_N - 1) < kBallForceError) return;
    if (last_way > 0 && way != last_way)
      power = std::clamp(std::log(result.force_N / last_force) / std::log(way / last_way), 0.8, 6.0);
    last_way = way;
    last_force = result.force_N;
    way *= std::pow(*scene.force_N / result.force_N, 1 / power);
    if (!(way < std::min(scene.ball_radius_mm, scene.block_mm[2])))
      throw Error(Failure::Usage, "a force that this ball can apply without sinking in",
                  "a force that buries it", "a smaller force or a larger ball");
  }
  result.converged = false;
}

constexpr double kNoPull = 1e-3;  // of the peak pressure

void warn(const Scene& scene, bool large_strain, Result& result) {
  std::string line;
  const double strain = result.press_mm / scene.block_mm[2];
  if (strain > 0.1 && !large_strain) {
    line = text(
        "pressed by %.0f %% of the thickness: the model is linear, real tissue stiffens from about "
        "10 %%: large strain",
        100 * strain);
    result.warnings.emplace_back(line);
  }
  if (result.tension_fraction > 0.001) {
    line = text("%.1f %% of the pressed area is under tension, where real contact would lift off",
                100 * result.tension_fraction);
    result.warnings.emplace_back(line);
  }
  if (scene.presser == Presser::Sphere) {
    const double across = 2 * result.contact_radius_mm / result.stress_Pa.pitch_mm[0];
    if (across < 6) {
      line = text("the contact is %.0f cells wide: force and radius are rough; use more cells", across);
      result.warnings.emplace_back(line);
    }
  }
  if (scene.inclusion) {
    const std::array<double, 3> size = scene.inclusion->size();
    for (size_t c = 0; c < 3; ++c) {
      const double across = size[c] / (scene.block_mm[c] / scene.cells[c]);
      if (across >= 6) continue;
      line = text("the inclusion is %.1f cells wide: its effect is off by several percent; use more cells",
                  across);
      result.warnings.emplace_back(line);
      break;
    }
  }
}

/// `error`: receives the error estimate by two grids; null: one grid is used.
Result solve_at_large_strain(const Scene& scene, const Options& options, std::optional<GridError>* error) {
  LargeStrainOptions large;
  if (options.residual != 0) large.residual = std::max(options.residual, 1e-10);
  large.step_mm = options.step_mm;
  large.threads = options.threads;
  large.quarter = options.quarter;
  const std::vector<PressLoad> loads = {{scene.press_mm, scene.force_N}};
  const auto [nx, ny, nz] = scene.cells;
  const bool two_grids = error && nx % 8 == 0 && ny % 8 == 0 && nz % 4 == 0 && nz >= 8;
  const LargeStrainResult pressed =
      two_grids ? solve_extrapolated(scene, loads, large) : solve_large_strain(scene, loads, large);
  Result result;
  result.converged = pressed.converged;
  result.iterations = pressed.iterations;
  result.rounds = pressed.newton_rounds;
  result.wall_s = pressed.wall_s;
  result.bytes = pressed.bytes;
  result.warnings = pressed.warnings;
  result.solver = "processor, large strain in " + std::to_string(pressed.steps) + " steps" +
                  (two_grids ? " of two grids" : "");
  result.press_mm = pressed.last_press_mm;
  result.force_N = pressed.last_force_N;
  if (!pressed.converged) return result;
  const PressedBlock& block = pressed.loads.back();
  result.press_mm = block.press_mm;
  result.force_N = block.force_N;
  if (two_grids)
    error->emplace(GridError{block.force_error_N, block.press_error_mm, block.pressure_error_Pa,
                             pressed.rim_order.empty() ? std::nullopt : std::optional(pressed.rim_order[0])});
  result.residual = block.residual;
  result.stress_Pa = block.pressure_Pa;
  result.deflection_mm = block.deflection_mm;
  const Map& stress = result.stress_Pa;
  result.center_stress_Pa = double{stress.at((stress.width - 1) / 2, (stress.height - 1) / 2)};
  result.core_strain = std::nan("");
  // Beside a smaller plate pressures are zero to within what equilibrium leaves.
  const double peak = static_cast<double>(*std::max_element(stress.values.begin(), stress.values.end()));
  const auto pulls = std::count_if(stress.values.begin(), stress.values.end(),
                                   [&](float p) { return double{p} < -kNoPull * peak; });
  result.tension_fraction = static_cast<double>(pulls) / static_cast<double>(stress.values.size());
  warn(scene, true, result);
  return result;
}

Result solve_either(const Scene& scene, const Options& options, std::optional<GridError>* error) {
  check(scene);
  if (options.residual != 0 && !(options.residual >= 1e-12 && options.residual <= 1e-2))
    throw Error(Failure::Usage, "a relative residual from 1e-12 to 1e-2", std::to_string(options.residual),
                "1e-6");
  const auto start = std::chrono::steady_clock::now();
  if (options.large_strain) return solve_at_large_strain(scene, options, error);
  if (scene.plate_friction > 0)
    throw Error(Failure::Usage, "friction of the plate at large strain", "small strain",
                "--large-strain, or a plate that slides or sticks");
  WorkTeam team(options.threads);
  Result result;
  ContactModel model(scene, options, team);
  if (scene.presser == Presser::Sphere && scene.force_N) {
    press_to_force(model, scene, result);
  } else {
    model.press(scene.press_mm.value_or(0.01 * scene.block_mm[2]), result);
    if (result.converged) {
      model.measure(1, result);
      // Except under a ball, results are proportional to the load.
      const double scale = scene.force_N                        ? *scene.force_N / result.force_N
                           : scene.presser == Presser::Pressure ? *scene.press_mm / result.press_mm
                                                                : 1;
      if (scale != 1) model.measure(scale, result);
    }
  }
  if (result.converged) warn(scene, options.large_strain, result);
  result.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace

Result solve(const Scene& scene, const Options& options) {
  return solve_either(scene, options, nullptr);
}

Result solve(const Scene& scene, const Options& options, std::optional<GridError>& error) {
  error.reset();
  return solve_either(scene, options, &error);
}

std::vector<Result> solve(const std::vector<Scene>& scenes, const Options& options,
                          const std::function<void(size_t)>& done) {
  for (const Scene& scene : scenes) check(scene);
  Options each = options;
  each.threads = 1;
  if (each.worker == Worker::Auto) each.worker = Worker::Processor;
  std::vector<Result> results(scenes.size());
  std::atomic<size_t> next = 0, ready = 0;
  std::mutex guard;
  std::exception_ptr failure;
  const auto serve = [&] {
    for (size_t i = next++; i < scenes.size(); i = next++) {
      try {
        results[i] = solve(scenes[i], each);
      } catch (...) {
        const std::lock_guard lock(guard);
        if (!failure) failure = std::current_exception();
        next = scenes.size();
        return;
      }
      if (done) done(++ready);
    }
  };
  const size_t count =
      options.threads != 0 ? options.threads : std::max(1u, std::thread::hardware_concurrency());
  std::vector<std::thread> threads;
  for (size_t t = 1; t < std::min(count, scenes.size()); ++t) threads.emplace_back(serve);
  serve();
  for (std::thread& thread : threads) thread.join();
  if (failure) std::rethrow_exception(failure);
  return results;
}

}  // namespace palpate::fem
