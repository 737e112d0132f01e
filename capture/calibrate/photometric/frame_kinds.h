// The kinds of frame in a recording: frames that are alike.
#pragma once

#include <cstddef>
#include <vector>

#include "palpate/frame.h"

namespace palpate {

/// Collects the frames of one recording and groups those that are alike: means of 8 x 8 px that differ by no
/// more than noise explains in nearly all places, light that changed as a whole taken out.
class FrameKinds {
 public:
  /// Frames of one format, in order; at most kMost of them.
  void add(const Frame& frame);
  size_t frames() const { return frames_.size(); }

  struct Kind {
    size_t example = 0;           ///< the frame that most others are like
    std::vector<size_t> members;  ///< positions among the frames added, rising
  };
  /// Kinds that come three times or more and in a fiftieth of the frames, by their first member.
  std::vector<Kind> find() const;

  static constexpr size_t kMost = 400;

 private:
  /// Whether nearly all means are alike.
  static bool alike(const std::vector<float>& a, const std::vector<float>& b, float limit);
  float limit() const;

  double full_scale_ = 255;
  std::vector<std::vector<float>> frames_;  ///< means, channel by channel
};

}  // namespace palpate
