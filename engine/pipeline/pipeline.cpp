#include "palpate/pipeline.h"

#include <algorithm>
#include <cassert>
#include <chrono>
#include <deque>
#include <stdexcept>

#include "palpate/error.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "engine/pipeline/frame_measurement.h"
#include "engine/sensor/fit.h"
#include "engine/pipeline/windowed_frame.h"
#include "engine/elasticity/elastic_convolution.h"
#include "engine/numeric/poisson_dct.h"
#include "engine/stages/contact.h"
#include "engine/stages/rest_level.h"
#include "engine/stages/elastic.h"
#include "engine/stages/gradient.h"
#include "engine/stages/lookup.h"
#include "engine/stages/import_pages.h"
#include "engine/stages/regions.h"
#include "engine/stages/skin.h"
#include "engine/stages/slope.h"
#include "engine/stages/surface.h"
#include "engine/stages/upload.h"
#include "engine/stages/weighted_frame.h"

namespace palpate {
namespace {

using Clock = std::chrono::steady_clock;

}  // namespace

struct Pipeline::Impl {
  Impl(gpu::Context& gpu_context, const Sensor& with_sensor, const FrameFormat& frame_format,
       const PipelineOptions& with_options)
      : context(gpu_context),
        sensor(with_sensor),
        format(frame_format),
        options(with_options),
        tuning(with_options.tuning ? *with_options.tuning : load_tuning(gpu_context).tuning),
        wants_surface(wants(with_options.outputs, Output::Surface)),
        wants_confidence(needs_confidence(with_sensor, with_options.outputs)),
        contact(gpu_context, with_sensor, frame_format,
                wants_surface && with_sensor.reading != Reading::Photometric, tuning,
                wants(with_options.outputs, Output::Contacts)) {
    if (wants(options.outputs, Output::Contacts)) regions.emplace(context, contact, format);
    if (follows_skin(sensor, wants(options.outputs, Output::Skin), wants(options.outputs, Output::Force)))
      skin.emplace(context, sensor, format);
    if (needs_gradient(sensor, options.outputs)) gradient.emplace(context, sensor, format);
    if (sensor.background.kind == BackgroundKind::Untouched)
      background.emplace(context, "background", format);
    if (wants_surface && sensor.reading == Reading::Elastic) {
      elastic.emplace(context, sensor, format, contact, tuning);
      datum.emplace(context, contact, map, tuning);
      if (options.solver == SurfaceSolver::Exact)
        convolution.emplace(ElasticKernel(sensor.elastic, sensor.pitch_mm_per_px), format.width,
                            format.height);
    } else if (wants_surface && sensor.reading == Reading::Lookup) {
      lookup.emplace(context, sensor, format, contact, tuning);
      datum.emplace(context, contact, map, tuning);
    } else if (wants_surface) {
      // With a pad's outline some pixels are never known: the solver with weights is then the only one.
      if (!sensor.pad || options.solver == SurfaceSolver::Exact)
        surface.emplace(context, format.width, format.height, options.solver, tuning, false,
                        options.warm_start);
      slope.emplace(context, sensor, format, contact, surface ? surface->right_sides() : RightSides::Cells,
                    tuning);
      datum.emplace(context, contact, map, tuning);
      if (options.solver == SurfaceSolver::Exact) dct.emplace(format.width, format.height);
    }
    if (wants_confidence) {
      partial.emplace(context, sensor, format, options.solver, slope.has_value());
      if (slope) slope->prepare_slopes(context);
    }
    if (!background) {
      has_background = true;
      Frame black;
      black.reshape(format);
      if (partial) partial->set_background(black);
    }
    const bool import =
        options.upload == Upload::Import || (options.upload == Upload::Auto && !context.is_software());
    if (import && context.host_import_alignment() > 0) pad.emplace(context, format);
    const auto made = [](const auto& stage) { return stage ? &*stage : nullptr; };
    measuring.emplace(sensor, format,
                      Measuring::Stages{&contact, regions ? &*regions : nullptr, made(datum), made(slope),
                                        made(skin), made(gradient), made(partial)});
    for (uint32_t i = 0; i < std::max(options.slots, 1u); ++i)
      make(slots.emplace_back(context, format, contact));
  }

