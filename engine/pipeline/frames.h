// Frames on their way through the device: every stage of the plan, in order.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "engine/measure/contact/gel_contacts.h"
#include "engine/measure/contact/smooth_touch.h"
#include "engine/measure/depth_error.h"
#include "engine/measure/rest_correction.h"
#include "engine/pipeline/frame_parts.h"
#include "engine/pipeline/frame_slot.h"
#include "engine/pipeline/layer_traction.h"
#include "engine/pipeline/object_follower.h"
#include "engine/pipeline/plan.h"
#include "engine/pipeline/surface/surface_method.h"
#include "engine/stages/frame/cell_change.h"
#include "engine/stages/frame/gradient.h"
#include "engine/stages/frame/import_pages.h"
#include "engine/stages/frame/markers.h"
#include "engine/stages/frame/skin.h"
#include "palpate/frame.h"

namespace palpate {

struct ShapeScale;

/// The caller numbers the slots, 0 to FramePlan::slots - 1, and says which frame goes where: each slot holds
/// one frame, from `submit` until the caller uses the slot again.
class Frames {
 public:
  /// `sensor` lives longer than this.
  Frames(gpu::Context& context, const Sensor& sensor, const FrameFormat& format, const FramePlan& plan,
         const Tuning& tuning);
  ~Frames();

  /// The untouched image, of the frames' format. Waits for the frames in flight that read the last one.
  void set_background(const Frame& background);
  /// Starts a frame. After a failure the slot is as it was.
  void submit(uint32_t slot, const Frame& frame);
  bool finished(uint32_t slot) const;
  /// Waits for the slot's frame, and gives its lease back.
  void wait(uint32_t slot);
  /// Parts of the finished frame by itself, valid until the next one; solves what the host has to.
  FrameParts& measure(uint32_t slot);
  /// FramePlan::motion: adds the object's pose to the parts of the frame that was measured last. `after_gap`:
  /// the frames before are not its predecessors.
  void follow_object(uint32_t slot, bool after_gap);
  /// The same frame, once its skin is followed: what the object does on it.
  void follow_object_on_skin(Touch& touch) { object_->follow_skin(touch); }
  /// The object's track begins anew.
  void restart_motion();

  /// As Result's, of a frame that is measured. `rest_mm`: SurfaceSummary::depth_offset_mm.
  void read_depth_mm(uint32_t slot, double rest_mm, std::vector<float>& depth_mm) const;
  std::vector<uint16_t> read_confidence(uint32_t slot) const;
  std::vector<gpu::ScopeTime> times(uint32_t slot) const;
  std::vector<gpu::ScopeTraffic> traffic() const;
  uint64_t memory_bytes() const;

 private:
  void make(FrameSlot& slot);
  void record(FrameSlot& slot);
  void record(FrameSlot& slot, gpu::Commands& commands, bool weighted);
  void upload(FrameSlot& slot, const Frame& frame);
  void find_skin(const Frame& untouched);
  void measure_confidence(FrameSlot& slot);
  void measure_contact(const FrameSlot& slot);
  void measure_regions(const FrameSlot& slot, const ShapeScale& scale);
  void measure_gel_contacts(const FrameSlot& slot);
  void correct_rest(FrameSlot& slot);
  SmoothTouch::TakenOff taken_off();
  void measure_skin(FrameSlot& slot);
  void measure_surface(FrameSlot& slot);
  GelContacts::Dent measure_areas();
  void measure_depth_error(FrameSlot& slot, const GelContacts::Dent& dent);
  void measure_markers(const FrameSlot& slot);
  void set_whole();
  void forget();

  gpu::Context& context_;
  FrameFormat format_;
  double pitch_mm_per_px_;
  double thickness_mm_;                    ///< of the pad; infinity: not known
  bool separate_;                          ///< nothing is followed from frame to frame
  std::optional<PaddedImage> background_;  ///< where one is subtracted
  Contact contact_;
  std::optional<Regions> regions_;
  std::optional<CellChangeStage> cell_change_;
  std::optional<GelContacts> gel_contacts_;
  std::optional<RestCorrection> rest_correction_;  ///< of a gel's surface
  std::optional<SmoothTouch> smooth_touch_;        ///< that it must not take off
  std::optional<DepthError> depth_error_;          ///< where the sensor file states one
  std::optional<Gradient> gradient_;
  std::optional<Skin> skin_;
  std::optional<Markers> markers_;
  std::optional<Confidence> confidence_;
  std::unique_ptr<SurfaceMethod> surface_;
  std::optional<LayerTraction> traction_;
  std::optional<ObjectFollower> object_;  ///< whose motion is asked for
  std::optional<ImportPages> pages_;      ///< where leased frames are read in place
  std::vector<Region> found_;  ///< in the frame that is measured; kept so that frames allocate nothing
  std::vector<ContactTouch> gray_regions_;
  FrameParts parts_;
  std::deque<FrameSlot> slots_;
};

}  // namespace palpate
