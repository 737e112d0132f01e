#include "engine/pipeline/weighted_solve.h"

#include <algorithm>

#include "engine/gpu/context.h"
#include "engine/numeric/weighted_poisson.h"
#include "engine/pipeline/frame_slot.h"
#include "engine/stages/slope.h"

namespace palpate {
namespace {

uint32_t iterations_for(SurfaceSolver solver) {
  return solver == SurfaceSolver::Converged ? WeightedSurface::kConvergedIterations
                                            : WeightedSurface::kLiveIterations;
}

}  // namespace

WeightedSolve::WeightedSolve(gpu::Context& context, const Sensor& sensor, const FrameFormat& format,
                             const FramePlan& plan, const Confidence& confidence, const Contact& contact,
                             const Slope& slope, const RestLevel& rest_level)
    : context_(context),
      format_(format),
      pitch_mm_per_px_(sensor.pitch_mm_per_px),
      always_(plan.weights == Weights::Always),
      filters_(plan.keep_filtered),
      confidence_(confidence),
      contact_(contact),
      slope_(slope),
      rest_level_(rest_level),
      known_(size_t{format.width} * format.height) {
  if (plan.solver == SurfaceSolver::Exact) {
    const Grid grid = grid_for(format.width, format.height);
    slope_x_ = FloatMap(context, "d/dx", grid);
    slope_y_ = FloatMap(context, "d/dy", grid);
  } else {
    surface_.emplace(context, format.width, format.height, pitch_mm_per_px_, iterations_for(plan.solver));
    fills_ = plan.solver == SurfaceSolver::Converged ? 3 : 1;
  }
}

void WeightedSolve::make(Slot& slot) const {
  if (!always_) slot.commands = gpu::Commands(context_);
  if (surface_) {
    slot.scalars = gpu::DeviceBuffer(context_, "weighted scalars", WeightedSurface::scalar_bytes(),
                                     gpu::Memory::Readback);
    return;
  }
  const uint64_t bytes = slope_x_.buffer.bytes();
  slot.slope_x = gpu::DeviceBuffer(context_, "d/dx readback", bytes, gpu::Memory::Readback);
  slot.slope_y = gpu::DeviceBuffer(context_, "d/dy readback", bytes, gpu::Memory::Readback);
}

void WeightedSolve::record(gpu::Commands& commands, FrameSlot& slot) const {
  if (always_) return record_into(commands, slot);
  gpu::Commands& own = slot.surface.weighted.commands;
  own.begin();
  // The filtered image belongs to whichever frame came last: it is made again.
  if (filters_) contact_.record(own, slot.without_markers(), slot.background, slot.records);
  record_into(own, slot);
  own.host_barrier();
  own.end();
}

void WeightedSolve::record_into(gpu::Commands& commands, FrameSlot& slot) const {
  SurfaceSlot& s = slot.surface;
  if (surface_) {
    slope_.record_slopes(commands, slot.without_markers(), slot.background, surface_->slope_x(),
                         surface_->slope_y(), s.clipped);
    confidence_.record_weights(commands, slot.confidence.map, surface_->weights());
    surface_->record(commands, s.depth, s.weighted.scalars);
    for (uint32_t i = 0; i < fills_; ++i) surface_->record_fill(commands, s.depth);
    rest_level_.record(commands, s.depth, slot.records, s.rest_records);
  } else {
    slope_.record_slopes(commands, slot.without_markers(), slot.background, slope_x_, slope_y_, s.clipped);
    commands.copy(slope_x_.buffer, s.weighted.slope_x, slope_x_.buffer.bytes());
    commands.copy(slope_y_.buffer, s.weighted.slope_y, slope_y_.buffer.bytes());
  }
}

void WeightedSolve::solve(FrameSlot& slot, uint32_t pitch) {
  Slot& own = slot.surface.weighted;
  const ConfidenceCounts& counts = slot.confidence.counts;
  // A partly shadowed pixel counts in part.
  own.used = always_ || counts.unknown + counts.shadowed > 0;
  if (!own.used) return;
  if (!always_) own.commands.submit();
  slot.records.invalidate();
  // While the GPU works: which parts hang together.
  find_known(slot);
  const auto tiles = slot.records.as<const shared::ContactRecord>();
  own.islands = islands_.find(known_, format_.width, format_.height, [&](uint32_t x, uint32_t y) {
    return tiles[size_t{y / contact_.tile_rows()} * contact_.tiles_x() + x / contact_.tile_columns()].area >
           0;
  });
  if (!always_) own.commands.wait();
  if (surface_)
    own.statistics = WeightedSurface::statistics(own.scalars);
  else
    solve_on_host(slot, pitch);
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

void WeightedSolve::solve_on_host(FrameSlot& slot, uint32_t pitch) const {
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
  float* solved = slot.surface.solved.as<float>().data();
  for (size_t i = 0; i < known_.size(); ++i)
    solved[i / format_.width * pitch + i % format_.width] = static_cast<float>(exact.z[i] * pitch_mm_per_px_);
}

void WeightedSolve::measure(const Slot& slot, Touch& touch) const {
  if (!slot.used) return;
  touch.surface->weighted = {.residual = slot.statistics.residual,
                             .unexplained = slot.statistics.unexplained,
                             .islands = slot.islands.count,
                             .touched_islands = slot.islands.touched};
  // Depth counts from the rest level: it is not determined where the contact lies on an island of its own.
  if (touch.contact && slot.islands.touched > 0 && slot.islands.apart())
    touch.surface->validity = Validity::Apart;
}

void WeightedSolve::add_times(const Slot& slot, std::vector<gpu::ScopeTime>& times) const {
  if (!slot.used || always_) return;
  const auto more = slot.commands.times();
  times.insert(times.end(), more.begin(), more.end());
}

uint64_t WeightedSolve::memory_bytes() const {
  return (surface_ ? surface_->memory_bytes() : 0) + slope_x_.buffer.bytes() + slope_y_.buffer.bytes();
}

uint64_t WeightedSolve::memory_bytes(const Slot& slot) {
  return slot.scalars.bytes() + slot.slope_x.bytes() + slot.slope_y.bytes();
}

}  // namespace palpate
