// palpate-lab stability: errors of estimates at the limits of the range, and the cost of a press.
#include <cmath>

#include "capture/files/output_file.h"
#include "engine/base/json.h"
#include "engine/base/text.h"
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
};

bool has_values(const lump::Estimate& e) {
  return (reports_numbers(e.verdict) || e.verdict == lump::Status::OutsideTraining) &&
         std::isfinite(e.size_mm.value) && std::isfinite(e.depth_mm.value);
}

std::string value_text(const lump::Value& v) {
  std::string line = palpate::text("%.3g (%.3g-%.3g)", v.value, v.low, v.high);
  return line;
}

std::string table(const std::vector<lump::StabilityRow>& rows) {
  std::string text;
  std::string line = palpate::text("%-16s %-38s %-17s %-18s %-18s %-18s\n", "group", "block", "verdict",
                                   "size, mm", "depth, mm", "stiffness ratio");
  text += line;
  for (const lump::StabilityRow& row : rows) {
    const lump::Estimate& e = row.estimate;
    const bool values = row.pressed && has_values(e);
    line = palpate::text(
        "%-16s %-38s %-17s %-18s %-18s %-18s\n", row.what.group.c_str(), row.what.name.c_str(),
        row.pressed ? to_string(e.verdict) : "not pressed", values ? value_text(e.size_mm).c_str() : "",
        values ? value_text(e.depth_mm).c_str() : "", values ? value_text(e.stiffness_ratio).c_str() : "");
    text += line;
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

std::string csv(const std::vector<lump::StabilityRow>& rows) {
  std::string text =
      "group,block,true_size_mm,true_depth_mm,true_stiffness_ratio,verdict,size_mm,size_low_mm,size_high_mm,"
      "depth_mm,depth_low_mm,depth_high_mm,stiffness_ratio,stiffness_ratio_low,stiffness_ratio_high\n";
  std::string line;
  for (const lump::StabilityRow& row : rows) {
    text += '"' + row.what.group + "\",\"" + row.what.name + "\",";
    if (row.what.scene.inclusion) {
      const fem::Inclusion& lump = *row.what.scene.inclusion;
      line = palpate::text("%g,%g,%g,", lump.size()[0], lump.depth_mm, lump.stiffness_ratio);
      text += line;
    } else {
      text += ",,,";
    }
    text += row.pressed ? to_string(row.estimate.verdict) : "not pressed";
    for (const lump::Value* v :
         {&row.estimate.size_mm, &row.estimate.depth_mm, &row.estimate.stiffness_ratio}) {
      line = palpate::text(",%.5g,%.5g,%.5g", v->value, v->low, v->high);
      text += row.pressed && has_values(row.estimate) ? line : ",,,";
    }
    text += "\n";
  }
  return text;
}

void write(const std::filesystem::path& path, const std::string& text) {
  OutputFile file(path);
  file.write(text);
  file.commit();
}

Report stability(const Common& common, const Options& options) {
  const lump::Estimator estimator = lump::named_estimator(
      options.method, lump::load_network(""), lump::ErrorSources::none(), {.threads = options.threads});
  const std::vector<lump::StabilityCase> cases = lump::stability_cases(options.noise);
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
      "Estimates at the limits: stiff, soft, shallow, wide, two lumps, none, noise, wrong tissue");
  const auto o = std::make_shared<Options>();
  command->add_setting("--method", o->method, Check::one_of({"network", "refined", "direct"}),
                       kLumpMethodHelp);
  command->add_setting("--noise", o->noise, Check::range(0.0, 1.0),
                       "Noise of each node, as a fraction of the highest load's peak pressure");
  command->add_setting("--threads", o->threads, Check::range(0, 256), "0: one per core");
  command->add_flag("--costs", o->costs,
                    "Also error against run time of grids, strain models and numbers of loads");
  command->add_option("--out", common.out,
                      "Folder for stability.csv, press_costs.csv and estimate_costs.csv");
  add_common(*command, common, "  palpate-lab stability --costs --out out/stability\n");
  command->runs(chosen, [o, &common] { return stability(common, *o); });
}

}  // namespace palpate
