#include "viz/commands/option_groups/block_options.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "capture/camera/camera_options.h"
#include "capture/files/tables/gauge.h"
#include "capture/run/palpation/press_timeline.h"
#include "capture/synthetic/tissue.h"
#include "engine/palpation/hand/press_reader.h"
#include "palpate/error.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"

namespace palpate {
namespace {

constexpr const char* kBlockGroup = "Block of tissue";

using Force = std::function<std::optional<double>(uint64_t)>;

Force true_force(const TissueOptions& tissue) {
  auto block = std::make_shared<const TissueSensor>(tissue);
  return [block](uint64_t sequence) { return block->block_force_N(sequence); };
}

/// Force of a table, at the frames of a recording.
Force gauge_force(const std::string& file, const MeasuredInput& input) {
  auto gauge = std::make_shared<const Gauge>(read_gauge(file, GaugeColumns::Normal));
  if (gauge->by_frame())
    return [gauge](uint64_t sequence) { return gauge_at_frame(*gauge, gauge->force_N, sequence); };
  std::vector<std::string> notes;
  const PressTimeline t = measure_press({input.input, {}, file}, input, notes, {.stop = interrupted});
  for (const std::string& note : notes) spdlog::info("{}", note);
  auto forces = std::make_shared<std::map<uint64_t, double>>();
  for (size_t i = 0; i < t.sequence.size(); ++i)
    if (std::isfinite(t.force_N[i])) forces->emplace(t.sequence[i], t.force_N[i]);
  return [forces](uint64_t sequence) {
    const auto there = forces->find(sequence);
    return there == forces->end() ? std::nullopt : std::optional(there->second);
  };
}

Force force_of(const BlockChoice& choice, const MeasuredInput& input,
               const std::optional<TissueOptions>& tissue) {
  if (choice.gauge.empty()) return tissue ? true_force(*tissue) : Force();
  if (choice.gauge == "truth") {
    if (!tissue)
      throw Error(Failure::Usage, "a gauge's table", "'truth', which only synthetic blocks of tissue have",
                  "--gauge FILE.csv");
    return true_force(*tissue);
  }
  if (is_camera(input.input))
    throw Error(Failure::Usage, "a recording with --gauge FILE", "a camera",
                "palpate record, then palpate replay SESSION --gauge FILE");
  return gauge_force(choice.gauge, input);
}

/// What --by-hand needs beyond a block.
void check_by_hand(const BlockChoice& choice, const MeasuredInput& input, const Frame& background,
                   const BlockSetting& block, bool force_known) {
  if (!choice.window_mm.empty())
    throw Error(Failure::Usage, "--by-hand, where the skin tells the window's place",
                "--window-at-mm with it", "one of them");
  check_hand(input.sensor, background.format, {.block_mm = block.block_mm, .young_Pa = block.young_Pa});
  if (!force_known)
    throw Error(Failure::Usage, "the force on the whole block, for --by-hand", "no gauge",
                is_camera(input.input)
                    ? "palpate record without it, then palpate replay SESSION --by-hand --gauge FILE.csv"
                    : "--gauge FILE.csv");
}

}  // namespace

CommandOption* add_block(CommandLine& command, std::vector<double>& block_mm, double& young_Pa) {
  command.add_option("--block-mm", block_mm, "Length, width and thickness of the tissue (default 40 40 20)")
      ->expected(3)
      ->check(Check::positive());
  return command.add_option("--young-Pa", young_Pa, "Young's modulus of the tissue")
      ->check(Check::positive());
}

void BlockChoice::add_to(CommandLine& command) {
  add_block(command, block_mm, young_Pa);
  command
      .add_option("--window-at-mm", window_mm,
                  "The window's middle from the block's, x y (default 0 0, or the synthetic block's)")
      ->expected(2);
  command.add_option("--gauge", gauge,
                     "CSV of the force on the whole block, with a recording (default: what the window "
                     "sees, where it sees all of the block; truth: of synthetic blocks)");
  command.add_flag("--by-hand", by_hand,
                   "The window goes from place to place without a stage; a window puts its presses together");
  for (const char* name : {"--block-mm", "--young-Pa", "--window-at-mm", "--gauge", "--by-hand"})
    command.get_option(name)->group(kBlockGroup);
}

std::unique_ptr<PressMonitor> monitor_presses(const BlockChoice& choice, const MeasuredInput& input,
                                              const Frame& background, uint64_t round) {
  const std::optional<TissueOptions> tissue = tissue_behind(input);
  if (!tissue && !choice.given()) return nullptr;
  PressSetup setup;
  BlockSetting& block = setup.block;
  if (tissue) block = {tissue->scene.block_mm, tissue->scene.young_Pa, {tissue->x_mm, tissue->y_mm}};
  setup.placed = !choice.by_hand && (!tissue || tissue->hand == 0);
  std::copy_n(choice.block_mm.begin(), choice.block_mm.size(), block.block_mm.begin());
  std::copy_n(choice.window_mm.begin(), choice.window_mm.size(), block.window_mm.begin());
  if (choice.young_Pa > 0) block.young_Pa = choice.young_Pa;
  if (!tissue && !(choice.young_Pa > 0))
    throw Error(Failure::Usage, "the tissue's modulus with the block's other properties", "none",
                "--young-Pa E, from a place without a lump");
  setup.force = force_of(choice, input, tissue);
  if (choice.by_hand) check_by_hand(choice, input, background, block, setup.force != nullptr);
  if (round > 0 && setup.force)
    setup.force = [force = std::move(setup.force), round](uint64_t sequence) {
      return force(sequence % round);
    };
  return std::make_unique<PressMonitor>(input.sensor, background, std::move(setup));
}

}  // namespace palpate
