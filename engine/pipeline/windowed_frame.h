// A pipeline that leaves out what nothing touches: the host finds the touched tiles, and a window around them
// is computed as a small frame of its own.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/measure/contact_tracker.h"
#include "engine/measure/force.h"
#include "engine/measure/shear.h"
#include "palpate/pipeline.h"
#include "engine/pipeline/contact_tiles.h"

namespace palpate {

/// Sizes of windows for frames of one format, smallest first: squares of growing shares of the shorter side.
std::vector<PixelRect> window_sizes(const FrameFormat& format);

/// `box` and the margin around it, within the frame: what a window has to hold.
PixelRect with_margin(const PixelRect& box, const FrameFormat& format);

/// Where a window of `size` goes: it stays at `last` as long as that holds `box`, else it is centred on it.
/// `box` has to fit. Places are in steps of 8 px, so that blocks of 8 x 8 px are the frame's own.
PixelRect place_window(const PixelRect& size, const PixelRect& box, const std::optional<PixelRect>& last,
                       const FrameFormat& format);

/// What Pipeline does with PipelineOptions::skip_untouched; its functions are Pipeline's.
class Skipping {
 public:
  /// Whether a window gives what the whole frame would: not where a pixel's depth depends on pressure far
  /// away (Reading::Elastic) or is absolute (Reading::Lookup), where pixels are weighted, where heights are
  /// solved on the host, and where everything is contact (a threshold of 0) or nothing is subtracted or
  /// filtered.
  static bool possible(const Sensor& sensor, const FrameFormat& format, const PipelineOptions& options);

  Skipping(gpu::Context& context, const Sensor& sensor, const FrameFormat& format,
           const PipelineOptions& options);

  void set_background(const Frame& background);
  bool submit(const Frame& frame);
  std::optional<Result> poll();
  std::optional<Result> wait();
  void release(const Result& result);
  std::vector<float> read_depth_mm(const Result& result) const;
  std::vector<gpu::ScopeTime> times(const Result& result) const;
  std::vector<gpu::ScopeTraffic> traffic() const;
  uint64_t memory_bytes() const;
  const FrameFormat& format() const { return format_; }
  const Sensor& sensor() const { return sensor_; }

 private:
  /// A size of window with the machine for its frames.
  struct Window {
    PixelRect size;
    Pipeline pipeline;
    std::optional<PixelRect> place;  ///< of the background it has; none: not used yet
  };
  /// A frame in flight or held by the caller.
  struct Slot {
    bool free = true;
    Pipeline* pipeline = nullptr;  ///< that computes it; none: nothing is touched
    PixelRect place;
    uint64_t saturated_px = 0;
    Result result;  ///< as the slot's pipeline gave it
    uint64_t sequence = 0;
    int64_t time_ns = 0;
    bool after_gap = false;
    std::chrono::steady_clock::time_point submitted;
  };

  Window* window_for(const PixelRect& box);
  void move(Window& window, const PixelRect& place);
  const Frame& crop(const Frame& frame, const PixelRect& place);
  Result finish(uint32_t index);
  Touch untouched(const Slot& slot) const;

  Sensor sensor_;
  FrameFormat format_;
  bool wants_surface_;
  Touched touched_;
  Frame background_;
  Pipeline whole_;
  std::deque<Window> windows_;  ///< smallest first
  Frame part_;
  gpu::DeviceBuffer flat_;  ///< the map of a frame without contact: no pixel of it is in its window
  std::optional<ContactTracker> tracker_;
  ForceHistory force_;
  ShearTracker shear_;
  std::vector<Slot> slots_;
  std::deque<uint32_t> in_flight_;
};

}  // namespace palpate
