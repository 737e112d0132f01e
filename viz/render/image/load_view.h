// Load on the skin over the frame, for the colours of the surface: pressure where the sensor's gray is
// pressure (SurfaceReading::Elastic) or by its elastic layer (Output::Traction), and shear over pressure.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/gpu/buffer.h"
#include "palpate/frame.h"
#include "palpate/pipeline.h"
#include "palpate/sensor.h"
#include "viz/render/surface_view.h"

namespace palpate::viz {

class LoadMap {
 public:
  static constexpr uint32_t kMostColumns = 640;  ///< of the map; larger frames are averaged down to it

  /// `frames_in_flight`: maps kept, one for each picture that may be drawing.
  LoadMap(gpu::Context& context, uint32_t frames_in_flight);

  /// The pressure that the sensor reads in a frame of one plane, through the same 5 x 5 filter as the
  /// measurement; on the host, about 1 ms at 640 x 480. The texels stay until as many further updates.
  LoadTexels update(const Frame& frame, const Frame& background, const Sensor& sensor);
  /// Pressure by the elastic layer, cell by cell; nothing where nothing touches.
  LoadTexels update(const TractionMaps& maps);
  /// Shear over pressure, 0 where the pressure is too small to divide by (friction_ratios).
  LoadTexels update_friction(const TractionMaps& maps);
  /// Largest pressure of the last update of pressure, MPa.
  double largest_MPa() const { return largest_MPa_; }

 private:
  LoadTexels upload(std::span<const float> values, uint32_t width, uint32_t height);
  LoadTexels upload_cells(std::span<const float> values, const TractionMaps& maps);

  struct Upload {
    gpu::DeviceBuffer values;
    gpu::TexelView texels;
  };
  gpu::Context& context_;
  std::vector<Upload> uploads_;
  size_t next_ = 0;
  double largest_MPa_ = 0;
};

}  // namespace palpate::viz
