#include "engine/pipeline/skin_slip.h"

#include <algorithm>
#include <cmath>

#include "engine/base/numbers.h"

namespace palpate {
namespace {

/// Frames over which what moves alike sticks; slower than its error over that way, a slip is not seen to end.
constexpr size_t kRecent = 10;

bool known(const SkinMotion& skin) {
  return skin.shift_x_mm.validity == Validity::Valid && skin.shift_y_mm.validity == Validity::Valid;
}

}  // namespace

SlipWitness SkinSlip::witness(const Moment& from, const Moment& to, const Pose& pose) const {
  Pose way = pose;
  way.motion = to.object * from.object.inverse();
  // What both moments share of key frames before is no error of the way between.
  const Matrix6d shared = (to.covariance - to.since_key) - (from.covariance - from.since_key);
  way.covariance = to.since_key + from.since_key;
  way.covariance.diagonal() += shared.diagonal().cwiseMax(0);
  const auto between = [](const Estimate& a, const Estimate& b) {
    return Estimate{b.value - a.value, std::hypot(a.standard_error, b.standard_error), b.validity};
  };
  const Estimate x = between(from.skin.shift_x_mm, to.skin.shift_x_mm),
                 y = between(from.skin.shift_y_mm, to.skin.shift_y_mm);
  return slip_between(way.components(),
                      {.shift_mm = {x.value, y.value}, .shift_sd_mm = {x.standard_error, y.standard_error}});
}

void SkinSlip::follow(const Pose& pose, Touch& touch) {
  ObjectPose& object = *touch.object;
  object.on_skin = OnSkin::Unknown;
  object.slip_mm.fill({kNaN, kNaN, Validity::NotFollowed});
  const bool followed = pose.state == PoseState::Begun || pose.state == PoseState::Tracked;
  if (!followed || !touch.skin || !known(*touch.skin) || touch.contacts.size() > 1) {
    stuck_.reset();
    recent_.clear();
    return;
  }
  const Moment now{pose.track, pose.motion, pose.covariance, pose.since_key, *touch.skin};
  // A track that begins anew, or has just begun, counts from there.
  if (pose.state == PoseState::Begun || !stuck_ || stuck_->track != now.track) {
    stuck_ = now;
    recent_.clear();
  }
  recent_.push_back(now);
  if (recent_.size() > kRecent) recent_.pop_front();
  SlipWitness seen = witness(*stuck_, now, pose);
  if (seen.on_skin != OnSkin::Unknown && recent_.size() == kRecent) {
    const SlipWitness lately = witness(recent_.front(), now, pose);
    if (lately.on_skin == OnSkin::Sticks) {
      stuck_ = now;
      seen = lately;
    }
  }
  object.on_skin = seen.on_skin;
  for (size_t k = 0; k < 2; ++k) {
    const bool told = !std::isnan(seen.slip_mm[k]);
    object.slip_mm[k] = {seen.slip_mm[k], seen.slip_sd_mm[k],
                         told ? Validity::Valid : Validity::Undetermined};
  }
}

}  // namespace palpate
