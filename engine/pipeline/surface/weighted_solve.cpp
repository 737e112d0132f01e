#include "engine/pipeline/surface/weighted_solve.h"

#include <algorithm>

#include "engine/gpu/context.h"
#include "engine/numeric/weighted_poisson.h"
#include "engine/pipeline/frame_slot.h"
#include "engine/stages/surface/slope.h"

namespace palpate {

WeightedSolve::WeightedSolve(gpu::Context& context, const Sensor& sensor, const FrameFormat& format,
                             const FramePlan& plan, const Confidence& confidence, const Contact& contact,
                             const Surface& plain, const Slope& slope)
    : context_(context),
      format_(format),
      pitch_mm_per_px_(sensor.pitch_mm_per_px),
      filters_(plan.keep_filtered),
      confidence_(confidence),
      contact_(contact),
      plain_(plain),
      slope_(slope),
      known_(size_t{format.width} * format.height) {
  const Grid grid = grid_for(format.width, format.height);
  if (plan.solve == Solve::Exact) {
    slope_x_ = FloatMap(context, "d/dx", grid);
    slope_y_ = FloatMap(context, "d/dy", grid);
  } else if (on_cells()) {
    surface_.emplace(context, coarser(grid), slope.strips(), WeightedSurface::kCellIterations);
    cells_ = FloatMap(context, "weighted heights of cells", coarser(grid));
  } else {
    surface_.emplace(context, format.width, format.height, pitch_mm_per_px_,
                     WeightedSurface::kFrameIterations);
  }
}

bool WeightedSolve::on_cells() const {
  return plain_.right_sides() == RightSides::Cells;
}

void WeightedSolve::set_known(std::span<const uint8_t> known) {
  still_islands_ = islands_.find(known, format_.width, format_.height).count;
}

void WeightedSolve::make(Slot& slot) const {
  if (surface_) {
    slot.commands = gpu::Commands(context_);
    slot.plain = gpu::Commands(context_);
    slot.scalars = gpu::DeviceBuffer(context_, "weighted scalars", WeightedSurface::scalar_bytes(),
                                     gpu::Memory::Readback);
    return;
  }
  const uint64_t bytes = slope_x_.buffer.bytes();
  slot.slope_x = gpu::DeviceBuffer(context_, "d/dx readback", bytes, gpu::Memory::Readback);
  slot.slope_y = gpu::DeviceBuffer(context_, "d/dy readback", bytes, gpu::Memory::Readback);
}

void WeightedSolve::record_right_side(gpu::Commands& commands, const FrameSlot& slot) const {
  if (on_cells()) {
    slope_.record_known(commands, slot.without_markers(), slot.background, confidence_.still_pairs(),
                        plain_.coarse_right_side(), slot.surface.clipped);
    return;
  }
  slope_.record_slopes(commands, slot.without_markers(), slot.background, surface_->slope_x(),
                       surface_->slope_y(), slot.surface.clipped);
  confidence_.record_weights(commands, confidence_.still_pairs(), surface_->weights());
  surface_->record_right_side(commands, plain_.right_side());
  plain_.record_coarse_right_side(commands);
}

void WeightedSolve::record_filtered(gpu::Commands& commands, const FrameSlot& slot) const {
  if (filters_) contact_.record(commands, slot.without_markers(), slot.background, slot.records);
}

void WeightedSolve::record_solve(gpu::Commands& commands, FrameSlot& slot) const {
  SurfaceSlot& s = slot.surface;
  if (!surface_) {
    slope_.record_slopes(commands, slot.without_markers(), slot.background, slope_x_, slope_y_, s.clipped);
    commands.copy(slope_x_.buffer, s.weighted.slope_x, slope_x_.buffer.bytes());
    commands.copy(slope_y_.buffer, s.weighted.slope_y, slope_y_.buffer.bytes());
    return;
  }
  const FloatMap& heights = on_cells() ? cells_ : s.depth;
  if (on_cells()) {
    const CellFaceMaps faces{surface_->across().buffer, surface_->down().buffer, surface_->field()};
    slope_.record_known(commands, slot.without_markers(), slot.background, slot.confidence.map.pairs,
                        surface_->right_side(), s.clipped, &faces);
    surface_->record_given(commands, heights, s.weighted.scalars);
  } else {
    slope_.record_slopes(commands, slot.without_markers(), slot.background, surface_->slope_x(),
                         surface_->slope_y(), s.clipped);
    confidence_.record_weights(commands, slot.confidence.map.pairs, surface_->weights());
    surface_->record(commands, heights, s.weighted.scalars);
  }
  surface_->record_fill(commands, heights);
  if (on_cells()) plain_.record_interpolation(commands, cells_, s.depth);
}

void WeightedSolve::solve(FrameSlot& slot, const HeightRows& heights) {
  Slot& own = slot.surface.weighted;
  const ConfidenceCounts& counts = slot.confidence.counts;
  own.in_part = plain_.solves_known_part() && confidence_.only_still(counts);
  own.used = !own.in_part && counts.unknown + counts.partial > 0;
  own.again = !surface_ || own.expected == own.used ? nullptr : own.used ? &own.commands : &own.plain;
  if (own.again) own.again->submit();
  own.islands = {.count = still_islands_};
  if (own.used || (own.in_part && still_islands_ > 1)) find_islands(slot);
  if (own.again) own.again->wait();
  if (!own.used) return;
  if (surface_)
    own.statistics = WeightedSurface::statistics(own.scalars);
  else
    solve_on_host(slot, heights);
}

// Which parts hang together, and which of them are touched.
void WeightedSolve::find_islands(FrameSlot& slot) {
  slot.records.invalidate();
  find_known(slot);
  const auto tiles = slot.records.as<const shared::ContactRecord>();
  slot.surface.weighted.islands =
      islands_.find(known_, format_.width, format_.height, [&](uint32_t x, uint32_t y) {
        const size_t row = y / contact_.tile_rows();
        return tiles[row * contact_.tiles_x() + x / contact_.tile_columns()].area > 0;
      });
}

// The lower half of each pixel of the map: its confidence.
void WeightedSolve::find_known(const FrameSlot& slot) {
  const ConfidenceMap& map = slot.confidence.map;
  map.buffer.invalidate();
  const std::span<const uint16_t> from = map.buffer.as<const uint16_t>();
  for (uint32_t y = 0; y < format_.height; ++y) {
    const auto row = from.subspan(size_t{y} * confidence_.pitch(), format_.width);
    std::ranges::transform(row, known_.begin() + static_cast<std::ptrdiff_t>(size_t{y} * format_.width),
                           [](uint16_t pixel) { return static_cast<uint8_t>(pixel & 255); });
  }
}

void WeightedSolve::solve_on_host(FrameSlot& slot, const HeightRows& heights) const {
  Slot& own = slot.surface.weighted;
  own.slope_x.invalidate();
  own.slope_y.invalidate();
  std::vector<float> gradients(2 * known_.size()), weights(known_.size());
  const uint32_t row = grid_for(format_.width, format_.height).pitch * 4;
  for (size_t i = 0; i < known_.size(); ++i) {
    const size_t at = i / format_.width * row + i % format_.width;
    gradients[2 * i] = own.slope_x.as<const float>()[at];
    gradients[2 * i + 1] = own.slope_y.as<const float>()[at];
    weights[i] = static_cast<float>(known_[i]) / static_cast<float>(shared::kFullConfidence);
  }
  const WeightedFaces faces = weighted_faces(gradients, weights, format_.width, format_.height);
  const WeightedSolution exact = solve_weighted(faces);
  own.statistics = {exact.residual, unexplained(faces, exact.z), exact.iterations, exact.converged};
  for (size_t i = 0; i < known_.size(); ++i)
    heights.values[i / format_.width * heights.pitch + i % format_.width] =
        static_cast<float>(exact.z[i] * pitch_mm_per_px_);
}

void WeightedSolve::measure(const Slot& slot, bool touched, SurfacePart& part) const {
  if (!slot.used && !slot.in_part) return;
  const Islands& islands = slot.islands;
  WeightedSummary& weighted = part.summary.weighted.emplace();
  weighted.islands = islands.count;
  weighted.touched_islands = islands.apart() || slot.used ? islands.touched : touched ? 1 : 0;
  if (slot.used) {
    weighted.residual = slot.statistics.residual;
    weighted.unexplained = slot.statistics.unexplained;
  }
  // Depth counts from the rest level: it is not determined where the contact lies on an island of its own.
  part.faults.apart = touched && islands.touched > 0 && islands.apart();
}

void WeightedSolve::add_times(const Slot& slot, std::vector<gpu::ScopeTime>& times) const {
  if (!slot.again) return;
  const auto more = slot.again->times();
  times.insert(times.end(), more.begin(), more.end());
}

uint64_t WeightedSolve::memory_bytes() const {
  return (surface_ ? surface_->memory_bytes() : 0) + cells_.buffer.bytes() + slope_x_.buffer.bytes() +
         slope_y_.buffer.bytes();
}

uint64_t WeightedSolve::memory_bytes(const Slot& slot) {
  return slot.scalars.bytes() + slot.slope_x.bytes() + slot.slope_y.bytes();
}

}  // namespace palpate
