// How a lump network is made from pressed blocks.
#pragma once

#include <vector>

#include "engine/lump/training/options.h"

namespace palpate {

/// Deterministic by seed, whatever the number of threads. Throws Error(Failure::Input) where the examples do
/// not do: other blocks, too few, no blocks without a lump.
LumpNetwork train_lumps(const std::vector<LumpExample>& examples, const LumpTrainingOptions& options,
                        LumpTrainingReport& report);

}  // namespace palpate
