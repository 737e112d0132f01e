#include "engine/pipeline/windowed_frame.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "engine/gpu/commands.h"
#include "engine/measure/force.h"
#include "engine/sensor/fit.h"
#include "engine/stages/skin.h"
#include "palpate/error.h"

namespace palpate {
namespace {

using Clock = std::chrono::steady_clock;

constexpr uint32_t kStep_px = 8;
constexpr uint32_t kMargin_px = 8;  // beyond touched tiles; contact pixels reach two of them
constexpr uint32_t kLeast_px = 64;  // sides of a window below which nothing is gained
// Pixels along a window's sides that show the background there: what is cut through must not become contact.
constexpr uint32_t kQuiet_px = 2;

// The smallest side of at least `least` px that reaches the frame's end from a place in steps of kStep_px.
uint32_t side_for(uint32_t least, uint32_t frame) {
  const uint32_t rest = frame % kStep_px;
  const uint32_t side = (std::max(least, rest) - rest + kStep_px - 1) / kStep_px * kStep_px + rest;
  return std::min(side, frame);
}

// The windows measure what is exact; what needs the whole frame is added to it.
Sensor without(const Sensor& sensor, bool force) {
  Sensor result = sensor;
  result.shear.reset();
  if (force) result.force.reset();
  return result;
}

PipelineOptions for_parts(PipelineOptions options) {
  options.skip_untouched = false;
  options.warm_start = false;
  return options;
}

}  // namespace

std::vector<PixelRect> window_sizes(const FrameFormat& format) {
  constexpr double kShares[] = {0.375, 0.5, 0.625};
  std::vector<PixelRect> sizes;
  const uint32_t shorter = std::min(format.width, format.height);
  for (const double share : kShares) {
    const auto side = static_cast<uint32_t>(std::ceil(share * shorter));
    const PixelRect size{0, 0, side_for(side, format.width), side_for(side, format.height)};
    if (side < kLeast_px || 2 * uint64_t{size.width} * size.height > uint64_t{format.width} * format.height)
      continue;
    sizes.push_back(size);
  }
  return sizes;
}

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
    const uint32_t lowest = (std::max(first + length, side) - side + kStep_px - 1) / kStep_px * kStep_px;
    const uint32_t wanted = (std::max(first, before) - before) / kStep_px * kStep_px;
    return std::min(std::max(wanted, lowest), frame - side);
  };
  return {along(box.x, box.width, size.width, format.width),
          along(box.y, box.height, size.height, format.height), size.width, size.height};
}

bool Skipping::possible(const Sensor& sensor, const FrameFormat& format, const PipelineOptions& options) {
  const bool usual =
      sensor.background.kind == BackgroundKind::Untouched && sensor.filter == Filter::Binomial5;
  const bool surface = wants(options.outputs, Output::Surface);
  return usual && !needs_confidence(sensor, options.outputs) && !needs_gradient(sensor, options.outputs) &&
         !follows_skin(sensor, wants(options.outputs, Output::Skin), wants(options.outputs, Output::Force)) &&
         !(surface && (sensor.reading == Reading::Elastic || sensor.reading == Reading::Lookup ||
                       options.solver == SurfaceSolver::Exact)) &&
         std::lround(sensor.threshold_gray * 128) > 0 && !window_sizes(format).empty();
}

Skipping::Skipping(gpu::Context& context, const Sensor& sensor, const FrameFormat& format,
                   const PipelineOptions& options)
    : sensor_(sensor),
      format_(format),
      wants_surface_(wants(options.outputs, Output::Surface)),
      touched_(sensor, format),
      whole_(context, without(sensor, false), format, for_parts(options)),
      shear_(sensor.pitch_mm_per_px),
      slots_(std::max(options.slots, 1u)) {
  if (wants(options.outputs, Output::Contacts)) {
    tracker_.emplace(sensor, format);
    whole_.leave_unfollowed();
  }
  for (const PixelRect& size : window_sizes(format)) {
    FrameFormat part = format;
    part.width = size.width;
    part.height = size.height;
    PipelineOptions of_window = for_parts(options);
    of_window.upload = Upload::Copy;  // of what is cut out
    windows_.push_back({size, Pipeline(context, without(sensor, true), part, of_window), {}});
    if (tracker_) windows_.back().pipeline.leave_unfollowed();
  }
  part_.bytes.reserve(
      FrameFormat{windows_.back().size.width, windows_.back().size.height, format.channels, format.bit_depth}
          .frame_bytes());
  if (!wants_surface_) return;
  flat_ = gpu::DeviceBuffer(context, "flat surface", 4 * sizeof(float), gpu::Memory::Device);
  gpu::clear(context, flat_);
}

void Skipping::set_background(const Frame& background) {
  whole_.set_background(background);
  background_.reshape(background.format);
  std::memcpy(background_.bytes.data(), background.pixels(), background.format.frame_bytes());
  touched_.set_background(background_);
  for (Window& window : windows_) window.place.reset();
}

