#include "viz/live/trail.h"

#include <algorithm>

namespace palpate::viz {

void Trail::add(const Touch& touch) {
  if (!touch.object || touch.object->state == PoseState::PictureDamaged) return;
  const ObjectPose& pose = *touch.object;
  if (pose.state != PoseState::Begun && pose.state != PoseState::Tracked) return clear();
  if (pose.track != track_) {
    clear();
    track_ = pose.track;
    // Where it was when the track began, of a track that is seen from its middle on too.
    for (size_t k = 0; k < 3; ++k)
      for (size_t c = 0; c < 3; ++c)
        first_mm_[k] += pose.rotation[3 * c + k] * (pose.at_mm[c] - pose.translation_mm[c]);
  }
  std::array<double, 2> now{pose.translation_mm[0], pose.translation_mm[1]};
  for (size_t k = 0; k < 2; ++k)
    for (size_t c = 0; c < 3; ++c) now[k] += pose.rotation[3 * k + c] * first_mm_[c];
  places_.push_back(now);
  if (places_.size() > kMost) places_.pop_front();
  for (size_t axis = 0; axis < 3; ++axis) axes_[axis] = {pose.rotation[axis], pose.rotation[3 + axis]};
  turns_known_ = std::ranges::all_of(pose.turn_rad, [](const Estimate& turn) { return turn.valid(); });
}

}  // namespace palpate::viz
