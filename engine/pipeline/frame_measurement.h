// What the device wrote of a frame becomes a touch in physical units, and is followed from frame to frame.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "engine/pipeline/frame_slot.h"
#include "engine/measure/contact_shape.h"
#include "engine/measure/contact_tracker.h"
#include "engine/measure/force.h"
#include "engine/measure/shear.h"
#include "engine/measure/skin_motion.h"
#include "palpate/sensor.h"
#include "engine/stages/gradient.h"
#include "engine/stages/skin.h"
#include "engine/stages/slope.h"
#include "palpate/touch.h"

namespace palpate {

class Measuring {
 public:
  /// Those that wrote; null where the pipeline has none. They live longer than this.
  struct Stages {
    const Contact* contact = nullptr;
    Regions* regions = nullptr;
    const Datum* datum = nullptr;  ///< with any surface
    const Slope* slope = nullptr;
    const Skin* skin = nullptr;
    const Gradient* gradient = nullptr;
    const WeightedFrame* partial = nullptr;
  };
  /// `sensor` lives longer than this.
  Measuring(const Sensor& sensor, const FrameFormat& format, const Stages& stages);

  /// Of a frame that the device has finished, in the order of the frames: force, shear, slip and ids follow
  /// from those before.
  Touch measure(const FrameSlot& slot);
  /// Regions get no ids: somebody else follows them.
  void leave_unfollowed() { tracker_.reset(); }

 private:
  void measure_regions(const FrameSlot& slot, std::span<const shared::ContactRecord> records,
                       const ShapeScale& scale, Touch& t);
  void measure_skin(const FrameSlot& slot, Touch& t);
  void measure_clipped(const FrameSlot& slot, Touch& t) const;
  void measure_elastic(const FrameSlot& slot, const RestLevel& map_level, Touch& t) const;
  void measure_lookup(const RestLevel& map_level, Touch& t) const;

  const Sensor& sensor_;
  FrameFormat format_;
  Stages stages_;
  std::optional<ContactTracker> tracker_;
  std::vector<Region> found_;  // of the frame that is measured; kept so that frames allocate nothing
  ForceHistory force_;
  std::vector<float> skin_sd_px_;
  SkinTracker skin_tracker_;
  ShearTracker shear_;
};

}  // namespace palpate