bool Skipping::submit(const Frame& frame) {
  if (background_.bytes.empty())
    throw Error(Failure::Input, "a background image", "none set", "Pipeline::set_background first");
  if (frame.format != format_)
    throw Error(Failure::Input, "frames of one size and depth",
                std::to_string(frame.format.width) + " x " + std::to_string(frame.format.height),
                "one recording at a time");
  const auto free = std::ranges::find_if(slots_, [](const Slot& slot) { return slot.free; });
  if (free == slots_.end()) return false;
  Slot& slot = *free;
  slot.submitted = Clock::now();
  slot.sequence = frame.sequence;
  slot.time_ns = frame.time_ns;
  slot.after_gap = frame.after_gap;
  const TouchedTiles& tiles = touched_.find(frame);
  slot.saturated_px = tiles.saturated_px;
  slot.pipeline = nullptr;
  slot.place = {};
  if (tiles.count > 0) {
    const PixelRect box = with_margin(tiles.box, format_);
    if (Window* window = window_for(box)) {
      move(*window, place_window(window->size, box, window->place, format_));
      slot.pipeline = &window->pipeline;
      slot.place = *window->place;
      window->pipeline.submit(crop(frame, slot.place));
    } else {
      slot.pipeline = &whole_;
      slot.place = {0, 0, format_.width, format_.height};
      whole_.submit(frame);
    }
  }
  slot.free = false;
  in_flight_.push_back(static_cast<uint32_t>(free - slots_.begin()));
  return true;
}

Skipping::Window* Skipping::window_for(const PixelRect& box) {
  for (Window& window : windows_) {
    // From a place in steps a window may have to begin up to a step before the box.
    const auto fits = [](uint32_t first, uint32_t length, uint32_t side, uint32_t frame) {
      const uint32_t begin = std::min(first / kStep_px * kStep_px, frame - std::min(side, frame));
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
void Skipping::move(Window& window, const PixelRect& place) {
  if (window.place == place) return;
  window.pipeline.place({place.x, place.y, format_.width, format_.height});
  window.pipeline.set_background(crop(background_, place));
  window.place = place;
}

const Frame& Skipping::crop(const Frame& frame, const PixelRect& place) {
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

std::optional<Result> Skipping::poll() {
  if (in_flight_.empty()) return std::nullopt;
  const uint32_t index = in_flight_.front();
  Slot& slot = slots_[index];
  if (slot.pipeline) {
    const std::optional<Result> result = slot.pipeline->poll();
    if (!result) return std::nullopt;
    slot.result = *result;
  }
  in_flight_.pop_front();
  return finish(index);
}

std::optional<Result> Skipping::wait() {
  if (in_flight_.empty()) return std::nullopt;
  const uint32_t index = in_flight_.front();
  Slot& slot = slots_[index];
  if (slot.pipeline) slot.result = *slot.pipeline->wait();
  in_flight_.pop_front();
  return finish(index);
}

Result Skipping::finish(uint32_t index) {
  Slot& slot = slots_[index];
  Result result;
  result.slot = index;
  if (slot.pipeline) {
    result.touch = slot.result.touch;
    result.surface = slot.result.surface;
    const bool cut = slot.pipeline != &whole_;
    result.copies = slot.result.copies + (cut ? 1 : 0);
  } else {
    result.touch = untouched(slot);
    result.surface.buffer = wants_surface_ ? &flat_ : nullptr;
    result.surface.pitch = 4;
  }
  Touch& t = result.touch;
  if (slot.pipeline != &whole_) {
    t.saturated_px = slot.saturated_px;
    if (t.has_surface && t.contact && t.saturated_px > 0) t.depth_validity = Validity::Saturated;
    if (wants_surface_) {
      result.surface.width = format_.width;
      result.surface.height = format_.height;
      result.surface.window = slot.place;
    }
  }
  // Which branch the force is on and where the shear counts from are the whole frames' history.
  if (slot.after_gap) force_.interrupt();
  if (sensor_.force) t.force_N = force_.update(*sensor_.force, force_reading(t));
  if (slot.after_gap) shear_.interrupt();
  shear_.update(sensor_.shear ? &*sensor_.shear : nullptr, t);
  if (tracker_) {
    if (slot.after_gap) tracker_->interrupt();
    tracker_->update(t);
  }
  result.turnaround_ms = std::chrono::duration<double, std::milli>(Clock::now() - slot.submitted).count();
  return result;
}

Touch Skipping::untouched(const Slot& slot) const {
  Touch t;
  t.sequence = slot.sequence;
  t.time_ns = slot.time_ns;
  t.centroid_x_px = t.centroid_y_px = std::numeric_limits<double>::quiet_NaN();
  t.has_contacts = tracker_.has_value();
  t.has_surface = wants_surface_;
  if (wants_surface_) {
    t.datum_from_rest = true;
    t.depth_validity = Validity::NoContact;
  }
  return t;
}

void Skipping::release(const Result& result) {
  Slot& slot = slots_[result.slot];
  if (slot.pipeline) slot.pipeline->release(slot.result);
  slot.free = true;
}

std::vector<float> Skipping::read_depth_mm(const Result& result) const {
  const Slot& slot = slots_[result.slot];
  if (slot.pipeline == &whole_) return whole_.read_depth_mm(slot.result);
  std::vector<float> depth_mm(size_t{format_.width} * format_.height);
  if (!slot.pipeline) return depth_mm;
  const std::vector<float> part = slot.pipeline->read_depth_mm(slot.result);
  for (uint32_t y = 0; y < slot.place.height; ++y)
    std::copy_n(part.data() + size_t{y} * slot.place.width, slot.place.width,
                depth_mm.data() + size_t{slot.place.y + y} * format_.width + slot.place.x);
  return depth_mm;
}

std::vector<gpu::ScopeTime> Skipping::times(const Result& result) const {
  const Slot& slot = slots_[result.slot];
  return slot.pipeline ? slot.pipeline->times(slot.result) : std::vector<gpu::ScopeTime>{};
}

std::vector<gpu::ScopeTraffic> Skipping::traffic() const {
  return whole_.traffic();
}

uint64_t Skipping::memory_bytes() const {
  uint64_t bytes = whole_.memory_bytes() + flat_.bytes();
  for (const Window& window : windows_) bytes += window.pipeline.memory_bytes();
  return bytes;
}

}  // namespace palpate
