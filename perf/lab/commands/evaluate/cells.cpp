#include "engine/base/json.h"
#include "engine/base/text.h"
#include "perf/lab/commands/evaluate/evaluate.h"
#include "perf/lab/judge/coverage_plot.h"
#include "perf/lab/judge/report.h"
#include "viz/commands/support/options.h"

namespace palpate {

void add_cell_options(CommandLine& command, judge::CellOptions& cells, const std::string& conditions) {
  command.add_option("--by", cells.by, "Conditions to cross with each other (default: all): " + conditions)
      ->delimiter(',');
  command.add_setting("--bins", cells.bins, Check::range(uint64_t{1}, uint64_t{20}),
                      "Bins of a numeric condition, with equally many cases in each");
  command.add_setting("--fewest", cells.fewest, Check::range(uint64_t{1}, uint64_t{1000000}),
                      "Fewest cases of a cell that is judged");
}

void add_trials(CommandLine& command, uint32_t& trials, const std::string& description) {
  command.add_setting("--trials", trials, Check::range(1, 1000000), description);
}

Report judged_report(const Common& common, const judge::Cases& cases, judge::CellOptions cells,
                     const std::string& stem, size_t trials, size_t wanted) {
  const bool complete = trials == wanted;
  if (cases.cases.empty() && !complete) return interrupted_report("interrupted");
  cells.seed = common.seed;
  const judge::Judgement judgement = judge::judge_cells(cases, cells);
  json::Value json = judge::judgement_json(judgement);
  json["trials"] = trials;
  json["complete"] = complete;
  Report report{judge::judgement_text(judgement), json};
  if (!complete) {
    report.text = text("interrupted after %zu of %zu trials: of those\n", trials, wanted) + report.text;
    report.exit_code = kInterrupted;
  }
  if (!common.out.empty())
    report.text += "wrote " + write_judgement(judgement, cases, common.out, stem) + "\n";
  return report;
}

}  // namespace palpate
