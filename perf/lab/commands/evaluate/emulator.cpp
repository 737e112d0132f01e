// palpate-lab evaluate emulator: what the network's emulator is off by on known blocks.
#include "capture/files/output_file.h"
#include "engine/lump/estimator.h"
#include "perf/lab/commands/evaluate/evaluate.h"
#include "perf/lab/study/emulator_errors.h"
#include "perf/lab/training/examples.h"
#include "viz/commands/support/options.h"

namespace palpate {
namespace {

struct Options {
  std::string file, network;
};

Report run(const Common& common, const Options& o) {
  const auto network = lump::load_network(o.network);
  const auto errors = lump::emulator_errors(*network, lump::read_examples(o.file));
  Report report(emulator_errors_text(errors), emulator_errors_json(errors));
  if (!common.out.empty()) {
    make_output_folder(common.out);
    write_whole(common.out / "emulator.csv", std::string_view(emulator_errors_csv(errors)));
    report.text += "wrote " + (common.out / "emulator.csv").string() + "\n";
  }
  return report;
}

}  // namespace

void add_evaluate_emulator(CommandLine& group, Common& common, Command& chosen) {
  CommandLine* command = group.add_subcommand(
      "emulator", "How far the emulator's bumps are off those of known blocks, without noise");
  auto o = std::make_shared<Options>();
  command->add_option("DATA", o->file, "Data set, palpate-lab dataset, of blocks that it has not seen")
      ->required();
  command->add_option("--network", o->network, "A network of palpate-lab train (default: the built-in one)");
  command->add_option("--out", common.out, "Folder for emulator.csv, a row a block");
  add_common(*command, common,
             "  palpate-lab dataset held_out.h5 --count 80 --seed 2027 --centred-share 0.75\n"
             "  palpate-lab evaluate emulator held_out.h5 --network my.lump\n");
  command->runs(chosen, [o, &common] { return run(common, *o); });
}

}  // namespace palpate
