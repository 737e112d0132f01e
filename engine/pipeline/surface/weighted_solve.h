// Weighted solve: the surface of a frame from the pixels of non-zero confidence. Built only where a caller
// asks for Output::Confidence or the sensor file names a pad or a shadow level; used for frames in which
// other pixels than those that no frame shows are unknown, or uncertain.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "engine/measure/height_rows.h"
#include "engine/pipeline/frame_parts.h"
#include "engine/pipeline/plan.h"
#include "engine/pipeline/surface/weighted_slot.h"
#include "engine/stages/surface/weighted_surface.h"
#include "palpate/touch.h"

namespace palpate {

class Confidence;
class Contact;
class Slope;
class Surface;
struct FrameSlot;

class WeightedSolve {
 public:
  using Slot = WeightedSlot;

  /// The stages live longer than this.
  WeightedSolve(gpu::Context& context, const Sensor& sensor, const FrameFormat& format, const FramePlan& plan,
                const Confidence& confidence, const Contact& contact, const Surface& plain,
                const Slope& slope);

  /// Which pixels are known in every frame.
  void set_known(std::span<const uint8_t> known);

  /// Buffers of a slot.
  void make(Slot& slot) const;
  /// The plain solve's right sides, of what is known in every frame; and clipped pixels.
  void record_right_side(gpu::Commands& commands, const FrameSlot& slot) const;
  /// Fills what the plain solve does, depth and clipped pixels; Solve::Exact: what the host solves from.
  void record_solve(gpu::Commands& commands, FrameSlot& slot) const;
  /// The filtered image, where one is read, belongs to whichever frame came last: made again.
  void record_filtered(gpu::Commands& commands, const FrameSlot& slot) const;
  /// Decides whether a finished frame whose confidence is counted needs weights, and solves it, to the end.
  /// Solve::Exact leaves the heights in `heights`. Not thread safe.
  void solve(FrameSlot& slot, const HeightRows& heights);
  void measure(const Slot& slot, bool touched, SurfacePart& part) const;

  void add_times(const Slot& slot, std::vector<gpu::ScopeTime>& times) const;
  uint64_t memory_bytes() const;
  static uint64_t memory_bytes(const Slot& slot);

 private:
  bool on_cells() const;
  void find_islands(FrameSlot& slot);
  void find_known(const FrameSlot& slot);
  void solve_on_host(FrameSlot& slot, const HeightRows& heights) const;

  gpu::Context& context_;
  FrameFormat format_;
  double pitch_mm_per_px_;
  bool filters_;
  const Confidence& confidence_;
  const Contact& contact_;
  const Surface& plain_;
  const Slope& slope_;
  std::optional<WeightedSurface> surface_;  ///< on the GPU: of cells where the plain solve is
  FloatMap cells_;                          ///< heights of those
  FloatMap slope_x_, slope_y_;              ///< Solve::Exact
  uint32_t still_islands_ = 1;
  // Mask of the frame that is solved; kept so that frames allocate nothing.
  std::vector<uint8_t> known_;
  IslandFinder islands_;
};

}  // namespace palpate
