#include "engine/pipeline/windowed_frame.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "engine/base/divide_up.h"
#include "engine/gpu/commands.h"
#include "engine/pipeline/surface/surface_gradient.h"

namespace palpate {
namespace {

constexpr uint32_t kMargin_px = 8;  // beyond touched tiles; contact pixels reach two of them
// Pixels along a window's sides that show the background there: what is cut through must not become contact.
constexpr uint32_t kQuiet_px = 2;

// Windows get what the host has cut out for them.
FramePlan for_window(FramePlan plan) {
  plan.upload = Upload::Copy;
  return plan;
}

}  // namespace

PixelRect with_margin(const PixelRect& box, const FrameFormat& format) {
  const uint32_t x = std::max(box.x, kMargin_px) - kMargin_px, y = std::max(box.y, kMargin_px) - kMargin_px;
  return {x, y, std::min(box.x + box.width + kMargin_px, format.width) - x,
          std::min(box.y + box.height + kMargin_px, format.height) - y};
}

PixelRect place_window(const PixelRect& size, const PixelRect& box, const std::optional<PixelRect>& last,
                       const FrameFormat& format) {
  if (last && last->contains(box)) return *last;
  const auto along = [](uint32_t first, uint32_t length, uint32_t side, uint32_t frame) {
    const uint32_t before = (side - length) / 2;
    const uint32_t lowest = divide_up(std::max(first + length, side) - side, kWindowStep_px) * kWindowStep_px;
    const uint32_t wanted = (std::max(first, before) - before) / kWindowStep_px * kWindowStep_px;
    return std::min(std::max(wanted, lowest), frame - side);
  };
  return {along(box.x, box.width, size.width, format.width),
          along(box.y, box.height, size.height, format.height), size.width, size.height};
}

WindowedFrame::WindowedFrame(gpu::Context& context, const Sensor& sensor, const FrameFormat& format,
                             const FramePlan& plan, const Tuning& tuning)
    : format_(format),
      contacts_(plan.regions),
      surface_(plan.surface != SurfaceKind::None),
      tiles_(sensor, format),
      whole_(context, sensor, format, plan, tuning),
      slots_(plan.slots) {
  for (const PixelRect& size : window_sizes(format)) {
    FrameFormat part = format;
    part.width = size.width;
    part.height = size.height;
    windows_.emplace_back(context, sensor, part, for_window(plan), tuning);
  }
  FrameFormat largest = format;
  largest.width = windows_.back().size.width;
  largest.height = windows_.back().size.height;
  part_.bytes.reserve(largest.frame_bytes());
  if (!surface_) return;
  flat_ = gpu::DeviceBuffer(context, "flat surface", 4 * sizeof(float), gpu::Memory::Device);
  gpu::clear(context, flat_);
}

void WindowedFrame::set_background(const Frame& background) {
  whole_.set_background(background);
  background_.reshape(background.format);
  std::memcpy(background_.bytes.data(), background.pixels(), background.format.frame_bytes());
  tiles_.set_background(background_);
  for (Window& window : windows_) window.place.reset();
}

void WindowedFrame::submit(uint32_t index, const Frame& frame) {
  const TouchedTiles& tiles = tiles_.find(frame);
  Slot slot;
  slot.saturated_px = tiles.saturated_px;
  if (tiles.count > 0) {
    const PixelRect box = with_margin(tiles.box, format_);
    if (Window* window = window_for(box)) {
      move(*window, place_window(window->size, box, window->place, format_));
      slot.frames = &window->frames;
      slot.place = *window->place;
      window->frames.submit(index, crop(frame, slot.place));
    } else {
      slot.frames = &whole_;
      slot.place = {0, 0, format_.width, format_.height};
      whole_.submit(index, frame);
    }
  }
  slots_[index] = slot;
}

WindowedFrame::Window* WindowedFrame::window_for(const PixelRect& box) {
  for (Window& window : windows_) {
    // From a place in steps a window may have to begin up to a step before the box.
    const auto fits = [](uint32_t first, uint32_t length, uint32_t side, uint32_t frame) {
      const uint32_t begin = std::min(first / kWindowStep_px * kWindowStep_px, frame - std::min(side, frame));
      return first + length <= begin + side;
    };
    if ((window.place && window.place->contains(box)) ||
        (fits(box.x, box.width, window.size.width, format_.width) &&
         fits(box.y, box.height, window.size.height, format_.height)))
      return &window;
  }
  return nullptr;
}

// Waits for the window's frames in flight, which read its background.
void WindowedFrame::move(Window& window, const PixelRect& place) {
  if (window.place == place) return;
  window.frames.place({place.x, place.y, format_.width, format_.height});
  window.frames.set_background(crop(background_, place));
  window.place = place;
}

const Frame& WindowedFrame::crop(const Frame& frame, const PixelRect& place) {
  FrameFormat format = format_;
  format.width = place.width;
  format.height = place.height;
  part_.reshape(format);
  part_.sequence = frame.sequence;
  part_.time_ns = frame.time_ns;
  const size_t bytes = format_.bytes_per_pixel();
  const bool left = place.x > 0, right = place.x + place.width < format_.width;
  const bool above = place.y > 0, below = place.y + place.height < format_.height;
  for (uint32_t channel = 0; channel < format_.channels; ++channel) {
    for (uint32_t y = 0; y < place.height; ++y) {
      uint8_t* to = part_.row(channel, y);
      const auto from = [&](const Frame& of) { return of.row(channel, place.y + y) + place.x * bytes; };
      const bool quiet = (above && y < kQuiet_px) || (below && y + kQuiet_px >= place.height);
      std::memcpy(to, from(quiet ? background_ : frame), format.row_bytes());
      if (left) std::memcpy(to, from(background_), kQuiet_px * bytes);
      const size_t last = (place.width - kQuiet_px) * bytes;
      if (right) std::memcpy(to + last, from(background_) + last, kQuiet_px * bytes);
    }
  }
  return part_;
}

bool WindowedFrame::finished(uint32_t index) const {
  const Slot& slot = slots_[index];
  return !slot.frames || slot.frames->finished(index);
}

void WindowedFrame::wait(uint32_t index) {
  if (slots_[index].frames) slots_[index].frames->wait(index);
}

FrameMeasurement WindowedFrame::measure(uint32_t index, Touch& touch) {
  const Slot& slot = slots_[index];
  FrameMeasurement measured;
  if (slot.frames) {
    measured = slot.frames->measure(index, touch);
    if (slot.frames == &whole_) return measured;
    ++measured.copies;  // what was cut out
  } else {
    measure_untouched(touch);
    measured.surface.buffer = surface_ ? &flat_ : nullptr;
    measured.surface.pitch = 4;
  }
  touch.saturated_px = slot.saturated_px;
  if (!surface_) return measured;
  if (touch.contact && too_many_saturated(touch)) touch.surface->validity = Validity::Saturated;
  measured.surface.width = format_.width;
  measured.surface.height = format_.height;
  measured.surface.window = slot.place;
  return measured;
}

void WindowedFrame::measure_untouched(Touch& touch) const {
  touch.centroid_x_px = touch.centroid_y_px = std::numeric_limits<double>::quiet_NaN();
  if (contacts_) touch.regions.emplace();
  if (!surface_) return;
  touch.surface.emplace().validity = Validity::NoContact;
  touch.surface->rest_from_untouched = true;
}

std::vector<float> WindowedFrame::read_depth_mm(uint32_t index, double rest_mm) const {
  const Slot& slot = slots_[index];
  if (slot.frames == &whole_) return whole_.read_depth_mm(index, rest_mm);
  std::vector<float> depth_mm(size_t{format_.width} * format_.height);
  if (!slot.frames) return depth_mm;
  const std::vector<float> part = slot.frames->read_depth_mm(index, rest_mm);
  for (uint32_t y = 0; y < slot.place.height; ++y)
    std::copy_n(part.data() + size_t{y} * slot.place.width, slot.place.width,
                depth_mm.data() + size_t{slot.place.y + y} * format_.width + slot.place.x);
  return depth_mm;
}

std::vector<gpu::ScopeTime> WindowedFrame::times(uint32_t index) const {
  const Slot& slot = slots_[index];
  return slot.frames ? slot.frames->times(index) : std::vector<gpu::ScopeTime>{};
}

uint64_t WindowedFrame::memory_bytes() const {
  uint64_t bytes = whole_.memory_bytes() + flat_.bytes();
  for (const Window& window : windows_) bytes += window.frames.memory_bytes();
  return bytes;
}

}  // namespace palpate
