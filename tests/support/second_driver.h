// SwiftShader in addition to the machine's own drivers: a Vulkan implementation on the processor that shares
// nothing with Mesa.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

namespace palpate {

/// Its file for the Vulkan loader, from Debian's chromium-common or PALPATE_SECOND_DRIVER; empty: not
/// installed.
inline std::string second_driver() {
  const char* named = std::getenv("PALPATE_SECOND_DRIVER");
  const std::string file = named ? named : "/usr/lib/chromium/vk_swiftshader_icd.json";
  return std::filesystem::exists(file) ? file : std::string();
}

/// Contexts made during its life see the second driver's device too.
class WithSecondDriver {
 public:
  WithSecondDriver() {
    if (const char* before = std::getenv(kVariable)) before_ = before;
    const std::string file = second_driver();
    if (!file.empty()) setenv(kVariable, (before_.empty() ? file : before_ + ":" + file).c_str(), 1);
  }
  ~WithSecondDriver() {
    if (before_.empty())
      unsetenv(kVariable);
    else
      setenv(kVariable, before_.c_str(), 1);
  }
  WithSecondDriver(const WithSecondDriver&) = delete;
  WithSecondDriver& operator=(const WithSecondDriver&) = delete;

 private:
  static constexpr const char* kVariable = "VK_ADD_DRIVER_FILES";
  std::string before_;
};

}  // namespace palpate