  void make(FrameSlot& slot) {
    if (pad) slot.padded = gpu::Commands(context);
    if (regions) slot.parts = regions->slot(context);
    if (gradient)
      slot.gradient_sums =
          gpu::DeviceBuffer(context, "gradient sums", gradient->record_bytes(), gpu::Memory::Readback);
    if (slot.frame.staged()) {
      slot.staged = gpu::Commands(context);
      slot.staged.begin();
      {
        const auto scope = slot.staged.scope("upload");
        slot.frame.record(slot.staged);
        slot.staged.barrier();
      }
      slot.staged.end();
    }
    if (wants_surface) {
      slot.depth = FloatMap(context, "depth", map);
      slot.datum_records =
          gpu::DeviceBuffer(context, "datum records", datum->record_bytes(), gpu::Memory::Readback);
      if (elastic)
        slot.border_records =
            gpu::DeviceBuffer(context, "border records", Elastic::kBorderBytes, gpu::Memory::Readback);
      if (slope)
        slot.clipped =
            gpu::DeviceBuffer(context, "clipped pixels", slope->clipped_bytes(), gpu::Memory::Readback);
    }
    record(slot);
  }

  /// The untouched image, or where nothing is subtracted anything of its shape: it is not read.
  const PaddedImage& rest(const FrameSlot& slot) const { return background ? *background : slot.frame; }

  /// Where the skin's pattern is in the untouched image; commands know how many points there are.
  void find_skin(const Frame& untouched) {
    skin->set_background(untouched);
    for (FrameSlot& slot : slots) {
      slot.skin_records =
          gpu::DeviceBuffer(context, "skin motions", skin->record_bytes(), gpu::Memory::Readback);
      record(slot);
    }
  }

  /// The frame's pixels on their way into the slot's padded image.
  void upload(FrameSlot& slot, const Frame& frame) {
    const PageImport* import = pad ? pad->find(frame) : nullptr;
    slot.copies = import ? 0 : 1;
    if (import) {
      slot.padded.begin();
      {
        const auto scope = slot.padded.scope("upload");
        pad->record(slot.padded, frame, *import, slot.frame);
      }
      slot.padded.end();
      slot.first = &slot.padded;
      slot.pages = frame.pages;
      slot.lease = frame.leased;
    } else {
      slot.frame.write(frame);
      slot.first = slot.frame.staged() ? &slot.staged : nullptr;
    }
  }

  // The life of a frame, once it is uploaded: the whole machine in the order in which it happens.
  void record(FrameSlot& slot) {
    slot.place = place;
    gpu::Commands& cmd = slot.commands;
    cmd.begin();
    contact.record(cmd, slot.frame, rest(slot), slot.records);
    if (regions) regions->record(cmd, slot.frame, rest(slot), slot.records, slot.parts);
    if (gradient) gradient->record(cmd, slot.frame, rest(slot), slot.gradient_sums);
    if (skin && skin->ready()) skin->record(cmd, slot.frame, slot.skin_records);
    if (partial) partial->record(context, cmd, slot.known, slot.frame);
    const bool weights = partial && partial->solves();
    if (weights)
      partial->record_solve(context, cmd, slot.known, slot.frame, rest(slot), contact, slot.records, *slope,
                            *datum, slot.depth, slot.datum_records, slot.clipped);
    if (wants_surface && !(weights && partial->always())) {
      if (elastic) elastic->record_pressure(cmd, slot.border_records);
      if (slope) slope->record(cmd, slot.frame, rest(slot), *surface, slot.clipped);
      if (!solves_on_host()) {
        if (elastic)
          elastic->record_deflection(cmd, slot.depth);
        else if (lookup)
          lookup->record(cmd, slot.depth);
        else
          surface->record(cmd, slot.depth);
        datum->record(cmd, slot.depth, slot.records, slot.datum_records, slot.inner_edges(format));
      } else {
        const gpu::DeviceBuffer& from = elastic ? elastic->pressure() : surface->right_side().buffer;
        const uint64_t bytes = map.bytes();
        slot.right_side =
            gpu::DeviceBuffer(context, "right side readback", from.bytes(), gpu::Memory::Readback);
        slot.solved = gpu::DeviceBuffer(context, "solved heights", bytes, gpu::Memory::Upload);
        cmd.copy(from, slot.right_side, from.bytes());
        slot.after_solve = gpu::Commands(context);
        slot.after_solve.begin();
        slot.after_solve.copy(slot.solved, slot.depth.buffer, bytes);
        slot.after_solve.barrier();
        datum->record(slot.after_solve, slot.depth, slot.records, slot.datum_records);
        slot.after_solve.host_barrier();
        slot.after_solve.end();
      }
    }
    cmd.host_barrier();
    cmd.end();
  }

