// Surface from slopes: SurfaceReading::Shading and SurfaceReading::Photometric, of the known pixels. Those
// that no frame shows (beyond the pad's outline, specks) are part of the plain solve; a frame in which others
// are unknown or uncertain is solved with weights.
#pragma once

#include <optional>
#include <vector>

#include "engine/numeric/poisson_dct.h"
#include "engine/pipeline/surface/surface_method.h"
#include "engine/pipeline/surface/weighted_solve.h"
#include "engine/stages/surface/slope.h"

namespace palpate {

class GradientSurface : public SurfaceMethod {
 public:
  GradientSurface(gpu::Context& context, const Sensor& sensor, const FrameFormat& format,
                  const FramePlan& plan, const Contact& contact, const Confidence* confidence,
                  const Tuning& tuning);

  void make(FrameSlot& slot) const override;
  void record(gpu::Commands& commands, FrameSlot& slot) override;
  void solve(FrameSlot& slot) override;
  SurfacePart measure(const FrameSlot& slot, const ContactTouch& whole) const override;
  void set_confidence(const Confidence& confidence) override;
  bool may_weigh() const override { return weighted_ && !dct_; }
  bool expects_weights(const Frame& frame) const override;
  void record_weighted(gpu::Commands& commands, FrameSlot& slot) const override;
  void add_times(const FrameSlot& slot, std::vector<gpu::ScopeTime>& times) const override;
  uint64_t memory_bytes() const override;
  using SurfaceMethod::memory_bytes;

 private:
  void record_plain(gpu::Commands& commands, FrameSlot& slot) const;

  Surface surface_;  ///< without weights, but for what no frame shows
  Slope slope_;
  std::optional<PoissonDct> dct_;  ///< Solve::Exact
  std::optional<WeightedSolve> weighted_;
  const Confidence* confidence_;
  bool last_weighed_ = false;   ///< the last frame needed weights
  std::vector<uint8_t> known_;  ///< of every frame, where weights are wanted
};

}  // namespace palpate
