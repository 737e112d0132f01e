// Motion sums stage: PixelSums by the device (shaders/motion). A step is one submission; the host solves it.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/kernel.h"
#include "engine/motion/pixel_terms.h"
#include "shaders/shared/object_motion.h"

namespace palpate {

class DeviceMotionSums : public PixelSums {
 public:
  explicit DeviceMotionSums(gpu::Context& context);

  /// Surfaces that were among the last few need not go to the device again.
  void set(const ContactSurface& key, const ContactSurface& now) override;
  LeftOver compare(size_t level, const MotionGuess& guess, Spread by) override;
  MotionSums step() override { return step_sums_; }
  MotionSums judged() override;
  ScoreField field() override;
  double loss(double scale) override;

  uint64_t memory_bytes() const override;

 private:
  /// A surface on the device: its levels, from the finest, one behind the other.
  struct Surface {
    uint64_t id = 0, used = 0;  ///< ContactSurface::id; when it was set
    gpu::DeviceBuffer planes, inside;
    gpu::TexelView plane_texels, inside_texels;
    std::vector<uint32_t> first, first_inside;  ///< of each level
  };
  Surface& surface_of(const ContactSurface& surface);
  void upload(const ContactSurface& from, Surface& to) const;
  void make_room();
  /// Of the compared guess; `scale`: 0, or what weights are about instead of the residuals'.
  void submit(const gpu::Kernel& kernel, bool compares, float scale);
  std::vector<double> added(uint32_t sums) const;

  gpu::Context& context_;
  gpu::Kernel residuals_, scale_of_, step_, judge_;
  gpu::Commands commands_;
  std::array<Surface, 4> surfaces_;
  Surface *there_ = nullptr, *here_ = nullptr;
  const ContactSurface *key_ = nullptr, *now_ = nullptr;
  uint64_t set_ = 0;
  size_t level_ = 0;
  shared::MotionPush push_{};
  LeftOver left_;
  MotionSums step_sums_;
  gpu::DeviceBuffer bins_, parts_, scale_, sums_, terms_;
  size_t room_ = 0;  ///< pixels inside that the buffers hold
};

}  // namespace palpate
