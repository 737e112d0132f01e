// palpate-lab evaluate repeats: spread of estimates of one block that is pressed again and again.

#include "capture/files/output_file.h"
#include "perf/lab/commands/evaluate/evaluate.h"
#include "perf/lab/study/days/repeat_evaluation.h"
#include "perf/lab/training/examples.h"
#include "viz/commands/support/lump_method.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"

namespace palpate {
namespace {

struct Options {
  std::string file, method = "refined";
  lump::RepeatJob job;
};

Report run(const Common& common, const Options& o) {
  const auto examples = lump::read_examples(o.file);
  lump::ErrorSources place = lump::ErrorSources::none();
  place.place = true;
  lump::RepeatJob job = o.job;
  job.estimator = lump::named_estimator(o.method, lump::load_network(""), place, {.threads = 1});
  job.seed = common.seed;
  std::vector<lump::RepeatedBlock> blocks;
  {
    ProgressBar bar(common, "blocks", examples.size());
    job.progress = [&](size_t done) {
      bar.update(done);
      return !interrupted();
    };
    blocks = judge_repeats(examples, job);
  }
  if (blocks.empty()) return interrupted_report("interrupted");
  Report report(repeats_text(blocks), repeats_json(blocks));
  if (!common.out.empty()) {
    make_output_folder(common.out);
    write_whole(common.out / "repeats.csv", std::string_view(repeats_csv(blocks)));
    report.text += "wrote " + (common.out / "repeats.csv").string() + "\n";
  }
  return report;
}

}  // namespace

void add_evaluate_repeats(CommandLine& group, Common& common, Command& chosen) {
  CommandLine* command = group.add_subcommand(
      "repeats",
      "How far estimates of one block spread from press to press, over the errors that they state");
  auto o = std::make_shared<Options>();
  command->add_option("DATA", o->file, "Data set of six loads or more, palpate-lab dataset")->required();
  o->job.sensor.window_mm = {36, 28};
  command->add_setting("--method", o->method, Check::one_of({"network", "refined"}), kLumpMethodHelp);
  command->add_setting("--presses", o->job.presses, Check::range(4, 1000), "Of each block");
  command->add_setting("--noise", o->job.sensor.noise_fraction, Check::range(0.0, 1.0),
                       "Noise of each node, as a fraction of the highest load's peak pressure");
  command->add_setting("--place-mm", o->job.place_mm, Check::range(0.0, 10.0),
                       "Most that a window lies aside of where it is told, along x and y");
  command->add_setting("--place-sd-mm", o->job.place_sd_mm, Check::range(0.0, 10.0),
                       "Standard error of a window's place that is told");
  command->add_setting("--load-share", o->job.load_share, Check::range(0.0, 0.2),
                       "Most that a press's loads lie above or below the nominal ones");
  command->add_setting("--threads", o->job.threads, Check::range(1, 256), "Threads");
  command->add_option("--out", common.out, "Folder for repeats.csv, a row a block");
  add_common(*command, common,
             "  palpate-lab dataset six.h5 --count 10 --loads 6 --no-lump-share 0\n"
             "  palpate-lab evaluate repeats six.h5 --presses 20 --out out/repeats\n");
  command->runs(chosen, [o, &common] { return run(common, *o); });
}

}  // namespace palpate
