// The raw camera image in a rectangle of the picture.
#pragma once

#include <vulkan/vulkan.h>

#include <cstdint>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/pipeline/surface_map.h"
#include "palpate/frame.h"
#include "viz/render/surface_view.h"

namespace palpate::viz {

/// A map of strain over the image: rows of `pitch` texels, `range` with the last colour; NaN shows the image.
struct ImageStrain {
  const gpu::TexelView* texels = nullptr;
  uint32_t pitch = 0;
  double range = 0;
  ColourMap map = ColourMap::Viridis;
};

class ImageView {
 public:
  /// `frames_in_flight`: uploads kept, one for each picture that may be drawing.
  ImageView(gpu::Context& context, const RenderPass& pass, uint32_t frames_in_flight);

  /// Copies the frame (gray or colour planes, 8 to 16 bit), halved as often as `rect` resolves no more, to
  /// the device and draws it into `rect` of a picture of size `extent`; full scale is white. Pixels of which
  /// `map` says that nothing is known are hatched. Once a picture. Over it `strain`, as wide and high as the
  /// frame, if there is any.
  void draw(VkCommandBuffer cmd, const Frame& frame, const SurfaceMap& map, const ViewRect& rect,
            VkExtent2D extent, const ImageStrain& strain = {});

 private:
  struct Upload {
    gpu::DeviceBuffer pixels;
    gpu::TexelView texels;
    gpu::DescriptorSets sets;
    uint64_t bytes = 0;
    bool wide = false;
  };
  gpu::Context& context_;
  TexelPipeline pipeline_;
  std::vector<Upload> uploads_;
  size_t next_ = 0;
  gpu::DeviceBuffer nothing_;  // where there is no strain
  gpu::TexelView nothing_texels_;
};

}  // namespace palpate::viz
