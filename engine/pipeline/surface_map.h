// Surface map: the height map of a finished frame, where the device has it.
#pragma once

#include <cstdint>
#include <span>

namespace palpate {

class Result;
namespace gpu {
class DeviceBuffer;
}

/// Rows x pitch floats, mm, positive into the pad, up to the constant SurfaceSummary::depth_offset_mm.
struct SurfaceMap {
  const gpu::DeviceBuffer* buffer = nullptr;  ///< null unless Output::Surface was asked for
  uint32_t width = 0;                         ///< px
  uint32_t height = 0;                        ///< px
  uint32_t pitch = 0;                         ///< floats from one row to the next
  /// Confidence of each pixel (shaders/shared/confidence.h), in host memory, rows confidence_pitch apart;
  /// empty unless Touch::confidence or pixels are saturated untouched.
  std::span<const uint16_t> confidence = {};
  uint32_t confidence_pitch = 0;
};

/// Untouched as long as the result lives.
const SurfaceMap& surface_of(const Result& result);

}  // namespace palpate
