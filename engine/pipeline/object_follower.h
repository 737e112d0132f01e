// Object follower: a frame's surface and contacts to the pose of what touches the pad (engine/motion).
#pragma once

#include <cstdint>
#include <vector>

#include "engine/measure/contact/gel_contacts.h"
#include "engine/measure/height_rows.h"
#include "engine/motion/pose_tracker.h"
#include "engine/pipeline/rest_change.h"
#include "engine/pipeline/skin_slip.h"
#include "palpate/sensor.h"

namespace palpate {

/// A pose of which nothing is known.
ObjectPose unknown_pose(PoseState state, PoseLoss loss = PoseLoss::None);

/// With what the calibration leaves of slopes and stays with the pad, and no finer pixels than tell of a
/// motion (0.04 mm).
PoseOptions pose_options(const Sensor& sensor);

class ObjectFollower {
 public:
  /// `sensor` has a scale. `sums`: who adds up the pixels. `marked`: printed markers are filled.
  ObjectFollower(const Sensor& sensor, const FrameFormat& format, std::unique_ptr<PixelSums> sums,
                 bool marked);

  /// Takes a copy of a frame's surface as it was solved. What is taken off where the pad seems to be at rest
  /// differs from frame to frame, and would change the object's shape.
  void look_at(const HeightRows& heights);
  /// The same frame, frames in order, as it was measured. `depth_gain_sd`: part of a depth that it is wrong
  /// by. `touched`: whether something touches at all. `contacts`: those of a colour gel; null: what is deeper
  /// than half of the deepest point is in contact. `by_depth`: they are what is in contact by its depth;
  /// outlines, which skin that spans from the object to the pad is in, are not.
  ObjectPose follow(const PadAtRest& rest, double depth_gain_sd, bool touched, const GelContacts* contacts,
                    bool by_depth);
  /// Of the frame that was followed last, once its skin is: what the object does on it.
  void follow_skin(Touch& touch) { slip_.follow(pose_, touch); }
  /// The next frame begins a new track.
  void restart() { tracker_.restart(); }
  uint64_t memory_bytes() const { return tracker_.memory_bytes(); }  ///< on a device

 private:
  void mark(const GelContacts* contacts, bool by_depth);
  void mark_contact(const GelContacts& contacts);
  void keep_deep();
  double rim_slope();

  uint32_t width_, height_;
  double pitch_mm_per_px_;
  bool marked_;
  PoseTracker tracker_;
  Pose pose_;
  double begun_mm_ = 0;  ///< depth of the contact's middle when the track began
  RestChange change_;    ///< since the track began
  SkinSlip slip_;
  std::vector<float> depth_mm_;
  std::vector<uint8_t> contact_;          ///< of each pixel
  std::vector<uint32_t> above_;           ///< rim_slope's: sums of contact_
  std::vector<float> rim_;                ///< slopes there
  std::vector<uint8_t> followed_;         ///< of each cell: it was in the contact that is followed
  std::vector<uint32_t> shared_, cells_;  ///< of each contact, from 1: cells of the one followed; all cells
};

}  // namespace palpate
