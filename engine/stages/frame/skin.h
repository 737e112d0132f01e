// Skin stage: follows the points of the pattern on the pad's skin from frame to frame, each by fitting its
// untouched window to the frame (shaders/frame/skin.comp).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/gpu/kernel.h"
#include "engine/measure/motion/skin_points.h"
#include "engine/stages/frame/upload.h"
#include "palpate/frame.h"
#include "palpate/sensor.h"
#include "palpate/touch.h"

namespace palpate {
namespace gpu {
class Commands;
class Context;
}  // namespace gpu

class Skin {
 public:
  /// Per point, as the kernel leaves it.
  struct Motion {
    float shift_x_px, shift_y_px;  ///< since the untouched image; of a lost point where to look for it
    float correlation;             ///< correlation with the untouched window; 0: lost
    float noise;                   ///< what the fit leaves, in gray levels of the untouched window
  };

  Skin(gpu::Context& context, const Sensor& sensor, const FrameFormat& format);

  /// Finds the points. Commands recorded before are no longer valid. Throws Error(Failure::Input) where the
  /// image has fewer than three.
  void set_background(const Frame& background);
  bool ready() const { return !templates_.empty(); }
  uint32_t points() const { return static_cast<uint32_t>(templates_.size()); }
  uint64_t record_bytes() const { return uint64_t{points()} * sizeof(Motion); }

  /// Leaves one Motion per point in `records`. Frames follow each other in the order of submission: the next
  /// one starts from this one's motions.
  void record(gpu::Commands& commands, const PaddedImage& frame, const gpu::DeviceBuffer& records) const;
  /// As Touch has them, and each point's standard error of one component, px.
  void read(std::span<const Motion> motions, std::vector<SkinPoint>& points, std::vector<float>& sd_px) const;

  const std::vector<SkinTemplate>& templates() const { return templates_; }
  const SkinWindow& window() const { return window_; }
  float search_px() const { return search_px_; }
  uint64_t memory_bytes() const { return points_.bytes() + windows_.bytes() + before_.bytes(); }

 private:
  gpu::Context& context_;
  FrameFormat format_;
  SkinPattern pattern_;
  SkinWindow window_;
  float search_px_;
  gpu::Kernel kernel_;
  std::vector<SkinTemplate> templates_;
  gpu::DeviceBuffer points_, windows_, before_;
  gpu::TexelView point_texels_, window_texels_, before_texels_;
};

}  // namespace palpate
