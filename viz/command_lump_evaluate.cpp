// palpate lump evaluate: how good estimates of lumps are, on blocks that are known.
#include <CLI/CLI.hpp>
#include <map>
#include <mutex>

#include "engine/error.h"
#include "engine/lump/lump_examples.h"
#include "viz/command_lump.h"
#include "viz/lump_evaluation.h"

namespace palpate {
namespace {

struct Options {
  std::string file, network, method = "network";
  LumpEvaluationJob job;
  uint32_t count = 0;
};

/// Who may estimate, by name.
LumpEstimator estimator_of(const Options& o, std::shared_ptr<const LumpNetwork> network) {
  if (o.method == "network")
    return [network](const LumpReading& reading) { return network->estimate(reading); };
  if (o.method == "direct") return direct_estimator();
  throw Error(Failure::Usage, "--method network or direct", "'" + o.method + "'", "--method network");
}

Report run(const Common& common, Options& o) {
  const auto network = o.network.empty() ? std::make_shared<const LumpNetwork>(LumpNetwork::built_in())
                                         : std::make_shared<const LumpNetwork>(LumpNetwork::read(o.network));
  o.job.estimator = estimator_of(o, network);
  std::vector<LumpExample> examples = lump_examples(read_lump_file(o.file));
  if (o.count > 0 && o.count < examples.size()) examples.resize(o.count);
  if (examples.empty())
    throw Error(Failure::Input, "a data set with a finished case", o.file + " without one",
                "palpate lump info " + o.file);
  o.job.seed = common.seed;
  std::mutex guard;
  ProgressBar bar(common, "readings", examples.size());
  o.job.progress = [&](size_t done) {
    const std::scoped_lock lock(guard);
    bar.update(done);
    return !interrupted();
  };
  std::vector<LumpJudged> judged;
  try {
    judged = judge_lumps(examples, o.job);
  } catch (const Stopped&) {
    return {"interrupted", R"({"complete": false})", kInterrupted};
  }
  const LumpScore score = score_of(judged);
  Report report{score_text(score), score_json(score, o.method, o.job)};
  if (!common.out.empty()) report.text += "wrote " + write_score(score, judged, common.out.string()) + "\n";
  return report;
}

}  // namespace

void add_lump_evaluate(CLI::App& group, Common& common, Command& chosen) {
  CLI::App* command =
      group.add_subcommand("evaluate", "How good estimates are: a known data set through a synthetic sensor");
  auto o = std::make_shared<Options>();
  command
      ->add_option("DATA", o->file, "A data set of palpate lump dataset, *.h5, that the network has not seen")
      ->required();
  command->add_option("--network", o->network,
                      "A file of palpate lump train (default: the built-in network)");
  command
      ->add_option("--method", o->method,
                   "Who estimates: network, or direct: the finite elements, about a minute a reading")
      ->capture_default_str();
  command
      ->add_option("--noise", o->job.sensor.noise_share,
                   "Of each node, share of the highest load's peak pressure")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1.0));
  command->add_option("--gauge-error", o->job.sensor.gauge_share, "Of each force, share")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1.0));
  command
      ->add_option("--modulus-error", o->job.modulus_error,
                   "The tissue's modulus is told wrong by this share")
      ->capture_default_str()
      ->check(CLI::Range(-0.9, 10.0));
  command
      ->add_option("--full-scale-Pa", o->job.sensor.full_scale_Pa,
                   "Of gray level 255; 0: the highest peak at 90 % of it")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1e9));
  command
      ->add_option("--window-mm", o->job.sensor.window_mm,
                   "What the camera sees of the plate (default 40 30)")
      ->expected(2);
  command->add_option("--loads", o->job.loads, "The highest so many loads; 0: all")
      ->capture_default_str()
      ->check(CLI::Range(0, 32));
  command->add_option("--count", o->count, "Cases, from the first; 0: all")->capture_default_str();
  command->add_option("--threads", o->job.threads, "More than one makes the times untrue")
      ->capture_default_str()
      ->check(CLI::Range(1, 256));
  command->add_option("--out", common.out, "Folder for lump_evaluation.csv and plots");
  add_common(*command, common,
             "  palpate lump evaluate held_out.h5 --out out/lump\n"
             "  palpate lump evaluate held_out.h5 --noise 0.05 --loads 1\n"
             "  palpate lump evaluate held_out.h5 --network my.lump --modulus-error 0.3 --json\n");
  command->callback([o, &common, &chosen] { chosen = [o, &common] { return run(common, *o); }; });
}

}  // namespace palpate
