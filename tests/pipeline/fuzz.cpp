// palpate_fuzz: thousands of random cases against the plain CPU versions.
// Prints seed and place of a difference and the smallest case that still shows it.
#include <chrono>
#include <cstdio>
#include <map>

#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "tests/pipeline/fuzz_cases.h"
#include "viz/commands/support/options.h"

namespace {

using namespace palpate;
using namespace palpate::fuzz;

struct Options {
  uint64_t cases = 1000;
  uint64_t seed = 1;
  std::string stage, device;
  bool validation = false;
};

const std::map<std::string, Stage> kStages = {{"contact", Stage::Contact},
                                              {"slope", Stage::Slope},
                                              {"surface", Stage::Surface},
                                              {"pipeline", Stage::Pipeline},
                                              {"gel", Stage::Gel}};

void progress(uint64_t done, uint64_t all) {
  if (done % 100 == 0)
    std::fprintf(stderr, "%llu of %llu\n", static_cast<unsigned long long>(done),
                 static_cast<unsigned long long>(all));
}

int fuzz_stages(const Options& options) {
  gpu::ContextOptions wanted;
  wanted.device = options.device;
  wanted.validation = options.validation;
  gpu::Context context(wanted);
  const Tuning defaults = default_tuning(context);
  std::map<std::string, uint64_t> done;
  for (uint64_t i = 0; i < options.cases; ++i) {
    const uint64_t seed = options.seed + i;
    const Case c = options.stage.empty() ? make_case(seed, defaults)
                                         : make_case(seed, defaults, kStages.at(options.stage));
    if (const std::string where = difference(context, c); !where.empty()) {
      std::printf("DIFFERENT: %s\n  %s\n", describe(c).c_str(), where.c_str());
      const Case small = shrink(context, c);
      std::printf("shrunk to: %s\n  %s\nagain with: --stage %s --seed %llu --cases 1\n",
                  describe(small).c_str(), difference(context, small).c_str(), to_string(c.stage),
                  static_cast<unsigned long long>(seed));
      return 1;
    }
    if (const auto messages = context.validation_messages(); !messages.empty()) {
      std::printf("%s\nvalidation: %s\n", describe(c).c_str(), messages.front().c_str());
      return 1;
    }
    ++done[to_string(c.stage)];
    progress(i + 1, options.cases);
  }
  std::printf("equal on %s:", context.report().name.c_str());
  for (const auto& [stage, count] : done)
    std::printf(" %s %llu", stage.c_str(), static_cast<unsigned long long>(count));
  std::printf(" cases\n");
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine program("palpate_fuzz: random cases against plain loops.", "palpate_fuzz");
  Options options;
  program.add_option("--cases", options.cases, "How many")->capture_default_str();
  program.add_option("--seed", options.seed, "Of the first case; the others follow it")
      ->capture_default_str();
  program.add_option("--stage", options.stage, "contact, slope, surface or pipeline (default: a mixture)")
      ->check(Check::one_of(std::vector<std::string>{"contact", "pipeline", "slope", "surface"}));
  program.add_option("--device", options.device, "Index or part of a name");
  program.add_flag("--validation", options.validation, "Under the Vulkan validation layer");
  if (const std::optional<int> code = program.parse_or_exit(argc, argv)) return *code;
  try {
    return fuzz_stages(options);
  } catch (const Error& error) {
    std::fprintf(stderr, "palpate_fuzz: %s\n", error.what());
    return error.exit_code();
  }
}
