// palpate-lab stability: errors of estimates at the limits of the range, and the cost of a press.
#include <cmath>

#include "capture/files/output_file.h"
#include "engine/base/json.h"
#include "engine/base/text.h"
#include "palpate/error.h"
#include "perf/lab/commands/commands.h"
#include "perf/lab/study/evaluation_table.h"
#include "perf/lab/study/stability.h"
#include "viz/commands/support/lump_method.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"

namespace palpate {
namespace {

using Json = json::Value;

struct Options {
  std::string method = "refined";
  double noise = 0.002;
  uint32_t threads = 0;
  bool costs = false;
  std::string group;
};

bool has_values(const lump::Estimate& e) {
  return (reports_numbers(e.verdict) || e.verdict == lump::Status::OutsideTraining) && e.size_mm.value > 0 &&
         std::isfinite(e.depth_mm.value);
}

std::string value_text(const lump::Value& v) {
  std::string line = palpate::text("%.3g (%.3g-%.3g)", v.value, v.low, v.high);
  return line;
}

/// What was estimated of a block: itself, and each of several lumps after it.
struct Line {
  std::string name;
  const lump::Estimate* estimate;
};
std::vector<Line> lines_of(const lump::StabilityRow& row) {
  std::vector<Line> lines = {{row.what.name, &row.estimate}};
  for (const lump::Estimate& one : row.estimate.lumps)
    lines.push_back({row.what.name + ", lump " + std::to_string(lines.size()), &one});
  return lines;
}

std::string table(const std::vector<lump::StabilityRow>& rows) {
  std::string text = palpate::text("%-16s %-38s %-17s %-18s %-18s %-18s %s\n", "group", "block", "verdict",
                                   "size, mm", "depth, mm", "stiffness ratio", "not held");
  for (const lump::StabilityRow& row : rows)
    for (const auto& [name, e] : lines_of(row)) {
      const bool values = row.pressed && has_values(*e);
      text += palpate::text(
          "%-16s %-38s %-17s %-18s %-18s %-18s %s\n", row.what.group.c_str(), name.c_str(),
          row.pressed ? to_string(e->verdict) : "not pressed", values ? value_text(e->size_mm).c_str() : "",
          values ? value_text(e->depth_mm).c_str() : "", values ? value_text(e->stiffness_ratio).c_str() : "",
          row.pressed ? row.misses_of(*e).c_str() : "");
    }
  return text;
}

std::string costs_table(const std::vector<lump::CostRow>& rows) {
  std::string text = "\nchoice      name                            time      largest error   force\n";
  std::string line;
  for (const lump::CostRow& row : rows) {
    line = palpate::text("%-11s %-30s %6.2f s   %6.2f %% of peak   %+.2f %%\n", row.choice.c_str(),
                         row.name.c_str(), row.wall_s, 100 * row.map_error, 100 * row.force_error);
    text += line;
  }
  return text;
}

Json to_json(const lump::Value& v) {
  return {{"value", v.value}, {"low", v.low}, {"high", v.high}};
}

Json to_json(const lump::StabilityRow& row) {
  const lump::Estimate& e = row.estimate;
  Json value = {{"group", row.what.group},
                {"name", row.what.name},
                {"pressed", row.pressed},
                {"verdict", row.pressed ? to_string(e.verdict) : "not pressed"},
                {"evidence", e.detection_statistic},
                {"not_held", row.misses()},
                {"reasons", e.reasons}};
  if (row.what.scene.inclusion) {
    const fem::Inclusion& lump = *row.what.scene.inclusion;
    value["truth"] = {
        {"size_mm", lump.size()[0]}, {"depth_mm", lump.depth_mm}, {"stiffness_ratio", lump.stiffness_ratio}};
  }
  if (row.pressed && has_values(e)) {
    value["size_mm"] = to_json(e.size_mm);
    value["depth_mm"] = to_json(e.depth_mm);
    value["stiffness_ratio"] = to_json(e.stiffness_ratio);
  }
  return value;
}

std::string truth_cells(const fem::Scene& scene) {
  if (!scene.inclusion) return ",,,";
  const fem::Inclusion& lump = *scene.inclusion;
  return palpate::text("%g,%g,%g,", lump.size()[0], lump.depth_mm, lump.stiffness_ratio);
}

std::string csv(const std::vector<lump::StabilityRow>& rows) {
  std::string text =
      "group,block,true_size_mm,true_depth_mm,true_stiffness_ratio,verdict,size_mm,size_low_mm,size_high_mm,"
      "depth_mm,depth_low_mm,depth_high_mm,stiffness_ratio,stiffness_ratio_low,stiffness_ratio_high,"
      "not_held\n";
  for (const lump::StabilityRow& row : rows)
    for (const auto& [name, e] : lines_of(row)) {
      text += '"' + row.what.group + "\",\"" + name + "\"," + truth_cells(row.what.scene);
      text += row.pressed ? to_string(e->verdict) : "not pressed";
      for (const lump::Value* v : {&e->size_mm, &e->depth_mm, &e->stiffness_ratio})
        text += row.pressed && has_values(*e) ? palpate::text(",%.5g,%.5g,%.5g", v->value, v->low, v->high)
                                              : std::string(",,,");
      text += ",\"" + (row.pressed ? row.misses_of(*e) : std::string()) + "\"\n";
    }
  return text;
}

/// Those of one group; all without one.
std::vector<lump::StabilityCase> chosen_cases(const Options& options) {
  std::vector<lump::StabilityCase> cases = lump::stability_cases(options.noise);
  std::string groups;
  for (const lump::StabilityCase& c : cases)
    if (groups.find(c.group) == std::string::npos) groups += (groups.empty() ? "" : ", ") + c.group;
  if (!options.group.empty()) std::erase_if(cases, [&](const auto& c) { return c.group != options.group; });
  if (cases.empty()) throw Error(Failure::Usage, "--group of these: " + groups, options.group, "no --group");
  return cases;
}

void write(const std::filesystem::path& path, const std::string& text) {
  OutputFile file(path);
  file.write(text);
  file.commit();
}

Report stability(const Common& common, const Options& options) {
  const lump::Estimator estimator = lump::named_estimator(
      options.method, lump::load_network(""), lump::ErrorSources::none(), {.threads = options.threads});
  const std::vector<lump::StabilityCase> cases = chosen_cases(options);
  std::vector<lump::StabilityRow> rows;
  {
    ProgressBar bar(common, "pressing", cases.size());
    rows = judge_stability(cases, estimator, common.seed, options.threads,
                           [&](uint64_t done) { bar.update(done); });
  }
  Json value = {{"method", options.method}, {"noise_share", options.noise}};
  for (const lump::StabilityRow& row : rows) value["blocks"].push_back(to_json(row));
  std::string text = table(rows);
  std::vector<lump::CostRow> costs;
  std::vector<lump::ScoreRow> by_loads;
  if (options.costs) {
    costs = lump::press_costs(options.threads);
    text += costs_table(costs);
    lump::EvaluationJob job;
    job.estimator = estimator;
    job.sensor.noise_fraction = options.noise;
    job.seed = common.seed;
    ProgressBar bar(common, "pressing balls", 12);
    by_loads =
        scores_over(lump::ScoreOver::Loads,
                    lump::pressed_balls(options.threads, [&](uint64_t done) { bar.update(done); }), job);
    text +=
        "\nthe estimator by number of loads, on balls of 6 to 12 mm, 3 and 6 mm deep, 3 and 10 times as "
        "stiff\n" +
        rows_text(by_loads);
    value["by_loads"] = rows_json(by_loads);
    for (const lump::CostRow& row : costs)
      value["costs"].push_back({{"choice", row.choice},
                                {"name", row.name},
                                {"wall_s", row.wall_s},
                                {"largest_error_of_peak", row.map_error},
                                {"force_error", row.force_error}});
  }
  if (!common.out.empty()) {
    make_output_folder(common.out);
    write(common.out / "stability.csv", csv(rows));
    text += "written: " + (common.out / "stability.csv").string();
    if (options.costs) {
      std::string lines = "choice,name,wall_s,largest_error_of_peak,force_error\n";
      std::string line;
      for (const lump::CostRow& row : costs) {
        line = palpate::text("%s,\"%s\",%.4g,%.4g,%.4g\n", row.choice.c_str(), row.name.c_str(), row.wall_s,
                             row.map_error, row.force_error);
        lines += line;
      }
      write(common.out / "press_costs.csv", lines);
      write(common.out / "estimate_costs.csv", rows_csv(by_loads));
      text += ", " + (common.out / "press_costs.csv").string() + ", estimate_costs.csv";
    }
    text += "\n";
  }
  return {text, value};
}

}  // namespace

void add_stability(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command = program.add_subcommand(
      "stability",
      "Estimates at the limits: stiff, soft, shallow, wide, two lumps, none, noise, wrong tissue, plates");
  const auto o = std::make_shared<Options>();
  command->add_setting("--method", o->method, Check::one_of({"network", "refined", "direct"}),
                       kLumpMethodHelp);
  command->add_setting("--noise", o->noise, Check::range(0.0, 1.0),
                       "Noise of each node, as a fraction of the highest load's peak pressure");
  command->add_setting("--threads", o->threads, Check::range(0, 256), "0: one per core");
  command->add_option("--group", o->group, "Of the table, alone: \"plate\", \"floor\" ... (default: all)");
  command->add_flag("--costs", o->costs,
                    "Also error against run time of grids, strain models and numbers of loads");
  command->add_option("--out", common.out,
                      "Folder for stability.csv, press_costs.csv and estimate_costs.csv");
  add_common(*command, common, "  palpate-lab stability --costs --out out/stability\n");
  command->runs(chosen, [o, &common] { return stability(common, *o); });
}

}  // namespace palpate
