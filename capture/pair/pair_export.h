// What two fingers have in common, in the files of both for other programs.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "capture/run/process/files_for_others.h"

namespace palpate {

/// The rows of pairs.csv in `folder`, as the group /pair of HDF5 and the topic /pair of MCAP, and the logs
/// beside both. A line of each log. Throws Error.
std::vector<std::string> add_pair_rows(const std::filesystem::path& folder, FilesForOthers& files);

}  // namespace palpate
