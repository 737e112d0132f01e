// palpate-lab train: training of the network that estimates lumps, from pressed blocks.
#include <spdlog/spdlog.h>

#include <cmath>
#include <cstdio>
#include <mutex>

#include "capture/files/output_file.h"
#include "engine/base/json.h"
#include "engine/base/text.h"
#include "palpate/error.h"
#include "perf/lab/commands/commands.h"
#include "perf/lab/study/evaluation.h"
#include "perf/lab/training/examples.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"

namespace palpate {
namespace {

struct Options {
  std::vector<std::string> files;
  std::string aside, validate, recalibrate;
  lump::TrainingOptions training;
};

std::string trust_text(const lump::Network& network) {
  std::string text =
      "errors of size, depth and ratio on the blocks kept out of training (medians), and factors that widen "
      "the intervals\n"
      "method   loads  noise    median error, %     shape    interval factors    evidence  misfit\n";
  std::string line;
  for (const lump::CalibrationRow& t : network.calibration()) {
    line = palpate::text(
        "%-8s %5u %5.1f %%   %4.1f  %4.1f  %4.1f   %3.0f %%   %4.2f  %4.2f  %4.2f   %8.3g  %6.3g\n",
        t.method == lump::Method::Network ? "network" : "refined", t.loads, 100 * t.noise_fraction,
        100 * t.median_error[0], 100 * t.median_error[1], 100 * t.median_error[2], 100 * t.shape_rate,
        t.inflation[0], t.inflation[1], t.inflation[2], t.log_likelihood_ratio, t.misfit);
    text += line;
  }
  return text;
}

/// Blocks from all files; `made_from` describes each file.
std::vector<lump::Example> read_examples(const std::vector<std::string>& files, std::string& made_from) {
  std::vector<lump::Example> examples;
  for (const std::string& file : files) {
    const lump::Data data = lump::read_lump_file(file);
    const std::vector<lump::Example> more = lump::lump_examples(data);
    const bool first = made_from.empty() || made_from.ends_with(' ');
    const std::string line =
        palpate::text("%s%zu cases of seed %llu (%u x %u x %u cells, %s)", first ? "" : "; ", more.size(),
                      static_cast<unsigned long long>(data.sweep.seed), data.sweep.cells[0],
                      data.sweep.cells[1], data.sweep.cells[2], data.program.c_str());
    made_from += line;
    examples.insert(examples.end(), more.begin(), more.end());
  }
  return examples;
}

/// Shows the progress of the training, and stops it on an interrupt.
class TrainingWatch {
 public:
  explicit TrainingWatch(const Common& common) : bar_(common, "lump network", 1000) {}

  bool update(const std::string& what, double fraction) {
    const std::scoped_lock lock(guard_);
    bar_.update(static_cast<uint64_t>(1000 * fraction));
    if (fraction > told_ + 0.2) {
      told_ = fraction;
      if (fraction < 1)
        spdlog::info("{}: {:.0f} %, {:.0f} s left", what, 100 * fraction,
                     wall_s() * (1 - fraction) / fraction);
    }
    return !interrupted();
  }
  double wall_s() const { return now_s() - start_s_; }

