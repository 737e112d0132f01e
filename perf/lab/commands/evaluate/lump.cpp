// palpate-lab evaluate lump: errors of lump estimates on blocks with known truth.
#include <map>
#include <optional>

#include "capture/files/output_file.h"
#include "engine/base/json.h"
#include "engine/base/normal.h"
#include "palpate/error.h"
#include "perf/lab/commands/commands.h"
#include "perf/lab/commands/evaluate/evaluate.h"
#include "perf/lab/judge/coverage_plot.h"
#include "perf/lab/judge/report.h"
#include "perf/lab/study/evaluation.h"
#include "perf/lab/study/evaluation_cells.h"
#include "perf/lab/study/evaluation_table.h"
#include "perf/lab/study/input_faults.h"
#include "perf/lab/study/lump_evaluation_plot.h"
#include "perf/lab/study/presses/hand_evaluation.h"
#include "perf/lab/study/presses/next_press_evaluation.h"
#include "perf/lab/study/skin_evaluation.h"
#include "perf/lab/training/examples.h"
#include "viz/commands/support/lump_method.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"
#include "viz/commands/support/relaxation_options.h"

namespace palpate {
namespace {

struct Options {
  std::vector<std::string> files;
  std::string network, method = "refined";
  std::optional<lump::ScoreOver> over;
  lump::EvaluationJob job;
  judge::CellOptions cells;
  RelaxationOptions relaxation;
  uint32_t count = 0;
  bool faults = false, by_hand = false, next_press = false, by_skin = false;
};

/// With --out the table goes there too.
Report with_table(const Common& common, Report report, const char* name, const std::string& csv) {
  if (common.out.empty()) return report;
  make_output_folder(common.out);
  write_whole(common.out / name, std::string_view(csv));
  report.text += "wrote " + (common.out / name).string() + "\n";
  return report;
}

/// The same readings by cell of what varies, with the score.
void add_cells(const Common& common, const Options& o, const std::vector<lump::Judged>& judged,
               Report& report) {
  const judge::Cases cases = lump::cases_of(judged);
  judge::CellOptions options = o.cells;
  options.seed = common.seed;
  const judge::Judgement judgement = judge::judge_cells(cases, options);
  report.json["cells"] = judge::judgement_json(judgement);
  report.text += "\nby cell:\n" + judge::judgement_summary(judgement);
  if (!common.out.empty())
    report.text += "wrote " + write_judgement(judgement, cases, common.out, "coverage") + "\n";
}

Report run(const Common& common, Options& o) {
  lump::ErrorSources sources = lump::ErrorSources::none();
  if (o.job.press_sd_mm > 0 && o.job.modulus_error != 0) sources.young = lump::ErrorSources{}.young;
  sources.thickness = kNormal90 * o.job.thickness_sd;
  o.job.estimator =
      lump::named_estimator(o.method, lump::load_network(o.network), sources, {.stop = interrupted});
  std::vector<lump::Example> examples;
  for (const std::string& file : o.files) {
    std::vector<lump::Example> more = lump::read_examples(file);
    if (o.count > 0 && o.count < more.size()) more.resize(o.count);
    examples.insert(examples.end(), std::make_move_iterator(more.begin()),
                    std::make_move_iterator(more.end()));
  }
  o.job.seed = common.seed;
  o.job.relaxation = relaxation_of(o.relaxation);
  const size_t observations = count_judged(examples.size(), o.job);
  if (observations == 0)
    throw Error(Failure::Usage, "a first block below " + std::to_string(examples.size()),
                "--first " + std::to_string(o.job.first), "--first 0");
  ProgressBar bar(common, "readings",
                  observations * (o.faults ? lump::fault_count()
                                  : o.over ? rows_of(*o.over)
                                           : 1));
  o.job.progress = [&](size_t done) {
    bar.update(done);
    return !interrupted();
  };
  Report nothing = interrupted_report("interrupted");
  if (o.by_hand) {
    const std::vector<lump::HandRow> rows = lump::judge_by_hand(examples, o.job, o.method);
    if (interrupted()) return nothing;
    return with_table(common, {hand_text(rows), hand_json(rows)}, "lump_by_hand.csv", hand_csv(rows));
  }
  if (o.next_press) {
    const lump::NextPressScore score = score_next_press(judge_next_press(examples, o.job, o.method));
    if (interrupted()) return nothing;
    return with_table(common, {next_press_text(score), next_press_json(score)}, "lump_next_press.csv",
                      next_press_csv(score));
  }
  if (o.over || o.faults) {
    try {
      if (o.faults) {
        const std::vector<lump::FaultRow> rows = lump::fault_rows(examples, o.job);
        return with_table(common, {faults_text(rows), faults_json(rows)}, "lump_faults.csv",
                          faults_csv(rows));
      }
      const std::vector<lump::ScoreRow> rows = scores_over(*o.over, examples, o.job);
      return with_table(common, {rows_text(rows), rows_json(rows)}, "lump_rows.csv", rows_csv(rows));
    } catch (const Stopped&) {
      return nothing;
    }
  }
  const std::vector<lump::Judged> judged = judge_lumps(examples, o.job);
  if (judged.empty()) return nothing;
  if (o.by_skin) {
    if (interrupted()) return nothing;
    const std::vector<lump::SkinRow> rows = lump::skin_rows(judged);
    return with_table(common, {skin_text(rows), skin_json(rows)}, "lump_by_skin.csv", skin_csv(rows));
  }
  const bool complete = judged.size() == observations;
  const lump::Score score = score_of(judged);
  json::Value json = score_json(score, o.method, o.job);
  json["complete"] = complete;
  Report report{score_text(score), std::move(json)};
  if (score.lumps > 0) add_cells(common, o, judged, report);
  if (!complete) {
    report.text = "interrupted after " + std::to_string(judged.size()) + " of " +
                  std::to_string(observations) + " readings: of those\n" + report.text;
    report.exit_code = kInterrupted;
  }
  if (!common.out.empty()) report.text += "wrote " + write_score(score, judged, common.out.string()) + "\n";
  return report;
}

}  // namespace

void add_evaluate_lump(CommandLine& group, Common& common, Command& chosen) {
  CommandLine* command = group.add_subcommand(
      "lump", "How good estimates are, on a known data set seen through a synthetic sensor");
  auto o = std::make_shared<Options>();
  static const std::map<std::string, lump::ScoreOver> kOver = {{"noise", lump::ScoreOver::Noise},
                                                               {"exposure", lump::ScoreOver::Exposure},
                                                               {"loads", lump::ScoreOver::Loads}};
  command
      ->add_option("DATA", o->files, "Data sets of palpate-lab dataset, *.h5, that the network has not seen")
      ->required();
  command->add_option("--network", o->network, "A file of palpate-lab train (default: the built-in network)");
  command->add_option("--method", o->method, kLumpMethodHelp)->capture_default_str();
  command->add_setting("--noise", o->job.sensor.noise_fraction, Check::range(0.0, 1.0),
                       "Noise of each node, as a fraction of the highest load's peak pressure");
  command
      ->add_option("--pattern", o->job.sensor.pattern_fraction,
                   "Fixed pattern of the sensor, the same at every load, as a fraction of the peak")
      ->option_text("NUM [0]")
      ->check(Check::range(0.0, 1.0));
  command->add_setting("--pattern-mm", o->job.sensor.pattern_length_mm, Check::range(0.0, 100.0),
                       "Its correlation length; 0: each node by itself");
  command->add_flag("--pattern-gain", o->job.sensor.pattern_gain, "The pattern grows with the pressure");
  command->add_setting("--repeats", o->job.repeats, Check::range(1, 1000),
                       "Readings of each block, each with new noise and pattern");
  command->add_setting("--gauge-error", o->job.sensor.gauge_fraction, Check::range(0.0, 1.0),
                       "Relative error of each force");
  command->add_setting("--modulus-error", o->job.modulus_error, Check::range(-0.9, 10.0),
                       "Relative error of the tissue's modulus as stated to the estimate");
  command->add_setting(
      "--press-sd-mm", o->job.press_sd_mm, Check::range(0.0, 10.0),
      "Standard error of the plate's way, by which the modulus is found, if it is not told wrong; 0: no way");
  command->add_setting("--press-sd-alike", o->job.press_sd_alike, Check::range(0.0, 1.0),
                       "Share of that variance that is alike at all loads");
  command->add_setting("--thickness-sd", o->job.thickness_sd, Check::range(0.0, 0.3),
                       "Relative standard error of the thickness as stated, which intervals cover");
  add_relaxation(*command, o->relaxation);
  command->add_flag("--tell-relaxation", o->job.relaxation_told, "Estimates are told of it, with that error")
      ->group("Relaxing tissue");
  command->add_flag("--tell-skin", o->job.skin_told, "The skin of blocks that have one is told")
      ->group("Skin and plate");
  command
      ->add_setting("--skin-sd", o->job.skin_sd, Check::range(0.0, 0.3),
                    "Relative standard error of its thickness and of its ratio, which intervals cover")
      ->group("Skin and plate");
  command->add_flag("--tell-plate", o->job.plate_told, "A plate that rubs or sticks is told")
      ->group("Skin and plate");
  command
      ->add_setting("--plate-sd", o->job.plate_sd, Check::range(0.0, 0.5),
                    "Standard error of its friction as told, which intervals cover")
      ->group("Skin and plate");
  command->add_setting("--full-scale-Pa", o->job.sensor.full_scale_Pa, Check::range(0.0, 1e9),
                       "Of gray level 255; 0: the highest peak at 90 % of it");
  command->add_option("--window-mm", o->job.sensor.window_mm,
                      "What the camera sees of the plate (default 40 30)");
  command->add_setting("--loads", o->job.loads, Check::range(0, 32),
                       "Number of loads, from the highest down; 0: all");
  command
      ->add_option("--exposure", o->job.sensor.exposure,
                   "The highest load's peak over full scale; above 1 its top is saturated")
      ->option_text("NUM [0.9]")
      ->check(Check::range(0.01, 100.0));
  command
      ->add_option(
          "--over", o->over,
          "A table instead of one score: noise (0.1 to 10 %, 1, 2 and 4 loads), exposure (the peak at 90 "
          "to 300 % of full scale, 1 and 4 loads), loads (1, 2 and 4)")
      ->transform(one_of(kOver));
  command->add_flag("--faults", o->faults,
                    "A table of wrong input instead: units, pitch, window, order of the loads ...; which the "
                    "estimate finds, and how far the others move it");
  command->add_flag("--by-hand", o->by_hand,
                    "Scans of several presses instead: on a stage, and by hand without one");
  command->add_flag("--next-press", o->next_press,
                    "Scans whose next press is proposed instead, beside a raster of presses");
  command->add_flag("--by-skin", o->by_skin, "A table by the blocks' skins and plates instead")
      ->group("Skin and plate");
  command->add_option("--count", o->count, "Cases of each data set, from the first; 0: all")
      ->capture_default_str();
  command->add_option("--first", o->job.first, "First case to read, counted over all data sets")
      ->capture_default_str();
  command->add_setting("--every", o->job.every, Check::range(1, 1000000), "Read every N-th case");
  command->add_setting("--threads", o->job.threads, Check::range(1, 256),
                       "Threads; with more than one the times are not valid");
  o->cells.by = {"size_mm", "depth_mm", "ratio"};
  add_cell_options(*command, o->cells, "size_mm, depth_mm, ratio, thickness_mm, offset_mm, shape");
  command->add_option("--out", common.out,
                      "Folder for lump_evaluation.csv, coverage.csv and plots, or lump_rows.csv");
  add_common(*command, common,
             "  palpate-lab evaluate lump held_out.h5 --out out/lump\n"
             "  palpate-lab evaluate lump held_out.h5 --noise 0.05 --loads 1\n"
             "  palpate-lab evaluate lump held_out.h5 --by size_mm,shape --bins 3 --out out/shapes\n"
             "  palpate-lab evaluate lump held_out.h5 --method direct --every 10 --out out/direct\n"
             "  palpate-lab evaluate lump held_out.h5 no_lump.h5 --over noise --threads 2 --out out/noise\n"
             "  palpate-lab evaluate lump held_out.h5 --by-hand --threads 2 --out out/by_hand\n"
             "  palpate-lab evaluate lump held_out.h5 --network my.lump --modulus-error 0.3 --json\n");
  command->runs(chosen, [o, &common] { return run(common, *o); });
}

}  // namespace palpate
