#include "palpate/pipeline.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <stdexcept>
#include <utility>

#include "engine/base/trace.h"
#include "engine/gpu/device_access.h"
#include "engine/measure/picture/picture_check.h"
#include "engine/pipeline/assemble.h"
#include "engine/pipeline/frames.h"
#include "engine/pipeline/object_follower.h"
#include "engine/pipeline/pipeline_access.h"
#include "engine/pipeline/specks.h"
#include "engine/pipeline/steady_light.h"
#include "engine/sensor/fit.h"
#include "palpate/error.h"

namespace palpate {
namespace {

using Clock = std::chrono::steady_clock;

std::string described(const FrameFormat& format) {
  return std::to_string(format.width) + " x " + std::to_string(format.height);
}

const Sensor& checked(const Sensor& sensor, const FrameFormat& format, const PipelineOptions& options) {
  validate(sensor, sensor.name);
  check_fit(sensor, format, options.outputs);
  return sensor;
}

}  // namespace

/// Memory that a slot lends to the result of its frame, from `submit` to the end of that result. It goes from
/// one frame to the next, so that frames allocate nothing.
struct Result::Hold {
  std::atomic<bool> taken = false;
  std::vector<ContactTouch> contacts;
  std::vector<SkinPoint> skin_points;
  std::shared_ptr<const std::vector<uint16_t>> of_specks;  ///< their confidence
  SurfaceMap surface;
  uint32_t slot = 0;
  const Frames* frames = nullptr;  ///< null: the pipeline is gone
  // Maps of this frame that were read back.
  bool has_depth = false, has_confidence = false;
  std::vector<float> depth_mm;
  std::vector<uint16_t> confidence;

