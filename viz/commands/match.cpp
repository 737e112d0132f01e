// palpate match: correspondence of the points of one set with those of another, deformed one.
#include <cstdio>

#include "capture/files/match_files.h"
#include "engine/base/json.h"
#include "engine/base/text.h"
#include "palpate/error.h"
#include "viz/commands/command.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"
#include "viz/report/match_plot.h"

namespace palpate {
namespace {

struct Options {
  std::vector<std::string> sets;
  std::string list;
  bool reflections = false;
  double most_turn_deg = 180;
};

constexpr double kFewTurns_deg = 45;  // a square grid turned by more is another square grid

std::vector<MatchFiles> pairs_of(const Options& options) {
  if (options.list.empty()) {
    if (options.sets.size() != 2)
      throw Error(Failure::Usage, "TEMPLATE.csv and TARGET.csv, or --list",
                  std::to_string(options.sets.size()) + " files",
                  "palpate match a.csv b.csv --out out/match");
    return {{options.sets[0], options.sets[1]}};
  }
  if (!options.sets.empty())
    throw Error(Failure::Usage, "either two files or --list", "both", "leaving one out");
  return read_pairs(options.list);
}

Report match(const Common& common, const Options& options) {
  const std::vector<MatchFiles> pairs = pairs_of(options);
  Report report;
  json::Value all = json::Value::array();
  ProgressBar bar(common, "matching", pairs.size());
  for (size_t k = 0; k < pairs.size() && !interrupted(); ++k) {
    const PointSet from = read_points(pairs[k].from), to = read_points(pairs[k].to);
    const MatchResult result =
        match_points(from, to, {.most_turn_deg = options.most_turn_deg, .reflections = options.reflections});
    const Facts facts = facts_of(pairs[k], from, to, result);
    report.say(facts.text);
    if (result.verdict == MatchVerdict::Ambiguous && options.most_turn_deg > kFewTurns_deg)
      report.text += "  where the target is hardly turned (a marker grid): --most-turn-deg 20\n";
    all.push_back(facts.json);
    if (!common.out.empty()) {
      const std::string name = palpate::text("%04zu", k + 1);
      const auto folder = options.list.empty() ? common.out : common.out / name;
      std::string written = write_match(folder, result, facts.json);
      draw_match(folder, from, to, result, written);
      report.text += "written: " + written + "\n";
    }
    bar.update(k + 1);
  }
  report.json = options.list.empty() ? all.at(0) : all;
  if (interrupted()) report.exit_code = kInterrupted;
  return report;
}

}  // namespace

void add_match(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command =
      program.add_subcommand("match", "Match the points of a set to those of its deformed copy");
  auto options = std::make_shared<Options>();
  command
      ->add_option("SETS", options->sets,
                   "TEMPLATE.csv and TARGET.csv: columns x,y or x,y,z, bare or with a unit (x_mm)")
      ->expected(0, 2);
  command->add_option("--list", options->list,
                      "CSV file with columns template,target: many pairs; names are relative to its folder");
  command->add_flag("--reflections", options->reflections, "The target may be the template's mirror image");
  command->add_setting(
      "--most-turn-deg", options->most_turn_deg, Check::range(0.0, 180.0),
      "Turns of the target by more are not tried; for regular grids, which fit themselves after "
      "a quarter turn");
  command->add_option("--out", common.out,
                      "Folder for warped.csv, partners.csv, match.json, match.png and .svg; with --list for "
                      "folders 0001, 0002, ... of them");
  add_common(*command, common,
             "  palpate match rest.csv pressed.csv --out out/match\n"
             "  palpate match rest.csv pressed.csv --json\n"
             "  palpate match --list pairs.csv --out out/pairs\n"
             "  palpate match markers_rest.csv markers_pressed.csv --most-turn-deg 20\n"
             "Order and number of points are free; points without a partner stay without one. Without a\n"
             "reliable match no partners are named, and the best try is called unreliable_warped.csv.\n");
  command->runs(chosen, [&common, options] { return match(common, *options); });
}

}  // namespace palpate
