// palpate-lab evaluate change: changes between two days on pairs of blocks with known truth.

#include "capture/files/output_file.h"
#include "palpate/error.h"
#include "perf/lab/commands/evaluate/evaluate.h"
#include "perf/lab/study/days/change_evaluation.h"
#include "perf/lab/study/days/day_extremes.h"
#include "perf/lab/training/examples.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"

namespace palpate {
namespace {

struct Options {
  std::string first, second;
  lump::ChangeJob job;
  judge::CellOptions cells;
  bool input_errors = false, extremes = false;
};

/// Both sets under each extreme; intervals cover what those of palpate lump compare do.
Report run_extremes(const Common& common, const std::vector<lump::Example>& first,
                    const std::vector<lump::Example>& second, lump::ChangeJob job) {
  const auto extremes = lump::day_extremes(job.sensor);
  const bool grown = second.front().size_mm > 1.02 * first.front().size_mm;
  std::vector<lump::ExtremeRow> rows;
  {
    ProgressBar bar(common, "pairs", first.size() * job.repeats * extremes.size());
    job.progress = [&](size_t done) {
      bar.update(done);
      return !interrupted();
    };
    rows = judge_extremes(first, second, extremes, grown, job);
  }
  if (rows.empty()) return interrupted_report("interrupted");
  Report report(extremes_text(rows), extremes_json(rows));
  if (!common.out.empty()) {
    make_output_folder(common.out);
    write_whole(common.out / "day_extremes.csv", std::string_view(extremes_csv(rows)));
    report.text += "wrote " + (common.out / "day_extremes.csv").string() + "\n";
  }
  return report;
}

Report run(const Common& common, const Options& o) {
  const auto first = lump::lump_examples(lump::read_lump_file(o.first)),
             second = lump::lump_examples(lump::read_lump_file(o.second));
  if (first.empty() || first.size() != second.size())
    throw Error(Failure::Input, "two days of the same lumps",
                std::to_string(first.size()) + " and " + std::to_string(second.size()) + " blocks",
                "palpate-lab dataset of one --seed and --count, the second with --grown");
  lump::ChangeJob job = o.job;
  job.seed = common.seed;
  if (o.input_errors || o.extremes) job.sources = lump::ErrorSources{};
  if (o.extremes) return run_extremes(common, first, second, job);
  const size_t wanted = first.size() * job.repeats;
  ProgressBar bar(common, "pairs", wanted);
  job.progress = [&](size_t done) {
    bar.update(done);
    return !interrupted();
  };
  const std::vector<lump::JudgedChange> judged = judge_changes(first, second, job);
  if (judged.empty()) return interrupted_report("interrupted");
  Report report = judged_report(common, lump::cases_of(judged), o.cells, "change", judged.size(), wanted);
  report.text = changes_text(judged) + "\nby cell:\n" + report.text;
  report.json["changes"] = changes_json(judged);
  return report;
}

}  // namespace

void add_evaluate_change(CommandLine& group, Common& common, Command& chosen) {
  CommandLine* command =
      group.add_subcommand("change", "How good the change between two days is, on pairs of known blocks");
  auto o = std::make_shared<Options>();
  command->add_option("FIRST", o->first, "Data set of the first day, palpate-lab dataset")->required();
  command->add_option("SECOND", o->second, "The same lumps later: another press, --grown, --stiffened")
      ->required();
  o->job.sensor.window_mm = {36, 28};
  command->add_setting("--noise", o->job.sensor.noise_fraction, Check::range(0.0, 1.0),
                       "Noise of each node, as a fraction of the highest load's peak pressure");
  command->add_setting("--place-mm", o->job.place_mm, Check::range(0.0, 10.0),
                       "Most that the second day's window lies aside of where it is told, along x and y");
  command->add_setting("--place-sd-mm", o->job.place_sd_mm, Check::range(0.0, 10.0),
                       "Standard error of a window's place that is told");
  command->add_option("--window-mm", o->job.sensor.window_mm, "What the camera sees (default 36 28)");
  command->add_setting("--repeats", o->job.repeats, Check::range(1, 1000),
                       "Readings of each pair, each with new noise and places");
  command->add_flag(
      "--input-errors", o->input_errors,
      "Intervals cover errors of modulus, thickness, pitch, light and place as those of palpate "
      "lump compare do");
  command->add_flag("--extremes", o->extremes,
                    "Days that differ in more than the lump: another pad, a turned map, another calibration, "
                    "another modulus told; with --input-errors");
  command->add_setting("--threads", o->job.threads, Check::range(1, 256), "Threads");
  o->cells.by = {"size_mm", "depth_mm", "ratio"};
  add_cell_options(*command, o->cells, "size_mm, depth_mm, ratio, growth, shape");
  command->add_option("--out", common.out,
                      "Folder for change.csv, .json, plots and change_cases.csv, or day_extremes.csv");
  add_common(*command, common,
             "  palpate-lab dataset first.h5 --count 40 --size-mm 8 12 --depth-mm 2 8 --floor-mm 2\n"
             "  palpate-lab dataset grown.h5 --count 40 --size-mm 8 12 --depth-mm 2 8 --floor-mm 2 \\\n"
             "      --grown 0.1\n"
             "  palpate-lab evaluate change first.h5 grown.h5 --out out/change\n");
  command->runs(chosen, [o, &common] { return run(common, *o); });
}

}  // namespace palpate