  const Frames& held() const {
    if (!frames) throw std::logic_error("a Result's maps cannot be read after the end of its Pipeline");
    return *frames;
  }
};

Result& Result::operator=(Result&& other) noexcept {
  if (this == &other) return *this;
  give_back();
  touch = std::move(other.touch);
  traction = other.traction;
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

std::span<const float> Result::depth_mm() const {
  if (!hold_ || !hold_->surface.buffer) return {};
  if (!hold_->has_depth)
    hold_->held().read_depth_mm(hold_->slot, touch.surface->depth_offset_mm, hold_->depth_mm);
  hold_->has_depth = true;
  return hold_->depth_mm;
}

std::span<const uint16_t> Result::confidence() const {
  if (!hold_) return {};
  if (!hold_->has_confidence) hold_->confidence = hold_->held().read_confidence(hold_->slot);
  hold_->has_confidence = true;
  return hold_->confidence;
}

struct Pipeline::Impl {
  /// Facts about a slot's frame from outside.
  struct Slot {
    std::shared_ptr<Result::Hold> hold = std::make_shared<Result::Hold>();
    FrameStamp stamp;
    Clock::time_point submitted;
  };

  Impl(gpu::Context& context, const Sensor& with_sensor, const FrameFormat& frame_format,
       const PipelineOptions& options, const Tuning& tuning)
      : sensor(checked(with_sensor, frame_format, options)),
        format(frame_format),
        plan(make_plan(sensor, format, options, context.is_software())),
        frames(context, sensor, format, plan, tuning),
        history(sensor, format, plan.regions, plan.separate),
        picture(format, sensor.saturation_gray, sensor.pad),
        any_picture(options.any_picture),
        ready(!plan.background),
        slots(plan.slots) {
    if (plan.flaws) flaws.emplace(format, plan.separate);
    if (plan.specks || plan.flaws)
      specks.emplace(format, plan.specks ? std::optional(dead_gray(sensor)) : std::nullopt);
    if (plan.steady_light) light.emplace(format, sensor.saturation_gray, plan.separate);
    in_flight.reserve(plan.slots);
    for (uint32_t i = 0; i < slots.size(); ++i) {
      Result::Hold& hold = *slots[i].hold;
      hold.contacts.reserve(plan.regions ? ContactTracker::kMostContacts : 0);
      hold.slot = i;
      hold.frames = &frames;
    }
  }
  ~Impl() {
    for (Slot& slot : slots) slot.hold->frames = nullptr;
  }

  void set_untouched(const Frame& frame) {
    const Frame& whole = specks ? specks->set_background(frame) : frame;
    frames.set_background(whole);
    if (light) light->set_background(whole);
  }

  void look_for_flaws(const Frame& frame) {
    if (!flaws || !flaws->look_at(frame)) return;
    specks->set_flaws(flaws->flaws());
    set_untouched(untouched);
  }

  void look_ahead(const Frame& frame) {
    look_for_flaws(frame);
    if (light && plan.separate) light->look_ahead(specks ? specks->fill(frame) : frame);
  }

  // A frame that the device has finished: measured by itself, then followed from those before it.
  Result finish(uint32_t index) {
    const TraceSpan span("finish");
    Slot& slot = slots[index];
    Result result;
    result.hold_ = slot.hold;
    Touch& touch = result.touch;
    touch.contacts.swap(slot.hold->contacts);
    touch.contacts.clear();
    touch.skin_points.swap(slot.hold->skin_points);
    touch.skin_points.clear();
    FrameParts& parts = frames.measure(index);
    FrameStamp stamp = slot.stamp;
    const bool spoilt = stamp.fault != PictureFault::None;
    if (spoilt)
      unseen += stamp.after_gap ? kMostUnseen + 1 : 1;
    else
      stamp.after_gap = stamp.after_gap || std::exchange(unseen, 0) > kMostUnseen;
    if (plan.motion && spoilt) parts.object = unknown_pose(PoseState::PictureDamaged);
    if (plan.motion && !spoilt) frames.follow_object(index, stamp.after_gap);
    assemble(parts, stamp, history, touch);
    if (plan.motion && !spoilt) frames.follow_object_on_skin(touch);
    if (!spoilt) {
      result.traction = parts.traction_maps;
      result.extrapolated = parts.extrapolated;
    }
    SurfaceMap& surface = slot.hold->surface;
    surface = parts.map;
    slot.hold->has_depth = slot.hold->has_confidence = false;
    if (specks && surface.confidence.empty() && specks->confidence()) {
      slot.hold->of_specks = specks->confidence();
      surface.confidence = *slot.hold->of_specks;
      surface.confidence_pitch = format.width;
    }
    result.copies = parts.copies;
    result.turnaround_ms = std::chrono::duration<double, std::milli>(Clock::now() - slot.submitted).count();
    return result;
  }

  Sensor sensor;
  FrameFormat format;
  FramePlan plan;
  Frames frames;
  TouchHistory history;
  std::optional<PadFlaws> flaws;
  Frame untouched;  ///< as it was given, where flaws may be found later
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

Pipeline::Pipeline(Device& device, const Sensor& sensor, const FrameFormat& format,
                   const PipelineOptions& options)
    : impl_(std::make_unique<Impl>(DeviceAccess::context(device), sensor, format, options,
                                   load_tuning(DeviceAccess::context(device)).tuning)) {}

Pipeline PipelineAccess::tuned(gpu::Context& context, const Sensor& sensor, const FrameFormat& format,
                               const PipelineOptions& options, const Tuning& tuning) {
  validate(tuning, context.properties().limits);
  return Pipeline(std::make_unique<Pipeline::Impl>(context, sensor, format, options, tuning));
}

Pipeline::Pipeline(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
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
  if (impl_->flaws) {
    impl_->flaws->set_background(frame);
    impl_->specks->set_flaws({});
    impl_->untouched.reshape(frame.format);
    std::copy_n(frame.pixels(), frame.format.frame_bytes(), impl_->untouched.bytes.begin());
  }
  impl_->set_untouched(frame);
  if (impl_->light) impl_->light->forget_series();
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
  const TraceSpan span("begin frame");
  const auto check = [&] {
    const TraceSpan of_check("check picture");
    free->stamp.fault = impl_->any_picture ? PictureFault::None : impl_->picture.look_at(frame);
    free->stamp.repeated = impl_->picture.repeats();
    if (free->stamp.fault == PictureFault::None) impl_->look_for_flaws(frame);
  };
  // A frame that may show flaws is measured without them; others are checked while the device works.
  const bool check_first = impl_->flaws && impl_->flaws->compares_next();
  if (check_first) check();
  const auto prepared = [&]() -> const Frame& {
    const TraceSpan of_light("light");
    const Frame& whole = impl_->specks ? impl_->specks->fill(frame) : frame;
    return impl_->light ? impl_->light->steady(whole) : whole;
  };
  impl_->frames.submit(index, prepared());
  if (!check_first) check();
  if (impl_->light) {
    const bool spoilt = free->stamp.fault != PictureFault::None;
    if (spoilt) impl_->light->forget_last();
    free->stamp.light = spoilt ? LightSummary{.state = LightState::Unknown} : impl_->light->summary();
  }
  free->stamp.sequence = frame.sequence;
  free->stamp.time_ns = frame.time_ns;
  free->stamp.after_gap = frame.after_gap;
  free->hold->taken.store(true, std::memory_order_relaxed);
  impl_->in_flight.push_back(index);
  return true;
}

std::optional<Result> Pipeline::poll() {
  if (impl_->in_flight.empty() || !impl_->frames.finished(impl_->in_flight.front())) return std::nullopt;
  return wait();
}

std::optional<Result> Pipeline::wait() {
  if (impl_->in_flight.empty()) return std::nullopt;
  const uint32_t index = impl_->in_flight.front();
  impl_->frames.wait(index);
  impl_->in_flight.erase(impl_->in_flight.begin());
  return impl_->finish(index);
}

Result Pipeline::process(const Frame& frame) {
  if (!submit(frame)) throw std::logic_error("Pipeline::process needs a free slot: end a Result first");
  return *wait();
}

void Pipeline::restart_motion() {
  impl_->frames.restart_motion();
}

uint64_t Pipeline::memory_bytes() const {
  return impl_->frames.memory_bytes();
}

const FrameFormat& Pipeline::format() const {
  return impl_->format;
}

SolveBy Pipeline::solved_by() const {
  return impl_->plan.solve == Solve::Exact ? SolveBy::Host : SolveBy::Device;
}

const Sensor& Pipeline::sensor() const {
  return impl_->sensor;
}

std::vector<gpu::ScopeTime> PipelineAccess::times(const Pipeline& pipeline, const Result& result) {
  return pipeline.impl_->frames.times(result.hold_->slot);
}

std::vector<gpu::ScopeTraffic> PipelineAccess::traffic(const Pipeline& pipeline) {
  return pipeline.impl_->frames.traffic();
}

FlawSummary PipelineAccess::flaws(const Pipeline& pipeline) {
  return pipeline.impl_->flaws ? pipeline.impl_->flaws->summary() : FlawSummary{};
}

void PipelineAccess::look_ahead(Pipeline& pipeline, const Frame& frame) {
  pipeline.impl_->look_ahead(frame);
}

const SurfaceMap& PipelineAccess::surface(const Result& result) {
  static const SurfaceMap kNone;
  return result.hold_ ? result.hold_->surface : kNone;
}

const SurfaceMap& surface_of(const Result& result) {
  return PipelineAccess::surface(result);
}

}  // namespace palpate
