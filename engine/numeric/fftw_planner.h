// FFTW makes and destroys plans from one thread at a time, across all its users.
#pragma once

#include <mutex>

namespace palpate {

inline std::mutex& fftw_planner() {
  static std::mutex mutex;
  return mutex;
}

}  // namespace palpate