  Result finish(uint32_t index) {
    FrameSlot& slot = slots[index];
    if (partial) partial->count(slot.known);
    const bool weights = slot.known.weighted;
    if (weights)
      partial->solve(slot.known, contact, slot.records,
                     slot.solved ? slot.solved.as<float>().data() : nullptr, map.pitch * 4);
    if (solves_on_host()) {
      slot.right_side.invalidate();
      const float* from = slot.right_side.as<float>().data();
      float* solved = slot.solved.as<float>().data();
      if (weights) {
        // done above
      } else if (elastic)
        convolution->solve(from + elastic->pressure_start(), elastic->pressure_pitch(), solved,
                           map.pitch * 4);
      else
        dct->solve(from, solved, map.pitch * 4);
      slot.solved.flush();
      slot.after_solve.submit();
      slot.after_solve.wait();
    }
    Result result;
    result.slot = index;
    result.copies = slot.copies;
    result.touch = measuring->measure(slot);
    if (wants_surface) {
      result.surface.buffer = &slot.depth.buffer;
      result.surface.width = map.width;
      result.surface.height = map.height;
      result.surface.pitch = map.pitch * 4;
    }
    if (partial) {
      slot.known.map.buffer.invalidate();
      result.surface.confidence = slot.known.map.buffer.as<const uint16_t>();
      result.surface.confidence_pitch = partial->pitch();
    }
    result.turnaround_ms = std::chrono::duration<double, std::milli>(Clock::now() - slot.submitted).count();
    return result;
  }

  bool solves_on_host() const { return dct || convolution; }

