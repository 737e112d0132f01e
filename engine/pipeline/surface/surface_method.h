// Surface method: a frame to heights, with all that belongs to it: weights, what the host solves, and the
// rest level.
#pragma once

#include <optional>
#include <vector>

#include "engine/pipeline/frame_parts.h"
#include "engine/pipeline/frame_slot.h"
#include "engine/pipeline/plan.h"
#include "palpate/touch.h"

namespace palpate {

/// Pressure by pixel, MPa, on the device: that of the frame whose commands ran last.
struct DevicePressure {
  const gpu::DeviceBuffer* buffer = nullptr;
  uint32_t pitch = 0;  ///< floats from row to row
  uint32_t start = 0;  ///< of pixel (0, 0)
};

class SurfaceMethod {
 public:
  virtual ~SurfaceMethod() = default;

  /// Buffers of a slot.
  virtual void make(FrameSlot& slot) const;
  /// After the contact stage, and the confidence where there is one.
  virtual void record(gpu::Commands& commands, FrameSlot& slot) = 0;
  /// The host's part of a frame that the device has finished, to its end.
  virtual void solve(FrameSlot& slot);
  /// Depth, volume, and what may be wrong with them, given the contact as a whole.
  virtual SurfacePart measure(const FrameSlot& slot, const ContactTouch& whole) const = 0;
  /// Which pixels no frame shows; commands have to be recorded again.
  virtual void set_confidence(const Confidence&) {}
  /// Whether a frame may need its pixels weighted: then `record_weighted`, in place of `record`, is for those
  /// that are expected to. Only the device knows it of frames with markers: there the last frame says it.
  virtual bool may_weigh() const { return false; }
  virtual bool expects_weights(const Frame&) const { return false; }
  virtual void record_weighted(gpu::Commands&, FrameSlot&) const {}
  /// Where pixels are pressures.
  virtual std::optional<DevicePressure> pressure() const { return std::nullopt; }

  const Grid& grid() const { return grid_; }  ///< of the depth
  /// Times of what is submitted apart from the slot's own commands.
  virtual void add_times(const FrameSlot&, std::vector<gpu::ScopeTime>&) const {}
  virtual uint64_t memory_bytes() const = 0;
  virtual uint64_t memory_bytes(const FrameSlot& slot) const;

  /// Heights of the frame that is measured, in host memory: with contacts of a gel, with traction by the
  /// layer's surface, with motion, and where the host solves.
  HeightRows heights(const FrameSlot& slot) const;
  /// Where the host has changed them: finds their rest level again, and moves them back to the device.
  void finish_heights(FrameSlot& slot) const;

 protected:
  /// `sensor` and `contact` live longer than this.
  SurfaceMethod(gpu::Context& context, const Sensor& sensor, const FrameFormat& format, const FramePlan& plan,
                const Contact& contact, const Tuning& tuning);

  /// The end of whatever solves for the slot's depth.
  void record_rest_level(gpu::Commands& commands, FrameSlot& slot) const;
  /// Measurements common to all methods, with heights counted from the rest level that the map shows.
  SurfaceSummary measure_heights(const FrameSlot& slot) const;
  /// The same where heights are depths: 0 is the untouched pad. Volume counts from the map's rest level.
  SurfaceSummary measure_depths(const FrameSlot& slot) const;
  RestHeight rest_of(const FrameSlot& slot) const;
  double volume_mm3(const FrameSlot& slot, double level_mm) const;

  /// Solve::Exact: room for `from`, which goes to the host.
  void make_host_solve(FrameSlot& slot, const gpu::DeviceBuffer& from) const;

  gpu::Context& context_;
  const Sensor& sensor_;
  FrameFormat format_;
  Grid grid_;
  RestLevel rest_level_;
  bool changes_heights_, reads_heights_;  ///< the host
};

}  // namespace palpate
