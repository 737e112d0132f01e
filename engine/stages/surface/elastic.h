// Elastic stage: a picture of contact pressure to the deflection of the pad's surface, by the
// pyramid of engine/pad/elastic_plan.h. Depths are absolute: 0 is the surface far from the contact, no
// rest level is looked for.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/gpu/kernel.h"
#include "engine/gpu/tuning.h"
#include "engine/pad/elastic_plan.h"
#include "engine/stages/surface/surface.h"
#include "palpate/sensor.h"

namespace palpate {
class Contact;
namespace gpu {
class Commands;
}

class Elastic {
 public:
  /// `contact` must keep its filtered image.
  Elastic(gpu::Context& context, const Sensor& sensor, const FrameFormat& format, const Contact& contact,
          const Tuning& tuning);
  /// Pressure given by the caller in pressure().
  Elastic(gpu::Context& context, const LayerKernel& kernel, uint32_t width, uint32_t height,
          const Tuning& tuning);

  const Grid& grid() const { return grid_; }  ///< of the depth map
  /// Contact pressure, MPa: rows of pressure_pitch() floats, pixel (0, 0) at pressure_start(); 0 in the
  /// margins.
  const gpu::DeviceBuffer& pressure() const { return levels_.front().pressure.buffer; }
  uint32_t pressure_pitch() const { return levels_.front().pitch * 4; }
  uint32_t pressure_start() const;

  static constexpr uint64_t kBorderBytes = shared::kElasticBorderRecords * sizeof(float);

  /// Fills pressure() from the contact stage's filtered image, and `border` with what touches_border() reads.
  void record_pressure(gpu::Commands& commands, const gpu::DeviceBuffer& border) const;
  /// Deflection by pressure(), mm, positive into the pad.
  void record_deflection(gpu::Commands& commands, const FloatMap& depth) const;

  /// The contact reaches the frame's border: the load outside is not seen, and its depth is missing.
  static bool touches_border(std::span<const float> border);
  /// Filtered gray from which a saturating response no longer tells the pressure, gray levels; infinite where
  /// it is linear.
  static double largest_readable_gray(const ElasticCalibration& pad);

  uint64_t memory_bytes() const;

 private:
  struct Level {
    uint32_t width = 0;  ///< cells, margins not included
    uint32_t height = 0;
    uint32_t pitch = 0;  ///< texels, margins included
    uint32_t rows = 0;
    FloatMap pressure;
    FloatMap answer;  ///< not of the finest level
    std::array<float, shared::kElasticOrbits> stencil{};

    uint32_t total() const { return pitch * rows; }
  };
  Elastic(gpu::Context& context, const ElasticPlan& plan, const Tuning& tuning);
  shared::ElasticPush push(size_t level, uint32_t strip_rows) const;
  std::array<uint32_t, 3> groups(uint32_t invocations) const;

  Grid grid_;
  uint32_t strip_rows_;
  uint32_t workgroup_;
  std::vector<Level> levels_;
  uint32_t table_pitch_ = 0;
  gpu::DeviceBuffer table_;
  gpu::TexelView table_texels_;
  gpu::TexelView filtered_;
  shared::ElasticPressurePush pressure_push_{};
  gpu::Kernel pressure_kernel_, border_kernel_, restrict_kernel_, level_kernel_, finest_kernel_,
      coarsest_kernel_;
};

}  // namespace palpate
