#include "engine/stages/weighted_frame.h"

#include <algorithm>

#include "engine/gpu/context.h"
#include "engine/numeric/weighted_poisson.h"

namespace palpate {
namespace {

uint32_t iterations_for(SurfaceSolver solver) {
  return solver == SurfaceSolver::Converged ? WeightedSurface::kConvergedIterations
                                            : WeightedSurface::kLiveIterations;
}

}  // namespace

WeightedFrame::WeightedFrame(gpu::Context& context, const Sensor& sensor, const FrameFormat& format,
                             SurfaceSolver solver, bool surface)
    : sensor_(sensor), format_(format), confidence_(context, sensor, format) {
  if (!surface) return;
  if (solver == SurfaceSolver::Exact) {
    const Grid grid = grid_for(format.width, format.height);
    slope_x_ = FloatMap(context, "d/dx", grid);
    slope_y_ = FloatMap(context, "d/dy", grid);
  } else {
    surface_.emplace(context, format.width, format.height, sensor.pitch_mm_per_px, iterations_for(solver));
    fills_ = solver == SurfaceSolver::Converged ? 3 : 1;
  }
}

void WeightedFrame::record(gpu::Context& context, gpu::Commands& commands, Slot& slot,
                           const PaddedImage& frame) const {
  slot.map = ConfidenceMap(context, confidence_.map_bytes());
  slot.records =
      gpu::DeviceBuffer(context, "confidence records", confidence_.record_bytes(), gpu::Memory::Readback);
  confidence_.record(commands, frame, slot.map, slot.records);
}

void WeightedFrame::record_solve(gpu::Context& context, gpu::Commands& commands, Slot& slot,
                                 const PaddedImage& frame, const PaddedImage& background,
                                 const Contact& contact, const gpu::DeviceBuffer& contact_records,
                                 const Slope& slope, const Datum& datum, const FloatMap& depth,
                                 const gpu::DeviceBuffer& datum_records,
                                 const gpu::DeviceBuffer& clipped) const {
  if (!always()) {
    slot.solve = gpu::Commands(context);
    slot.solve.begin();
    // The filtered image belongs to whichever frame came last: it is made again.
    if (sensor_.reading == Reading::Shading) contact.record(slot.solve, frame, background, contact_records);
  }
  gpu::Commands& cmd = always() ? commands : slot.solve;
  if (surface_) {
    slot.scalars = gpu::DeviceBuffer(context, "weighted scalars", WeightedSurface::scalar_bytes(),
                                     gpu::Memory::Readback);
    slope.record_slopes(cmd, frame, background, surface_->slope_x(), surface_->slope_y(), clipped);
    confidence_.record_weights(cmd, slot.map, surface_->weights());
    surface_->record(cmd, depth, slot.scalars);
    for (uint32_t i = 0; i < fills_; ++i) surface_->record_fill(cmd, depth);
    datum.record(cmd, depth, contact_records, datum_records);
  } else {
    const uint64_t bytes = grid_for(format_.width, format_.height).bytes();
    slot.slope_x = gpu::DeviceBuffer(context, "d/dx readback", bytes, gpu::Memory::Readback);
    slot.slope_y = gpu::DeviceBuffer(context, "d/dy readback", bytes, gpu::Memory::Readback);
    slope.record_slopes(cmd, frame, background, slope_x_, slope_y_, clipped);
    cmd.copy(slope_x_.buffer, slot.slope_x, bytes);
    cmd.copy(slope_y_.buffer, slot.slope_y, bytes);
  }
  if (always()) return;
  cmd.host_barrier();
  cmd.end();
}

void WeightedFrame::count(Slot& slot) const {
  slot.records.invalidate();
  slot.counts = confidence_.sum(slot.records.as<const shared::ConfidenceRecord>());
  // A partly shadowed pixel counts in part.
  slot.weighted = solves() && (always() || slot.counts.unknown + slot.counts.shadowed > 0);
}

void WeightedFrame::solve(Slot& slot, const Contact& contact, const gpu::DeviceBuffer& contact_records,
                          float* solved, uint32_t pitch) const {
  if (!always()) slot.solve.submit();
  contact_records.invalidate();
  // While the GPU works: which parts hang together.
  const std::vector<uint16_t> pixels = read(slot);
  std::vector<uint8_t> known(pixels.size());
  std::transform(pixels.begin(), pixels.end(), known.begin(),
                 [](uint16_t p) { return static_cast<uint8_t>(p & 255); });
  const auto tiles = contact_records.as<const shared::ContactRecord>();
  slot.islands = find_islands(known, format_.width, format_.height, [&](uint32_t x, uint32_t y) {
    return tiles[size_t{y / contact.tile_rows()} * contact.tiles_x() + x / contact.tile_columns()].area > 0;
  });
  if (!always()) slot.solve.wait();
  if (surface_) {
    slot.evidence = WeightedSurface::evidence(slot.scalars);
    return;
  }
  slot.slope_x.invalidate();
  slot.slope_y.invalidate();
  std::vector<float> gradients(2 * pixels.size()), weights(pixels.size());
  const uint32_t row = grid_for(format_.width, format_.height).pitch * 4;
  for (size_t i = 0; i < pixels.size(); ++i) {
    const size_t at = i / format_.width * row + i % format_.width;
    gradients[2 * i] = slot.slope_x.as<const float>()[at];
    gradients[2 * i + 1] = slot.slope_y.as<const float>()[at];
    weights[i] = static_cast<float>(known[i]) / static_cast<float>(shared::kFullConfidence);
  }
  const WeightedFaces faces = weighted_faces(gradients, weights, format_.width, format_.height);
  const WeightedSolution exact = solve_weighted(faces);
  slot.evidence = {exact.residual, misfit(faces, exact.z), exact.iterations, exact.converged};
  for (size_t i = 0; i < pixels.size(); ++i)
    solved[i / format_.width * pitch + i % format_.width] =
        static_cast<float>(exact.z[i] * sensor_.pitch_mm_per_px);
}

void WeightedFrame::report(const Slot& slot, Touch& touch) const {
  touch.has_confidence = true;
  touch.unknown_px = slot.counts.unknown;
  touch.shadowed_px = slot.counts.shadowed;
  touch.outside_px = slot.counts.outside;
  if (!slot.weighted) return;
  touch.weighted = true;
  touch.weighted_residual = slot.evidence.residual;
  touch.weighted_misfit = slot.evidence.misfit;
  touch.islands = slot.islands.count;
  touch.touched_islands = slot.islands.touched;
  // Depth counts from the rest level: it is not determined where the contact lies on an island of its own.
  if (touch.contact && slot.islands.touched > 0 && slot.islands.apart())
    touch.depth_validity = Validity::Apart;
}

uint64_t WeightedFrame::memory_bytes() const {
  return confidence_.memory_bytes() + (surface_ ? surface_->memory_bytes() : 0) + slope_x_.buffer.bytes() +
         slope_y_.buffer.bytes();
}

uint64_t WeightedFrame::memory_bytes(const Slot& slot) {
  return slot.map.buffer.bytes() + slot.records.bytes() + slot.scalars.bytes() + slot.slope_x.bytes() +
         slot.slope_y.bytes();
}

}  // namespace palpate
