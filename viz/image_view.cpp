#include "viz/image_view.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "engine/gpu/context.h"
#include "shaders/image_frag.spv.h"
#include "shaders/image_vert.spv.h"
#include "shaders/shared/surface_view.h"

namespace palpate::viz {

ImageView::ImageView(gpu::Context& context, const RenderPass& pass, uint32_t frames_in_flight)
    : context_(context),
      pipeline_(context, pass, {"raw image", k_image_vert, k_image_frag}, sizeof(ImagePush),
                VK_PRIMITIVE_TOPOLOGY_TRIANGLE_STRIP, false),
      uploads_(frames_in_flight) {}

void ImageView::draw(VkCommandBuffer cmd, const Frame& frame, const ViewRect& rect, VkExtent2D extent) {
  const FrameFormat& format = frame.format;
  Upload& upload = uploads_[next_++ % uploads_.size()];
  const bool wide = format.bytes_per_pixel() == 2;
  if (upload.bytes != format.frame_bytes() || upload.wide != wide) {
    upload.texels = {};
    upload.pixels = gpu::DeviceBuffer(context_, "raw image", format.frame_bytes(), gpu::Memory::Upload);
    upload.texels = gpu::TexelView(context_, upload.pixels, wide ? VK_FORMAT_R16_UINT : VK_FORMAT_R8_UINT);
    upload.bytes = format.frame_bytes();
    upload.wide = wide;
  }
  std::memcpy(upload.pixels.as<uint8_t>().data(), frame.bytes.data(), format.frame_bytes());
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
  push.taps = static_cast<uint32_t>(std::clamp(std::ceil(step_px - 0.25), 1.0, 4.0));
  push.scale = 1.0f / static_cast<float>(format.max_gray());
  push.step_px = static_cast<float>(step_px);

  const VkViewport viewport{0, 0, static_cast<float>(extent.width), static_cast<float>(extent.height), 0, 1};
  const VkRect2D scissor{{0, 0}, extent};
  vkCmdSetViewport(cmd, 0, 1, &viewport);
  vkCmdSetScissor(cmd, 0, 1, &scissor);
  pipeline_.bind(cmd, upload.texels, &push);
  vkCmdDraw(cmd, 4, 1, 0, 0);
}

}  // namespace palpate::viz