 private:
  double start_s_ = now_s();
  std::mutex guard_;
  ProgressBar bar_;
  double told_ = 0;
};

std::string report_text(const std::string& file, size_t bytes, const lump::TrainingReport& report,
                        double wall_s) {
  return text(
      "%s: %zu bytes, from %u blocks with a lump and %u without, in %.0f s\n"
      "the block alone is known to %.3g %% of its pressure, fields miss %.3g %% of the peak,\n"
      "the emulators' mean is off by %.3g %% of the peak, RMS (median of blocks: %.3g %%), on the "
      "%u blocks that\n"
      "were kept aside, %.2g times what they differ by (%.3g %% on those seen); the network's loss "
      "is %.3g\n\n",
      file.c_str(), bytes, report.lumps, report.no_lumps, wall_s, 100 * report.base_error,
      100 * report.fields_error, 100 * report.network_error, 100 * report.mean_error, report.kept_aside,
      report.error_over_spread, 100 * report.network_error_seen, report.inverse_loss);
}

json::Value report_json(const std::string& file, size_t bytes, const lump::TrainingReport& report,
                        const std::string& made_from, double wall_s) {
  return {{"file", file},
          {"bytes", bytes},
          {"lumps", report.lumps},
          {"without_lump", report.no_lumps},
          {"left_out", report.left_out},
          {"base_error", report.base_error},
          {"fields_error", report.fields_error},
          {"network_error", report.network_error},
          {"network_error_seen", report.network_error_seen},
          {"mean_error", report.mean_error},
          {"kept_aside", report.kept_aside},
          {"reader_loss", report.inverse_loss},
          {"made_from", made_from},
          {"wall_s", wall_s}};
}

Report run(const Common& common, Options& o) {
  if (common.out.empty()) throw Error(Failure::Usage, "--out FILE for the network", "none", "--out my.lump");
  std::string made_from;
  std::vector<lump::Example> examples = read_examples(o.files, made_from);
  if (!o.aside.empty()) {
    made_from += "; calibrated on ";
    for (lump::Example& example : read_examples({o.aside}, made_from)) {
      example.aside = true;
      examples.push_back(std::move(example));
    }
  }
  o.training.seed = common.seed;
  o.training.made_from = made_from + "; training seed " + std::to_string(common.seed);
  TrainingWatch watch(common);
  o.training.progress = [&](const std::string& what, double fraction) {
    return watch.update(what, fraction);
  };
  lump::TrainingReport report;
  std::string bytes;
  lump::Network network(nullptr);
  try {
    network = o.recalibrate.empty()
                  ? train_lumps(examples, o.training, report)
                  : recalibrate_lumps(lump::Network::read(o.recalibrate), examples, o.training, report);
    bytes = network.bytes();
  } catch (const Stopped&) {
    return interrupted_report("interrupted: no network was written");
  }
  const double wall_s = watch.wall_s();
  write_whole(common.out, std::string_view(bytes));
  const std::string file = common.out.string();
  Report out;
  out.text =
      (o.recalibrate.empty() ? report_text(file, bytes.size(), report, wall_s)
                             : text("%s: calibrated on %u blocks with a lump and %u without, in %.0f s\n\n",
                                    file.c_str(), report.lumps, report.no_lumps, wall_s)) +
      trust_text(network);
  json::Value json = report_json(file, bytes.size(), report, network.made_from(), wall_s);
  if (!o.validate.empty()) {
    lump::EvaluationJob job;
    job.estimator = [&network](const lump::Observation& observation) {
      return network.estimate(observation);
    };
    job.seed = common.seed;
    const lump::Score score =
        lump::score_of(judge_lumps(lump::lump_examples(lump::read_lump_file(o.validate)), job));
    out.text += "\n" + o.validate + " through a synthetic sensor, 1 % noise:\n" + score_text(score);
    json["validation"] = score_json(score, "network", job);
  }
  out.json = json;
  return out;
}

}  // namespace

void add_train(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command = program.add_subcommand("train", "Train a network on data sets of pressed blocks");
  auto o = std::make_shared<Options>();
  command->add_option("DATA", o->files, "Data sets of palpate-lab dataset, *.h5")->required();
  command->add_option("--out", common.out, "The network's file, *.lump");
  command->add_option("--aside", o->aside,
                      "A data set that intervals come from and nothing is learnt of (default: one block of "
                      "DATA in four)");
  command->add_option("--validate", o->validate, "A data set that it has not seen: how good it is there");
  command->add_option(
      "--recalibrate", o->recalibrate,
      "A network: its weights stay, its intervals and limits come from DATA, which it has not seen");
  command->add_setting("--members", o->training.ensemble, Check::range(2, 16),
                       "Emulators, from lumps to their bumps, whose mean is used");
  command->add_setting("--hidden", o->training.hidden, Check::range(4, 512),
                       "Width of both hidden layers of emulators");
  command->add_setting("--fields", o->training.fields, Check::range(6, 200),
                       "Principal components of a bump");
  command->add_setting("--rounds", o->training.rounds, Check::range(1, 100000),
                       "Passes through all examples");
  command->add_setting("--decay", o->training.decay, Check::range(0.0, 100.0), "Decay of the weights");
  command->add_setting("--readings", o->training.observations, Check::range(1000, 10000000),
                       "Observations that the emulators simulate to train the network");
  command->add_setting("--reader-hidden", o->training.reader_hidden, Check::range(4, 1024),
                       "Width of the network's hidden layers");
  command->add_setting("--reader-rounds", o->training.reader_rounds, Check::range(1, 10000),
                       "Passes through the simulated observations");
  command->add_setting("--readers", o->training.readers, Check::range(1, 16),
                       "Networks from observations to lumps");
  command->add_setting("--trials", o->training.trials, Check::range(20, 100000),
                       "Observations for each noise and number of loads to calibrate intervals on");
  command->add_setting("--threads", o->training.threads, Check::range(0, 256), "0: one per core");
  add_common(
      *command, common,
      "  palpate-lab dataset train.h5 --count 1200\n"
      "  palpate-lab train train.h5 --out my.lump\n"
      "  palpate-lab train train.h5 --out my.lump --validate held_out.h5\n"
      "  palpate lump estimate press_1.npy press_2.npy --network my.lump --force-N 0.5,1 --young-Pa 4000\n");
  command->runs(chosen, [o, &common] { return run(common, *o); });
}

}  // namespace palpate
