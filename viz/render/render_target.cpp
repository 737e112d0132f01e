#include "viz/render/render_target.h"

#include <array>
#include <chrono>

#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "viz/look/theme.h"

namespace palpate::viz {
namespace {

constexpr VkFormat kDepthFormat = VK_FORMAT_D32_SFLOAT;  // every device draws with it

VkAttachmentDescription attachment(VkFormat format, VkSampleCountFlagBits samples, VkAttachmentLoadOp load,
                                   VkAttachmentStoreOp store, VkImageLayout final_layout) {
  VkAttachmentDescription a{};
  a.format = format;
  a.samples = samples;
  a.loadOp = load;
  a.storeOp = store;
  a.stencilLoadOp = VK_ATTACHMENT_LOAD_OP_DONT_CARE;
  a.stencilStoreOp = VK_ATTACHMENT_STORE_OP_DONT_CARE;
  a.initialLayout = VK_IMAGE_LAYOUT_UNDEFINED;
  a.finalLayout = final_layout;
  return a;
}

}  // namespace

RenderPass::RenderPass(gpu::Context& context, VkFormat color, VkSampleCountFlagBits samples,
                       VkImageLayout final_layout)
    : context_(context), color_(color), samples_(samples) {
  const bool resolve = samples != VK_SAMPLE_COUNT_1_BIT;
  constexpr auto kColorLayout = VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL;
  std::vector<VkAttachmentDescription> attachments{
      attachment(color, samples, VK_ATTACHMENT_LOAD_OP_CLEAR,
                 resolve ? VK_ATTACHMENT_STORE_OP_DONT_CARE : VK_ATTACHMENT_STORE_OP_STORE,
                 resolve ? kColorLayout : final_layout),
      attachment(kDepthFormat, samples, VK_ATTACHMENT_LOAD_OP_CLEAR, VK_ATTACHMENT_STORE_OP_DONT_CARE,
                 VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL)};
  if (resolve) {
    attachments.push_back(attachment(color, VK_SAMPLE_COUNT_1_BIT, VK_ATTACHMENT_LOAD_OP_DONT_CARE,
                                     VK_ATTACHMENT_STORE_OP_STORE, final_layout));
  }
  const VkAttachmentReference color_reference{0, kColorLayout};
  const VkAttachmentReference depth_reference{1, VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL};
  const VkAttachmentReference resolve_reference{2, kColorLayout};
  VkSubpassDescription subpass{};
  subpass.pipelineBindPoint = VK_PIPELINE_BIND_POINT_GRAPHICS;
  subpass.colorAttachmentCount = 1;
  subpass.pColorAttachments = &color_reference;
  subpass.pDepthStencilAttachment = &depth_reference;
  subpass.pResolveAttachments = resolve ? &resolve_reference : nullptr;

  // The images are used again by the next picture, and read by a copy after the last.
  constexpr VkPipelineStageFlags kDrawing = VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT |
                                            VK_PIPELINE_STAGE_EARLY_FRAGMENT_TESTS_BIT |
                                            VK_PIPELINE_STAGE_LATE_FRAGMENT_TESTS_BIT;
  constexpr VkAccessFlags kDrawn =
      VK_ACCESS_COLOR_ATTACHMENT_WRITE_BIT | VK_ACCESS_DEPTH_STENCIL_ATTACHMENT_WRITE_BIT;
  std::array<VkSubpassDependency, 2> dependencies{};
  dependencies[0] = {
      VK_SUBPASS_EXTERNAL,
      0,
      kDrawing | VK_PIPELINE_STAGE_TRANSFER_BIT,
      kDrawing,
      kDrawn,
      kDrawn | VK_ACCESS_DEPTH_STENCIL_ATTACHMENT_READ_BIT | VK_ACCESS_COLOR_ATTACHMENT_READ_BIT,
      0};
  dependencies[1] = {0,
                     VK_SUBPASS_EXTERNAL,
                     VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT,
                     VK_PIPELINE_STAGE_TRANSFER_BIT,
                     VK_ACCESS_COLOR_ATTACHMENT_WRITE_BIT,
                     VK_ACCESS_TRANSFER_READ_BIT,
                     0};
  VkRenderPassCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_RENDER_PASS_CREATE_INFO;
  info.attachmentCount = static_cast<uint32_t>(attachments.size());
  info.pAttachments = attachments.data();
  info.subpassCount = 1;
  info.pSubpasses = &subpass;
  info.dependencyCount = static_cast<uint32_t>(dependencies.size());
  info.pDependencies = dependencies.data();
  gpu::check(vkCreateRenderPass(context.device(), &info, nullptr, &pass_), "a render pass");
}

RenderPass::~RenderPass() {
  if (!context_.hung()) vkDestroyRenderPass(context_.device(), pass_, nullptr);
}

void RenderPass::begin(VkCommandBuffer cmd, VkFramebuffer framebuffer, VkExtent2D extent) const {
  std::array<VkClearValue, 2> clear{};
  const Rgb ground = theme().ground;
  clear[0].color = {{static_cast<float>(ground.red) / 255, static_cast<float>(ground.green) / 255,
                     static_cast<float>(ground.blue) / 255, 1}};
  clear[1].depthStencil = {1.0f, 0};
  VkRenderPassBeginInfo info{};
  info.sType = VK_STRUCTURE_TYPE_RENDER_PASS_BEGIN_INFO;
  info.renderPass = pass_;
  info.framebuffer = framebuffer;
  info.renderArea.extent = extent;
  info.clearValueCount = static_cast<uint32_t>(clear.size());
  info.pClearValues = clear.data();
  vkCmdBeginRenderPass(cmd, &info, VK_SUBPASS_CONTENTS_INLINE);
  const VkViewport viewport{0, 0, static_cast<float>(extent.width), static_cast<float>(extent.height), 0, 1};
  const VkRect2D scissor{{0, 0}, extent};
  vkCmdSetViewport(cmd, 0, 1, &viewport);
  vkCmdSetScissor(cmd, 0, 1, &scissor);
}

VkSampleCountFlagBits choose_samples(const gpu::Context& context) {
  if (context.is_software()) return VK_SAMPLE_COUNT_1_BIT;
  const VkPhysicalDeviceLimits& limits = context.properties().limits;
  const VkSampleCountFlags both = limits.framebufferColorSampleCounts & limits.framebufferDepthSampleCounts;
  return both & VK_SAMPLE_COUNT_4_BIT ? VK_SAMPLE_COUNT_4_BIT : VK_SAMPLE_COUNT_1_BIT;
}

Attachment::Attachment(gpu::Context& context, const char* name, VkFormat format, VkExtent2D extent,
                       VkSampleCountFlagBits samples, VkImageUsageFlags usage, VkImageAspectFlags aspect)
    : context_(&context) {
  VkImageCreateInfo image{};
  image.sType = VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO;
  image.imageType = VK_IMAGE_TYPE_2D;
  image.format = format;
  image.extent = {extent.width, extent.height, 1};
  image.mipLevels = 1;
  image.arrayLayers = 1;
  image.samples = samples;
  image.tiling = VK_IMAGE_TILING_OPTIMAL;
  image.usage = usage;
  gpu::check(vkCreateImage(context.device(), &image, nullptr, &image_), "an image to draw into");
  VkMemoryRequirements needs{};
  vkGetImageMemoryRequirements(context.device(), image_, &needs);
  VkMemoryAllocateInfo memory{};
  memory.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO;
  memory.allocationSize = needs.size;
  memory.memoryTypeIndex = context.memory_type(needs.memoryTypeBits, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT, 0);
  gpu::check(vkAllocateMemory(context.device(), &memory, nullptr, &memory_),
             "memory of an image to draw into");
  gpu::check(vkBindImageMemory(context.device(), image_, memory_, 0), "binding image memory");
  VkImageViewCreateInfo view{};
  view.sType = VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO;
  view.image = image_;
  view.viewType = VK_IMAGE_VIEW_TYPE_2D;
  view.format = format;
  view.subresourceRange = {aspect, 0, 1, 0, 1};
  gpu::check(vkCreateImageView(context.device(), &view, nullptr, &view_), "an image view");
  context.set_name(VK_OBJECT_TYPE_IMAGE, reinterpret_cast<uint64_t>(image_), name);
}

Attachment::~Attachment() {
  if (!context_ || context_->hung()) return;
  vkDestroyImageView(context_->device(), view_, nullptr);
  vkDestroyImage(context_->device(), image_, nullptr);
  vkFreeMemory(context_->device(), memory_, nullptr);
}

Attachments::Attachments(gpu::Context& context, const RenderPass& pass, VkExtent2D extent)
    : depth(context, "picture depth", kDepthFormat, extent, pass.samples(),
            VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT, VK_IMAGE_ASPECT_DEPTH_BIT) {
  if (pass.samples() != VK_SAMPLE_COUNT_1_BIT) {
    samples = Attachment(context, "picture samples", pass.color(), extent, pass.samples(),
                         VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT, VK_IMAGE_ASPECT_COLOR_BIT);
  }
}

VkFramebuffer Attachments::framebuffer(gpu::Context& context, const RenderPass& pass, VkImageView color,
                                       VkExtent2D extent) const {
  const bool resolve = pass.samples() != VK_SAMPLE_COUNT_1_BIT;
  const std::array<VkImageView, 3> views{resolve ? samples.view() : color, depth.view(), color};
  VkFramebufferCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_FRAMEBUFFER_CREATE_INFO;
  info.renderPass = pass.handle();
  info.attachmentCount = resolve ? 3 : 2;
  info.pAttachments = views.data();
  info.width = extent.width;
  info.height = extent.height;
  info.layers = 1;
  VkFramebuffer framebuffer = VK_NULL_HANDLE;
  gpu::check(vkCreateFramebuffer(context.device(), &info, nullptr, &framebuffer), "a framebuffer");
  return framebuffer;
}

OffscreenTarget::OffscreenTarget(gpu::Context& context, const RenderPass& pass, VkExtent2D extent)
    : context_(context),
      pass_(pass),
      extent_(extent),
      attachments_(context, pass, extent),
      color_(context, "picture", kFormat, extent, VK_SAMPLE_COUNT_1_BIT,
             VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT,
             VK_IMAGE_ASPECT_COLOR_BIT),
      framebuffer_(attachments_.framebuffer(context, pass, color_.view(), extent)),
      readback_(context, "picture readback", uint64_t{4} * extent.width * extent.height,
                gpu::Memory::Readback),
      commands_(context) {}

OffscreenTarget::~OffscreenTarget() {
  commands_.settle();
  if (!context_.hung()) vkDestroyFramebuffer(context_.device(), framebuffer_, nullptr);
}

void OffscreenTarget::begin() {
  commands_.begin();
}

void OffscreenTarget::begin_pass() {
  pass_.begin(commands_.handle(), framebuffer_, extent_);
}

RgbImage OffscreenTarget::finish() {
  const VkCommandBuffer cmd = commands_.handle();
  vkCmdEndRenderPass(cmd);
  VkBufferImageCopy region{};
  region.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
  region.imageExtent = {extent_.width, extent_.height, 1};
  vkCmdCopyImageToBuffer(cmd, color_.image(), VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, readback_.handle(), 1,
                         &region);
  commands_.host_barrier();
  commands_.end();
  const auto start = std::chrono::steady_clock::now();
  commands_.submit();
  commands_.wait();
  draw_ms_ = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  readback_.invalidate();

  RgbImage image{extent_.width, extent_.height, {}};
  const size_t count = size_t{extent_.width} * extent_.height;
  image.rgb.resize(3 * count);
  const uint8_t* rgba = readback_.as<uint8_t>().data();
  for (size_t i = 0; i < count; ++i) {
    for (size_t c = 0; c < 3; ++c) image.rgb[3 * i + c] = rgba[4 * i + c];
  }
  return image;
}

void map_to_picture_barrier(const gpu::Context& context, VkCommandBuffer cmd) {
  VkMemoryBarrier2 barrier{};
  barrier.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER_2;
  barrier.srcStageMask = VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_2_COPY_BIT;
  barrier.srcAccessMask = VK_ACCESS_2_SHADER_WRITE_BIT | VK_ACCESS_2_TRANSFER_WRITE_BIT;
  barrier.dstStageMask = VK_PIPELINE_STAGE_2_VERTEX_SHADER_BIT | VK_PIPELINE_STAGE_2_FRAGMENT_SHADER_BIT |
                         VK_PIPELINE_STAGE_2_INDEX_INPUT_BIT;
  barrier.dstAccessMask = VK_ACCESS_2_SHADER_READ_BIT | VK_ACCESS_2_INDEX_READ_BIT;
  VkDependencyInfo dependency{};
  dependency.sType = VK_STRUCTURE_TYPE_DEPENDENCY_INFO;
  dependency.memoryBarrierCount = 1;
  dependency.pMemoryBarriers = &barrier;
  context.pipeline_barrier(cmd, dependency);
}

}  // namespace palpate::viz