  gpu::Context& context;
  Sensor sensor;
  FrameFormat format;
  PipelineOptions options;
  Tuning tuning;
  bool wants_surface;
  bool wants_confidence;
  std::optional<PaddedImage> background;  // where one is subtracted
  bool has_background = false;
  Contact contact;
  std::optional<Regions> regions;
  FramePlace place{0, 0, format.width, format.height};
  Grid map = grid_for(format.width, format.height);  // of the depth
  std::optional<Slope> slope;
  std::optional<Surface> surface;
  std::optional<Datum> datum;
  std::optional<PoissonDct> dct;
  std::optional<Elastic> elastic;  // in place of slope and surface
  std::optional<ElasticConvolution> convolution;
  std::optional<Lookup> lookup;          // in place of slope and surface
  std::optional<WeightedFrame> partial;  // where not everything is known
  std::optional<Gradient> gradient;
  std::optional<Skin> skin;  // where its pattern is followed
  std::optional<Measuring> measuring;
  std::optional<Pad> pad;  // where leased frames are read in place
  std::deque<FrameSlot> slots;
  std::deque<uint32_t> in_flight;
};

Pipeline::Pipeline(gpu::Context& context, const Sensor& sensor, const FrameFormat& format,
                   const PipelineOptions& options) {
  validate(sensor, sensor.name);
  check_fit(sensor, format, options.outputs);
  if (options.tuning) validate(*options.tuning, context.properties().limits);
  if (options.skip_untouched && Skipping::possible(sensor, format, options))
    skipping_ = std::make_unique<Skipping>(context, sensor, format, options);
  else
    impl_ = std::make_unique<Impl>(context, sensor, format, options);
}

Pipeline::Pipeline(Pipeline&&) noexcept = default;

Pipeline::~Pipeline() {
  if (!impl_) return;
  for (FrameSlot& slot : impl_->slots) {
    slot.commands.settle();
    slot.known.solve.settle();
  }
}

void Pipeline::place(const FramePlace& place) {
  if (impl_->slope) impl_->slope->place(place);
  impl_->place = place;
}

void Pipeline::leave_unfollowed() {
  impl_->measuring->leave_unfollowed();
}

void Pipeline::set_background(const Frame& frame) {
  if (skipping_) return skipping_->set_background(frame);
  for (FrameSlot& slot : impl_->slots) slot.commands.wait();
  if (frame.format != impl_->format) {
    throw Error(Failure::Input, "a background image of the frames' format",
                std::to_string(frame.format.width) + " x " + std::to_string(frame.format.height) + ", " +
                    std::to_string(frame.format.channels) + " channels, " +
                    std::to_string(frame.format.bit_depth) + " bits",
                "a background taken with the same camera settings");
  }
  if (!impl_->background) {
    const uint8_t* pixels = frame.pixels();
    if (std::any_of(pixels, pixels + frame.format.frame_bytes(), [](uint8_t byte) { return byte != 0; }))
      throw Error(Failure::Input, "a black background, or none, for background.source 'none'", "another one",
                  "source 'untouched' in the sensor file");
    return;
  }
  impl_->background->write(frame);
  gpu::Commands commands(impl_->context);
  commands.begin();
  impl_->background->record(commands);
  commands.end();
  commands.submit();
  commands.wait();
  if (impl_->partial) impl_->partial->set_background(frame);
  impl_->has_background = false;
  if (impl_->skin) impl_->find_skin(frame);
  impl_->has_background = true;
}

bool Pipeline::submit(const Frame& frame) {
  if (skipping_) return skipping_->submit(frame);
  if (!impl_->has_background)
    throw Error(Failure::Input, "a background image", "none set", "Pipeline::set_background first");
  if (frame.format != impl_->format) {
    throw Error(Failure::Input, "frames of one size and depth",
                std::to_string(frame.format.width) + " x " + std::to_string(frame.format.height),
                "one recording at a time");
  }
  for (uint32_t i = 0; i < impl_->slots.size(); ++i) {
    FrameSlot& slot = impl_->slots[i];
    if (!slot.free) continue;
    if (slot.place != impl_->place) impl_->record(slot);
    slot.sequence = frame.sequence;
    slot.time_ns = frame.time_ns;
    slot.after_gap = frame.after_gap;
    slot.submitted = Clock::now();
    try {
      impl_->upload(slot, frame);
      if (impl_->regions) Regions::start(slot.parts);
      slot.commands.submit(slot.first);
    } catch (...) {
      slot.give_back();
      throw;
    }
    slot.free = false;
    impl_->in_flight.push_back(i);
    return true;
  }
  return false;
}

std::optional<Result> Pipeline::poll() {
  if (skipping_) return skipping_->poll();
  if (impl_->in_flight.empty() || !impl_->slots[impl_->in_flight.front()].commands.finished())
    return std::nullopt;
  return wait();
}

std::optional<Result> Pipeline::wait() {
  if (skipping_) return skipping_->wait();
  if (impl_->in_flight.empty()) return std::nullopt;
  const uint32_t index = impl_->in_flight.front();
  FrameSlot& slot = impl_->slots[index];
  slot.commands.wait();
  slot.give_back();
  impl_->in_flight.pop_front();
  return impl_->finish(index);
}

void Pipeline::release(const Result& result) {
  if (skipping_) return skipping_->release(result);
  impl_->slots[result.slot].free = true;
}

Touch Pipeline::process(const Frame& frame) {
  if (!submit(frame)) throw std::logic_error("Pipeline::process needs a free slot: release a result first");
  const std::optional<Result> result = wait();
  release(*result);
  return result->touch;
}

std::vector<float> Pipeline::read_depth_mm(const Result& result) const {
  assert(result.surface.buffer != nullptr);
  if (skipping_) return skipping_->read_depth_mm(result);
  const Grid& grid = impl_->map;
  const gpu::DeviceBuffer* from = result.surface.buffer;
  gpu::DeviceBuffer staging;
  if (!from->mapped()) {
    staging = gpu::DeviceBuffer(impl_->context, "depth readback", grid.bytes(), gpu::Memory::Readback);
    gpu::Commands commands(impl_->context);
    commands.begin();
    commands.copy(*from, staging, grid.bytes());
    commands.host_barrier();
    commands.end();
    commands.submit();
    commands.wait();
    from = &staging;
  }
  from->invalidate();
  const std::span<const float> raw = from->as<const float>();
  const auto datum = static_cast<float>(result.touch.depth_datum_mm);
  std::vector<float> depth_mm;
  depth_mm.reserve(size_t{grid.width} * grid.height);
  for (uint32_t y = 0; y < grid.height; ++y) {
    const auto row = raw.subspan(size_t{y} * grid.pitch * 4, grid.width);
    for (const float value : row) depth_mm.push_back(value + datum);
  }
  return depth_mm;
}

std::vector<uint16_t> Pipeline::read_confidence(const Result& result) const {
  if (skipping_ || !impl_->partial) return {};
  return impl_->partial->read(impl_->slots[result.slot].known);
}

std::vector<gpu::ScopeTime> Pipeline::times(const Result& result) const {
  if (skipping_) return skipping_->times(result);
  const FrameSlot& slot = impl_->slots[result.slot];
  std::vector<gpu::ScopeTime> times;
  if (slot.first) times = slot.first->times();
  const auto main = slot.commands.times();
  times.insert(times.end(), main.begin(), main.end());
  if (impl_->solves_on_host()) {
    const auto rest = slot.after_solve.times();
    times.insert(times.end(), rest.begin(), rest.end());
  }
  const WeightedFrame::Slot& known = slot.known;
  if (known.weighted && !impl_->partial->always()) {
    const auto rest = known.solve.times();
    times.insert(times.end(), rest.begin(), rest.end());
  }
  return times;
}

std::vector<gpu::ScopeTraffic> Pipeline::traffic() const {
  if (skipping_) return skipping_->traffic();
  const FrameSlot& slot = impl_->slots.front();
  std::vector<gpu::ScopeTraffic> traffic;
  for (const gpu::Commands* part : {&slot.staged, &slot.commands, &slot.after_solve}) {
    const auto more = part->traffic();
    traffic.insert(traffic.end(), more.begin(), more.end());
  }
  return traffic;
}

uint64_t Pipeline::memory_bytes() const {
  if (skipping_) return skipping_->memory_bytes();
  uint64_t bytes = impl_->contact.filtered().bytes() + impl_->contact.marks().bytes();
  if (impl_->regions) bytes += impl_->regions->memory_bytes();
  if (impl_->background) bytes += impl_->background->memory_bytes();
  if (impl_->surface) bytes += impl_->surface->memory_bytes();
  if (impl_->elastic) bytes += impl_->elastic->memory_bytes();
  if (impl_->lookup) bytes += impl_->lookup->memory_bytes();
  if (impl_->partial) bytes += impl_->partial->memory_bytes();
  if (impl_->skin) bytes += impl_->skin->memory_bytes();
  for (const FrameSlot& slot : impl_->slots) {
    bytes += WeightedFrame::memory_bytes(slot.known) + Regions::memory_bytes(slot.parts);
    bytes += slot.frame.memory_bytes() + slot.records.bytes() + slot.depth.buffer.bytes() +
             slot.datum_records.bytes() + slot.skin_records.bytes() + slot.gradient_sums.bytes() +
             slot.border_records.bytes() + slot.clipped.bytes() + slot.right_side.bytes() +
             slot.solved.bytes();
  }
  return bytes;
}

const FrameFormat& Pipeline::format() const {
  if (skipping_) return skipping_->format();
  return impl_->format;
}
const Sensor& Pipeline::sensor() const {
  if (skipping_) return skipping_->sensor();
  return impl_->sensor;
}

}  // namespace palpate
