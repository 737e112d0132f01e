#include "engine/pipeline.h"

#include <algorithm>
#include <cassert>
#include <chrono>
#include <cmath>
#include <deque>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "engine/error.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "engine/mechanics/contact_shape.h"
#include "engine/mechanics/contact_tracker.h"
#include "engine/mechanics/force.h"
#include "engine/mechanics/shear.h"
#include "engine/mechanics/skin.h"
#include "engine/skipping.h"
#include "engine/solve/elastic_convolution.h"
#include "engine/solve/poisson_dct.h"
#include "engine/stages/contact.h"
#include "engine/stages/datum.h"
#include "engine/stages/elastic.h"
#include "engine/stages/gradient.h"
#include "engine/stages/lookup.h"
#include "engine/stages/pad.h"
#include "engine/stages/regions.h"
#include "engine/stages/skin.h"
#include "engine/stages/slope.h"
#include "engine/stages/surface.h"
#include "engine/stages/upload.h"
#include "engine/stages/weighted_frame.h"

namespace palpate {
namespace {

using Clock = std::chrono::steady_clock;

void require(bool fits, const Sensor& sensor, const std::string& wanted, const std::string& found,
             const std::string& remedy) {
  if (!fits) throw Error(Failure::Sensor, "sensor '" + sensor.name + "' with " + wanted, found, remedy);
}

void check_fit(const Sensor& sensor, const FrameFormat& format, uint32_t outputs) {
  const uint64_t pixels = uint64_t{format.width} * format.height;
  require(
      pixels > 0 && pixels <= kMaxPixels && format.width <= kMaxSide_px && format.height <= kMaxSide_px,
      sensor,
      "frames of 1 to " + std::to_string(kMaxPixels) + " pixels, sides up to " + std::to_string(kMaxSide_px),
      std::to_string(format.width) + " x " + std::to_string(format.height), "a crop in the sensor file");
  require(format.channels == 1 || (format.channels == 3 && format.bit_depth == 8), sensor,
          "gray frames, or colour of 8 bits",
          std::to_string(format.channels) + " channels of " + std::to_string(format.bit_depth) + " bits",
          "channels 1, or bit_depth 8");
  require(
      format.channels == sensor.channels && format.bit_depth == sensor.bit_depth, sensor,
      "its " + std::to_string(sensor.channels) + " channels of " + std::to_string(sensor.bit_depth) + " bits",
      "frames of " + std::to_string(format.channels) + " channels of " + std::to_string(format.bit_depth) +
          " bits",
      "frame.channels and frame.bit_depth in the sensor file");
  if (sensor.pad) {
    bool seen = false;
    for (uint32_t y = 0; y < format.height && !seen; ++y)
      for (uint32_t x = 0; x < format.width && !seen; ++x) seen = contains(*sensor.pad, x, y);
    require(seen, sensor, "a pad outline that covers some pixel",
            "none inside " + std::to_string(format.width) + " x " + std::to_string(format.height) + " px",
            "'pad' in px of the rectified frame");
  }
  if (follows_skin(sensor, wants(outputs, Output::Skin), wants(outputs, Output::Force))) {
    require(sensor.skin.has_value(), sensor, "a pattern on the skin", "none",
            "'skin' in the sensor file, or outputs without skin");
    require(sensor.background.kind == BackgroundKind::Untouched, sensor,
            "an untouched image in which the skin's pattern is found", "background.source 'none'",
            "'untouched', or outputs without skin");
  }
  require(!wants(outputs, Output::Gradient) || format.bit_depth == 8, sensor,
          "frames of 8 bits, for the sum of gradients", std::to_string(format.bit_depth) + " bits",
          "outputs without it");
  if (!wants(outputs, Output::Surface)) return;
  require(sensor.reading != Reading::None, sensor,
          "a surface reading (shading, photometric, elastic or lookup)", "none",
          "asking for force only, or adding 'surface' to the sensor file");
  require(sensor.reading != Reading::Photometric || format.channels == 3, sensor,
          "colour frames for reading 'photometric'", "gray frames", "channels 3 in the sensor file");
  require(sensor.reading != Reading::Shading || format.channels == 1, sensor,
          "gray frames for reading 'shading'", "colour frames", "channels 1 in the sensor file");
  require(sensor.reading != Reading::Elastic || format.channels == 1, sensor,
          "gray frames for reading 'elastic'", "colour frames", "channels 1 in the sensor file");
  require(sensor.reading != Reading::Lookup || format.channels == 1, sensor,
          "gray frames for reading 'lookup'", "colour frames", "channels 1 in the sensor file");
}

// Whether so much of the contact is clipped that its depth cannot be right: a share of its area, and in the
// reading `shading` more than what the 5 x 5 filter leaves dark along its rim, whatever its slope.
bool too_many_clipped(const Touch& t, const Sensor& sensor) {
  constexpr double kShare = 0.01, kRim_px = 4;
  double allowed_px = kShare * static_cast<double>(t.area_px);
  if (sensor.reading == Reading::Shading) {
    // The circumference of an ellipse lies below that of the circle with the same root mean square of axes.
    const double across_px = std::hypot(t.ellipse.major_mm, t.ellipse.minor_mm) / sensor.pitch_mm_per_px;
    allowed_px += kRim_px * std::numbers::pi * across_px / std::numbers::sqrt2;
  }
  return static_cast<double>(t.clipped_px) > allowed_px;
}

}  // namespace

struct Pipeline::Impl {
  // Everything one frame in flight owns. Its commands are recorded once and submitted for every frame.
  struct Slot {
    Slot(gpu::Context& context, const FrameFormat& format, const Contact& contact)
        : frame(context, "frame", format),
          records(context, "contact records", contact.record_bytes(), gpu::Memory::Readback),
          commands(context) {}

