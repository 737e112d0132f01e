// Free memory of the machine: the largest frames are tested where they fit, and said to be skipped where not.
#pragma once

#include <fstream>
#include <string>

namespace palpate {

/// 0 where the system does not report it.
inline double memory_left_GiB() {
  std::ifstream in("/proc/meminfo");
  for (std::string key; in >> key;) {
    double kib = 0;
    if (key == "MemAvailable:" && in >> kib) return kib / 1048576;
  }
  return 0;
}

}  // namespace palpate
