// Render target of pictures: a render pass, its attachments, and an off-screen target that can be read back.
#pragma once

#include <vulkan/vulkan.h>

#include <cstdint>
#include <utility>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"

namespace palpate::gpu {
class Context;
}

namespace palpate::viz {

/// 8-bit red, green, blue, rows from the top, tightly packed.
struct RgbImage {
  uint32_t width = 0;
  uint32_t height = 0;
  std::vector<uint8_t> rgb;

  const uint8_t* at(uint32_t x, uint32_t y) const { return rgb.data() + 3 * (size_t{y} * width + x); }
};

/// Colour and depth, one subpass; with more than one sample the colour is resolved at the end.
class RenderPass {
 public:
  /// `final_layout`: of the single-sample colour image after the pass (present or transfer source).
  RenderPass(gpu::Context& context, VkFormat color, VkSampleCountFlagBits samples,
             VkImageLayout final_layout);
  ~RenderPass();
  RenderPass(const RenderPass&) = delete;
  RenderPass& operator=(const RenderPass&) = delete;

  VkRenderPass handle() const { return pass_; }
  VkFormat color() const { return color_; }
  VkSampleCountFlagBits samples() const { return samples_; }
  /// Starts the pass on a cleared picture; pipelines' viewport and scissor are set to the whole of it.
  void begin(VkCommandBuffer cmd, VkFramebuffer framebuffer, VkExtent2D extent) const;

 private:
  gpu::Context& context_;
  VkFormat color_;
  VkSampleCountFlagBits samples_;
  VkRenderPass pass_ = VK_NULL_HANDLE;
};

/// Samples of a pixel: 4 where the device draws in hardware, 1 on a CPU driver, which takes 2.4 times as long
/// with 4. The edges that show most, those of the surface and of text, are smooth with one as well.
VkSampleCountFlagBits choose_samples(const gpu::Context& context);

/// An image with memory and view.
class Attachment {
 public:
  Attachment() = default;
  /// Throws Error(Failure::Device) when memory runs out.
  Attachment(gpu::Context& context, const char* name, VkFormat format, VkExtent2D extent,
             VkSampleCountFlagBits samples, VkImageUsageFlags usage, VkImageAspectFlags aspect);
  ~Attachment();
  Attachment(Attachment&& other) noexcept { swap(other); }
  Attachment& operator=(Attachment&& other) noexcept {
    swap(other);
    return *this;
  }
  VkImage image() const { return image_; }
  VkImageView view() const { return view_; }

 private:
  void swap(Attachment& other) noexcept {
    std::swap(context_, other.context_);
    std::swap(image_, other.image_);
    std::swap(memory_, other.memory_);
    std::swap(view_, other.view_);
  }
  gpu::Context* context_ = nullptr;
  VkImage image_ = VK_NULL_HANDLE;
  VkDeviceMemory memory_ = VK_NULL_HANDLE;
  VkImageView view_ = VK_NULL_HANDLE;
};

/// Depth (and multisampled colour) for pictures of one size, shared by the framebuffers of a swapchain.
struct Attachments {
  Attachments() = default;
  Attachments(gpu::Context& context, const RenderPass& pass, VkExtent2D extent);
  /// A framebuffer that draws into `color`; the caller destroys it.
  VkFramebuffer framebuffer(gpu::Context& context, const RenderPass& pass, VkImageView color,
                            VkExtent2D extent) const;

  Attachment depth;
  Attachment samples;  ///< empty with one sample
};

/// Draws without a window. begin, record into cmd(), finish.
class OffscreenTarget {
 public:
  static constexpr VkFormat kFormat = VK_FORMAT_R8G8B8A8_UNORM;

  /// `pass` must be of kFormat and end in VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL.
  OffscreenTarget(gpu::Context& context, const RenderPass& pass, VkExtent2D extent);
  ~OffscreenTarget();
  OffscreenTarget(const OffscreenTarget&) = delete;
  OffscreenTarget& operator=(const OffscreenTarget&) = delete;

  VkExtent2D extent() const { return extent_; }
  VkCommandBuffer cmd() const { return commands_.handle(); }
  /// Starts recording; the render pass starts with begin_pass, after the caller's barriers and copies.
  void begin();
  void begin_pass();
  /// Ends the pass, waits for the picture and returns it. draw_ms() then holds submission to fence, host
  /// clock.
  RgbImage finish();
  double draw_ms() const { return draw_ms_; }

 private:
  gpu::Context& context_;
  const RenderPass& pass_;
  VkExtent2D extent_;
  Attachments attachments_;
  Attachment color_;
  VkFramebuffer framebuffer_ = VK_NULL_HANDLE;
  gpu::DeviceBuffer readback_;
  gpu::Commands commands_;
  double draw_ms_ = 0;
};

/// Kernels' writes become visible to the shaders of a picture recorded after it.
void map_to_picture_barrier(const gpu::Context& context, VkCommandBuffer cmd);

}  // namespace palpate::viz
