// palpate-lab evaluate pairs: two lumps in one block, each estimated, against the truth.
#include "capture/files/output_file.h"
#include "perf/lab/commands/evaluate/evaluate.h"
#include "perf/lab/study/pairs/pair_evaluation.h"
#include "perf/lab/study/pairs/pair_interaction.h"
#include "viz/commands/support/options.h"

namespace palpate {
namespace {

struct Options {
  std::string file, network;
  lump::PairJob job;
  uint32_t cells = 0;
};

Report run(const Common& common, const Options& o) {
  if (o.cells > 0) {
    const auto measured = lump::measure_interaction(lump::read_lump_file(o.file), o.cells);
    return {lump::interaction_text(measured), lump::interaction_json(measured)};
  }
  lump::PairJob job = o.job;
  job.seed = common.seed;
  job.estimator = lump::named_estimator("refined", lump::load_network(o.network), lump::ErrorSources::none());
  const auto judged = judge_pairs(lump::read_lump_file(o.file), job);
  Report report(pairs_text(judged), pairs_json(judged));
  if (!common.out.empty()) {
    make_output_folder(common.out);
    write_whole(common.out / "pairs.csv", std::string_view(pairs_csv(judged)));
    report.text += "wrote " + (common.out / "pairs.csv").string() + "\n";
  }
  return report;
}

}  // namespace

void add_evaluate_pairs(CommandLine& group, Common& common, Command& chosen) {
  CommandLine* command = group.add_subcommand(
      "pairs", "Estimates of two lumps in one block, by how far apart they lie, on known blocks");
  auto o = std::make_shared<Options>();
  command->add_option("DATA", o->file, "Data set, palpate-lab dataset --second-lump")->required();
  command->add_setting("--noise", o->job.sensor.noise_fraction, Check::range(0.0, 1.0),
                       "Of each node, fraction of the highest load's peak");
  command->add_setting("--loads", o->job.loads, Check::range(0, 32), "Of each block; 0: all");
  command->add_setting("--repeats", o->job.repeats, Check::range(1, 1000), "Readings of each block");
  command->add_option("--network", o->network, "A file of palpate-lab train (default: the built-in network)");
  command->add_setting(
      "--interaction", o->cells, Check::range(0, 64),
      "Instead, what the lumps of each block do to each other, by finite elements on so many "
      "cells along the block");
  command->add_option("--out", common.out, "Folder for pairs.csv, a row a lump");
  add_common(*command, common,
             "  palpate-lab dataset pairs.h5 --count 14 --second-lump 1.5 --size-mm 5 8 --shapes sphere\n"
             "  palpate-lab evaluate pairs pairs.h5 --out out/pairs\n");
  command->runs(chosen, [o, &common] { return run(common, *o); });
}

}  // namespace palpate
