// The sensor files that come with the program, wherever it was built or installed.
#pragma once

#include <filesystem>
#include <vector>

namespace palpate {

/// Their folder: capture/sensors next to the build folder, or share/palpate/sensors of an installation. Empty
/// where there is neither.
std::filesystem::path shipped_sensors_folder();
/// The files, by name.
std::vector<std::filesystem::path> shipped_sensors();

}  // namespace palpate
