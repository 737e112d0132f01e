// Weighted solve: the surface of a frame from the pixels of non-zero confidence. Built only where a caller
// asks for Output::Confidence or the sensor file names a pad or a shadow level.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "engine/pipeline/plan.h"
#include "engine/pipeline/weighted_slot.h"
#include "engine/stages/weighted_surface.h"
#include "palpate/touch.h"

namespace palpate {

class Confidence;
class Contact;
class RestLevel;
class Slope;
struct FrameSlot;

class WeightedSolve {
 public:
  using Slot = WeightedSlot;

  /// The stages live longer than this.
  WeightedSolve(gpu::Context& context, const Sensor& sensor, const FrameFormat& format, const FramePlan& plan,
                const Confidence& confidence, const Contact& contact, const Slope& slope,
                const RestLevel& rest_level);

  /// Buffers of a slot.
  void make(Slot& slot) const;
  /// Weights::Always: among the frame's `commands`. Otherwise recorded for itself: it runs where a frame
  /// turns out to need it. It fills what the solve without weights does: depth, rest level and clipped
  /// pixels.
  void record(gpu::Commands& commands, FrameSlot& slot) const;
  /// Of a finished frame whose confidence is counted: whether it needs weights, and its solve, to the end.
  /// SurfaceSolver::Exact leaves the heights in the slot's `solved`, rows `pitch` floats apart. Not thread
  /// safe.
  void solve(FrameSlot& slot, uint32_t pitch);
  void measure(const Slot& slot, Touch& touch) const;

  void add_times(const Slot& slot, std::vector<gpu::ScopeTime>& times) const;
  uint64_t memory_bytes() const;
  static uint64_t memory_bytes(const Slot& slot);

 private:
  void record_into(gpu::Commands& commands, FrameSlot& slot) const;
  void find_known(const FrameSlot& slot);
  void solve_on_host(FrameSlot& slot, uint32_t pitch) const;

  gpu::Context& context_;
  FrameFormat format_;
  double pitch_mm_per_px_;
  bool always_, filters_;
  const Confidence& confidence_;
  const Contact& contact_;
  const Slope& slope_;
  const RestLevel& rest_level_;
  std::optional<WeightedSurface> surface_;  ///< on the GPU
  FloatMap slope_x_, slope_y_;              ///< SurfaceSolver::Exact
  uint32_t fills_ = 1;
  // Of the frame that is solved; kept so that frames allocate nothing.
  std::vector<uint8_t> known_;
  IslandFinder islands_;
};

}  // namespace palpate
