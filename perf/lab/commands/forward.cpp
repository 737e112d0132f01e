// palpate-lab forward: stress and deflection at the surface of tissue with a lump (engine/fem/README.md).
#include "perf/lab/forward/forward.h"
#include "engine/base/text.h"
#include "engine/fem/solve.h"

#include <algorithm>
#include <charconv>
#include <map>
#include <mutex>

#include "engine/base/json.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "perf/lab/commands/commands.h"
#include "viz/commands/support/forward_options.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"

namespace palpate {
namespace {

struct Options {
  fem::Scene scene;
  fem::Options solver;
  fem::Inclusion lump;
  bool no_inclusion = false;
  std::vector<double> size_mm;
  std::vector<double> block_mm;
  std::vector<double> offset_mm, plate_mm;
  std::vector<std::string> pad;
  std::string cells;
  double press_mm = 0, force_N = 0, skin_mm = 0, skin_ratio = 1;
  std::string sensor;

  std::mutex opening;
  std::unique_ptr<gpu::Context> context;  ///< none before the solver wants it
};

/// THICKNESS_MM:MODULUS_PA
fem::PadSheet parse_sheet(const std::string& text) {
  fem::PadSheet sheet;
  const char* end = text.data() + text.size();
  const auto [colon, error] = std::from_chars(text.data(), end, sheet.thickness_mm);
  if (error != std::errc() || colon == end || *colon != ':' ||
      std::from_chars(colon + 1, end, sheet.young_Pa).ptr != end)
    throw Error(Failure::Usage, "--pad THICKNESS_MM:MODULUS_PA", "'" + text + "'", "--pad 2:34000");
  return sheet;
}

fem::Scene scene_of(const Options& options) {
  fem::Scene scene = options.scene;
  scene.inclusion.reset();
  if (!options.no_inclusion) {
    fem::Inclusion lump = options.lump;
    if (options.size_mm.size() == 1)
      lump.size_mm.fill(options.size_mm[0]);
    else if (options.size_mm.size() == 3)
      std::copy_n(options.size_mm.begin(), 3, lump.size_mm.begin());
    else if (!options.size_mm.empty())
      throw Error(Failure::Usage, "one size or three", std::to_string(options.size_mm.size()), "--size-mm 8");
    std::copy_n(options.offset_mm.begin(), options.offset_mm.size(), lump.offset_mm.begin());
    scene.inclusion = lump;
  }
  std::copy_n(options.block_mm.begin(), options.block_mm.size(), scene.block_mm.begin());
  if (options.plate_mm.size() == 2) scene.plate_half_mm = {options.plate_mm[0] / 2, options.plate_mm[1] / 2};
  if (options.skin_mm != 0)
    scene.skin = fem::Skin{options.skin_mm, options.skin_ratio};
  else if (options.skin_ratio != 1)
    throw Error(Failure::Usage, "a skin's thickness with --skin-ratio", "none", "--skin-mm 2");
  for (const std::string& sheet : options.pad) scene.pad.push_back(parse_sheet(sheet));
  if (!options.cells.empty()) scene.cells = parse_cells("--cells", options.cells, "64x64x32");
  if (options.force_N != 0) {
    scene.force_N = options.force_N;
    scene.press_mm.reset();
  }
  if (options.press_mm != 0) scene.press_mm = options.press_mm;
  return scene;
}

/// Exit code of an answer that did not come about: no input is to blame, and no number is to be used.
constexpr int kNotConverged = kInternalError;

/// The solver opens the device when it wants it, from any of its threads.
void offer_device(const Common& common, Options& options) {
  options.solver.device = [&common, &options] {
    const std::lock_guard lock(options.opening);
    if (!options.context) options.context = open_device(common);
    return options.context.get();
  };
}

Report one_scene(const Common& common, const Options& options) {
  const fem::Scene scene = scene_of(options);
  std::optional<Sensor> sensor;
  if (!options.sensor.empty()) sensor = load_sensor(options.sensor);
  if (sensor && !has_scale(*sensor))
    throw Error(Failure::Sensor, "a sensor with a scale in " + options.sensor, "\"pitch_mm_per_px\": null",
                "palpate calibrate scale");
  std::optional<fem::GridError> grid_error;
  ForwardOutcome outcome = describe(scene, fem::solve(scene, options.solver, grid_error));
  outcome.grid_error = grid_error;
  json::Value value = to_json(outcome);
  std::string text = to_text(outcome);
  if (!outcome.result.converged) return {text, value, kNotConverged};
  const TactileImage image = tactile_image(outcome.result.stress_Pa, sensor ? &*sensor : nullptr);
  value["tactile_image"] = {{"sensor", image.source},
                            {"width_px", image.width},
                            {"height_px", image.height},
                            {"pitch_mm_per_px", image.pitch_mm_per_px},
                            {"brightest_change_gray", image.brightest_change},
                            {"clipped_px", image.clipped_px}};
  const std::string line = palpate::text(
      "tactile image   %u x %u px, brightest change %.3g gray of 255%s (%s)\n", image.width, image.height,
      image.brightest_change, image.brightest_change < 1 ? ": below one step" : "", image.source.c_str());
  text += line;
  if (image.clipped_px > 0)
    text += "warning         " + std::to_string(image.clipped_px) + " px of the tactile image are clipped\n";
  if (!common.out.empty()) text += "written: " + write_files(outcome, image, common.out) + "\n";
  return {text, value};
}

Report sweep_command(const Common& common, const Options& options) {
  std::unique_ptr<ProgressBar> bar;
  std::mutex guard;
  const std::vector<SweepRow> rows =
      sweep(scene_of(options), options.solver, [&](uint64_t done, uint64_t total) {
        const std::lock_guard lock(guard);
        if (!bar) bar = std::make_unique<ProgressBar>(common, "solving", total);
        bar->update(done);
      });
  bar.reset();
  std::string text = sweep_text(rows);
  if (!common.out.empty()) text += "written: " + write_sweep(rows, common.out) + "\n";
  const bool all =
      std::all_of(rows.begin(), rows.end(), [](const SweepRow& row) { return row.outcome.result.converged; });
  return {text, sweep_json(rows), all ? 0 : kNotConverged};
}

Report convergence_command(const Common& common, const Options& options) {
  const ConvergenceTables tables = converge(scene_of(options), options.solver);
  std::string text = convergence_text(tables);
  if (!common.out.empty()) text += "written: " + write_convergence(tables, common.out) + "\n";
  return {text, convergence_json(tables)};
}

void add_tissue_options(CommandLine& command, Options& o) {
  command
      .add_option("--block-mm", o.block_mm, "Length, width and thickness of the tissue (default 40 40 20)")
      ->expected(3);
  command.add_option("--young-Pa", o.scene.young_Pa, "Young's modulus of the tissue")->capture_default_str();
  command.add_option("--poisson", o.scene.poisson, "Poisson's ratio, 0 to 0.4999")->capture_default_str();
  command.add_option("--skin-mm", o.skin_mm, "Thickness of a skin, part of the tissue's (default: none)")
      ->check(Check::positive());
  command.add_option("--skin-ratio", o.skin_ratio, "The skin's modulus over the tissue's (default 1)")
      ->check(Check::positive());
  command.add_flag("--bottom-slides", o.scene.bottom_slides,
                   "The tissue slides on its base without friction");
}

void add_inclusion_options(CommandLine& command, Options& o) {
  command.add_flag("--no-inclusion", o.no_inclusion, "Tissue alone");
  command
      .add_option("--shape", o.lump.shape, "sphere, ellipsoid, cylinder (upright), lying (cylinder along x)")
      ->transform(one_of(lump_shapes()))
      ->default_str("sphere");
  command
      .add_option("--size-mm", o.size_mm, "Diameter of the inclusion, or its sizes along x, y, z (default 8)")
      ->expected(1, 3);
  command.add_option("--depth-mm", o.lump.depth_mm, "From the surface to the inclusion's top")
      ->capture_default_str();
  command.add_option("--stiffness-ratio", o.lump.stiffness_ratio, "Inclusion's modulus over the tissue's")
      ->capture_default_str();
  command.add_option("--offset-mm", o.offset_mm, "Inclusion's centre from the block's middle, x y")
      ->expected(2);
}

void add_press_options(CommandLine& command, Options& o) {
  static const std::map<std::string, fem::Presser> kPresserNames = {
      {"flat", fem::Presser::Flat}, {"ball", fem::Presser::Sphere}, {"pressure", fem::Presser::Pressure}};
  command
      .add_option("--pad", o.pad,
                  "A sheet of the sensor's pad, THICKNESS_MM:MODULUS_PA, from the tissue outwards; again for "
                  "each. Bonded to each other and to the plate that presses")
      ->take_all();
  command.add_flag("--pad-slides", o.scene.pad_slides,
                   "On the tissue, without friction (default: bonded to it)");
  command.add_option("--presser", o.scene.presser, "flat (rigid plate), ball, pressure (even)")
      ->transform(one_of(kPresserNames))
      ->default_str("flat");
  command
      .add_option("--plate-mm", o.plate_mm,
                  "Length and width of a flat plate in the middle of the surface (default: all of it)")
      ->expected(2);
  command.add_flag("--plate-sticks", o.scene.plate_sticks,
                   "The flat plate holds the tissue sideways (default: it slides without friction)");
  command.add_option("--plate-friction", o.scene.plate_friction,
                     "Coefficient with which the flat plate slides, 0 to 2, of --large-strain (default 0)");
  command.add_option("--ball-radius-mm", o.scene.ball_radius_mm, "Of --presser ball");
  CommandOption* way = command.add_option("--press-mm", o.press_mm, "Travel of the presser, mm (default 1)")
                           ->check(Check::positive());
  command.add_option("--force-N", o.force_N, "Force of the presser, N, instead of its travel")
      ->check(Check::positive())
      ->excludes(way);
}

void add_solver_options(CommandLine& command, Options& o) {
  static const std::map<std::string, fem::Worker> kWorkerNames = {
      {"processor", fem::Worker::Processor}, {"device", fem::Worker::Device}, {"auto", fem::Worker::Auto}};
  o.solver.worker = fem::Worker::Auto;
  CommandOption* large = command.add_flag(
      "--large-strain", o.solver.large_strain,
      "Neo-Hookean tissue pressed in steps: beyond 10 % of the thickness the only one "
      "that holds (flat presser, bonded pad); on two grids, with the error estimated by both");
  command.add_setting("--step-mm", o.solver.step_mm, Check::positive(), "Of --large-strain, at most")
      ->needs(large);
  command.add_option("--cells", o.cells, "Cells of the tissue along x, y, z (default 64x64x32)")
      ->option_text("AxBxC");
  command.add_option("--residual", o.solver.residual,
                     "Relative residual to stop at (default 1e-6; 1e-8 above a Poisson's ratio of 0.497)");
  command.add_option("--most-iterations", o.solver.most_iterations, "Of the solver, before it gives up")
      ->capture_default_str();
  command
      .add_option("--solver", o.solver.worker,
                  "processor, device (Vulkan, in double precision), or auto: on large grids a trial of both, "
                  "else the processor")
      ->transform(one_of(kWorkerNames))
      ->default_str("auto");
  command.add_setting("--threads", o.solver.threads, Check::range(0, 256), "Threads; 0: one per core");
}

}  // namespace

void add_forward(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command = program.add_subcommand(
      "forward", "Press a finite-element model of tissue with a lump by a plate, a ball or an even pressure");
  auto o = std::make_shared<Options>();
  add_tissue_options(*command, *o);
  add_inclusion_options(*command, *o);
  add_press_options(*command, *o);
  add_solver_options(*command, *o);
  command->add_option("--sensor", o->sensor,
                      "Sensor file whose picture is wanted (default: the built-in sensor's)");
  command->add_option("--out", common.out, "Folder for maps, profile, tactile image and plots");
  add_common(*command, common,
             "  palpate-lab forward --out out/lump\n"
             "  palpate-lab forward --size-mm 12 --force-N 2 --large-strain --json\n"
             "  palpate-lab forward --shape ellipsoid --size-mm 10 10 5 --depth-mm 3 --stiffness-ratio 25\n"
             "  palpate-lab forward --pad 2:34000 --pad 2:80000 --pad 2:140000\n"
             "  palpate-lab forward sweep --cells 48x48x24 --out out/sweep\n"
             "  palpate-lab forward convergence --out out/convergence\n"
             "Linear elasticity unless --large-strain; an answer that did not converge is not shown\n"
             "(exit code 1).\n");
  CommandLine* sweeping =
      command->add_subcommand("sweep", "Vary each of the six inputs (d, h, E_r, shape, t, l) by itself")
          ->fallthrough();
  sweeping->footer(
      "Examples:\n"
      "  palpate-lab forward sweep --cells 48x48x24 --out out/sweep\n"
      "Its options are those of palpate-lab forward; exit codes too.\n");
  CommandLine* converging =
      command
          ->add_subcommand("convergence",
                           "Error against grid and run time; iterations over the model's range")
          ->fallthrough();
  converging->footer(
      "Examples:\n"
      "  palpate-lab forward convergence --out out/convergence\n"
      "Its options are those of palpate-lab forward; exit codes too.\n");
  command->require_subcommand(0, 1);
  command->callback([o, sweeping, converging, &common, &chosen] {
    chosen = [o, &common, swept = sweeping->parsed(), tables = converging->parsed()] {
      offer_device(common, *o);
      Report report = swept    ? sweep_command(common, *o)
                      : tables ? convergence_command(common, *o)
                               : one_scene(common, *o);
      if (o->context && !validation_clean(*o->context)) report.exit_code = kInternalError;
      return report;
    };
  });
}

}  // namespace palpate
