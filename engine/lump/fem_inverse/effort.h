// Work that a direct inversion lets the finite elements do: its limit, and whether it was asked to stop.
#pragma once

#include <cstddef>
#include <limits>
#include <utility>

#include "engine/base/stop.h"

namespace palpate::lump {

/// Cells times iterations of their equilibrium, those of conjugate gradients and rounds of Newton's search
/// alike: within some 30 % the time that they take, but the same on every machine.
class Effort {
 public:
  /// `most`: 0 for any. `stop`: null for never.
  Effort(double most, StopAsked stop)
      : most_(most > 0 ? most : std::numeric_limits<double>::infinity()), stop_(std::move(stop)) {}

  /// No more is done, presses end where they are.
  bool spent() const { return done_ >= most_; }
  double done() const { return done_; }

  /// For a solver on so many cells, which asks at each iteration: counts, and ends the press once all is
  /// spent, if it is `limited`. Throws Stopped once stop says so. Lives no longer than this.
  StopAsked watch(size_t cells, bool limited) {
    return [this, cells, limited] {
      check_stop(stop_);
      done_ += static_cast<double>(cells);
      return limited && spent();
    };
  }

 private:
  double most_, done_ = 0;
  StopAsked stop_;
};

}  // namespace palpate::lump
