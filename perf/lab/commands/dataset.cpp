// palpate-lab dataset: presses of many lumps at large strain in one HDF5 file.
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cstdio>
#include <map>
#include <set>

#include "engine/base/json.h"
#include "palpate/error.h"
#include "palpate/version.h"
#include "perf/lab/commands/commands.h"
#include "perf/lab/dataset/dataset_report.h"
#include "perf/lab/dataset/dataset_run.h"
#include "viz/commands/support/forward_options.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"

namespace palpate {
namespace {

struct Options {
  lump::DatasetJob job;
  std::string file, cells, coarser_cells;
  std::vector<double> size_mm, depth_mm, stiffness_ratio, thickness_mm, young_Pa, greatest_press, block_mm,
      skin_mm, skin_ratio;
  std::vector<uint32_t> nodes;
  std::vector<std::string> shapes;
  bool linear = false;  // diameter and depth
};

/// One number stands for a range without width.
void set(lump::Range& range, const std::vector<double>& given) {
  if (!given.empty()) range = {given.front(), given.back()};
}

lump::Sweep sweep_of(const Common& common, const Options& o) {
  lump::Sweep sweep = o.job.sweep;
  sweep.seed = common.seed;
  sweep.logarithmic = !o.linear;
  set(sweep.size_mm, o.size_mm);
  set(sweep.depth_mm, o.depth_mm);
  set(sweep.stiffness_ratio, o.stiffness_ratio);
  set(sweep.thickness_mm, o.thickness_mm);
  set(sweep.young_Pa, o.young_Pa);
  set(sweep.greatest_press, o.greatest_press);
  set(sweep.skin_mm, o.skin_mm);
  set(sweep.skin_ratio, o.skin_ratio);
  if (!o.block_mm.empty()) sweep.block_mm = {o.block_mm.front(), o.block_mm.back()};
  if (!o.cells.empty()) sweep.cells = parse_cells("--cells", o.cells, "32x32x16");
  if (o.coarser_cells == "0")
    sweep.coarser_cells = {0, 0, 0};
  else if (!o.coarser_cells.empty())
    sweep.coarser_cells = parse_cells("--coarser-cells", o.coarser_cells, "32x32x16");
  if (!o.nodes.empty()) sweep.nodes = {o.nodes.front(), o.nodes.back()};
  if (!o.shapes.empty()) {
    // In the order of InclusionShape and each once: the order in which they were typed makes no other
    // sweep.
    std::set<InclusionShape> shapes;
    for (const std::string& name : o.shapes) {
      bool known = false;
      for (const InclusionShape shape : lump::Sweep().shapes)
        if (name == to_string(shape)) known = shapes.insert(shape).second || true;
      if (!known)
        throw Error(Failure::Usage, "--shapes of sphere, ellipsoid, cylinder, lying", "'" + name + "'",
                    "--shapes sphere,lying");
    }
    sweep.shapes.assign(shapes.begin(), shapes.end());
  }
  return sweep;
}

/// One line that is drawn over itself on a terminal, a line now and then elsewhere.
class ProgressLine {
 public:
  explicit ProgressLine(const Common& common) : quiet_(common.quiet), terminal_(isatty(STDERR_FILENO) != 0) {}
  ~ProgressLine() {
    if (drawn_ && terminal_) std::fputs("\r\x1b[K", stderr);
  }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  void show(const lump::DatasetProgress& progress) {
    const double every_s = terminal_ ? 0.5 : 30;
    if (quiet_ || progress.wall_s < next_s_) return;
    next_s_ = progress.wall_s + every_s;
    const std::string line = progress_text(progress);
    if (terminal_) {
      std::fprintf(stderr, "\r\x1b[K%s", line.c_str());
      std::fflush(stderr);
    } else {
      spdlog::info("{}", line);
    }
    drawn_ = true;
  }

