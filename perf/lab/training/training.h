// How a lump network is made from pressed blocks.
#pragma once

#include <vector>

#include "perf/lab/training/options.h"

namespace palpate::lump {

/// Deterministic by seed, whatever the number of threads. Throws Error(Failure::Input) where the examples do
/// not do: other blocks, too few, no blocks without a lump.
Network train_lumps(const std::vector<Example>& examples, const TrainingOptions& options,
                    TrainingReport& report);

/// A network with its weights as they are; its intervals, and the limits of its verdicts, from other blocks,
/// of which it has seen none. Throws as train_lumps().
Network recalibrate_lumps(const Network& network, const std::vector<Example>& examples,
                          const TrainingOptions& options, TrainingReport& report);

}  // namespace palpate::lump
