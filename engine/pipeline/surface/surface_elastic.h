// Surface from pressure: SurfaceReading::Elastic. Depth is absolute: there is no rest level to be found.
#pragma once

#include <optional>

#include "engine/pad/layer_convolution.h"
#include "engine/pipeline/surface/surface_method.h"
#include "engine/stages/surface/elastic.h"

namespace palpate {

class ElasticSurface : public SurfaceMethod {
 public:
  ElasticSurface(gpu::Context& context, const Sensor& sensor, const FrameFormat& format,
                 const FramePlan& plan, const Contact& contact, const Tuning& tuning);

  void make(FrameSlot& slot) const override;
  void record(gpu::Commands& commands, FrameSlot& slot) override;
  void solve(FrameSlot& slot) override;
  SurfacePart measure(const FrameSlot& slot, const ContactTouch& whole) const override;
  std::optional<DevicePressure> pressure() const override {
    return DevicePressure{&elastic_.pressure(), elastic_.pressure_pitch(), elastic_.pressure_start()};
  }
  uint64_t memory_bytes() const override { return elastic_.memory_bytes(); }
  using SurfaceMethod::memory_bytes;

 private:
  Elastic elastic_;
  std::optional<LayerConvolution> convolution_;  ///< Solve::Exact
};

}  // namespace palpate
