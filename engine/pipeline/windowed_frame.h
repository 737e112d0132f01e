// Windowed frame: only the touched part of a frame is computed. The host finds the touched tiles, and a
// window around them is computed as a small frame of its own.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/pipeline/contact_tiles.h"
#include "engine/pipeline/whole_frame.h"

namespace palpate {

/// `box` and the margin around it, within the frame: what a window has to hold.
PixelRect with_margin(const PixelRect& box, const FrameFormat& format);

/// Where a window of `size` goes: it stays at `last` as long as that holds `box`, else it is centred on it.
/// `box` has to fit. Places are in steps of 8 px, so that blocks of 8 x 8 px are the frame's own.
PixelRect place_window(const PixelRect& size, const PixelRect& box, const std::optional<PixelRect>& last,
                       const FrameFormat& format);

class WindowedFrame : public Frames {
 public:
  /// Where can_window(). `sensor` lives longer than this.
  WindowedFrame(gpu::Context& context, const Sensor& sensor, const FrameFormat& format, const FramePlan& plan,
                const Tuning& tuning);

  void set_background(const Frame& background) override;
  void submit(uint32_t slot, const Frame& frame) override;
  bool finished(uint32_t slot) const override;
  void wait(uint32_t slot) override;
  FrameMeasurement measure(uint32_t slot, Touch& touch) override;
  std::vector<float> read_depth_mm(uint32_t slot, double rest_mm) const override;
  std::vector<uint16_t> read_confidence(uint32_t) const override { return {}; }
  std::vector<gpu::ScopeTime> times(uint32_t slot) const override;
  std::vector<gpu::ScopeTraffic> traffic() const override { return whole_.traffic(); }
  uint64_t memory_bytes() const override;

 private:
  /// A size of window with the machine for its frames.
  struct Window {
    Window(gpu::Context& context, const Sensor& sensor, const FrameFormat& format, const FramePlan& plan,
           const Tuning& tuning)
        : size{0, 0, format.width, format.height}, frames(context, sensor, format, plan, tuning) {}
    PixelRect size;
    WholeFrame frames;
    std::optional<PixelRect> place;  ///< of the background it has; none: not used yet
  };
  /// Which machine has the slot's frame, in a slot of the same number.
  struct Slot {
    WholeFrame* frames = nullptr;  ///< none: nothing is touched
    PixelRect place;
    uint64_t saturated_px = 0;
  };

  Window* window_for(const PixelRect& box);
  void move(Window& window, const PixelRect& place);
  const Frame& crop(const Frame& frame, const PixelRect& place);
  void measure_untouched(Touch& touch) const;

  FrameFormat format_;
  bool contacts_, surface_;
  ContactTiles tiles_;
  Frame background_;
  WholeFrame whole_;
  std::deque<Window> windows_;  ///< smallest first
  Frame part_;
  gpu::DeviceBuffer flat_;  ///< the map of a frame without contact: no pixel of it is in its window
  std::vector<Slot> slots_;
};

}  // namespace palpate
