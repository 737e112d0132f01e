// palpate-lab tune: the kernels' constants for one device, measured once and kept.
#include <spdlog/spdlog.h>

#include <filesystem>
#include <system_error>

#include "engine/base/json.h"
#include "engine/base/readable.h"
#include "engine/base/text.h"
#include "engine/gpu/context.h"
#include "engine/gpu/tuning.h"
#include "engine/stages/frame/contact.h"
#include "palpate/error.h"
#include "palpate/frame.h"
#include "perf/lab/commands/commands.h"
#include "perf/lab/kernels/tune.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"

namespace palpate {
namespace {

using Json = json::Value;

struct Options {
  std::vector<std::string> sizes{"640x480", "1392x1042"};
  int repetitions = 15;
  bool dry_run = false;
  bool force = false;
};

perf::TuneRequest::Size parse_size(const std::string& text) {
  constexpr uint32_t kLeastSide_px = 16;
  unsigned width = 0, height = 0;
  char rest = 0;
  const bool read = text.size() < 16 && std::sscanf(text.c_str(), "%ux%u%c", &width, &height, &rest) == 2;
  if (!read || width < kLeastSide_px || height < kLeastSide_px || width > kMaxSide_px ||
      height > kMaxSide_px || uint64_t{width} * height > kMaxPixels) {
    throw Error(Failure::Usage,
                "a size like 640x480, sides from " + std::to_string(kLeastSide_px) + " to " +
                    std::to_string(kMaxSide_px) + " and at most " + std::to_string(kMaxPixels) + " px",
                "'" + text + "'", "--sizes 640x480,1392x1042");
  }
  return {width, height};
}

Json json_of(const Tuning& tuning) {
  Json json;
  for (const TuningField& field : tuning_fields()) json[field.name] = tuning.*field.value;
  return json;
}

Json json_of(const perf::Quartiles& time) {
  return {{"median", time.median}, {"lower_quartile", time.low}, {"upper_quartile", time.high}};
}

std::string percent(const perf::Quartiles& time) {
  return palpate::text("%+5.1f %% (%+.1f to %+.1f)", 100 * (1 - time.median), 100 * (1 - time.high),
                       100 * (1 - time.low));
}

std::string line(const char* name, const std::string& usual, const std::string& chosen,
                 const std::string& gain) {
  return palpate::text("%-22s %8s %8s  %s\n", name, usual.c_str(), chosen.c_str(), gain.c_str());
}

/// GPUs time their kernels themselves; a processor is timed from outside.
std::unique_ptr<gpu::Context> open_timed(const Common& common) {
  std::unique_ptr<gpu::Context> context = open_device(common);
  if (context->is_software()) return context;
  gpu::ContextOptions options;
  options.device = std::to_string(context->report().index);
  options.validation = common.validation;
  options.timers = true;
  context.reset();
  return std::make_unique<gpu::Context>(options);
}

Report show_cached(const gpu::Context& context, const CachedTuning& cached) {
  const Tuning usual = default_tuning(context);
  std::string text = context.report().name + ": measured before; --force measures again\n";
  text += line("parameter", "default", "chosen", "");
  for (const TuningField& field : tuning_fields()) {
    text +=
        line(field.name, std::to_string(usual.*field.value), std::to_string(cached.tuning.*field.value), "");
  }
  const Json value = {{"device", context.report().name},  {"cached", true},
                      {"file", tuning_file().string()},   {"written", false},
                      {"tuning", json_of(cached.tuning)}, {"complete", true}};
  return {text + "from: " + tuning_file().string(), value, 0};
}

Report tune(const Common& common, const Options& options) {
  perf::TuneRequest request;
  request.sizes.clear();
  for (const std::string& size : options.sizes) request.sizes.push_back(parse_size(size));
  request.repetitions = options.repetitions;
  request.stopped = interrupted;
  const double start_s = now_s();
  const std::unique_ptr<gpu::Context> context = open_timed(common);
  const std::filesystem::path file = tuning_file();
  const CachedTuning cached = load_tuning(*context);
  if (cached.measured && !options.force && !options.dry_run) return show_cached(*context, cached);
  if (!options.dry_run && file.empty())
    throw Error(Failure::Output, "a cache folder for the tuning", "neither XDG_CACHE_HOME nor HOME is set",
                "setting one of them, or --dry-run");
  // Measuring takes half a minute: a place that cannot be written is named before.
  std::error_code failed;
  if (!options.dry_run) std::filesystem::create_directories(file.parent_path(), failed);
  if (failed)
    throw Error(Failure::Output, "a folder " + file.parent_path().string(), system_words(failed),
                "another XDG_CACHE_HOME, or --dry-run");

  request.say = [](const std::string& what) { spdlog::info("measuring: {}", what); };
  const perf::Tuned tuned = perf::measure_tuning(*context, request);
  const bool writes = tuned.complete && !options.dry_run;
  if (writes) save_tuning(*context, tuned.tuning, file);

  const double seconds = now_s() - start_s;
  std::string text = context->report().name + ", by " + tuned.clock + "\n";
  text += line("parameter", "default", "chosen", "gain of the best candidate (half of all pairs)");
  Json fields = Json::array();
  for (const perf::TunedField& f : tuned.fields) {
    const bool kept = f.chosen == f.usual;
    const std::string note =
        f.best == f.usual
            ? "-"
            : percent(f.best_time) +
                  (kept ? ", " + std::to_string(f.best) +
                              (tuned.frames_gained ? ": within the spread" : ": whole frames are no faster")
                        : "");
    text += line(f.name.c_str(), std::to_string(f.usual), std::to_string(f.chosen), note);
    fields.push_back({{"name", f.name},
                      {"default", f.usual},
                      {"best", f.best},
                      {"chosen", f.chosen},
                      {"best_time", json_of(f.best_time)}});
  }
  text += line("whole frame", "", "", percent(tuned.frame_time));
  const std::string took = palpate::text("%.0f s; ", seconds);
  text += took;
  text += !tuned.complete   ? "stopped, nothing written"
          : options.dry_run ? "nothing written (--dry-run)"
                            : "written: " + file.string();
  const Json value = {{"device", context->report().name},
                      {"cached", false},
                      {"clock", tuned.clock},
                      {"sizes", options.sizes},
                      {"repetitions", options.repetitions},
                      {"parameters", fields},
                      {"frame_time", json_of(tuned.frame_time)},
                      {"tuning", json_of(tuned.tuning)},
                      {"file", file.string()},
                      {"written", writes},
                      {"seconds", seconds},
                      {"complete", tuned.complete}};
  const bool clean = validation_clean(*context);
  return {text, value, !tuned.complete ? kInterrupted : clean ? 0 : kInternalError};
}

}  // namespace

void add_tune(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command =
      program.add_subcommand("tune", "Find the kernel constants that run fastest on a device, and keep them");
  auto options = std::make_shared<Options>();
  command->add_option("--sizes", options->sizes, "Frame sizes to tune for, e.g. 640x480,1392x1042")
      ->delimiter(',')
      ->expected(1, 8);
  command->add_setting("--repetitions", options->repetitions, Check::range(3, 200),
                       "Paired runs that decide for or against a candidate");
  command->add_flag("--dry-run", options->dry_run, "Measure and print, write nothing");
  command->add_flag("--force", options->force, "Measure even where the device was measured before");
  add_common(*command, common,
             "  palpate-lab tune                        once a device, about half a minute\n"
             "  palpate-lab tune --force --sizes 1920x1080\n"
             "  palpate-lab tune --dry-run --json       what it would choose\n");
  command->runs(chosen, [&common, options] { return tune(common, *options); });
}

}  // namespace palpate
