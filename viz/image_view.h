// The raw camera image in a rectangle of the picture.
#pragma once

#include <vulkan/vulkan.h>

#include <cstdint>
#include <vector>

#include "engine/frame.h"
#include "engine/gpu/buffer.h"
#include "engine/pipeline.h"
#include "viz/surface_view.h"

namespace palpate::viz {

class ImageView {
 public:
  /// `frames_in_flight`: uploads kept, one for each picture that may be drawing.
  ImageView(gpu::Context& context, const RenderPass& pass, uint32_t frames_in_flight);

  /// Copies the frame (gray or colour planes, 8 to 16 bit) to the device and draws it into `rect` of a
  /// picture of size `extent`; full scale is white. Pixels of which `map` says that nothing is known are
  /// hatched. Once a picture.
  void draw(VkCommandBuffer cmd, const Frame& frame, const SurfaceMap& map, const ViewRect& rect,
            VkExtent2D extent);

 private:
  struct Upload {
    gpu::DeviceBuffer pixels;
    gpu::TexelView texels;
    uint64_t bytes = 0;
    bool wide = false;
  };
  gpu::Context& context_;
  TexelPipeline pipeline_;
  std::vector<Upload> uploads_;
  size_t next_ = 0;
};

}  // namespace palpate::viz
