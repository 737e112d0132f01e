// palpate integrate: from a gradient field to a height map.
#include <spdlog/spdlog.h>

#include <cstdio>

#include "capture/files/npy.h"
#include "capture/files/output_file.h"
#include "capture/run/input.h"
#include "engine/base/json.h"
#include "engine/base/text.h"
#include "engine/gpu/context.h"
#include "engine/stages/surface/surface.h"
#include "engine/stages/surface/weighted_surface.h"
#include "palpate/error.h"
#include "palpate/frame.h"
#include "viz/commands/command.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"
#include "viz/commands/workflow/integrate_lights.h"

namespace palpate {
namespace {

struct Options {
  std::vector<std::filesystem::path> inputs;  ///< gradients, or images with lights
  std::filesystem::path lights, truth;        ///< empty: none
  std::filesystem::path gradients;
  std::filesystem::path weights;  ///< empty: none
  bool kinks = false;
  SurfaceSolver solver = SurfaceSolver::Best;
};

/// Throws where a height map cannot be made of such a shape.
void check_shape(const NpyArray& array, const std::filesystem::path& file) {
  const std::vector<size_t>& shape = array.shape;
  const bool fits = shape.size() == 3 && shape[2] == 2 && shape[0] >= 1 && shape[1] >= 1 &&
                    shape[0] <= kMaxSide_px && shape[1] <= kMaxSide_px;
  if (!fits) {
    throw Error(Failure::Input,
                "gradients of rows x columns x 2 (dz/dx, dz/dy), each side 1 to " +
                    std::to_string(kMaxSide_px) + ", in '" + file.string() + "'",
                describe_shape(shape), "numpy.stack([dz_dx, dz_dy], axis=-1)");
  }
}

NpyArray read_weights(const Options& options, const NpyArray& gradients) {
  if (options.weights.empty())
    return {{gradients.shape[0], gradients.shape[1]},
            std::vector<float>(gradients.shape[0] * gradients.shape[1], 1.0f)};
  NpyArray weights = read_npy(options.weights);
  const std::vector<size_t> wanted{gradients.shape[0], gradients.shape[1]};
  if (weights.shape != wanted) {
    throw Error(Failure::Input,
                "weights of " + describe_shape(wanted) + ", one for each pixel, in '" +
                    options.weights.string() + "'",
                describe_shape(weights.shape), "an array of the gradients' rows and columns");
  }
  return weights;
}

/// `fraction`: of the gradients, that no surface explains.
void warn_of_turning(double fraction) {
  constexpr double kTurning = 0.3;
  if (fraction > kTurning)
    spdlog::warn(
        "{:.0f} % of the gradients belong to no surface: check order (dz/dx, dz/dy), signs and noise",
        100 * fraction);
}

/// The same with a weight for each pixel.
Report integrate_with_weights(const Common& common, const Options& options, const NpyArray& array) {
  const NpyArray weights = read_weights(options, array);
  const auto rows = static_cast<uint32_t>(array.shape[0]), cols = static_cast<uint32_t>(array.shape[1]);
  const std::unique_ptr<gpu::Context> context = open_device(common);
  const double start_s = now_s();
  const WeightedHeights heights =
      integrate_weighted(*context, array.values, weights.values, rows, cols, options.solver, options.kinks);
  const double seconds = now_s() - start_s;
  make_output_folder(common.out);
  const std::filesystem::path file = common.out / "height.npy";
  write_npy(file, heights.values, {rows, cols});
  const WeightedStatistics& statistics = heights.statistics;
  const json::Value value = {{"height", file.string()},
                             {"rows", rows},
                             {"columns", cols},
                             {"solver", to_string(options.solver)},
                             {"solved_by", heights.solve == Solve::Exact ? "host" : "device"},
                             {"device", context->report().name},
                             {"residual", statistics.residual},
                             {"inconsistency", statistics.unexplained},
                             {"iterations", statistics.iterations},
                             {"converged", statistics.converged},
                             {"unknown_px", heights.islands.unknown_px},
                             {"islands", heights.islands.count},
                             {"kinks", heights.kinks},
                             {"peak_to_valley", heights.peak_to_valley},
                             {"seconds", seconds},
                             {"complete", true}};
  const std::string line = palpate::text(
      "%u x %u heights, peak to valley %.6g, relative residual %.2g after %u iterations, inconsistency %.2g, "
      "%llu px unknown, %.3f s\n",
      rows, cols, heights.peak_to_valley, statistics.residual, statistics.iterations, statistics.unexplained,
      static_cast<unsigned long long>(heights.islands.unknown_px), seconds);
  warn_of_turning(statistics.unexplained);
  if (heights.islands.apart()) {
    spdlog::warn("unknown pixels cut the field into {} islands: heights between them are not determined",
                 heights.islands.count);
  }
  if (!statistics.converged && options.solver == SurfaceSolver::Best)
    spdlog::warn("not converged: weights of too many orders of magnitude");
  return {line + ("written: " + file.string()), value, validation_clean(*context) ? 0 : kInternalError};
}

Report integrate(const Common& common, Options options) {
  if (!options.lights.empty()) {
    if (!options.weights.empty() || options.kinks)
      throw Error(Failure::Usage, "gradients for --weights and --kinks", "images under --lights",
                  "palpate integrate without these options");
    return integrate_lights(common, {options.inputs, options.lights, options.truth});
  }
  if (options.inputs.size() != 1 || !options.truth.empty())
    throw Error(
        Failure::Usage, "one array of gradients, or images with --lights FILE",
        options.inputs.size() != 1 ? std::to_string(options.inputs.size()) + " files" : "--truth alone",
        "palpate integrate --help");
  options.gradients = options.inputs.front();
  const NpyArray array = read_npy(options.gradients);
  check_shape(array, options.gradients);
  if (!options.weights.empty() || options.kinks) return integrate_with_weights(common, options, array);
  const auto rows = static_cast<uint32_t>(array.shape[0]), cols = static_cast<uint32_t>(array.shape[1]);
  const std::unique_ptr<gpu::Context> context = open_device(common);
  const double start_s = now_s();
  const Heights heights = integrate_gradients(*context, array.values, rows, cols, options.solver);
  const double seconds = now_s() - start_s;

  make_output_folder(common.out);
  const std::filesystem::path file = common.out / "height.npy";
  write_npy(file, heights.values, {rows, cols});
  const json::Value value = {{"height", file.string()},
                             {"rows", rows},
                             {"columns", cols},
                             {"solver", to_string(options.solver)},
                             {"solved_by", heights.solve == Solve::Exact ? "host" : "device"},
                             {"device", context->report().name},
                             {"residual", heights.statistics.residual},
                             {"inconsistency", heights.statistics.inconsistency},
                             {"peak_to_valley", heights.statistics.peak_to_valley},
                             {"seconds", seconds},
                             {"complete", true}};
  const std::string line =
      text("%u x %u heights, peak to valley %.6g, relative residual %.2g, inconsistency %.2g, %.3f s\n", rows,
           cols, heights.statistics.peak_to_valley, heights.statistics.residual,
           heights.statistics.inconsistency, seconds);
  warn_of_turning(heights.statistics.inconsistency);
  return {line + ("written: " + file.string()), value, validation_clean(*context) ? 0 : kInternalError};
}

}  // namespace

void add_integrate(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command = program.add_subcommand(
      "integrate", "Turn a gradient field (NumPy array), or images under several lights, into a height map");
  auto options = std::make_shared<Options>();
  command
      ->add_option("GRADIENTS", options->inputs,
                   "rows x columns x 2, float32 or float64: dz/dx (right), dz/dy (down), per pixel; with "
                   "--lights the gray images, in the order of the lights")
      ->required();
  command->add_option("--lights", options->lights,
                      "What palpate calibrate lights wrote: heights in mm from images under several lights");
  command->add_option("--truth", options->truth,
                      "With --lights: known heights to compare with, mm (NumPy array or TrueMap file)");
  command->add_option(
      "--weights", options->weights,
      "rows x columns, at least 0: how much each pixel's gradient counts; 0: unknown, and may be NaN");
  command->add_flag("--kinks", options->kinks,
                    "Find places where the slope jumps (the rim of a pressed ball) and keep the heights "
                    "around them from ringing");
  command->add_option("--out", common.out, "Folder for height.npy")->required();
  command
      ->add_option("--solver", options->solver,
                   "best (default), on the device or the processor, or live (one multigrid pass)")
      ->transform(one_of(kSolverNames));
  add_common(*command, common,
             "  palpate integrate slopes.npy --out out/height\n"
             "  palpate integrate slopes.npy --out out/height --solver live --json\n"
             "  palpate integrate image0*.png --lights lights.json --out out/height\n"
             "height.npy is float32, rows x columns, mean 0, in the gradients' unit times one pixel: the "
             "heights whose\n"
             "differences fit the gradients best (least squares, no rim pinned, tilt kept).\n");
  command->runs(chosen, [&common, options] { return integrate(common, *options); });
}

}  // namespace palpate
