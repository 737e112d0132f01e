// Still noise: how far the frames of a pad that nothing touches differ from one another.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "palpate/frame.h"

namespace palpate {

class StillNoise {
 public:
  /// A frame of three channels that nothing touches; frames of one format.
  void add(const Frame& frame);
  /// Standard deviation of a frame's red, green and blue, units of full scale; 0: there were no two frames
  /// that differ. The median over the pairs that follow one another, so that one with a faint touch does not
  /// count.
  std::array<double, 3> sd() const;

 private:
  std::optional<Frame> last_;
  std::array<std::vector<double>, 3> variances_;  ///< of each pair
};

}  // namespace palpate
