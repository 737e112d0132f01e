// Frames on their way through the device: the one interface of WholeFrame and WindowedFrame.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "palpate/frame.h"
#include "palpate/pipeline.h"
#include "palpate/touch.h"

namespace palpate {

/// What measuring a finished frame leaves beside its Touch.
struct FrameMeasurement {
  SurfaceMap surface;
  TractionMaps traction;
  uint32_t copies = 0;                     ///< as Result::copies
  std::span<const float> skin_sd_px = {};  ///< standard error of each of Touch::skin_points
};

/// The caller numbers the slots, 0 to FramePlan::slots - 1, and says which frame goes where: each slot holds
/// one frame, from `submit` until the caller uses the slot again.
class Frames {
 public:
  virtual ~Frames() = default;

  /// The untouched image, of the frames' format. Waits for the frames in flight that read the last one.
  virtual void set_background(const Frame& background) = 0;
  /// Starts a frame. After a failure the slot is as it was.
  virtual void submit(uint32_t slot, const Frame& frame) = 0;
  virtual bool finished(uint32_t slot) const = 0;
  /// Waits for the slot's frame, and gives its lease back.
  virtual void wait(uint32_t slot) = 0;
  /// Fills what the finished frame says by itself into `touch`, which has no values yet: nothing that follows
  /// from frames before it. Contacts are the frame's regions, without ids, small ones too. Solves what the
  /// host has to.
  virtual FrameMeasurement measure(uint32_t slot, Touch& touch) = 0;

  /// As Pipeline's, of a frame that is measured. `rest_mm`: SurfaceSummary::depth_offset_mm.
  virtual std::vector<float> read_depth_mm(uint32_t slot, double rest_mm) const = 0;
  virtual std::vector<uint16_t> read_confidence(uint32_t slot) const = 0;
  virtual std::vector<gpu::ScopeTime> times(uint32_t slot) const = 0;
  virtual std::vector<gpu::ScopeTraffic> traffic() const = 0;
  virtual uint64_t memory_bytes() const = 0;
};

}  // namespace palpate