    void give_back() {
      lease.reset();
      pages.reset();
    }

    PaddedImage frame;
    // What comes before `commands`: moving what the processor wrote, where device memory is not mapped, or
    // padding what is read in place.
    gpu::Commands staged;
    gpu::Commands padded;
    gpu::Commands* first = nullptr;  // the one of them that went with the last frame
    // Of a frame that is read in place, until it is finished.
    std::shared_ptr<MappedPages> pages;
    std::shared_ptr<const uint8_t> lease;  // given back before the pages, wherever both go
    uint32_t copies = 0;
    gpu::DeviceBuffer records;
    FloatMap depth;
    gpu::DeviceBuffer datum_records;
    gpu::DeviceBuffer border_records;  // Reading::Elastic
    gpu::DeviceBuffer clipped;         // the other readings
    gpu::DeviceBuffer skin_records;
    gpu::DeviceBuffer gradient_sums;
    gpu::Commands commands;
    // Only for SurfaceSolver::Exact, which leaves the GPU in between.
    gpu::DeviceBuffer right_side;
    gpu::DeviceBuffer solved;
    gpu::Commands after_solve;

    Regions::Slot parts;        // with Output::Contacts
    WeightedFrame::Slot known;  // where not everything is

    FramePlace place;  // for which the commands were recorded
    bool free = true;
    uint64_t sequence = 0;
    int64_t time_ns = 0;
    bool after_gap = false;
    Clock::time_point submitted;
  };

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
                wants(with_options.outputs, Output::Contacts)),
        skin_tracker(with_sensor.pitch_mm_per_px),
        shear(with_sensor.pitch_mm_per_px) {
    if (wants(options.outputs, Output::Contacts)) {
      regions.emplace(context, contact, format);
      tracker.emplace(sensor, format);
    }
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
    for (uint32_t i = 0; i < std::max(options.slots, 1u); ++i)
      make(slots.emplace_back(context, format, contact));
  }

