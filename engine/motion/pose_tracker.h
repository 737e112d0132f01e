// Pose tracker: where the object that touches the pad has moved since it was first seen.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <utility>

#include "engine/motion/key_memory.h"
#include "engine/motion/registration.h"
#include "palpate/object_pose.h"

namespace palpate {

struct PoseOptions {
  SurfaceOptions surface;
  RegistrationOptions registration;
  MemoryOptions memory;
  /// Relative standard error of the maps' depths, the same in all: turns about axes along the pad are wrong
  /// by as much, all alike, and do not average over key frames.
  double gain_sd = 0;
  /// Standard error of RegistrationOptions::skin_smoothing_mm2, mm2, which all key frames share, too.
  double skin_smoothing_sd_mm2 = 0;
  // A frame becomes the new key frame where it shares less than this with the last one, is turned from it by
  // more than this, or leaves so many times the residual of the key frame's first frame.
  double key_overlap = 0.6;
  double key_turn_deg = 10;
  double key_residual = 1.6;
  // Beyond these the track is lost.
  double least_overlap = 0.25;
  double most_residual =
      3;  ///< times that of the frames before, the largest of which fades by a tenth a frame
  double least_fitting = 0.6;       ///< part of the pixels
  double most_disagreement = 0.25;  ///< Registration::disagreement
  double most_step = 1.0 / 3;       ///< motion of the contact's middle in a frame, in diameters
  // A contact that still grows is no rigid one: a track begins anew where its first key frame has grown by so
  // much, and its middle has gone along the pad by no more than so many radii.
  double grown = 1.2, still = 0.1;
};

/// Of the object's point at at_mm: its shifts since the track began, and the object's turns about the axes x,
/// y and z (the rotation vector), in the pad's axes; NaN, error too, where the surface does not determine
/// them.
struct PoseComponents {
  double shift_mm[3] = {}, shift_sd_mm[3] = {};
  double turn_rad[3] = {}, turn_sd_rad[3] = {};
};

struct Pose {
  PoseState state = PoseState::NoContact;
  PoseLoss loss = PoseLoss::None;
  PoseDoubt doubt = PoseDoubt::None;
  uint32_t track = 0;  ///< counts from 1
  uint32_t keys = 0;   ///< key frames of the track so far
  /// How often an earlier key frame was seen again. In that frame the motion jumps by what it had drifted,
  /// and the covariance falls to that of the earlier one and the link to it.
  uint32_t returns = 0;
  // Where tracked or begun:
  RigidMotion motion = {};  ///< of the object since the track began; see components() for what of it is known
  Eigen::Vector3d at_mm = Eigen::Vector3d::Zero();  ///< where what follows is seen
  /// Of the small motion about at_mm that is missing, the errors of all key frames in it.
  Matrix6d covariance = Matrix6d::Zero();
  Matrix6d since_key = Matrix6d::Zero();  ///< of that, the part since the last key frame
  Freedom freedom = {};                   ///< what is unknown of the motion since the track began
  Slippage surface = Slippage::None;      ///< what the contact is now
  Eigen::Vector3d pivot_mm = Eigen::Vector3d::Zero();  ///< Freedom::pivot_mm of that
  /// How far the object may have turned unseen about axes along the pad: by rolling on its way since the
  /// track began, over the height of its pivot or the contact's radius, and as far as it is seen to turn; a
  /// radian at most.
  double roll_rad = 0;
  double residual_mm = 0;
  double overlap = 0;

  /// At another place of the object, such as a ball's centre, whose shifts are known where those of its
  /// surface are not.
  PoseComponents components(const Eigen::Vector3d& place_mm) const;
  PoseComponents components() const { return components(at_mm); }
};

class PoseTracker {
 public:
  /// `sums`: who adds up the pixels.
  explicit PoseTracker(const PoseOptions& options = {}, std::unique_ptr<PixelSums> sums = host_sums())
      : options_(options), sums_(std::move(sums)), memory_(memory_of(options)) {}

  /// Frames in order. Throws Error where a map is not as HeightMap says.
  const Pose& update(const HeightMap& map);
  /// A frame that nothing touches: the track ends.
  const Pose& lift();
  /// The next frame that something touches begins a new track.
  void restart() { lift(); }
  uint64_t memory_bytes() const { return sums_->memory_bytes(); }  ///< on a device

 private:
  static MemoryOptions memory_of(const PoseOptions& options) {
    MemoryOptions memory = options.memory;
    memory.gain_sd = options.gain_sd;
    memory.skin_smoothing_sd_mm2 = options.skin_smoothing_sd_mm2;
    return memory;
  }
  struct Found {
    Registration registration;
    PoseLoss loss = PoseLoss::None;
  };
  void begin(ContactSurface surface, uint32_t track);
  bool still_grows(const ContactSurface& surface, const Registration& found) const;
  Found find(const ContactSurface& surface) const;
  /// Where one rigid object explains the frame badly: the largest of its contacts alone, if that is better.
  bool find_apart(const HeightMap& map, Found& found, ContactSurface& surface) const;
  PoseDoubt doubt_of(const Registration& found);
  PoseLoss loss_of(const Registration& found) const;
  /// The pose, by a motion from one of the track's key frames.
  void take(const TrackKey& key, const Registration& found);
  void go_on(const Registration& found);
  /// Takes the pose from an earlier key frame, if the new one shows it again.
  void look_back(const ContactSurface& surface);
  bool needs_key(const Registration& found) const;
  void make_key(ContactSurface surface);

  PoseOptions options_;
  std::unique_ptr<PixelSums> sums_;
  Pose pose_;
  TrackKey key_;
  KeyMemory memory_;
  RigidMotion from_key_, last_step_;
  // Error of from_key_, and of all before, without those of levels; of those, the first frame's.
  Matrix6d link_ = Matrix6d::Zero(), before_ = link_, first_ = link_;
  Vector6d tilted_ = Vector6d::Zero(), smoothed_ = tilted_;  // as of a TrackKey, of the pose
  Eigen::Vector3d last_at_mm_ = Eigen::Vector3d::Zero();
  double last_residual_mm_ = 0, high_residual_mm_ = 0, calm_residual_mm_ = 0;
  double way_mm_ = 0;      // along the pad since the track began, at most
  bool restless_ = false;  // the last frame left twice the calm residual
};

}  // namespace palpate
