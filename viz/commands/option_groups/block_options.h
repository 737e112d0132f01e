// Options of a pressed block of tissue on the command line, and the monitor of its presses.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "capture/run/input.h"
#include "engine/palpation/press_monitor.h"
#include "viz/commands/command.h"

namespace palpate {

class CommandLine;
class CommandOption;

/// --block-mm and --young-Pa, the latter returned.
CommandOption* add_block(CommandLine& command, std::vector<double>& block_mm, double& young_Pa);

/// Block given on the command line. Empty: only the values that an input knows itself.
struct BlockChoice {
  std::vector<double> block_mm;   ///< length, width, thickness; empty: 40 40 20
  double young_Pa = 0;            ///< of the tissue; 0: not said
  std::vector<double> window_mm;  ///< the window's middle from the block's; empty: 0 0
  std::string gauge;  ///< CSV of the force on the block, or "truth" of a synthetic block; empty: not said
  bool by_hand =
      false;  ///< nobody knows where the window lies: the skin tells (a synthetic hand's without it)

  /// The choice must outlive the parsing.
  void add_to(CommandLine& command);
  bool given() const {
    return !block_mm.empty() || young_Pa > 0 || !window_mm.empty() || !gauge.empty() || by_hand;
  }
};

/// Watches presses where a block is known: from `choice`, or because the input is the synthetic one. Null
/// where it is not. A gauge's table that counts time is brought together with a recording, which is read once
/// for that. `round`: frames after which the numbers of a looped recording begin anew; 0: never. Throws
/// Error(Failure::Usage) on a block without a modulus, on a gauge with a camera, and on presses by hand whose
/// place is stated or whose force is not known, and as check_hand() and measure_press() do.
std::unique_ptr<PressMonitor> monitor_presses(const BlockChoice& choice, const MeasuredInput& input,
                                              const Frame& background, uint64_t round = 0);

}  // namespace palpate
