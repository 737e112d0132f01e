#include "engine/palpation/press_detector.h"

#include <algorithm>

namespace palpate {

PressDetector::Step PressDetector::add(double force_N) {
  switch (state_) {
    case State::Pressing:
      highest_N_ = std::max(highest_N_, force_N);
      if (force_N >= least_N_ && force_N >= kOver * highest_N_) return Step::Pressing;
      state_ = State::Leaving;
      lowest_N_ = force_N;
      return Step::Over;
    case State::Leaving:
      if (lowest_N_ < 0) {  // given up: while it goes on it is not a new one
        highest_N_ = std::max(highest_N_, force_N);
        if (force_N >= kOver * highest_N_) return Step::Rest;
        lowest_N_ = force_N;
      }
      lowest_N_ = std::min(lowest_N_, force_N);
      if (force_N < least_N_) state_ = State::Rest;
      // Pressed again before the sensor was taken away: what merely falls is no press.
      if (force_N < std::max(least_N_, lowest_N_ + kAgain * highest_N_)) return Step::Rest;
      break;
    case State::Rest:
      if (force_N < least_N_) return Step::Rest;
      break;
  }
  state_ = State::Pressing;
  highest_N_ = force_N;
  return Step::Began;
}

void PressDetector::break_off() {
  if (state_ != State::Pressing) return;
  lowest_N_ = -1;
  state_ = State::Leaving;
}

}  // namespace palpate
