#include "engine/palpation/press_detector.h"

#include <algorithm>
#include <cmath>

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

std::vector<PressSpan> find_presses(const std::vector<double>& force_N, double least_N) {
  PressDetector detector(least_N);
  std::vector<PressSpan> found;
  for (size_t i = 0; i < force_N.size(); ++i) {
    const bool known = std::isfinite(force_N[i]);
    if (!known) detector.break_off();
    const PressDetector::Step step = known ? detector.add(force_N[i]) : PressDetector::Step::Rest;
    if (step == PressDetector::Step::Began) found.push_back({i, i, force_N[i]});
    if (!detector.pressing()) continue;
    found.back().last = i;
    found.back().highest_N = detector.highest_N();
  }
  return found;
}

}  // namespace palpate
