// Cases of a data set as examples to learn from and to be judged by.
#pragma once

#include <vector>

#include "engine/lump/dataset/file.h"
#include "engine/lump/training/training.h"

namespace palpate {

/// The cases that reached at least one load, in their order; loads that were not reached are left out.
std::vector<LumpExample> lump_examples(const LumpData& data);

}  // namespace palpate
