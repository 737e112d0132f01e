// palpate-lab evaluate limit: whether lumps above the stated limit of detection are seen.
#include "capture/files/output_file.h"
#include "perf/lab/commands/evaluate/evaluate.h"
#include "perf/lab/study/limit_evaluation.h"
#include "perf/lab/training/examples.h"
#include "viz/commands/support/options.h"

namespace palpate {
namespace {

struct Options {
  std::string file;
  lump::LimitJob job;
};

Report run(const Common& common, const Options& o) {
  lump::LimitJob job = o.job;
  job.seed = common.seed;
  const auto judged = judge_limits(lump::lump_examples(lump::read_lump_file(o.file)), job);
  Report report(limits_text(judged), limits_json(judged));
  if (!common.out.empty()) {
    make_output_folder(common.out);
    write_whole(common.out / "limit.csv", std::string_view(limits_csv(judged)));
    report.text += "wrote " + (common.out / "limit.csv").string() + "\n";
  }
  return report;
}

}  // namespace

void add_evaluate_limit(CommandLine& group, Common& common, Command& chosen) {
  CommandLine* command = group.add_subcommand(
      "limit", "Whether lumps above the limit of detection are seen, on known blocks at several noises");
  auto o = std::make_shared<Options>();
  command->add_option("DATA", o->file, "Data set, palpate-lab dataset: its balls and upright cylinders")
      ->required();
  command
      ->add_option("--noise", o->job.noise_fractions,
                   "Noises of each node, fractions of the highest load's peak (default 0.002,0.01,0.03)")
      ->delimiter(',');
  command->add_setting("--repeats", o->job.repeats, Check::range(1, 1000),
                       "Readings of each block and noise");
  command->add_option("--out", common.out, "Folder for limit.csv, a row a reading");
  add_common(*command, common,
             "  palpate-lab dataset small.h5 --count 40 --size-mm 2 8 --depth-mm 2 8 --shapes sphere\n"
             "  palpate-lab evaluate limit small.h5 --out out/limit\n");
  command->runs(chosen, [o, &common] { return run(common, *o); });
}

}  // namespace palpate
