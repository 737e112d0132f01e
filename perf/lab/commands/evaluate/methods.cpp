// palpate-lab evaluate methods: error against run time of every way to estimate a lump.
#include <algorithm>
#include <cmath>

#include "capture/files/output_file.h"
#include "engine/base/text.h"
#include "palpate/error.h"
#include "perf/lab/commands/evaluate/evaluate.h"
#include "perf/lab/study/method_costs.h"
#include "perf/lab/training/examples.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"
#include "viz/report/plot.h"

namespace palpate {
namespace {

struct Options {
  std::string file;
  lump::EvaluationJob job;
  uint32_t count = 8, threads = 0;
};

Plot costs_plot(const std::vector<lump::MethodCost>& costs) {
  constexpr const char* kQuantities[] = {"size", "depth", "stiffness ratio"};
  Plot plot{.across = 3, .width_px = 1320, .height_px = 460};
  for (size_t p = 0; p < 3; ++p) {
    PlotPanel panel{std::string(kQuantities[p]) + " (numbers: loads)",
                    "processor time of a reading, s (median)", "error, % (median)"};
    panel.log_x = panel.log_y = true;
    panel.x_range = {{0.001, 500}};
    size_t colour = 0;
    for (const char* method : {"network", "refined", "direct"}) {
      PlotCurve points{
          .title = method, .style = PlotCurve::Style::LinesAndPoints, .colour = colour, .size = 1.2};
      PlotCurve words{.style = PlotCurve::Style::Words, .colour = colour++};
      for (const lump::MethodCost& c : costs) {
        if (c.method != method || !(c.median[p] > 0)) continue;
        points.add(c.cpu_s, 100 * c.median[p]);
        words.add(c.cpu_s, 100 * c.median[p]);
        words.words.push_back(text(" %u", c.loads));
      }
      if (points.x.empty()) continue;
      panel.curves.push_back(std::move(points));
      panel.curves.push_back(std::move(words));
    }
    plot.panels.push_back(std::move(panel));
  }
  return plot;
}

Report run(const Common& common, const Options& o) {
  std::vector<lump::Example> examples = lump::read_examples(o.file);
  std::erase_if(examples, [](const lump::Example& e) { return !e.lump; });
  if (examples.empty())
    throw Error(Failure::Input, "blocks with a lump", "none in " + o.file, "palpate-lab dataset");
  examples.resize(std::min<size_t>(examples.size(), o.count));
  lump::EvaluationJob job = o.job;
  job.seed = common.seed;
  std::vector<lump::MethodCost> costs;
  {
    ProgressBar bar(common, "ways", lump::kEstimateWays);
    costs = method_costs(examples, job, {.threads = o.threads, .stop = interrupted},
                         [&](size_t done) { bar.update(done); });
  }
  if (costs.empty()) return interrupted_report("interrupted");
  Report report(method_costs_text(costs), method_costs_json(costs));
  if (!common.out.empty()) {
    make_output_folder(common.out);
    write_whole(common.out / "methods.csv", std::string_view(method_costs_csv(costs)));
    std::string written = (common.out / "methods.csv").string();
    draw_plot(costs_plot(costs), common.out / "methods", written);
    report.text += "wrote " + written + "\n";
  }
  return report;
}

}  // namespace

void add_evaluate_methods(CommandLine& group, Common& common, Command& chosen) {
  CommandLine* command = group.add_subcommand(
      "methods", "Error against run time of network, refined and direct inversion, at one to four loads");
  auto o = std::make_shared<Options>();
  command->add_option("DATA", o->file, "Data set of palpate-lab dataset that the network has not seen")
      ->required();
  command->add_setting("--count", o->count, Check::range(1, 100000), "Blocks with a lump, from the first");
  command->add_setting("--noise", o->job.sensor.noise_fraction, Check::range(0.0, 1.0),
                       "Noise of each node, as a fraction of the highest load's peak pressure");
  command->add_setting("--threads", o->threads, Check::range(0, 256),
                       "Of the direct inversion; 0: one per core");
  command->add_option("--out", common.out, "Folder for methods.csv and the plot");
  add_common(*command, common,
             "  palpate-lab dataset held_out.h5 --count 12 --seed 2\n"
             "  palpate-lab evaluate methods held_out.h5 --count 8 --out out/methods\n");
  command->runs(chosen, [o, &common] { return run(common, *o); });
}

}  // namespace palpate
