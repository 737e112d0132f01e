#include "palpate/pipeline.h"

#include <algorithm>
#include <atomic>
#include <cassert>
#include <chrono>
#include <stdexcept>
#include <utility>

#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "engine/gpu/device_access.h"
#include "engine/gpu/tuning.h"
#include "engine/measure/picture_check.h"
#include "engine/pipeline/choose_solver.h"
#include "engine/pipeline/history.h"
#include "engine/pipeline/specks.h"
#include "engine/pipeline/steady_light.h"
#include "engine/pipeline/windowed_frame.h"
#include "engine/sensor/fit.h"
#include "palpate/error.h"

namespace palpate {
namespace {

using Clock = std::chrono::steady_clock;

std::unique_ptr<Frames> make_frames(gpu::Context& context, const Sensor& sensor, const FrameFormat& format,
                                    const FramePlan& plan, const Tuning& tuning) {
  if (plan.windowed) return std::make_unique<WindowedFrame>(context, sensor, format, plan, tuning);
  return std::make_unique<WholeFrame>(context, sensor, format, plan, tuning);
}

// Whether the surface has weights decides on the solver, and the solver on how traction is solved.
FramePlan plan_for(gpu::Context& context, const Sensor& sensor, const FrameFormat& format,
                   PipelineOptions options) {
  const FramePlan plan = make_plan(sensor, format, options);
  options.solver = choose_solver(options.solver, plan, context.is_software());
  return make_plan(sensor, format, options);
}

std::string described(const FrameFormat& format) {
  return std::to_string(format.width) + " x " + std::to_string(format.height);
}

}  // namespace

/// Whether a slot is taken, from `submit` to the end of its result. Memory of touches goes from one frame to
/// the next, so that frames allocate nothing.
struct Result::Hold {
  std::atomic<bool> taken = false;
  std::vector<ContactTouch> contacts;
  std::vector<SkinPoint> skin_points;
  std::shared_ptr<const std::vector<uint16_t>> confidence;  ///< of specks
};

Result& Result::operator=(Result&& other) noexcept {
  if (this == &other) return *this;
  give_back();
  touch = std::move(other.touch);
  surface = other.surface;
  traction = other.traction;
  slot = other.slot;
  turnaround_ms = other.turnaround_ms;
  copies = other.copies;
  hold_ = std::move(other.hold_);
  return *this;
}

void Result::give_back() noexcept {
  if (!hold_) return;
  hold_->contacts.swap(touch.contacts);
  hold_->skin_points.swap(touch.skin_points);
  hold_->taken.store(false, std::memory_order_release);
  hold_.reset();
}

struct Pipeline::Impl {
  /// What is known of a slot's frame from outside.
  struct Slot {
    std::shared_ptr<Result::Hold> hold = std::make_shared<Result::Hold>();
    uint64_t sequence = 0;
    int64_t time_ns = 0;
    bool after_gap = false;
    PictureFault fault = PictureFault::None;
    bool repeated = false;
    std::optional<LightSummary> light;
    Clock::time_point submitted;
  };

  Impl(gpu::Context& context, const Sensor& with_sensor, const FrameFormat& frame_format,
       const PipelineOptions& options)
      : sensor(with_sensor),
        format(frame_format),
        plan(plan_for(context, sensor, format, options)),
        frames(make_frames(context, sensor, format, plan,
                           options.tuning ? *options.tuning : load_tuning(context).tuning)),
        history(sensor, format, plan.regions, plan.separate),
        picture(format, sensor.saturation_gray, sensor.pad),
        any_picture(options.any_picture),
        ready(!plan.background),
        slots(plan.slots) {
    if (plan.specks) specks.emplace(format, dead_gray(sensor));
    if (plan.steady_light) light.emplace(format, sensor.saturation_gray, plan.separate);
    in_flight.reserve(plan.slots);
    for (Slot& slot : slots) slot.hold->contacts.reserve(plan.regions ? ContactTracker::kMostContacts : 0);
  }

  // A frame that the device has finished: measured by itself, then followed from those before it.
  Result finish(uint32_t index) {
    Slot& slot = slots[index];
    Result result;
    result.hold_ = slot.hold;
    result.slot = index;
    Touch& touch = result.touch;
    touch.contacts.swap(slot.hold->contacts);
    touch.contacts.clear();
    touch.skin_points.swap(slot.hold->skin_points);
    touch.sequence = slot.sequence;
    touch.time_ns = slot.time_ns;
    touch.light = slot.light;
    touch.repeated = slot.repeated;
    touch.picture = PictureFault::None;
    const FrameMeasurement measured = frames->measure(index, touch);
    result.surface = measured.surface;
    if (slot.fault == PictureFault::None) {
      history.follow(touch, slot.after_gap || std::exchange(unseen, 0) > kMostUnseen, measured.skin_sd_px);
      if (touch.light && touch.light->state == LightState::Unknown) doubt_light(touch);
      result.traction = measured.traction;
    } else {
      unseen += slot.after_gap ? kMostUnseen + 1 : 1;
      forget_measured(touch, slot.fault);
    }
    if (specks && result.surface.confidence.empty() && specks->confidence()) {
      slot.hold->confidence = specks->confidence();
      result.surface.confidence = *slot.hold->confidence;
      result.surface.confidence_pitch = format.width;
    }
    result.copies = measured.copies;
    result.turnaround_ms = std::chrono::duration<double, std::milli>(Clock::now() - slot.submitted).count();
    return result;
  }

