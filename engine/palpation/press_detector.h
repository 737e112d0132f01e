// Presses in a force over time: when one begins, and when it is over.
#pragma once

#include <cstddef>
#include <vector>

namespace palpate {

class PressDetector {
 public:
  static constexpr double kOver = 0.6;  ///< fraction of the highest force below which a press is over
  /// Rise after it, fraction of the last press's highest force, that is a new one though nothing was taken
  /// away.
  static constexpr double kAgain = 0.15;

  /// `least_N`: from which force on something presses, above 0.
  explicit PressDetector(double least_N) : least_N_(least_N) {}

  /// From the next frame on.
  void set_least(double least_N) { least_N_ = least_N; }

  enum class Step : unsigned char {
    Rest,      ///< nothing presses, or a press is being taken away
    Began,     ///< this frame is the first of a press
    Pressing,  ///< and this one goes on with it
    Over,      ///< this frame no longer belongs to the press
  };
  /// `force_N`: of the next frame, on the whole block.
  Step add(double force_N);
  /// Gives up the present press: the next one begins after a rest.
  void break_off();

  bool pressing() const { return state_ == State::Pressing; }
  double highest_N() const { return highest_N_; }  ///< of this press, or the last one

 private:
  enum class State : unsigned char { Rest, Pressing, Leaving };
  double least_N_;
  State state_ = State::Rest;
  double highest_N_ = 0, lowest_N_ = 0;  ///< lowest: since the last press was over; below 0: given up
};

/// Frames of one press, `first` to `last`.
struct PressSpan {
  size_t first = 0, last = 0;
  double highest_N = 0;
};
/// All presses in the forces of a recording's frames that reach `least_N`; a force that is not known (NaN)
/// ends one.
std::vector<PressSpan> find_presses(const std::vector<double>& force_N, double least_N);

}  // namespace palpate
