#include "engine/pipeline/layer_traction.h"

#include <algorithm>
#include <cmath>

#include "engine/base/trace.h"
#include "engine/gpu/context.h"
#include "shaders/shared/confidence.h"

namespace palpate {
namespace {

constexpr uint32_t kMostCells = 80;      // along a row: finer ones say no more than the errors of slopes let
constexpr double kSlopeByNormal = 1.25;  // error of n / n_z over that of n, on average over slopes to 0.6
constexpr double kSlopeSd = 0.06;        // where the sensor file says nothing
constexpr double kLeastSlopeSd = 5e-3, kMostSlopeSd = 0.3;
constexpr double kDeepest = 1.0 / 3;  // of the thickness: a depth by linear theory from pressures ends
constexpr double kShiftSd_px = 0.1;   // of a followed place, where the sensor file says nothing
constexpr double kSpread = 0.6;       // of the skin's spacing: how far a place's shift is taken to reach
constexpr float kLeastWeight = 0.3f;

uint32_t cell_side(uint32_t width) {
  return shared::kCellSide *
         std::max(1u, (width + kMostCells * shared::kCellSide - 1) / (kMostCells * shared::kCellSide));
}

double slope_sd(const Sensor& sensor, double cell_mm) {
  double sd = 0;
  if (sensor.reading == SurfaceReading::Photometric)
    sd = kSlopeByNormal * sensor.photometric.normal_sd;
  else if (sensor.reading == SurfaceReading::Lookup)
    sd = std::sqrt(2.0) * sensor.lookup.depth_sd_mm / cell_mm;
  return sd > 0 ? std::clamp(sd, kLeastSlopeSd, kMostSlopeSd) : kSlopeSd;
}

TractionGrid grid_of(const Sensor& sensor, const FrameFormat& format) {
  const uint32_t side = cell_side(format.width);
  return {format.width / side, format.height / side, side * sensor.pitch_mm_per_px};
}

double shift_sd_mm(const Sensor& sensor) {
  const double sd_px = sensor.skin && sensor.skin->shift_sd_px > 0 ? sensor.skin->shift_sd_px : kShiftSd_px;
  return sd_px * sensor.pitch_mm_per_px;
}

TractionOptions options_of(const Sensor& sensor, const LayerCalibration& layer, const TractionGrid& grid) {
  TractionOptions options;
  options.slope_sd = slope_sd(sensor, grid.cell_mm);
  options.error_length_mm = layer.thickness_mm;
  options.shift_sd_mm = shift_sd_mm(sensor);
  return options;
}

Estimate with_modulus(double value, double sd, double relative_sd) {
  return {value, std::hypot(sd, relative_sd * value), Validity::Valid};
}

/// Shear over pressure of the cells whose pressure is enough to divide by.
template <typename Take>
void each_ratio(std::span<const float> pressure, std::span<const float> shear_x,
                std::span<const float> shear_y, const Take& take) {
  const auto least = static_cast<float>(kLeastPressureShare) * *std::ranges::max_element(pressure);
  for (size_t i = 0; i < pressure.size(); ++i)
    if (pressure[i] > 0 && pressure[i] >= least) take(i, std::hypot(shear_x[i], shear_y[i]) / pressure[i]);
}

}  // namespace

std::vector<float> friction_ratios(const TractionMaps& maps) {
  if (maps.shear_x_kPa.empty() || maps.pressure_kPa.empty()) return {};
  std::vector<float> ratios(maps.pressure_kPa.size());
  each_ratio(maps.pressure_kPa, maps.shear_x_kPa, maps.shear_y_kPa,
             [&](size_t cell, float ratio) { ratios[cell] = ratio; });
  return ratios;
}

LayerTraction::LayerTraction(gpu::Context& context, const Sensor& sensor, const FrameFormat& format,
                             const SurfaceMethod& surface, bool on_host)
    : context_(context),
      sensor_(sensor),
      surface_(surface),
      layer_(layer_of(sensor).value_or(LayerCalibration{})),
      means_(size_t{cells_along(format.width)} * cells_along(format.height)),
      fine_(cell_side(format.width) / shared::kCellSide),
      grid_(grid_of(sensor, format)),
      solver_(pad_of(layer_), grid_, options_of(sensor, layer_, grid_)) {
  const size_t cells = size_t{grid_.width} * grid_.height;
  for (std::vector<float>* map : {&depth_, &pressure_, &shift_x_, &shift_y_, &weight_}) map->resize(cells);
  for (std::vector<uint8_t>* map : {&contact_, &known_, &shift_known_}) map->assign(cells, 1);
  if (!on_host && !surface.pressure())
    stage_.emplace(context, pad_of(layer_), grid_, options_of(sensor, layer_, grid_));
  if (has_gel_contacts(sensor)) bending_.emplace(format, sensor.pitch_mm_per_px, layer_.thickness_mm);
}

void LayerTraction::set_background(const Frame& background) {
  if (bending_) bending_->set_background(background);
}

void LayerTraction::make(FrameSlot& slot) const {
  TractionSlot& traction = slot.traction;
  const std::optional<DevicePressure> pressure = surface_.pressure();
  for (std::vector<float>* map : {&traction.pressure_kPa, &traction.shear_x_kPa, &traction.shear_y_kPa})
    map->assign(size_t{grid_.width} * grid_.height, 0);
  if (pressure)
    traction.input =
        gpu::DeviceBuffer(context_, "traction input", pressure->buffer->bytes(), gpu::Memory::Readback);
  if (!stage_) return;
  traction.stage = stage_->slot(context_);
  traction.solve = gpu::Commands(context_);
  traction.depths =
      gpu::DeviceBuffer(context_, "traction depths", traction.stage.depth.bytes(), gpu::Memory::Upload);
  traction.solve.begin();
  traction.solve.copy(traction.depths, traction.stage.depth, traction.stage.depth.bytes());
  traction.solve.barrier();
  stage_->record(traction.solve, traction.stage);
  traction.solve.host_barrier();
  traction.solve.end();
}

// The pressure's buffer is the next frame's as well; depths are the slot's own, and final only later.
void LayerTraction::record(gpu::Commands& commands, FrameSlot& slot) const {
  const std::optional<DevicePressure> pressure = surface_.pressure();
  if (pressure) commands.copy(*pressure->buffer, slot.traction.input, pressure->buffer->bytes());
}

void LayerTraction::measure(FrameSlot& slot, FrameParts& parts) {
  const TraceSpan span("traction");
  TractionPart& part = parts.traction.emplace();
  TractionSummary& summary = part.summary;
  for (Estimate* one : components(summary)) one->validity = Validity::NoContact;
  if (!parts.touched()) return forget();
  follows_ = true;
  TractionInput input;
  if (surface_.pressure()) {
    read_pressures(slot);
    input.pressure_MPa = pressure_;
  } else {
    find_contact(parts);
    read_heights(slot);
    read_confidence(slot);
    input = {.depth_mm = depth_, .known = known_};
    if (!parts.contacts.empty()) input.contact = contact_;
  }
  if (spread_shifts(parts)) {
    input.shift_x_mm = shift_x_;
    input.shift_y_mm = shift_y_;
    input.shift_known = shift_known_;
  }
  // The device's stage ends with the frame; the host goes on beyond it.
  input.goes_on = parts.whole.at_border;
  std::optional<TractionReading> device;
  if (stage_ && !input.goes_on) device = press_on_device(slot);
  // What the device leaves open (thin layers, wide contacts) the host solves.
  const bool by_device = device && device->converged;
  if (by_device) input.pressure_MPa = device->pressure_MPa;
  const Traction& found = solver_.solve(input);
  const double depth_mm = parts.surface->summary.depth_max_mm;
  if (!surface_.pressure())
    deep_ = deep_press(press_shape(found.pressure_MPa, grid_, depth_mm, layer_.thickness_mm));
  fill(found, slot, summary);
  if (bending_) summary.bending_mm = bending_->measure(slot.cell_changes.as<const shared::CellChange>());
  part.not_converged = !found.converged;
  if (device) summary.iterations += device->iterations;
  if (by_device) {
    summary.residual = device->residual;
    summary.unexplained_slope = device->slope_rms;
  }
  part.too_deep = depth_mm > (surface_.pressure() ? kDeepest : kDeepestPress) * layer_.thickness_mm;
  part.covered = summary.unknown_cells > 0;
  const TractionSlot& maps = slot.traction;
  parts.traction_maps = {.width = grid_.width, .height = grid_.height, .cell_px = fine_ * shared::kCellSide};
  parts.traction_maps.pressure_kPa = maps.pressure_kPa;
  if (summary.fx_N.validity != Validity::NotCalibrated) {
    parts.traction_maps.shear_x_kPa = maps.shear_x_kPa;
    parts.traction_maps.shear_y_kPa = maps.shear_y_kPa;
  }
}

// Once, however many frames nothing touches.
void LayerTraction::forget() {
  if (!follows_) return;
  follows_ = false;
  solver_.forget();
  if (stage_) stage_->forget(context_);
}

// The device finds the pressure; the host finds its standard error, and the shear.
TractionReading LayerTraction::press_on_device(FrameSlot& slot) {
  TractionSlot& traction = slot.traction;
  std::ranges::copy(depth_, traction.depths.as<float>().begin());
  traction.depths.flush();
  stage_->write_masks(traction.stage, contact_, known_);
  traction.solve.submit();
  traction.solve.wait();
  return stage_->read(traction.stage);
}

// In the boxes of contacts, and a cell around them.
void LayerTraction::find_contact(const FrameParts& parts) {
  const bool everywhere = parts.contacts.empty();
  std::fill(contact_.begin(), contact_.end(), everywhere ? 1 : 0);
  const uint32_t side = fine_ * shared::kCellSide;
  for (const ContactTouch& one : parts.contacts) {
    const uint32_t left = one.box.x / side, top = one.box.y / side;
    const uint32_t right = (one.box.x + one.box.width) / side + 2;
    const uint32_t bottom = (one.box.y + one.box.height) / side + 2;
    for (uint32_t y = top - std::min(top, 1u); y < std::min(bottom, grid_.height); ++y)
      for (uint32_t x = left - std::min(left, 1u); x < std::min(right, grid_.width); ++x)
        contact_[size_t{y} * grid_.width + x] = 1;
  }
}

void LayerTraction::read_pressures(FrameSlot& slot) {
  const DevicePressure map = *surface_.pressure();
  slot.traction.input.invalidate();
  const std::span<const float> pixels = slot.traction.input.as<const float>();
  const uint32_t side = fine_ * shared::kCellSide;
  for (uint32_t y = 0; y < grid_.height; ++y)
    for (uint32_t x = 0; x < grid_.width; ++x) {
      double sum_MPa = 0;
      for (uint32_t row = 0; row < side; ++row)
        for (uint32_t column = 0; column < side; ++column)
          sum_MPa += double{pixels[map.start + size_t{y * side + row} * map.pitch + x * side + column]};
      pressure_[size_t{y} * grid_.width + x] = static_cast<float>(sum_MPa / (side * side));
    }
}

void LayerTraction::read_heights(const FrameSlot& slot) {
  const HeightRows heights = surface_.heights(slot);
  cell_means(heights, means_);
  const uint32_t cells_x = cells_along(heights.width);
  for (uint32_t y = 0; y < grid_.height; ++y)
    for (uint32_t x = 0; x < grid_.width; ++x) {
      float sum = 0;
      for (uint32_t row = 0; row < fine_; ++row)
        for (uint32_t column = 0; column < fine_; ++column)
          sum += means_[size_t{y * fine_ + row} * cells_x + x * fine_ + column];
      depth_[size_t{y} * grid_.width + x] = sum / static_cast<float>(fine_ * fine_);
    }
}

// A cell is known where half of its pixels are, and their mean is a number.
void LayerTraction::read_confidence(const FrameSlot& slot) {
  const uint32_t side = fine_ * shared::kCellSide;
  const bool all = slot.confidence.map.buffer.bytes() == 0;
  const std::span<const uint16_t> map =
      all ? std::span<const uint16_t>{} : slot.confidence.map.buffer.as<const uint16_t>();
  for (uint32_t y = 0; y < grid_.height; ++y)
    for (uint32_t x = 0; x < grid_.width; ++x) {
      const size_t cell = size_t{y} * grid_.width + x;
      uint32_t seen = 0;
      for (uint32_t row = 0; row < side && !all; ++row)
        for (uint32_t column = 0; column < side; ++column)
          seen += (map[size_t{y * side + row} * slot.confidence.pitch + x * side + column] &
                   shared::kFullConfidence) != 0;
      known_[cell] = std::isfinite(depth_[cell]) && (all || 2 * seen >= side * side) ? 1 : 0;
    }
}

// Each followed place gives its shift to the cells around where it is now.
bool LayerTraction::spread_shifts(const FrameParts& parts) {
  if (parts.skin_points.empty() || !sensor_.skin) return false;
  std::fill(weight_.begin(), weight_.end(), 0.0f);
  std::fill(shift_x_.begin(), shift_x_.end(), 0.0f);
  std::fill(shift_y_.begin(), shift_y_.end(), 0.0f);
  const auto side = static_cast<double>(fine_ * shared::kCellSide);
  const double reach = std::max(kSpread * sensor_.skin->spacing_px / side, 0.5);
  const int cells = static_cast<int>(std::ceil(2 * reach));
  const auto pitch = static_cast<float>(sensor_.pitch_mm_per_px);
  for (size_t i = 0; i < parts.skin_points.size(); ++i) {
    const SkinPoint& point = parts.skin_points[i];
    if (point.correlation <= 0 || !(parts.skin_sd_px[i] >= 0)) continue;
    const double x = (double{point.rest_x_px + point.shift_x_px} + 0.5) / side - 0.5;
    const double y = (double{point.rest_y_px + point.shift_y_px} + 0.5) / side - 0.5;
    const int left = static_cast<int>(std::lround(x)) - cells, top = static_cast<int>(std::lround(y)) - cells;
    for (int row = std::max(top, 0); row < std::min(top + 2 * cells + 1, static_cast<int>(grid_.height));
         ++row)
      for (int column = std::max(left, 0);
           column < std::min(left + 2 * cells + 1, static_cast<int>(grid_.width)); ++column) {
        const double squares = (std::pow(row - y, 2) + std::pow(column - x, 2)) / (2 * reach * reach);
        const auto weight = static_cast<float>(std::exp(-squares));
        const size_t cell = static_cast<size_t>(row) * grid_.width + static_cast<size_t>(column);
        weight_[cell] += weight;
        shift_x_[cell] += weight * pitch * point.shift_x_px;
        shift_y_[cell] += weight * pitch * point.shift_y_px;
      }
  }
  bool some = false;
  for (size_t i = 0; i < weight_.size(); ++i) {
    shift_known_[i] = weight_[i] >= kLeastWeight ? 1 : 0;
    if (shift_known_[i] == 0) continue;
    some = true;
    shift_x_[i] /= weight_[i];
    shift_y_[i] /= weight_[i];
  }
  return some;
}

void LayerTraction::fill_shear(const Traction& found, FrameSlot& slot, TractionSummary& summary) const {
  if (found.shear_x_MPa.empty()) return;
  for (size_t i = 0; i < found.shear_x_MPa.size(); ++i) {
    slot.traction.shear_x_kPa[i] = 1e3f * found.shear_x_MPa[i];
    slot.traction.shear_y_kPa[i] = 1e3f * found.shear_y_MPa[i];
    const double kPa = 1e3 * std::hypot(double{found.shear_x_MPa[i]}, double{found.shear_y_MPa[i]});
    summary.shear_max_kPa = std::max(summary.shear_max_kPa, kPa);
  }
  if (const double friction = sensor_.shear ? sensor_.shear->friction : 0; friction > 0) {
    double pressed = 0, slipping = 0;
    const TractionSlot& maps = slot.traction;
    each_ratio(maps.pressure_kPa, maps.shear_x_kPa, maps.shear_y_kPa, [&](size_t, float ratio) {
      pressed += ratio > 0;
      slipping += ratio >= kSlippingShare * friction;
    });
    if (pressed > 0) summary.slipping_fraction = slipping / pressed;
  }
  const Wrench& w = found.wrench;
  const double relative_sd = layer_.relative_sd;
  summary.fx_N = with_modulus(w.force_N[0], w.force_sd_N[0], relative_sd);
  summary.fy_N = with_modulus(w.force_N[1], w.force_sd_N[1], relative_sd);
  summary.mz_Nmm = with_modulus(w.moment_Nmm[2], w.moment_sd_Nmm[2], relative_sd);
}

void LayerTraction::fill(const Traction& found, FrameSlot& slot, TractionSummary& summary) const {
  const double area_mm2 = grid_.cell_mm * grid_.cell_mm;
  for (size_t i = 0; i < found.pressure_MPa.size(); ++i) {
    const double kPa = 1e3 * deep_.factor * double{found.pressure_MPa[i]};
    slot.traction.pressure_kPa[i] = static_cast<float>(kPa);
    summary.pressure_max_kPa = std::max(summary.pressure_max_kPa, kPa);
    summary.area_mm2 += kPa > 0 ? area_mm2 : 0;
    summary.unknown_cells += contact_[i] != 0 && known_[i] == 0;
  }
  const Wrench& w = found.wrench;
  const double relative_sd = std::hypot(layer_.relative_sd, deep_.relative_sd), factor = deep_.factor;
  summary.fz_N = with_modulus(factor * w.force_N[2], factor * w.force_sd_N[2], relative_sd);
  summary.mx_Nmm = with_modulus(factor * w.moment_Nmm[0], factor * w.moment_sd_Nmm[0], relative_sd);
  summary.my_Nmm = with_modulus(factor * w.moment_Nmm[1], factor * w.moment_sd_Nmm[1], relative_sd);
  for (Estimate* unknown : {&summary.fx_N, &summary.fy_N, &summary.mz_Nmm}) *unknown = {};
  fill_shear(found, slot, summary);
  summary.unexplained_slope = found.slope_rms;
  summary.residual = found.residual;
  summary.iterations = found.iterations;
}

uint64_t LayerTraction::memory_bytes() const {
  return stage_ ? stage_->memory_bytes() : 0;
}

uint64_t LayerTraction::memory_bytes(const FrameSlot& slot) {
  const TractionSlot& t = slot.traction;
  return t.input.bytes() + t.depths.bytes() + t.stage.depth.bytes() + t.stage.flags.bytes() +
         t.stage.pressure.bytes() + t.stage.state.bytes() + t.stage.records.bytes();
}

}  // namespace palpate
