#include "perf/profile/machine.h"

#include <sys/utsname.h>
#include <unistd.h>

#include <Eigen/Core>
#include <fstream>
#include <opencv2/core/version.hpp>

#include "engine/base/clock.h"
#include "engine/gpu/context.h"

namespace palpate::perf {
namespace {

std::string cpu_name() {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);) {
    const size_t colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) return line.substr(colon + 2);
  }
  utsname system{};
  uname(&system);
  return system.machine;
}

}  // namespace

Machine describe_machine(const gpu::Context& context) {
  const gpu::DeviceReport& report = context.report();
  utsname system{};
  uname(&system);
  Machine machine;
  machine.device = report.name;
  machine.device_type = report.type;
  machine.driver = report.driver;
  machine.vulkan = report.api_version;
  machine.device_memory_bytes = report.memory_bytes;
  machine.cpu = cpu_name();
  machine.cpu_threads = static_cast<uint32_t>(std::max(1L, sysconf(_SC_NPROCESSORS_ONLN)));
  machine.memory_bytes = static_cast<uint64_t>(std::max(0L, sysconf(_SC_PHYS_PAGES))) *
                         static_cast<uint64_t>(std::max(0L, sysconf(_SC_PAGE_SIZE)));
  machine.system = std::string(system.sysname) + " " + system.release + " " + system.machine;
#ifdef __clang__
  machine.compiler = std::string("Clang ") + __clang_version__;
#else
  machine.compiler = std::string("GCC ") + __VERSION__;
#endif
  machine.palpate = PALPATE_VERSION;
  machine.libraries = "Eigen " + std::to_string(EIGEN_WORLD_VERSION) + "." +
                      std::to_string(EIGEN_MAJOR_VERSION) + "." + std::to_string(EIGEN_MINOR_VERSION) +
                      ", OpenCV " + CV_VERSION;
  machine.date_utc = utc_now();
  return machine;
}

}  // namespace palpate::perf
