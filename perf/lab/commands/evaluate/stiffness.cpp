// palpate-lab evaluate stiffness: how true the modulus by the way of the plate can be.
#include "capture/files/output_file.h"
#include "perf/lab/commands/evaluate/evaluate.h"
#include "perf/lab/study/stiffness_fit.h"
#include "perf/lab/training/examples.h"
#include "viz/commands/support/options.h"

namespace palpate {
namespace {

struct Options {
  std::vector<std::string> files;
  std::string fit;
};

Report run(const Options& o) {
  std::vector<lump::Example> examples;
  for (const std::string& file : o.files)
    for (lump::Example& e : lump::read_examples(file)) examples.push_back(std::move(e));
  const lump::BlockStiffness fit =
      o.fit.empty() ? lump::BlockStiffness::built_in() : lump::fit_stiffness(examples);
  const lump::StiffnessErrors errors = judge_stiffness(fit, examples);
  Report report(stiffness_text(errors), stiffness_json(errors));
  if (!o.fit.empty()) {
    write_whole(o.fit, std::string_view(lump::stiffness_numbers(fit)));
    report.text += "wrote " + o.fit + "\n";
  }
  return report;
}

}  // namespace

void add_evaluate_stiffness(CommandLine& group, Common& common, Command& chosen) {
  CommandLine* command = group.add_subcommand(
      "stiffness", "How far the force at a way of the plate is off, by which a tissue's modulus is found");
  auto o = std::make_shared<Options>();
  command->add_option("DATA", o->files, "Data sets of palpate-lab dataset")->required();
  command->add_option(
      "--fit", o->fit,
      "Fits these blocks and writes the numbers of engine/lump/tissue/block_stiffness.inc here");
  add_common(*command, common,
             "  palpate-lab evaluate stiffness held_out.h5\n"
             "  palpate-lab evaluate stiffness plain.h5 lumps.h5 --fit block_stiffness.inc\n");
  command->runs(chosen, [o] { return run(*o); });
}

}  // namespace palpate
