// Whole frame: every stage of the plan over all pixels.
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "engine/measure/gel_contacts.h"
#include "engine/pipeline/frame_slot.h"
#include "engine/pipeline/frames.h"
#include "engine/pipeline/layer_traction.h"
#include "engine/pipeline/plan.h"
#include "engine/pipeline/surface/surface_method.h"
#include "engine/stages/frame/cell_change.h"
#include "engine/stages/frame/gradient.h"
#include "engine/stages/frame/import_pages.h"
#include "engine/stages/frame/markers.h"
#include "engine/stages/frame/skin.h"

namespace palpate {

struct ShapeScale;

class WholeFrame : public Frames {
 public:
  /// `sensor` lives longer than this.
  WholeFrame(gpu::Context& context, const Sensor& sensor, const FrameFormat& format, const FramePlan& plan,
             const Tuning& tuning);
  ~WholeFrame() override;

  void set_background(const Frame& background) override;
  void submit(uint32_t slot, const Frame& frame) override;
  bool finished(uint32_t slot) const override;
  void wait(uint32_t slot) override;
  FrameMeasurement measure(uint32_t slot, Touch& touch) override;
  std::vector<float> read_depth_mm(uint32_t slot, double rest_mm) const override;
  std::vector<uint16_t> read_confidence(uint32_t slot) const override;
  std::vector<gpu::ScopeTime> times(uint32_t slot) const override;
  std::vector<gpu::ScopeTraffic> traffic() const override;
  uint64_t memory_bytes() const override;

  /// Frames submitted from here on are parts of larger ones: centroids are theirs, and weights that vary over
  /// the frame.
  void place(const FramePlace& place);

 private:
  void make(FrameSlot& slot);
  void record(FrameSlot& slot);
  void record(FrameSlot& slot, gpu::Commands& commands, bool weighted);
  void upload(FrameSlot& slot, const Frame& frame);
  void find_skin(const Frame& untouched);
  void measure_contact(const FrameSlot& slot, Touch& touch);
  void measure_regions(const FrameSlot& slot, const ShapeScale& scale, Touch& touch);
  void measure_gel_contacts(const FrameSlot& slot, Touch& touch);
  void record_rest_correction(FrameSlot& slot);
  void set_whole(Touch& touch) const;
  void forget();
  void measure_markers(const FrameSlot& slot, Touch& touch) const;
  void correct_rest(FrameSlot& slot, Touch& touch);
  void measure_areas(Touch& touch);

  gpu::Context& context_;
  FrameFormat format_;
  double pitch_mm_per_px_;
  bool separate_;  ///< nothing is followed from frame to frame
  FramePlace place_;
  std::optional<PaddedImage> background_;  ///< where one is subtracted
  Contact contact_;
  std::optional<Regions> regions_;
  std::optional<CellChangeStage> cell_change_;
  std::optional<GelContacts> gel_contacts_;
  std::optional<RestCorrection> rest_correction_;  ///< of a gel's surface
  std::optional<Gradient> gradient_;
  std::optional<Skin> skin_;
  std::optional<Markers> markers_;
  std::optional<Confidence> confidence_;
  std::unique_ptr<SurfaceMethod> surface_;
  std::optional<LayerTraction> traction_;
  std::optional<ImportPages> pages_;  ///< where leased frames are read in place
  std::vector<Region> found_;         ///< in the frame that is measured; kept so that frames allocate nothing
  std::vector<ContactTouch> gray_regions_;
  std::deque<FrameSlot> slots_;
};

}  // namespace palpate
