#include "capture/sensors/shipped_sensors.h"

#include <algorithm>
#include <system_error>

namespace palpate {

namespace fs = std::filesystem;

fs::path shipped_sensors_folder() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error).parent_path();
  if (error) return {};
  for (const char* place : {"../capture/sensors", "../share/palpate/sensors"})
    if (fs::path folder = (program / place).lexically_normal(); fs::is_directory(folder, error))
      return folder;
  return {};
}

std::vector<fs::path> shipped_sensors() {
  std::vector<fs::path> files;
  std::error_code error;
  const fs::path folder = shipped_sensors_folder();
  if (folder.empty()) return files;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (entry.path().extension() == ".json") files.push_back(entry.path());
  std::ranges::sort(files);
  return files;
}

}  // namespace palpate
