// Words and numbers about a data set of lumps, for people and for machines.
#pragma once

#include <filesystem>
#include <string>

#include "engine/base/facts.h"
#include "perf/lab/dataset/dataset_run.h"

namespace palpate::lump {

/// "123 of 3000 cases, 14.2 a minute, 3 h 22 min left, 2 not converged".
std::string progress_text(const DatasetProgress& progress);

/// Summary of a run, and how to go on where it was interrupted.
std::string dataset_text(const DatasetJob& job, const DatasetReport& report);
json::Value dataset_json(const DatasetJob& job, const DatasetReport& report);

/// Contents of a file: sweep, cases by state and shape, ranges of inputs, forces and pressures; where only
/// its journal is there, how far it came. Throws Error(Failure::Input) where there is neither.
Facts dataset_info(const std::filesystem::path& file);

}  // namespace palpate::lump
