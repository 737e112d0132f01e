#include "engine/pipeline/frames.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "engine/base/trace.h"
#include "engine/gpu/context.h"
#include "engine/measure/contact/contact_shape.h"
#include "engine/measure/contact/contact_tracker.h"
#include "engine/pipeline/surface/make_surface.h"
#include "engine/stages/motion_sums.h"

namespace palpate {
namespace {

// Where the processor's own driver would only copy them once more, pages are not imported.
bool reads_in_place(const gpu::Context& context, Upload upload) {
  const bool wanted = upload == Upload::Import || (upload == Upload::Auto && !context.is_software());
  return wanted && context.host_import_alignment() > 0;
}

double thickness_mm(const Sensor& sensor) {
  const std::optional<LayerCalibration> layer = layer_of(sensor);
  return layer ? layer->thickness_mm : std::numeric_limits<double>::infinity();
}

}  // namespace

Frames::Frames(gpu::Context& context, const Sensor& sensor, const FrameFormat& format, const FramePlan& plan,
               const Tuning& tuning)
    : context_(context),
      format_(format),
      pitch_mm_per_px_(sensor.pitch_mm_per_px),
      thickness_mm_(thickness_mm(sensor)),
      separate_(plan.separate),
      contact_(context, sensor, format, plan.keep_filtered, tuning, plan.regions) {
  if (plan.background) background_.emplace(context, "background", format);
  if (plan.regions) {
    regions_.emplace(context, contact_, format);
    parts_.contacts.reserve(ContactTracker::kMostContacts);
  }
  if (plan.gel_contacts) {
    cell_change_.emplace(context, format);
    gel_contacts_.emplace(sensor, format);
  }
  if (plan.gradient) gradient_.emplace(context, sensor, format, tuning);
  if (plan.skin) skin_.emplace(context, sensor, format);
  if (plan.markers) markers_.emplace(context, sensor, format);
  if (plan.confidence) confidence_.emplace(context, sensor, format, markers_ ? &*markers_ : nullptr);
  surface_ =
      make_surface(context, sensor, format, plan, contact_, confidence_ ? &*confidence_ : nullptr, tuning);
  if (plan.traction) traction_.emplace(context, sensor, format, *surface_, plan.traction_on_host);
  if (plan.motion)
    object_.emplace(sensor, format,
                    plan.motion_on_host ? host_sums() : std::make_unique<DeviceMotionSums>(context),
                    plan.markers);
  if (gel_contacts_ && surface_) rest_correction_.emplace(format.width, format.height);
  if (rest_correction_ && sensor.reading == SurfaceReading::Photometric)
    smooth_touch_.emplace(sensor, format);
  if (surface_ && DepthError::states_seen(sensor)) depth_error_.emplace(sensor.photometric, format);
  if (confidence_ && !background_) {
    Frame black;
    black.reshape(format);
    confidence_->set_background(black);
    if (surface_) surface_->set_confidence(*confidence_);
  }
  if (reads_in_place(context, plan.upload)) pages_.emplace(context, format);
  for (uint32_t i = 0; i < plan.slots; ++i)
    make(slots_.emplace_back(context, format, contact_, background_ ? &*background_ : nullptr));
}

Frames::~Frames() {
  for (FrameSlot& slot : slots_) {
    slot.commands.settle();
    slot.weighted.settle();
    slot.surface.weighted.commands.settle();
    slot.surface.weighted.plain.settle();
    slot.surface.to_device.settle();
    slot.traction.solve.settle();
  }
}

void Frames::make(FrameSlot& slot) {
  const auto readback = [this](const char* name, uint64_t bytes) {
    return gpu::DeviceBuffer(context_, name, bytes, gpu::Memory::Readback);
  };
  if (pages_) slot.padded = gpu::Commands(context_);
  if (slot.frame.staged()) {
    slot.staged = gpu::Commands(context_);
    slot.staged.begin();
    {
      const auto scope = slot.staged.scope("upload");
      slot.frame.record(slot.staged);
      slot.staged.barrier();
    }
    slot.staged.end();
  }
  if (markers_) slot.markers.emplace(context_, format_, markers_->record_bytes());
  if (regions_) slot.regions = regions_->slot(context_);
  if (cell_change_) slot.cell_changes = readback("cell changes", cell_change_->bytes());
  if (gradient_) slot.gradient_sums = readback("gradient sums", gradient_->record_bytes());
  if (confidence_) {
    slot.confidence.map = ConfidenceMap(context_, confidence_->map_bytes());
    slot.confidence.records = readback("confidence records", confidence_->record_bytes());
    slot.confidence.pitch = confidence_->pitch();
  }
  if (surface_) surface_->make(slot);
  if (traction_) traction_->make(slot);
  if (depth_error_) slot.extrapolated.resize(size_t{depth_error_->cells_x()} * depth_error_->cells_y());
  slot.running = &slot.commands;
  if (surface_ && surface_->may_weigh()) slot.weighted = gpu::Commands(context_);
  record(slot);
}

void Frames::record(FrameSlot& slot) {
  record(slot, slot.commands, false);
  if (surface_ && surface_->may_weigh()) record(slot, slot.weighted, true);
}

// The whole machine, in order.
void Frames::record(FrameSlot& slot, gpu::Commands& cmd, bool weighted) {
  cmd.begin();
  if (markers_) markers_->record(cmd, slot.frame, slot.background, *slot.markers);
  const PaddedImage& frame = slot.without_markers();
  contact_.record(cmd, frame, slot.background, slot.records);
  if (regions_) regions_->record(cmd, frame, slot.background, slot.records, slot.regions);
  if (cell_change_) cell_change_->record(cmd, frame, slot.background, slot.cell_changes);
  if (gradient_) gradient_->record(cmd, frame, slot.background, slot.gradient_sums);
  if (skin_ && skin_->ready()) skin_->record(cmd, slot.frame, slot.skin_records);
  if (confidence_) confidence_->record(cmd, frame, slot.confidence.map, slot.confidence.records);
  if (surface_) weighted ? surface_->record_weighted(cmd, slot) : surface_->record(cmd, slot);
  if (traction_) traction_->record(cmd, slot);
  cmd.host_barrier();
  cmd.end();
}

void Frames::set_background(const Frame& background) {
  for (const FrameSlot& slot : slots_) slot.running->wait();
  background_->write(background);
  gpu::run_once(context_, [&](gpu::Commands& commands) { background_->record(commands); });
  const Frame plain = markers_ ? markers_->set_background(background, *background_) : Frame{};
  if (confidence_) {
    confidence_->set_background(markers_ ? plain : background);
    if (surface_) surface_->set_confidence(*confidence_);
  }
  if (gel_contacts_) gel_contacts_->set_background(markers_ ? plain : background);
  if (traction_) traction_->set_background(markers_ ? plain : background);
  if (skin_) find_skin(background);
  // Commands know where the skin's pattern is, how dark its markers are, and what no frame shows.
  if (skin_ || markers_ || confidence_)
    for (FrameSlot& slot : slots_) record(slot);
}

// Where the skin's pattern is in the untouched image.
void Frames::find_skin(const Frame& untouched) {
  skin_->set_background(untouched);
  for (FrameSlot& slot : slots_) {
    slot.skin_records =
        gpu::DeviceBuffer(context_, "skin motions", skin_->record_bytes(), gpu::Memory::Readback);
    slot.skin_sd_px.reserve(skin_->points());
  }
}

void Frames::submit(uint32_t index, const Frame& frame) {
  FrameSlot& slot = slots_[index];
  try {
    upload(slot, frame);
    if (regions_) Regions::start(slot.regions);
    slot.surface.weighted.expected = surface_ && surface_->expects_weights(frame);
    slot.running = slot.surface.weighted.expected ? &slot.weighted : &slot.commands;
    slot.running->submit(slot.first);
  } catch (...) {
    slot.give_back();
    throw;
  }
}

// The frame's pixels on their way into the slot's padded image.
void Frames::upload(FrameSlot& slot, const Frame& frame) {
  const TraceSpan span("upload");
  const PageImport* import = pages_ ? pages_->find(frame) : nullptr;
  slot.copies = import ? 0 : 1;
  if (import) {
    slot.padded.begin();
    {
      const auto scope = slot.padded.scope("upload");
      pages_->record(slot.padded, frame, *import, slot.frame);
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

bool Frames::finished(uint32_t slot) const {
  return slots_[slot].running->finished();
}

void Frames::wait(uint32_t slot) {
  slots_[slot].running->wait();
  slots_[slot].give_back();
}

FrameParts& Frames::measure(uint32_t index) {
  FrameSlot& slot = slots_[index];
  if (separate_) forget();
  parts_.clear();
  parts_.copies = slot.copies;
  if (confidence_) measure_confidence(slot);
  if (surface_) surface_->solve(slot);
  measure_contact(slot);
  if (object_) object_->look_at(surface_->heights(slot));
  if (rest_correction_) correct_rest(slot);
  if (gradient_) {
    slot.gradient_sums.invalidate();
    const uint64_t units = gradient_->sum(slot.gradient_sums.as<const uint32_t>());
    parts_.gradient_sum = static_cast<double>(units) / shared::kGradientUnits;
  }
  if (skin_) measure_skin(slot);
  if (surface_) measure_surface(slot);
  if (markers_) measure_markers(slot);
  if (traction_) traction_->measure(slot, parts_);
  return parts_;
}

void Frames::follow_object(uint32_t index, bool after_gap) {
  const TraceSpan span("object motion");
  if (after_gap) object_->restart();
  const SurfaceSummary& summary = parts_.surface->summary;
  const bool corrected = slots_[index].surface.was_corrected && rest_correction_;
  PadAtRest rest{.level_mm = -summary.depth_offset_mm, .level_sd_mm = summary.depth_sd_mm};
  if (corrected)
    rest = {.level_mm = rest_correction_->rest_level_mm(),
            .level_sd_mm = std::hypot(summary.depth_sd_mm, rest_correction_->error_mm()),
            .cells_x = cells_along(format_.width),
            .means_mm = rest_correction_->means_mm(),
            .at_rest = gel_contacts_->at_rest()};
  const double gain_sd = summary.depth_max_mm > 0 ? summary.depth_sd_mm / summary.depth_max_mm : 0;
  parts_.object =
      object_->follow(rest, gain_sd, parts_.touched(), gel_contacts_ ? &*gel_contacts_ : nullptr, corrected);
}

void Frames::restart_motion() {
  if (object_) object_->restart();
}

// Forgets the start of contacts, noise and traction.
void Frames::forget() {
  if (gel_contacts_) gel_contacts_->restart();
  if (traction_) traction_->forget();
}

void Frames::measure_confidence(FrameSlot& slot) {
  ConfidenceSlot& confidence = slot.confidence;
  confidence.records.invalidate();
  confidence.counts = confidence_->sum(confidence.records.as<const shared::ConfidenceRecord>());
  parts_.confidence = {.unknown_px = confidence.counts.unknown,
                       .shadowed_px = confidence.counts.shadowed,
                       .outside_px = confidence.counts.outside};
  confidence.map.buffer.invalidate();
  parts_.map.confidence = confidence.map.buffer.as<const uint16_t>();
  parts_.map.confidence_pitch = confidence_->pitch();
}

void Frames::measure_contact(const FrameSlot& slot) {
  slot.records.invalidate();
  const uint32_t middle_x_px = format_.width / 2, middle_y_px = format_.height / 2;
  const ShapeScale scale{static_cast<double>(middle_x_px), static_cast<double>(middle_y_px),
                         pitch_mm_per_px_};
  set_shape(parts_.whole, contact_.sum(slot.records.as<const shared::ContactRecord>()), scale);
  if (regions_) measure_regions(slot, scale);
}

void Frames::measure_regions(const FrameSlot& slot, const ShapeScale& scale) {
  parts_.regions.emplace().overflow =
      !regions_->find(slot.regions, slot.records.as<const shared::ContactRecord>(), found_);
  for (const Region& region : found_) {
    ContactTouch& one = parts_.contacts.emplace_back();
    set_shape(one, region.moments, scale);
    one.box = region.box;
  }
  if (gel_contacts_) measure_gel_contacts(slot);
}

// The regions of gray change are pieces of a gel's contacts; the whole contact's gray sum and peak stay
// theirs.
void Frames::measure_gel_contacts(const FrameSlot& slot) {
  std::swap(gray_regions_, parts_.contacts);
  slot.cell_changes.invalidate();
  gel_contacts_->find(slot.cell_changes.as<const shared::CellChange>(), gray_regions_, parts_.contacts);
  // Among markers a change of light is not taken out of the slopes.
  parts_.light_unknown = markers_ && (!gel_contacts_->light_trusted() || gel_contacts_->other_light());
  set_whole();
}

void Frames::set_whole() {
  const ContactTouch& gel = gel_contacts_->whole();
  ContactTouch& whole = parts_.whole;
  whole.centroid_x_px = gel.centroid_x_px;
  whole.centroid_y_px = gel.centroid_y_px;
  whole.area_px = gel.area_px;
  whole.area_mm2 = gel.area_mm2;
  whole.ellipse = gel.ellipse;
  whole.at_border = gel.at_border;
}

void Frames::correct_rest(FrameSlot& slot) {
  const TraceSpan span("rest correction");
  const HeightRows heights = surface_->heights(slot);
  rest_correction_->look_at(heights);
  const auto find = [&] { return rest_correction_->find(gel_contacts_->at_rest()); };
  slot.surface.was_corrected = find();
  slot.surface.rest_unknown = false;
  if (slot.surface.was_corrected && smooth_touch_) {
    const SmoothTouch::TakenOff what = taken_off();
    slot.surface.rest_unknown = what == SmoothTouch::TakenOff::PerhapsTouch;
    if (what == SmoothTouch::TakenOff::Touch) {
      gel_contacts_->rest_where_unchanged();
      slot.surface.was_corrected = find();
      slot.surface.rest_unknown = !slot.surface.was_corrected;
    }
  }
  if (!slot.surface.was_corrected) return;
  take_off(heights, rest_correction_->level_mm());
  slot.surface.changed = true;
  gel_contacts_->split(rest_correction_->depth_mm(), rest_correction_->error_mm(), gray_regions_,
                       parts_.contacts);
  set_whole();
}

SmoothTouch::TakenOff Frames::taken_off() {
  return smooth_touch_->look_at({.at_rest = gel_contacts_->at_rest(),
                                 .raised = gel_contacts_->raised(),
                                 .level_mm = rest_correction_->level_mm(),
                                 .depth_mm = rest_correction_->depth_mm(),
                                 .change = gel_contacts_->mean_change()});
}

void Frames::measure_skin(FrameSlot& slot) {
  slot.skin_records.invalidate();
  skin_->read(slot.skin_records.as<const Skin::Motion>(), parts_.skin_points, slot.skin_sd_px);
  parts_.follows_skin = true;
  parts_.skin_sd_px = slot.skin_sd_px;
}

// The surface's own doubts, by saturated and clipped pixels, are of the outlines of a gel's contacts.
void Frames::measure_surface(FrameSlot& slot) {
  surface_->finish_heights(slot);
  parts_.surface = surface_->measure(slot, parts_.whole);
  parts_.surface->faults.light_unknown = slot.surface.rest_unknown;
  parts_.surface->faults.too_deep = parts_.surface->summary.depth_max_mm > thickness_mm_;
  std::optional<GelContacts::Dent> dent;
  if (slot.surface.was_corrected && rest_correction_) dent = measure_areas();
  if (depth_error_) measure_depth_error(slot, dent.value_or(GelContacts::Dent{}));
  const Grid& grid = surface_->grid();
  parts_.map.buffer = &slot.surface.depth.buffer;
  parts_.map.width = grid.width;
  parts_.map.height = grid.height;
  parts_.map.pitch = grid.pitch * 4;
}

// What reached the border by its outline still does.
GelContacts::Dent Frames::measure_areas() {
  const std::span<const float> depth_mm = rest_correction_->depth_mm();
  const bool at_border = parts_.whole.at_border;
  gel_contacts_->shrink_to_depth(depth_mm, gray_regions_, parts_.contacts);
  set_whole();
  parts_.whole.at_border = parts_.whole.at_border || at_border;
  const GelContacts::Dent dent = gel_contacts_->dent(depth_mm);
  parts_.surface->summary.dented_mm2 = dent.area_px * pitch_mm_per_px_ * pitch_mm_per_px_;
  return dent;
}

// A depth whose contact is in part unlike anything that calibration saw may be wrong by that part of it.
void Frames::measure_depth_error(FrameSlot& slot, const GelContacts::Dent& dent) {
  SurfaceSummary& summary = parts_.surface->summary;
  double x_px = parts_.whole.centroid_x_px, y_px = parts_.whole.centroid_y_px, share = 0, rest_mm = 0;
  if (dent.level_mm) {
    const std::span<const float> depth_mm = rest_correction_->depth_mm();
    const auto sum = depth_error_->mark(slot.cell_changes.as<const shared::CellChange>(), depth_mm,
                                        *dent.level_mm, slot.extrapolated);
    summary.extrapolated_px = sum.px;
    share = sum.share();
    parts_.surface->faults.extrapolated = share > DepthError::kMuch;
    parts_.extrapolated = {depth_error_->cells_x(), depth_error_->cells_y(), shared::kCellSide,
                           slot.extrapolated};
    const auto deepest = static_cast<uint32_t>(std::ranges::max_element(depth_mm) - depth_mm.begin());
    const uint32_t column = deepest % depth_error_->cells_x(), row = deepest / depth_error_->cells_x();
    x_px = (column + 0.5) * shared::kCellSide;
    y_px = (row + 0.5) * shared::kCellSide;
    rest_mm = dent.noise_mm;
  }
  if (!parts_.touched()) return;
  const double relative = depth_error_->relative(x_px, y_px);
  if (relative > 0)
    summary.depth_sd_mm = std::hypot(relative * summary.depth_max_mm, share * summary.depth_max_mm, rest_mm);
}

void Frames::measure_markers(const FrameSlot& slot) {
  constexpr uint64_t kOneIn = 100;  // pixels unknown, from where the surface is not what it seems
  slot.markers->records.invalidate();
  const MarkerCounts counts = markers_->sum(slot.markers->records.as<const uint32_t>());
  parts_.markers = {.filled_px = counts.marked - counts.unknown, .unknown_px = counts.unknown};
  if (parts_.surface)
    parts_.surface->faults.covered = counts.unknown * kOneIn > uint64_t{format_.width} * format_.height;
}

void Frames::read_depth_mm(uint32_t slot, double rest_mm, std::vector<float>& depth_mm) const {
  const Grid& grid = surface_->grid();
  const gpu::DeviceBuffer* from = &slots_[slot].surface.on_host();
  gpu::DeviceBuffer staging;
  if (!from->mapped()) {
    staging = gpu::DeviceBuffer(context_, "depth readback", grid.bytes(), gpu::Memory::Readback);
    gpu::run_once(context_, [&](gpu::Commands& commands) {
      commands.copy(*from, staging, grid.bytes());
      commands.host_barrier();
    });
    from = &staging;
  }
  from->invalidate();
  const std::span<const float> raw = from->as<const float>();
  const auto rest = static_cast<float>(rest_mm);
  depth_mm.clear();
  depth_mm.reserve(size_t{grid.width} * grid.height);
  for (uint32_t y = 0; y < grid.height; ++y) {
    const auto row = raw.subspan(size_t{y} * grid.pitch * 4, grid.width);
    for (const float value : row) depth_mm.push_back(value + rest);
  }
}

std::vector<uint16_t> Frames::read_confidence(uint32_t slot) const {
  return confidence_ ? confidence_->unpack(slots_[slot].confidence.map) : std::vector<uint16_t>{};
}

std::vector<gpu::ScopeTime> Frames::times(uint32_t index) const {
  const FrameSlot& slot = slots_[index];
  std::vector<gpu::ScopeTime> times;
  if (slot.first) times = slot.first->times();
  const auto main = slot.running->times();
  times.insert(times.end(), main.begin(), main.end());
  if (surface_) surface_->add_times(slot, times);
  return times;
}

std::vector<gpu::ScopeTraffic> Frames::traffic() const {
  const FrameSlot& slot = slots_.front();
  std::vector<gpu::ScopeTraffic> traffic;
  for (const gpu::Commands* part : {&slot.staged, &slot.commands}) {
    const auto more = part->traffic();
    traffic.insert(traffic.end(), more.begin(), more.end());
  }
  return traffic;
}

uint64_t Frames::memory_bytes() const {
  uint64_t bytes = contact_.filtered().bytes() + contact_.marks().bytes();
  if (regions_) bytes += regions_->memory_bytes();
  if (background_) bytes += background_->memory_bytes();
  if (skin_) bytes += skin_->memory_bytes();
  if (markers_) bytes += markers_->memory_bytes();
  if (confidence_) bytes += confidence_->memory_bytes();
  if (surface_) bytes += surface_->memory_bytes();
  if (traction_) bytes += traction_->memory_bytes();
  if (object_) bytes += object_->memory_bytes();
  for (const FrameSlot& slot : slots_) {
    bytes += slot.frame.memory_bytes() + slot.records.bytes() + Regions::memory_bytes(slot.regions) +
             slot.cell_changes.bytes() + slot.gradient_sums.bytes() + slot.skin_records.bytes() +
             slot.confidence.map.buffer.bytes() + slot.confidence.records.bytes();
    if (slot.markers) bytes += slot.markers->frame.memory_bytes() + slot.markers->records.bytes();
    if (surface_) bytes += surface_->memory_bytes(slot);
    bytes += LayerTraction::memory_bytes(slot);
  }
  return bytes;
}

}  // namespace palpate