  Sensor sensor;
  FrameFormat format;
  FramePlan plan;
  std::unique_ptr<Frames> frames;
  TouchHistory history;
  std::optional<Specks> specks;
  std::optional<SteadyLight> light;
  PictureCheck picture;
  bool any_picture = false;
  bool compares = false;  ///< the check has its untouched image
  /// Frames in a row, up to now, whose pictures were spoilt; after more nothing is followed across them.
  uint64_t unseen = 0;
  static constexpr uint64_t kMostUnseen = 3;
  bool ready;  ///< has the background that it needs
  std::vector<Slot> slots;
  std::vector<uint32_t> in_flight;  ///< slots, the oldest frame first
};

Pipeline::Pipeline(gpu::Context& context, const Sensor& sensor, const FrameFormat& format,
                   const PipelineOptions& options) {
  validate(sensor, sensor.name);
  check_fit(sensor, format, options.outputs);
  if (options.tuning) validate(*options.tuning, context.properties().limits);
  impl_ = std::make_unique<Impl>(context, sensor, format, options);
}

Pipeline::Pipeline(Device& device, const Sensor& sensor, const FrameFormat& format,
                   const PipelineOptions& options)
    : Pipeline(DeviceAccess::context(device), sensor, format, options) {}

Pipeline::Pipeline(Pipeline&&) noexcept = default;
Pipeline::~Pipeline() = default;

void Pipeline::set_background(const Frame& frame) {
  if (frame.format != impl_->format) {
    throw Error(Failure::Input, "a background image of the frames' format",
                described(frame.format) + ", " + std::to_string(frame.format.channels) + " channels, " +
                    std::to_string(frame.format.bit_depth) + " bits",
                "a background taken with the same camera settings");
  }
  if (!impl_->plan.background) {
    const uint8_t* pixels = frame.pixels();
    if (std::any_of(pixels, pixels + frame.format.frame_bytes(), [](uint8_t byte) { return byte != 0; }))
      throw Error(Failure::Input, "a black background, or none, for background.source 'none'", "another one",
                  "source 'untouched' in the sensor file");
    return;
  }
  impl_->ready = false;
  impl_->picture.set_reference(frame);
  impl_->compares = true;
  const Frame& whole = impl_->specks ? impl_->specks->set_background(frame) : frame;
  impl_->frames->set_background(whole);
  if (impl_->light) impl_->light->set_background(whole);
  impl_->ready = true;
}

bool Pipeline::submit(const Frame& frame) {
  if (!impl_->ready)
    throw Error(Failure::Input, "a background image", "none set", "Pipeline::set_background first");
  if (frame.format != impl_->format)
    throw Error(Failure::Input, "frames of one size and depth", described(frame.format),
                "one recording at a time");
  const auto free = std::ranges::find_if(
      impl_->slots, [](const Impl::Slot& slot) { return !slot.hold->taken.load(std::memory_order_acquire); });
  if (free == impl_->slots.end()) return false;
  free->submitted = Clock::now();
  const auto index = static_cast<uint32_t>(free - impl_->slots.begin());
  // Where nothing is subtracted, the first frame says what the picture looks like.
  if (!std::exchange(impl_->compares, true)) impl_->picture.set_reference(frame);
  free->fault = impl_->any_picture ? PictureFault::None : impl_->picture.look_at(frame);
  free->repeated = impl_->picture.repeats();
  const bool spoilt = free->fault != PictureFault::None;
  const Frame& whole = impl_->specks ? impl_->specks->fill(frame) : frame;
  // A spoilt picture teaches nothing about the light.
  impl_->frames->submit(index, impl_->light && !spoilt ? impl_->light->steady(whole) : whole);
  if (impl_->light)
    free->light = spoilt ? LightSummary{.state = LightState::Unknown} : impl_->light->summary();
  free->sequence = frame.sequence;
  free->time_ns = frame.time_ns;
  free->after_gap = frame.after_gap;
  free->hold->taken.store(true, std::memory_order_relaxed);
  impl_->in_flight.push_back(index);
  return true;
}

std::optional<Result> Pipeline::poll() {
  if (impl_->in_flight.empty() || !impl_->frames->finished(impl_->in_flight.front())) return std::nullopt;
  return wait();
}

std::optional<Result> Pipeline::wait() {
  if (impl_->in_flight.empty()) return std::nullopt;
  const uint32_t index = impl_->in_flight.front();
  impl_->frames->wait(index);
  impl_->in_flight.erase(impl_->in_flight.begin());
  return impl_->finish(index);
}

Touch Pipeline::process(const Frame& frame) {
  if (!submit(frame)) throw std::logic_error("Pipeline::process needs a free slot: end a Result first");
  return std::move(wait()->touch);
}

std::vector<float> Pipeline::read_depth_mm(const Result& result) const {
  assert(result.surface.buffer != nullptr);
  return impl_->frames->read_depth_mm(result.slot, result.touch.surface->depth_offset_mm);
}

std::vector<uint16_t> Pipeline::read_confidence(const Result& result) const {
  return impl_->frames->read_confidence(result.slot);
}

std::vector<gpu::ScopeTime> Pipeline::times(const Result& result) const {
  return impl_->frames->times(result.slot);
}

std::vector<gpu::ScopeTraffic> Pipeline::traffic() const {
  return impl_->frames->traffic();
}

uint64_t Pipeline::memory_bytes() const {
  return impl_->frames->memory_bytes();
}

const FrameFormat& Pipeline::format() const {
  return impl_->format;
}

SurfaceSolver Pipeline::solver() const {
  return impl_->plan.solver;
}

const Sensor& Pipeline::sensor() const {
  return impl_->sensor;
}

}  // namespace palpate
