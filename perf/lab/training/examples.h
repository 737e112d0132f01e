// Cases of a data set as examples to learn from and to be judged by.
#pragma once

#include <string>
#include <vector>

#include "perf/lab/dataset/file.h"
#include "perf/lab/training/training.h"

namespace palpate::lump {

/// The cases that reached at least one load, in their order; loads that were not reached are left out.
std::vector<Example> lump_examples(const Data& data);
/// Those of a file. Throws Error(Failure::Input) where no case is finished, and as read_lump_file() does.
std::vector<Example> read_examples(const std::string& file);

}  // namespace palpate::lump
