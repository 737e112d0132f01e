#include "perf/lab/study/method_costs.h"

#include <algorithm>
#include <ctime>

#include "engine/base/statistics.h"
#include "engine/base/text.h"

namespace palpate::lump {
namespace {

struct EstimateWay {
  const char* method;
  uint32_t loads;
};
constexpr std::array<EstimateWay, kEstimateWays> kWays = {{{"network", 1},
                                                           {"network", 2},
                                                           {"network", 4},
                                                           {"refined", 1},
                                                           {"refined", 2},
                                                           {"refined", 4},
                                                           {"direct", 4}}};

}  // namespace

std::vector<MethodCost> method_costs(const std::vector<Example>& examples, const EvaluationJob& job,
                                     const LongRun& run, const std::function<void(size_t done)>& progress) {
  const auto network = load_network("");
  std::vector<MethodCost> costs;
  for (const EstimateWay& way : kWays) {
    EvaluationJob own = job;
    const Estimator estimator = named_estimator(way.method, network, ErrorSources::none(), run);
    std::vector<double> cpu_s;
    own.estimator = Inverse([&](const Observation& seen) {
      // Of the process: time of its processors, whatever else runs.
      const std::clock_t start = std::clock();
      Estimate estimate = estimator(seen);
      cpu_s.push_back(static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
      return estimate;
    });
    own.loads = way.loads;
    own.threads = 1;
    const std::vector<Judged> judged = judge_lumps(examples, own);
    if (judged.size() < count_judged(examples.size(), own)) break;
    const Score score = score_of(judged);
    costs.push_back({way.method, way.loads, score.lumps, score.judged, score.median, median(cpu_s),
                     *std::max_element(cpu_s.begin(), cpu_s.end()), score.coverage});
    progress(costs.size());
  }
  return costs;
}

std::string method_costs_text(const std::vector<MethodCost>& costs) {
  std::string table =
      "method    loads  seen        time, s (most)         errors of size, depth, ratio  hold\n";
  for (const MethodCost& c : costs)
    table += text("%-9s %-6u %zu of %-6zu %8.3g (%.3g) %14.2g, %.2g, %.2g %%        %.0f, %.0f, %.0f %%\n",
                  c.method.c_str(), c.loads, c.judged, c.lumps, c.cpu_s, c.slowest_s, 100 * c.median[0],
                  100 * c.median[1], 100 * c.median[2], 100 * c.coverage[0], 100 * c.coverage[1],
                  100 * c.coverage[2]);
  return table;
}

std::string method_costs_csv(const std::vector<MethodCost>& costs) {
  std::string csv =
      "method,loads,lumps,seen,cpu_s,most_cpu_s,size_error,depth_error,ratio_error,size_hold,depth_hold,"
      "ratio_hold\n";
  for (const MethodCost& c : costs) {
    csv +=
        text("%s,%u,%zu,%zu,%.4g,%.4g", c.method.c_str(), c.loads, c.lumps, c.judged, c.cpu_s, c.slowest_s);
    for (const auto* values : {&c.median, &c.coverage})
      for (const double value : *values) csv += text(",%.3g", value);
    csv += "\n";
  }
  return csv;
}

json::Value method_costs_json(const std::vector<MethodCost>& costs) {
  json::Value all = json::Value::array();
  for (const MethodCost& c : costs)
    all.push_back({{"method", c.method},
                   {"loads", c.loads},
                   {"lumps", c.lumps},
                   {"seen", c.judged},
                   {"cpu_s", c.cpu_s},
                   {"most_cpu_s", c.slowest_s},
                   {"median_error", c.median},
                   {"hold", c.coverage}});
  return all;
}

}  // namespace palpate::lump
