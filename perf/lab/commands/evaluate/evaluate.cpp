// palpate-lab evaluate: verdicts and intervals judged cell by cell of what varies.
#include "perf/lab/commands/evaluate/evaluate.h"
#include "viz/commands/support/options.h"

namespace palpate {

void add_evaluate(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* group = program.add_subcommand(
      "evaluate", "Check intervals and verdicts under each combination of conditions, and name the worst");
  group->require_subcommand(1);
  group->footer(
      "Examples:\n"
      "  palpate-lab evaluate table results.csv --by size_mm,depth_mm\n"
      "  palpate-lab evaluate match --trials 500 --out out/match\n"
      "  palpate-lab evaluate modulus --out out/modulus\n"
      "  palpate-lab help evaluate force\n");
  add_evaluate_table(*group, common, chosen);
  add_evaluate_match(*group, common, chosen);
  add_evaluate_modulus(*group, common, chosen);
  add_evaluate_force(*group, common, chosen);
  add_evaluate_lump(*group, common, chosen);
  add_evaluate_change(*group, common, chosen);
  add_evaluate_methods(*group, common, chosen);
  add_evaluate_repeats(*group, common, chosen);
  add_evaluate_emulator(*group, common, chosen);
  add_evaluate_limit(*group, common, chosen);
  add_evaluate_pairs(*group, common, chosen);
  add_evaluate_stiffness(*group, common, chosen);
}

}  // namespace palpate
