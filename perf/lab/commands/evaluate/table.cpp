// palpate-lab evaluate table: judges the cases of a CSV table.
#include <filesystem>

#include "perf/lab/commands/evaluate/evaluate.h"
#include "perf/lab/judge/judged_table.h"
#include "viz/commands/support/options.h"

namespace palpate {
namespace {

struct Options {
  std::filesystem::path file;
  JudgedTableOptions table;
  judge::CellOptions cells;
};

Report run(const Common& common, Options& o) {
  o.table.by = o.cells.by;
  const judge::Cases cases = read_judged_table(o.file, o.table);
  return judged_report(common, cases, o.cells, "coverage", cases.cases.size(), cases.cases.size());
}

}  // namespace

void add_evaluate_table(CommandLine& group, Common& common, Command& chosen) {
  CommandLine* command =
      group.add_subcommand("table", "Judge a table of truths, estimates, intervals and verdicts");
  auto o = std::make_shared<Options>();
  command
      ->add_option("RESULTS", o->file,
                   "CSV: truth,value,low,high, or NAME_truth,NAME,NAME_low,NAME_high for each quantity; "
                   "verdict; wrong (0 or 1); other columns are conditions")
      ->required();
  add_cell_options(*command, o->cells, "columns of the table");
  command->add_setting("--promise", o->table.promise, Check::range(0.01, 0.999),
                       "Coverage that the intervals promise, 0 to 1");
  command
      ->add_option("--reported", o->table.reported,
                   "Verdicts that report a number (default: reported, valid, found, reliable, yes, true, 1); "
                   "all others refuse")
      ->delimiter(',');
  command->add_option("--out", common.out, "Folder for coverage.txt, .csv, .json and plots");
  add_common(*command, common,
             "  palpate-lab evaluate table results.csv --by size_mm,depth_mm\n"
             "  palpate-lab evaluate table results.csv --promise 0.95 --fewest 50 --out out/coverage\n"
             "  palpate-lab evaluate table lumps.csv --reported 'found,stiffness open' --json\n"
             "--by a quantity that was estimated goes by its truth.\n"
             "A cell is below its promise where its count would be so low, in any one of all cells, in at\n"
             "most 5 % of tables if the promise held everywhere. Lines are taken to err independently.\n");
  command->runs(chosen, [o, &common] { return run(common, *o); });
}

}  // namespace palpate
