// Rate of events, as a window shows it.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>

namespace palpate::viz {

/// Events a second over the last second or two.
class Rate {
 public:
  /// `count`: events so far.
  double update(uint64_t count, std::chrono::steady_clock::time_point now);

 private:
  struct Mark {
    std::chrono::steady_clock::time_point at;
    uint64_t count;
  };
  std::deque<Mark> marks_;
};

}  // namespace palpate::viz
