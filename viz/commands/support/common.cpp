#include "viz/commands/support/common.h"

#include <spdlog/spdlog.h>

#include <cerrno>
#include <cstdio>
#include <utility>

#include "engine/base/readable.h"
#include "engine/gpu/context.h"
#include "engine/gpu/tuning.h"
#include "palpate/error.h"
#include "viz/commands/support/options.h"

namespace palpate {
namespace {

constexpr const char* kExitCodes =
    "Exit codes: 0 done, 1 internal error, 2 usage, 3 input, 4 sensor file, 5 device,\n"
    "            6 display, 7 output, 130 ended by Ctrl-C (what was written is kept).";

/// Name of an option's value in the help; the rest (types, ranges, lists of values) is in each option's own
/// words.
constexpr std::pair<const char*, const char*> kValueNames[] = {
    {"--sensor", "FILE"},
    {"--background", "FILE"},
    {"--out", "DIR"},
    {"--device", "INDEX|NAME"},
    {"--seed", "N"},
    {"--frames", "N"},
    {"--repeat", "N"},
    {"--bits", "N"},
    {"--seconds", "S"},
    {"--patience", "S"},
    {"--rate", "HZ"},
    {"--force", "NEWTON"},
    {"--radius", "MM"},
    {"--size", "WxH"},
    {"--sizes", "WxH,..."},
    {"--repetitions", "N"},
    {"--mode", "NAME"},
    {"--response", "NAME"},
    {"--solver", "NAME"},
    {"--vsync", "NAME"},
    {"--outputs", "LIST"},
    {"--depth", "FORMAT"},
    {"--confidence", "FORMAT"},
    {"--picture-every", "N"},
    {"--depth-range", "MM"},
    {"--exaggeration", "FACTOR"},
    {"--view", "AZIMUTH,ELEVATION"},
    {"--speed", "FACTOR"},
    {"--from", "S"},
    {"--camera", "NODE"},
    {"--format", "NAME"},
    {"--fps", "HZ"},
    {"--exposure", "TIME|auto"},
    {"--gain", "N|auto"},
    {"--white-balance", "K|auto"},
    {"--control", "NAME=VALUE"},
    {"--camera-buffers", "N"},
    {"--camera-timeout", "TIME"},
    {"--weights", "FILE"},
    {"--images", "LIST"},
    {"--every", "N"},
    {"--colours", "QUANTITY"},
    {"--skin-strain", "COMPONENT"},
    {"--colour-map", "NAME"},
    {"--colour-range", "MOST"},
    {"--section", "X0,Y0,X1,Y1"},
    {"--gauge", "FILE"},
    {"--align", "auto|none|S"},
    {"--align-by", "MOMENT"},
    {"--offset", "S"},
    {"--signal", "NAME"},
    {"--model", "NAME"},
    {"--check", "RECORDING"},
    {"--check-gauge", "FILE"},
    {"--plots", "DIR"},
    {"--friction", "MU"},
    {"--balls", "FILE"},
    {"--ball-mm", "MM"},
    {"--ring-mm", "MM"},
    {"--spacing-mm", "MM"},
    {"--travel-mm", "MM,..."},
    {"--grid", "COLUMNSxROWS"},
    {"--pattern", "NAME"},
    {"--indices", "N,..."},
    {"--extinction", "K,..."},
    {"--thickness-mm", "MM,..."},
    {"--angle-deg", "DEG"},
    {"--wavelength-nm", "NM"},
    {"--led-layer", "LAYER"},
    {"--vary", "LAYER:FROM:TO"},
    {"--contact", "N,..."},
    {"--depth-mm", "MM"},
    {"--length-mm", "MM"},
    {"--rays", "N"},
    {"--shape", "NAME"},
    {"--radius-mm", "MM"},
    {"--radius2-mm", "MM"},
    {"--half-angle-deg", "DEG"},
    {"--force-N", "NEWTON"},
    {"--young-kPa", "KPA,..."},
    {"--poisson", "RATIO"},
    {"--series", "NAME"},
    {"--figure", "7|8"},
    {"--corners", "X,Y,..."},
    {"--pitch", "MM/PX"},
    {"--sample", "SHAPE,SIZEmm"},
    {"--shapes", "NAME,..."},
    {"--reported", "VERDICT,..."},
    {"--by", "CONDITION,..."},
    {"--network", "FILE"},
    {"--validate", "FILE"},
    {"--recalibrate", "FILE"},
    {"--positions", "FILE"},
    {"--list", "FILE"},
    {"--approach", "FILE"},
    {"--pad", "MM:PA"},
    {"--method", "NAME"},
    {"--coarser-cells", "AxBxC"},
};

}  // namespace

void add_common(CommandLine& command, Common& common, const std::string& examples) {
  command.add_flag("--json", common.json, "Print one JSON value on stdout and nothing else")
      ->group(kCommonGroup);
  command.add_flag("--quiet", common.quiet, "No progress, no log except errors")->group(kCommonGroup);
  command
      .add_option("--device", common.device,
                  "Vulkan device: index or part of its name (see `palpate devices`)")
      ->group(kCommonGroup);
  command.add_option("--seed", common.seed, "Seed of everything random")
      ->capture_default_str()
      ->group(kCommonGroup);
  command
      .add_flag("--validation", common.validation,
                "Run under the Vulkan validation layer; any message fails the run")
      ->group(kCommonGroup);
  command.name_values(kValueNames, std::size(kValueNames));
  command.footer("Examples:\n" + examples + "\n" + kExitCodes + "\n");
}

void add_jsonl(CommandLine& command, Common& common) {
  command
      .add_flag("--jsonl", common.jsonl,
                "Print each frame as one line of JSON as soon as it is measured, keys as the columns of "
                "measurements.csv, and at the end {\"summary\": ...}")
      ->excludes(command.get_option("--json"));
}

void print_line(const std::string& line) {
  const bool written = std::fputs((line + "\n").c_str(), stdout) >= 0 && std::fflush(stdout) == 0;
  if (!written)
    throw Error(Failure::Output, "to write to stdout", system_words(errno), "another place for the output");
}

std::unique_ptr<gpu::Context> open_device(const Common& common,
                                          const std::vector<const char*>* window_extensions) {
  gpu::ContextOptions options;
  options.device = common.device;
  options.validation = common.validation;
  if (window_extensions) {
    options.instance_extensions = *window_extensions;
    options.presentation = true;
  }
  auto context = std::make_unique<gpu::Context>(options);
  spdlog::info("device: {}", context->report().name);
  const std::string ignored = load_tuning(*context).ignored;
  if (!ignored.empty()) spdlog::warn("{}", ignored);
  return context;
}

bool validation_clean(const gpu::Context& context) {
  const std::vector<std::string> messages = context.validation_messages();
  for (const std::string& message : messages) spdlog::error("validation: {}", message);
  return messages.empty();
}

}  // namespace palpate