  void make(Slot& slot) {
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
  const PaddedImage& rest(const Slot& slot) const { return background ? *background : slot.frame; }

  /// Where the skin's pattern is in the untouched image; commands know how many points there are.
  void find_skin(const Frame& untouched) {
    skin->set_background(untouched);
    for (Slot& slot : slots) {
      slot.skin_records =
          gpu::DeviceBuffer(context, "skin motions", skin->record_bytes(), gpu::Memory::Readback);
      record(slot);
    }
  }

  /// The frame's pixels on their way into the slot's padded image.
  void upload(Slot& slot, const Frame& frame) {
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
  void record(Slot& slot) {
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
        datum->record(cmd, slot.depth, slot.records, slot.datum_records, inner_edges(slot));
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

  InnerEdges inner_edges(const Slot& slot) const {
    const FramePlace& at = slot.place;
    return {at.x > 0, at.x + format.width<at.frame_width, at.y> 0, at.y + format.height < at.frame_height};
  }

  Result finish(uint32_t index) {
    Slot& slot = slots[index];
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
    result.touch = measure(slot);
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

  Touch measure(const Slot& slot) {
    slot.records.invalidate();
    const auto records = slot.records.as<const shared::ContactRecord>();
    const FramePlace& at = slot.place;
    const int64_t center_x = at.frame_width / 2, center_y = at.frame_height / 2;  // as in ContactMoments
    const ContactMoments m = moved(contact.sum(records), int64_t{at.x} + format.width / 2 - center_x,
                                   int64_t{at.y} + format.height / 2 - center_y);
    const ShapeScale scale{static_cast<double>(center_x), static_cast<double>(center_y),
                           sensor.pitch_mm_per_px};
    Touch t;
    t.sequence = slot.sequence;
    t.time_ns = slot.time_ns;
    t.contact = m.area > 0;
    set_shape(t, m, scale);
    if (regions) measure_regions(slot, records, scale, t);
    if (gradient) {
      slot.gradient_sums.invalidate();
      const uint64_t units = gradient->sum(slot.gradient_sums.as<const uint32_t>());
      t.gradient_sum = static_cast<double>(units) / shared::kGradientUnits;
      t.has_gradient = true;
    }
    if (wants_surface) {
      slot.datum_records.invalidate();
      const RestLevel rest =
          datum->rest_level(records, slot.datum_records.as<const shared::DatumRecord>(), inner_edges(slot));
      t.has_surface = true;
      t.depth_datum_mm = -rest.level_mm;
      t.depth_max_mm = rest.highest_mm - rest.level_mm;
      t.datum_from_rest = rest.from_untouched;
      t.volume_mm3 = datum->volume_px_mm(records, slot.datum_records.as<const shared::DatumRecord>(),
                                         elastic ? 0 : rest.level_mm) *
                     sensor.pitch_mm_per_px * sensor.pitch_mm_per_px;
      t.depth_validity = !t.contact           ? Validity::NoContact
                         : t.saturated_px > 0 ? Validity::Saturated
                                              : Validity::Valid;
      if (elastic)
        measure_elastic(slot, rest, t);
      else if (lookup)
        measure_lookup(rest, t);
      else
        measure_clipped(slot, t);
    }
    if (partial) partial->report(slot.known, t);
    if (slot.after_gap) force.interrupt();
    if (sensor.force) t.force_N = force.update(*sensor.force, force_reading(t));
    if (slot.after_gap) shear.interrupt();
    if (skin) measure_skin(slot, t);
    shear.update(sensor.shear ? &*sensor.shear : nullptr, t);
    if (tracker) {
      if (slot.after_gap) tracker->interrupt();
      tracker->update(t, skin_sd_px);
    }
    return t;
  }

  // Each region of the contact, not followed yet.
  void measure_regions(const Slot& slot, std::span<const shared::ContactRecord> records,
                       const ShapeScale& scale, Touch& t) {
    const FramePlace& at = slot.place;
    t.has_contacts = true;
    t.regions_overflow = !regions->find(slot.parts, records, found);
    for (const Region& region : found) {
      ContactTouch& one = t.contacts.emplace_back();
      set_shape(one,
                moved(region.moments, int64_t{at.x} + format.width / 2 - int64_t{at.frame_width / 2},
                      int64_t{at.y} + format.height / 2 - int64_t{at.frame_height / 2}),
                scale);
      one.box = {region.box.x + at.x, region.box.y + at.y, region.box.width, region.box.height};
    }
  }

  void measure_skin(const Slot& slot, Touch& t) {
    slot.skin_records.invalidate();
    skin->read(slot.skin_records.as<const Skin::Motion>(), t.skin_points, skin_sd_px);
    if (slot.after_gap) skin_tracker.interrupt();
    const double per_px = 1 / sensor.pitch_mm_per_px;
    const ContactOutline outline{t.centroid_x_px, t.centroid_y_px, t.ellipse.major_mm * per_px,
                                 t.ellipse.minor_mm * per_px, t.ellipse.angle_rad};
    t.has_skin = true;
    t.skin = skin_tracker.update(t.contact ? &outline : nullptr, t.skin_points, skin_sd_px);
  }

  void measure_clipped(const Slot& slot, Touch& t) const {
    slot.clipped.invalidate();
    t.clipped_px = slope->clipped_px(slot.clipped.as<const uint32_t>());
    if (t.depth_validity == Validity::Valid && too_many_clipped(t, sensor))
      t.depth_validity = Validity::Clipped;
  }

  // Depth by pressure is absolute: there is no rest level to be found.
  void measure_elastic(const Slot& slot, const RestLevel& map_level, Touch& t) const {
    slot.border_records.invalidate();
    t.depth_datum_mm = 0;
    t.depth_max_mm = map_level.highest_mm;
    t.datum_from_rest = true;
    t.depth_sd_mm = sensor.elastic.relative_sd * std::abs(t.depth_max_mm);
    if (t.contact && Elastic::touches_border(slot.border_records.as<const float>()))
      t.depth_validity = Validity::AtBorder;
    if (t.contact && (t.saturated_px > 0 || t.peak_gray > Elastic::largest_readable_gray(sensor.elastic)))
      t.depth_validity = Validity::Saturated;
  }

  // So is depth by a table.
  void measure_lookup(const RestLevel& map_level, Touch& t) const {
    t.depth_datum_mm = 0;
    t.depth_max_mm = map_level.highest_mm;
    t.datum_from_rest = true;
    t.depth_sd_mm = sensor.lookup.depth_sd_mm;
    if (t.depth_validity == Validity::Valid && t.peak_gray > sensor.lookup.points.back()[0])
      t.depth_validity = Validity::AboveRange;
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
  std::optional<ContactTracker> tracker;
  std::vector<Region> found;  // of the frame that is measured; kept so that frames allocate nothing
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
  ForceHistory force;
  std::optional<Gradient> gradient;
  std::optional<Skin> skin;  // where its pattern is followed
  std::vector<float> skin_sd_px;
  SkinTracker skin_tracker;
  ShearTracker shear;
  std::optional<Pad> pad;  // where leased frames are read in place
  std::deque<Slot> slots;
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
  for (Impl::Slot& slot : impl_->slots) {
    slot.commands.settle();
    slot.known.solve.settle();
  }
}

void Pipeline::place(const FramePlace& place) {
  if (impl_->slope) impl_->slope->place(place);
  impl_->place = place;
}

void Pipeline::leave_unfollowed() {
  impl_->tracker.reset();
}

void Pipeline::set_background(const Frame& frame) {
  if (skipping_) return skipping_->set_background(frame);
  for (Impl::Slot& slot : impl_->slots) slot.commands.wait();
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
    Impl::Slot& slot = impl_->slots[i];
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
  Impl::Slot& slot = impl_->slots[index];
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
  const Impl::Slot& slot = impl_->slots[result.slot];
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
  const Impl::Slot& slot = impl_->slots.front();
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
  for (const Impl::Slot& slot : impl_->slots) {
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
