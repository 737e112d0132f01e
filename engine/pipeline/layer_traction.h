// Layer traction: a frame's surface to pressure and shear on the pad, and the wrench that they make. Where
// the sensor's pixels are pressures already (SurfaceReading::Elastic) those are summed, else the layer's
// contact is solved for on the host (engine/pad/traction.h), only in frames that something touches.
#pragma once

#include <optional>
#include <vector>

#include "engine/measure/bending.h"
#include "engine/measure/deep_press.h"
#include "engine/pad/traction.h"
#include "engine/pipeline/frame_parts.h"
#include "engine/pipeline/frame_slot.h"
#include "engine/pipeline/surface/surface_method.h"
#include "engine/stages/traction.h"
#include "palpate/pipeline.h"
#include "palpate/touch.h"

namespace palpate {

class LayerTraction {
 public:
  /// `sensor`, which has a layer, and `surface` live longer than this.
  LayerTraction(gpu::Context& context, const Sensor& sensor, const FrameFormat& format,
                const SurfaceMethod& surface, bool on_host);

  void set_background(const Frame& background);
  /// Buffers of a slot, and what is submitted apart from its own commands.
  void make(FrameSlot& slot) const;
  /// After the surface, in the slot's own commands.
  void record(gpu::Commands& commands, FrameSlot& slot) const;
  /// Measures parts.traction of a frame whose contacts, surface and skin points `parts` has already, and the
  /// maps, which stay in the slot.
  void measure(FrameSlot& slot, FrameParts& parts);

  /// The next frame does not start from this one's solution.
  void forget();
  uint64_t memory_bytes() const;
  static uint64_t memory_bytes(const FrameSlot& slot);

 private:
  TractionReading press_on_device(FrameSlot& slot);
  void find_contact(const FrameParts& parts);
  void read_pressures(FrameSlot& slot);
  void read_heights(const FrameSlot& slot);
  void read_confidence(const FrameSlot& slot);
  bool spread_shifts(const FrameParts& parts);
  void fill_shear(const Traction& found, FrameSlot& slot, TractionSummary& summary) const;
  void fill(const Traction& found, FrameSlot& slot, TractionSummary& summary) const;

  gpu::Context& context_;
  const Sensor& sensor_;
  const SurfaceMethod& surface_;
  LayerCalibration layer_;
  std::vector<float> means_;  ///< of the surface, by cells of shared::kCellSide px
  uint32_t fine_;             ///< of those along one of ours
  TractionGrid grid_;
  TractionSolver solver_;
  std::optional<TractionStage> stage_;  ///< where the device finds the pressure
  std::optional<Bending> bending_;      ///< of colour gels
  DeepPress deep_;                      ///< of the frame that is measured
  bool follows_ = false;                ///< both begin from a frame before
  // Maps of the frame that is measured; kept so that frames allocate nothing.
  std::vector<float> depth_, pressure_, shift_x_, shift_y_, weight_;
  std::vector<uint8_t> contact_, known_, shift_known_;
};

}  // namespace palpate
