// Surface from slopes: Reconstruction::Shading and Reconstruction::Photometric, with the pixels' confidence
// as weights where some of it is 0.
#pragma once

#include <optional>

#include "engine/numeric/poisson_dct.h"
#include "engine/pipeline/surface_method.h"
#include "engine/pipeline/weighted_solve.h"
#include "engine/stages/slope.h"

namespace palpate {

/// Whether pixels that touch has saturated are so many, beside the contact's, that its depth cannot be right.
bool too_many_saturated(const Touch& touch);

class GradientSurface : public SurfaceMethod {
 public:
  GradientSurface(gpu::Context& context, const Sensor& sensor, const FrameFormat& format,
                  const FramePlan& plan, const Contact& contact, const Confidence* confidence,
                  const Tuning& tuning);

  void make(FrameSlot& slot) const override;
  void record(gpu::Commands& commands, FrameSlot& slot) override;
  void solve(FrameSlot& slot) override;
  void measure(const FrameSlot& slot, Touch& touch) const override;
  void place(const FramePlace& place) override { slope_.place(place); }
  void add_times(const FrameSlot& slot, std::vector<gpu::ScopeTime>& times) const override;
  uint64_t memory_bytes() const override;
  using SurfaceMethod::memory_bytes;

 private:
  std::optional<Surface> surface_;  ///< without weights
  Slope slope_;
  std::optional<PoissonDct> dct_;  ///< SurfaceSolver::Exact
  std::optional<WeightedSolve> weighted_;
};

}  // namespace palpate
