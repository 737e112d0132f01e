// Touch history: state carried over from earlier frames, contacts' ids, the force's branch, shear and slip.
#pragma once

#include <optional>
#include <span>

#include "engine/measure/contact/contact_tracker.h"
#include "engine/measure/force.h"
#include "engine/measure/motion/shear.h"
#include "engine/measure/motion/skin_motion.h"
#include "palpate/sensor.h"
#include "palpate/touch.h"

namespace palpate {

class TouchHistory {
 public:
  /// `contacts`: they are told apart. `separate`: as PipelineOptions::separate. `sensor` lives longer than
  /// this.
  TouchHistory(const Sensor& sensor, const FrameFormat& format, bool contacts, bool separate = false);

  /// Frames in order, as assemble() has them by themselves. `after_gap`: the frames before are not the
  /// predecessors of this one. `skin_sd_px`: standard error of each of Touch::skin_points.
  void follow(Touch& touch, bool after_gap, std::span<const float> skin_sd_px = {});

 private:
  void interrupt();
  void measure_alone(Touch& touch);
  void follow_skin(Touch& touch, std::span<const float> skin_sd_px);

  const Sensor& sensor_;
  bool separate_;
  ForceHistory force_;
  SkinTracker skin_;
  ShearTracker shear_;
  std::optional<ContactTracker> contacts_;
};

}  // namespace palpate
