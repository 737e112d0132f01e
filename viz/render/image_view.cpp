#include "viz/render/image_view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "engine/gpu/context.h"
#include "shaders/image_frag.spv.h"
#include "shaders/image_vert.spv.h"
#include "shaders/shared/confidence.h"
#include "shaders/shared/surface_view.h"

namespace palpate::viz {

ImageView::ImageView(gpu::Context& context, const RenderPass& pass, uint32_t frames_in_flight)
    : context_(context),
      pipeline_(context, pass, {"raw image", k_image_vert, k_image_frag}, sizeof(ImagePush),
                VK_PRIMITIVE_TOPOLOGY_TRIANGLE_STRIP, false, 2),
      uploads_(frames_in_flight),
      nothing_(context, "no strain", sizeof(float) * 4, gpu::Memory::Upload),
      nothing_texels_(context, nothing_, VK_FORMAT_R32_SFLOAT) {
  for (Upload& upload : uploads_) upload.sets = gpu::DescriptorSets(context);
}

namespace {

// Diagonal stripes of mid gray and near black over what is not known.
template <typename Pixel>
void hatch(std::span<Pixel> planes, const FrameFormat& format, const SurfaceMap& map) {
  constexpr uint32_t kStripe_px = 3;
  const uint32_t light = format.max_gray() / 2, dark = format.max_gray() / 8;
  for (uint32_t y = 0; y < format.height; ++y) {
    for (uint32_t x = 0; x < format.width; ++x) {
      if ((map.confidence[size_t{y} * map.confidence_pitch + x] & shared::kFullConfidence) != 0) continue;
      const auto value = static_cast<Pixel>((x + y) / kStripe_px % 2 == 0 ? light : dark);
      for (uint32_t c = 0; c < format.channels; ++c)
        planes[(size_t{c} * format.height + y) * format.width + x] = value;
    }
  }
}

}  // namespace

void ImageView::draw(VkCommandBuffer cmd, const Frame& frame, const SurfaceMap& map, const ViewRect& rect,
                     VkExtent2D extent, const ImageStrain& strain) {
  const FrameFormat& format = frame.format;
  Upload& upload = uploads_[next_++ % uploads_.size()];
  upload.sets.reset();
  const bool wide = format.bytes_per_pixel() == 2;
  if (upload.bytes != format.frame_bytes() || upload.wide != wide) {
    upload.texels = {};
    upload.pixels = gpu::DeviceBuffer(context_, "raw image", format.frame_bytes(), gpu::Memory::Upload);
    upload.texels = gpu::TexelView(context_, upload.pixels, wide ? VK_FORMAT_R16_UINT : VK_FORMAT_R8_UINT);
    upload.bytes = format.frame_bytes();
    upload.wide = wide;
  }
  std::memcpy(upload.pixels.as<uint8_t>().data(), frame.pixels(), format.frame_bytes());
  if (!map.confidence.empty()) {
    if (wide)
      hatch(upload.pixels.as<uint16_t>(), format, map);
    else
      hatch(upload.pixels.as<uint8_t>(), format, map);
  }
  upload.pixels.flush();

  const auto clip = [](double px, uint32_t size) { return static_cast<float>(2 * px / size - 1); };
  const double step_px = static_cast<double>(format.width) / rect.width;
  ImagePush push{};
  push.left = clip(rect.x, extent.width);
  push.top = clip(rect.y, extent.height);
  push.right = clip(rect.x + static_cast<double>(rect.width), extent.width);
  push.bottom = clip(rect.y + static_cast<double>(rect.height), extent.height);
  push.width = format.width;
  push.height = format.height;
  push.channels = format.channels;
  push.pixel_bytes = wide ? 2 : 1;
  push.taps = static_cast<uint32_t>(std::clamp(std::ceil(step_px - 0.25), 1.0, 4.0));
  push.scale = 1.0f / static_cast<float>(format.max_gray());
  push.step_px = static_cast<float>(step_px);

  push.strain_range = strain.texels ? static_cast<float>(strain.range) : 0;
  push.strain_pitch = strain.pitch;
  push.strain_colours = static_cast<uint32_t>(strain.map);

  const VkViewport viewport{0, 0, static_cast<float>(extent.width), static_cast<float>(extent.height), 0, 1};
  const VkRect2D scissor{{0, 0}, extent};
  vkCmdSetViewport(cmd, 0, 1, &viewport);
  vkCmdSetScissor(cmd, 0, 1, &scissor);
  const std::array<const gpu::TexelView*, 2> texels{&upload.texels,
                                                    strain.texels ? strain.texels : &nothing_texels_};
  pipeline_.bind(cmd, upload.sets, texels, &push);
  vkCmdDraw(cmd, 4, 1, 0, 0);
}

}  // namespace palpate::viz
