// Observer of a long run: decides whether it continues, and receives its progress.
#pragma once

#include <cstdint>
#include <functional>

namespace palpate {

struct RunWatch {
  /// Told of the work done so far; lives as long as that part of the run.
  using Progress = std::function<void(uint64_t done)>;

  std::function<bool()> stop = {};  ///< asked between frames, and by sources that wait; true: the run ends
  /// Begins a part of the run, so many frames or presses long; total 0: unknown.
  std::function<Progress(const char* what, uint64_t total)> progress = {};

  bool stopped() const { return stop && stop(); }
  Progress begin(const char* what, uint64_t total) const {
    return progress ? progress(what, total) : [](uint64_t) {};
  }
};

}  // namespace palpate