 private:
  bool quiet_, terminal_, drawn_ = false;
  double next_s_ = 0;
};

Report dataset_command(const Common& common, Options& o) {
  const lump::Processes processes;
  // One of several processes writes messages.
  if (processes.rank() != 0) spdlog::set_level(spdlog::level::off);
  lump::DatasetJob job = o.job;
  job.file = o.file;
  job.program = std::string("palpate ") + PALPATE_VERSION_TEXT;
  job.presser = lump::press_lump;
  job.stop = interrupted;
  ProgressLine line(common);
  job.progress = [&](const lump::DatasetProgress& progress) { line.show(progress); };
  // Errors of the command line are found by every process, printed by the first only, and end them all.
  try {
    job.sweep = sweep_of(common, o);
  } catch (const Error&) {
    if (processes.rank() == 0) throw;
    return {};
  }
  const lump::DatasetReport made = make_lump_dataset(job, processes);
  if (!made.leads) return {};
  const int code = made.complete || job.assemble_only ? 0 : kInterrupted;
  return {dataset_text(job, made), dataset_json(job, made), code};
}

}  // namespace

void add_dataset(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command = program.add_subcommand(
      "dataset", "Press an even sweep of lumps at large strain; maps and truth in one HDF5 file");
  auto o = std::make_shared<Options>();
  lump::Sweep& sweep = o->job.sweep;
  o->job.count = 1000;
  command->add_option("FILE", o->file, "The data set, *.h5. While it is made: FILE.part")->required();
  command->add_option("--count", o->job.count, "Cases")->capture_default_str();
  command->add_option("--first", o->job.first, "Number of the first case in the sweep")
      ->capture_default_str();
  const auto range = [&](const char* name, std::vector<double>& to, const char* words) {
    command->add_option(name, to, words)->expected(1, 2);
  };
  range("--size-mm", o->size_mm, "Smallest and largest diameter, mm (default 4 14)");
  range("--depth-mm", o->depth_mm, "From the surface to the lump's top (default 1.5 10)");
  range("--stiffness-ratio", o->stiffness_ratio,
        "Lump's modulus over the tissue's, even in its logarithm (default 1.3 40)");
  command->add_flag("--linear", o->linear,
                    "Diameter and depth even in mm, not in their logarithms: fewer small and shallow lumps");
  range("--thickness-mm", o->thickness_mm, "Of the tissue (default 16 24)");
  range("--young-Pa", o->young_Pa, "Of the tissue, even in its logarithm (default 2000 30000)");
  range("--greatest-press", o->greatest_press,
        "Press at the last load over the thickness (default 0.1 0.22)");
  command
      ->add_option("--offset-mm", sweep.offset_mm, "Of the lump's centre, most, to either side in x and y.")
      ->capture_default_str();
  command
      ->add_option("--centred-share", sweep.centred_fraction,
                   "Fraction of the lumps that lie in the middle, solved as a quarter")
      ->capture_default_str();
  range("--block-mm", o->block_mm, "Length and width of the tissue (default 40 40)");
  command->add_option("--poisson", sweep.poisson, "Poisson's ratio, 0 to 0.4999")->capture_default_str();
  command->add_option("--floor-mm", sweep.floor_mm, "Least tissue below a lump, mm")->capture_default_str();
  command->add_option("--rim-mm", sweep.rim_mm, "Least tissue around a lump, mm")->capture_default_str();
  command
      ->add_option("--grown", sweep.grown,
                   "Another day of the same lumps: share by which each diameter is more, about its centre")
      ->option_text("NUM [0]");
  command->add_option("--stiffened", sweep.stiffened, "The same of each stiffness ratio")
      ->option_text("NUM [0]");
  command->add_option("--shapes", o->shapes, "Of sphere, ellipsoid, cylinder (upright), lying (default: all)")
      ->delimiter(',');
  range("--skin-mm", o->skin_mm,
        "Thickness of a skin, part of the tissue's, lumps lie below (default: none)");
  range("--skin-ratio", o->skin_ratio, "Its modulus over the tissue's, even in its logarithm (default 1)");
  command
      ->add_option("--plate-friction", sweep.plate_friction,
                   "Coefficient with which the tissue slides along the plate (default 0)")
      ->option_text("NUM");
  command->add_flag("--plate-sticks", sweep.plate_sticks, "The plate holds the tissue sideways");
  command
      ->add_option("--second-lump", sweep.second_gap_mm,
                   "Beside each lump a second one, at least so many mm of tissue between them")
      ->option_text("MM");
  command->add_option("--no-lump-share", sweep.no_lump_fraction,
                      "Fraction of the cases without a lump (default 1/12)");
  command->add_option("--loads", sweep.loads, "Equal steps of the press at which maps are kept")
      ->capture_default_str();
  command->add_option("--cells", o->cells, "Cells of the tissue along x, y, z (default 48x48x24)")
      ->option_text("AxBxC");
  command->add_option("--coarser-cells", o->coarser_cells,
                      "Cells of a second grid of the same proportions, from which and the first the limit of "
                      "no size is taken (default 24x24x12); 0: none. Where both are multiples of a grid "
                      "of 12 cells or more, their cells follow the lump's surface");
  command->add_option("--nodes", o->nodes, "Of the maps along x and y, whatever the cells (default 33 33)")
      ->expected(1, 2);
  command->add_option("--residual", sweep.residual, "Forces out of balance over all forces to stop at")
      ->capture_default_str();
  command->add_option("--step-mm", sweep.step_mm, "Largest step of the press, mm")->capture_default_str();
  command->add_setting("--threads", o->job.threads, Check::range(0, 256),
                       "Of each process, a case each; 0: one per core, under mpirun 1");
  command->add_flag("--assemble", o->job.assemble_only,
                    "Solve nothing: write FILE from the cases that are done");
  add_common(
      *command, common,
      "  palpate-lab dataset train.h5 --count 2000\n"
      "  palpate-lab dataset held_out.h5 --count 200 --seed 2 --cells 72x72x36 --coarser-cells 36x36x18\n"
      "  mpirun -n 8 palpate-lab dataset train.h5 --count 2000\n"
      "  mpirun --host one:16,two:16 palpate-lab dataset train.h5 --count 20000\n"
      "  palpate-lab info train.h5\n"
      "The same command goes on after a kill, and with a larger --count after its end. The file has the\n"
      "same bytes whatever the number of processes and threads. Only the first process uses the disk.\n");
  command->runs(chosen, [o, &common] { return dataset_command(common, *o); });
}

void add_info(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command =
      program.add_subcommand("info", "Contents of a data set of lumps, finished or unfinished");
  auto file = std::make_shared<std::string>();
  command->add_option("FILE", *file, "*.h5")->required();
  add_common(*command, common, "  palpate-lab info train.h5\n");
  command->runs(chosen, [file] { return Report(lump::dataset_info(*file)); });
}

}  // namespace palpate
