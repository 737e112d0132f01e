// Waiting for an event instead of for a time: no test may depend on the machine's speed.
#pragma once

#include <chrono>
#include <functional>
#include <thread>

namespace palpate {

/// Against waits without end, nothing else: no machine is that slow.
inline constexpr std::chrono::seconds kHangs{600};

/// Asks until it is so; false where something hangs.
inline bool eventually(const std::function<bool()>& is_so,
                       std::chrono::milliseconds between = std::chrono::milliseconds(5)) {
  const auto end = std::chrono::steady_clock::now() + kHangs;
  while (!is_so()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(between);
  }
  return true;
}

}  // namespace palpate
