// A frame of which not everything is known: confidence of its pixels, and the surface from those that can be
// trusted. Built only where a caller asks for Output::Confidence or the sensor file names a pad or a shadow
// level.
#pragma once

#include <optional>
#include <vector>

#include "engine/gpu/commands.h"
#include "engine/stages/confidence.h"
#include "engine/stages/contact.h"
#include "engine/stages/rest_level.h"
#include "engine/stages/slope.h"
#include "engine/stages/weighted_surface.h"
#include "palpate/touch.h"

namespace palpate {

class WeightedFrame {
 public:
  /// What one frame in flight owns.
  struct Slot {
    ConfidenceMap map;
    gpu::DeviceBuffer records;
    gpu::DeviceBuffer scalars;           ///< of the weighted solve
    gpu::Commands solve;                 ///< the surface once more, with weights
    gpu::DeviceBuffer slope_x, slope_y;  ///< SurfaceSolver::Exact, on the host
    bool weighted = false;               ///< the frame needs weights
    ConfidenceCounts counts;
    WeightedEvidence evidence;
    Islands islands;
  };

  /// `surface`: weights for it too (readings 'shading' and 'photometric'), else confidence only.
  WeightedFrame(gpu::Context& context, const Sensor& sensor, const FrameFormat& format, SurfaceSolver solver,
                bool surface);

  void set_background(const Frame& background) { confidence_.set_background(background); }
  bool solves() const { return surface_ || slope_x_.buffer; }

  /// Buffers of a slot, and its confidence among the frame's commands.
  void record(gpu::Context& context, gpu::Commands& commands, Slot& slot, const PaddedImage& frame) const;
  /// The surface with weights. `depth`, `datum_records` and `clipped` are what the frame's own solve fills.
  /// With a pad's outline in the sensor file there are always unknown pixels: then this is the frame's own
  /// solve, among its `commands`. Otherwise it is recorded for itself and runs where a frame turns out to
  /// need it.
  void record_solve(gpu::Context& context, gpu::Commands& commands, Slot& slot, const PaddedImage& frame,
                    const PaddedImage& background, const Contact& contact,
                    const gpu::DeviceBuffer& contact_records, const Slope& slope, const Datum& datum,
                    const FloatMap& depth, const gpu::DeviceBuffer& datum_records,
                    const gpu::DeviceBuffer& clipped) const;
  bool always() const { return surface_ && sensor_.pad; }

  /// Counts what is not known, and whether the surface needs weights.
  void count(Slot& slot) const;
  /// Runs the slot's weighted solve to its end; `contact` tells which islands are touched.
  /// SurfaceSolver::Exact leaves the heights in `solved`, rows `pitch` floats apart.
  void solve(Slot& slot, const Contact& contact, const gpu::DeviceBuffer& contact_records, float* solved,
             uint32_t pitch) const;
  void report(const Slot& slot, Touch& touch) const;

  uint32_t pitch() const { return confidence_.pitch(); }
  std::vector<uint16_t> read(const Slot& slot) const { return confidence_.unpack(slot.map); }
  uint64_t memory_bytes() const;
  static uint64_t memory_bytes(const Slot& slot);

 private:
  Sensor sensor_;
  FrameFormat format_;
  Confidence confidence_;
  std::optional<WeightedSurface> surface_;  ///< on the GPU
  FloatMap slope_x_, slope_y_;              ///< SurfaceSolver::Exact
  uint32_t fills_ = 1;
};

}  // namespace palpate
