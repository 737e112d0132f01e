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
  /// Whether `solve` has made the heights of the frame that is measured, not the slot's commands.
  virtual bool solved_apart(const FrameSlot&) const { return false; }
  /// The host's part of a frame that the device has finished, to its end.
  virtual void solve(FrameSlot& slot);
  /// Depth, volume, and what may be wrong with them, given the contact as a whole.
  virtual SurfacePart measure(const FrameSlot& slot, const ContactTouch& whole) const = 0;
  /// Which pixels no frame shows; commands have to be recorded again.
  virtual void set_confidence(const Confidence&) {}
  /// Whether a frame may need its pixels weighted: then `record_weighted`, in place of `record`, is for those
  /// that are expected to.
  virtual bool may_weigh() const { return false; }
  virtual bool expects_weights() const { return false; }
  virtual void record_weighted(gpu::Commands&, FrameSlot&) const {}
  /// Where pixels are pressures.
  virtual std::optional<DevicePressure> pressure() const { return std::nullopt; }

  const Grid& grid() const { return grid_; }  ///< of the depth
  /// Times of what is submitted apart from the slot's own commands.
  virtual void add_times(const FrameSlot& slot, std::vector<gpu::ScopeTime>& times) const;
  virtual uint64_t memory_bytes() const = 0;
  virtual uint64_t memory_bytes(const FrameSlot& slot) const;

  /// Whatever changes a slot's heights afterwards lets their rest level be found again.
  void record_rest_level(gpu::Commands& commands, FrameSlot& slot) const;

 protected:
  /// `sensor` and `contact` live longer than this.
  SurfaceMethod(gpu::Context& context, const Sensor& sensor, const FrameFormat& format,
                const Contact& contact, const Tuning& tuning);

  /// Measurements common to all methods, with heights counted from the rest level that the map shows.
  SurfaceSummary measure_heights(const FrameSlot& slot) const;
  /// The same where heights are depths: 0 is the untouched pad. Volume counts from the map's rest level.
  SurfaceSummary measure_depths(const FrameSlot& slot) const;
  RestHeight rest_of(const FrameSlot& slot) const;
  double volume_mm3(const FrameSlot& slot, double level_mm) const;

  // Solve::Exact: `from` goes to the host, and the slot's `solved` comes back from there.
  void make_host_solve(FrameSlot& slot, const gpu::DeviceBuffer& from) const;
  void record_host_solve(gpu::Commands& commands, const gpu::DeviceBuffer& from, FrameSlot& slot) const;
  /// Moves what the host has solved to the device, and waits for its rest level.
  static void finish_host_solve(FrameSlot& slot);

  gpu::Context& context_;
  const Sensor& sensor_;
  FrameFormat format_;
  Grid grid_;
  RestLevel rest_level_;
};

}  // namespace palpate
