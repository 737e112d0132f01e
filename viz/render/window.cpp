#include "viz/render/window.h"

#define GLFW_INCLUDE_NONE
#define GLFW_INCLUDE_VULKAN
#include <GLFW/glfw3.h>

#include <algorithm>
#include <cassert>
#include <cmath>

#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "viz/render/desktop.h"

namespace palpate::viz {
namespace {

VkPresentModeKHR present_mode(Vsync vsync) {
  switch (vsync) {
    case Vsync::Mailbox:
      return VK_PRESENT_MODE_MAILBOX_KHR;
    case Vsync::Off:
      return VK_PRESENT_MODE_IMMEDIATE_KHR;
    default:
      return VK_PRESENT_MODE_FIFO_KHR;
  }
}

void check_present(VkResult result, const char* what) {
  if (result == VK_ERROR_SURFACE_LOST_KHR) {
    throw Error(Failure::Display, "the window", "its display was closed", "starting again");
  }
  gpu::check(result, what);
}

}  // namespace

Window::Window(gpu::Context& context, const WindowOptions& options) : context_(context) {
  window_extensions();
  glfwWindowHint(GLFW_CLIENT_API, GLFW_NO_API);
  glfwWindowHint(GLFW_SCALE_TO_MONITOR, GLFW_TRUE);
  window_ = glfwCreateWindow(static_cast<int>(options.width), static_cast<int>(options.height),
                             options.title.c_str(), nullptr, nullptr);
  if (!window_) throw Error(Failure::Display, "a window", desktop_message(), "a running desktop");
  // Keys are collected here: one pressed and released between two pictures must not be lost. ImGui chains its
  // own callback.
  glfwSetWindowUserPointer(window_, this);
  glfwSetKeyCallback(window_, [](GLFWwindow* w, int key, int scancode, int action, int mods) {
    if (action == GLFW_RELEASE) return;
    // Signs and letters are where the person's keyboard has them.
    if (const char* name = glfwGetKeyName(key, scancode); name && name[0] && !name[1]) {
      const char c = name[0];
      if (c >= 'a' && c <= 'z') key = GLFW_KEY_A + (c - 'a');
      for (const auto& [sign, its_key] : {std::pair{'+', GLFW_KEY_EQUAL},
                                          {'-', GLFW_KEY_MINUS},
                                          {',', GLFW_KEY_COMMA},
                                          {'.', GLFW_KEY_PERIOD},
                                          {'[', GLFW_KEY_LEFT_BRACKET},
                                          {']', GLFW_KEY_RIGHT_BRACKET}})
        if (c == sign) key = its_key;
    }
    // Held down, only keys of steps go on.
    const bool repeats = key == GLFW_KEY_LEFT || key == GLFW_KEY_RIGHT || key == GLFW_KEY_UP ||
                         key == GLFW_KEY_DOWN || key == GLFW_KEY_COMMA || key == GLFW_KEY_PERIOD ||
                         key == GLFW_KEY_EQUAL || key == GLFW_KEY_MINUS || key == GLFW_KEY_LEFT_BRACKET ||
                         key == GLFW_KEY_RIGHT_BRACKET || key == GLFW_KEY_PAGE_UP ||
                         key == GLFW_KEY_PAGE_DOWN;
    if (action == GLFW_REPEAT && !repeats) return;
    static_cast<Window*>(glfwGetWindowUserPointer(w))
        ->keys_.push_back(
            {key, (mods & GLFW_MOD_SHIFT) != 0, (mods & GLFW_MOD_CONTROL) != 0, (mods & GLFW_MOD_ALT) != 0});
  });
  glfwSetDropCallback(window_, [](GLFWwindow* w, int count, const char** paths) {
    auto& drops = static_cast<Window*>(glfwGetWindowUserPointer(w))->drops_;
    drops.insert(drops.end(), paths, paths + count);
  });
  glfwSetWindowSizeLimits(window_, 480, 320, GLFW_DONT_CARE, GLFW_DONT_CARE);
  // A click between two pictures is seen by whoever asks next.
  glfwSetInputMode(window_, GLFW_STICKY_MOUSE_BUTTONS, GLFW_TRUE);
  vsync_ = options.vsync;
  try {
    attach();
  } catch (...) {
    detach();
    glfwDestroyWindow(window_);
    throw;
  }
}

Window::~Window() {
  detach();
  glfwDestroyWindow(window_);
}

void Window::attach() {
  if (glfwCreateWindowSurface(context_.instance(), window_, nullptr, &surface_) != VK_SUCCESS)
    throw Error(Failure::Display, "a window that Vulkan can draw to", desktop_message(),
                "another display or driver");
  VkBool32 presentable = VK_FALSE;
  vkGetPhysicalDeviceSurfaceSupportKHR(context_.physical_device(), context_.queue_family(), surface_,
                                       &presentable);
  if (!presentable)
    throw Error(Failure::Device, "a device that can show pictures in this window",
                context_.report().name + ", which cannot", "--device with another one of palpate devices");
  uint32_t count = 0;
  vkGetPhysicalDeviceSurfaceFormatsKHR(context_.physical_device(), surface_, &count, nullptr);
  std::vector<VkSurfaceFormatKHR> formats(count);
  vkGetPhysicalDeviceSurfaceFormatsKHR(context_.physical_device(), surface_, &count, formats.data());
  if (formats.empty())
    throw Error(Failure::Display, "a pixel format for the window", "none", "another display");
  // Colours are display encoded by the shaders already: no sRGB conversion on writing.
  format_ = formats.front();
  for (const VkSurfaceFormatKHR& f : formats) {
    if (f.format == VK_FORMAT_B8G8R8A8_UNORM || f.format == VK_FORMAT_R8G8B8A8_UNORM) {
      format_ = f;
      break;
    }
  }
  pass_ = std::make_unique<RenderPass>(context_, format_.format, choose_samples(context_),
                                       VK_IMAGE_LAYOUT_PRESENT_SRC_KHR);
  if (!offers(vsync_)) vsync_ = Vsync::On;  // every display has FIFO
  create_slots();
  create_swapchain();
}

void Window::detach() {
  context_.wait_idle();
  if (!context_.hung()) {
    destroy_targets();
    if (swapchain_) vkDestroySwapchainKHR(context_.device(), swapchain_, nullptr);
    for (Slot& s : slots_) {
      vkDestroySemaphore(context_.device(), s.acquired, nullptr);
      vkDestroyFence(context_.device(), s.fence, nullptr);
      vkDestroyCommandPool(context_.device(), s.pool, nullptr);
    }
    if (surface_) vkDestroySurfaceKHR(context_.instance(), surface_, nullptr);
  }
  targets_.clear();
  slots_ = {};
  swapchain_ = VK_NULL_HANDLE;
  surface_ = VK_NULL_HANDLE;
  attachments_ = {};
  readback_ = {};
  captured_picture_.reset();
  pass_.reset();
  oldest_unfinished_ = next_picture_;
}

void Window::create_slots() {
  for (Slot& s : slots_) {
    VkCommandPoolCreateInfo pool{};
    pool.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO;
    pool.flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT;
    pool.queueFamilyIndex = context_.queue_family();
    gpu::check(vkCreateCommandPool(context_.device(), &pool, nullptr, &s.pool), "a command pool");
    VkCommandBufferAllocateInfo cmd{};
    cmd.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
    cmd.commandPool = s.pool;
    cmd.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
    cmd.commandBufferCount = 1;
    gpu::check(vkAllocateCommandBuffers(context_.device(), &cmd, &s.cmd), "a command buffer");
    VkFenceCreateInfo fence{};
    fence.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO;
    gpu::check(vkCreateFence(context_.device(), &fence, nullptr, &s.fence), "a fence");
    VkSemaphoreCreateInfo semaphore{};
    semaphore.sType = VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO;
    gpu::check(vkCreateSemaphore(context_.device(), &semaphore, nullptr, &s.acquired), "a semaphore");
  }
}

void Window::destroy_targets() {
  for (Target& t : targets_) {
    vkDestroyFramebuffer(context_.device(), t.framebuffer, nullptr);
    vkDestroyImageView(context_.device(), t.view, nullptr);
    vkDestroySemaphore(context_.device(), t.drawn, nullptr);
  }
  targets_.clear();
}

void Window::create_swapchain() {
  VkSurfaceCapabilitiesKHR can{};
  check_present(vkGetPhysicalDeviceSurfaceCapabilitiesKHR(context_.physical_device(), surface_, &can),
                "the window");
  int width = 0, height = 0;
  glfwGetFramebufferSize(window_, &width, &height);
  VkExtent2D extent = can.currentExtent;
  if (extent.width == UINT32_MAX) {
    extent.width =
        std::clamp(static_cast<uint32_t>(width), can.minImageExtent.width, can.maxImageExtent.width);
    extent.height =
        std::clamp(static_cast<uint32_t>(height), can.minImageExtent.height, can.maxImageExtent.height);
  }
  stale_ = true;
  if (extent.width == 0 || extent.height == 0) return;  // minimised: later

  can_copy_ = (can.supportedUsageFlags & VK_IMAGE_USAGE_TRANSFER_SRC_BIT) != 0;
  const VkSwapchainKHR old = swapchain_;
  VkSwapchainCreateInfoKHR info{};
  info.sType = VK_STRUCTURE_TYPE_SWAPCHAIN_CREATE_INFO_KHR;
  info.surface = surface_;
  info.minImageCount = can.minImageCount + 1;
  if (can.maxImageCount) info.minImageCount = std::min(info.minImageCount, can.maxImageCount);
  info.imageFormat = format_.format;
  info.imageColorSpace = format_.colorSpace;
  info.imageExtent = extent;
  info.imageArrayLayers = 1;
  info.imageUsage = VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT;
  if (can_copy_) info.imageUsage |= VK_IMAGE_USAGE_TRANSFER_SRC_BIT;
  info.preTransform = can.currentTransform;
  info.compositeAlpha = can.supportedCompositeAlpha & VK_COMPOSITE_ALPHA_OPAQUE_BIT_KHR
                            ? VK_COMPOSITE_ALPHA_OPAQUE_BIT_KHR
                            : VK_COMPOSITE_ALPHA_INHERIT_BIT_KHR;
  info.presentMode = present_mode(vsync_);
  info.clipped = VK_TRUE;
  info.oldSwapchain = old;
  context_.wait_idle();
  check_present(vkCreateSwapchainKHR(context_.device(), &info, nullptr, &swapchain_), "a swapchain");
  destroy_targets();
  if (old) vkDestroySwapchainKHR(context_.device(), old, nullptr);
  extent_ = extent;
  attachments_ = Attachments(context_, *pass_, extent);

  uint32_t count = 0;
  vkGetSwapchainImagesKHR(context_.device(), swapchain_, &count, nullptr);
  std::vector<VkImage> images(count);
  vkGetSwapchainImagesKHR(context_.device(), swapchain_, &count, images.data());
  for (const VkImage image : images) {
    Target t;
    t.image = image;
    VkImageViewCreateInfo view{};
    view.sType = VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO;
    view.image = image;
    view.viewType = VK_IMAGE_VIEW_TYPE_2D;
    view.format = format_.format;
    view.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
    gpu::check(vkCreateImageView(context_.device(), &view, nullptr, &t.view), "a view of the window");
    t.framebuffer = attachments_.framebuffer(context_, *pass_, t.view, extent);
    VkSemaphoreCreateInfo semaphore{};
    semaphore.sType = VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO;
    gpu::check(vkCreateSemaphore(context_.device(), &semaphore, nullptr, &t.drawn), "a semaphore");
    targets_.push_back(t);
  }
  stale_ = false;
}

float Window::scale() const {
  float x = 1, y = 1;
  glfwGetWindowContentScale(window_, &x, &y);
  return std::clamp(std::max(x, y), 0.75f, 4.0f);
}

bool Window::close_requested() const {
  return glfwWindowShouldClose(window_) == GLFW_TRUE;
}

bool Window::minimised() const {
  int width = 0, height = 0;
  glfwGetFramebufferSize(window_, &width, &height);
  return width == 0 || height == 0 || glfwGetWindowAttrib(window_, GLFW_ICONIFIED) == GLFW_TRUE;
}

bool Window::offers(Vsync vsync) const {
  uint32_t count = 0;
  vkGetPhysicalDeviceSurfacePresentModesKHR(context_.physical_device(), surface_, &count, nullptr);
  std::vector<VkPresentModeKHR> modes(count);
  vkGetPhysicalDeviceSurfacePresentModesKHR(context_.physical_device(), surface_, &count, modes.data());
  return std::find(modes.begin(), modes.end(), present_mode(vsync)) != modes.end();
}

void Window::set_vsync(Vsync vsync) {
  if (vsync == vsync_ || !offers(vsync)) return;
  vsync_ = vsync;
  stale_ = true;
}

std::vector<KeyPress> Window::take_keys() {
  return std::exchange(keys_, {});
}

std::vector<std::string> Window::take_drops() {
  return std::exchange(drops_, {});
}

void Window::switch_full_screen() {
  auto& [x, y, width, height] = before_full_screen_;
  if (width > 0) {
    glfwSetWindowMonitor(window_, nullptr, x, y, width, height, GLFW_DONT_CARE);
    before_full_screen_ = {};
    return;
  }
  GLFWmonitor* monitor = glfwGetPrimaryMonitor();
  const GLFWvidmode* mode = monitor ? glfwGetVideoMode(monitor) : nullptr;
  if (!mode) return;
  glfwGetWindowPos(window_, &x, &y);
  glfwGetWindowSize(window_, &width, &height);
  glfwSetWindowMonitor(window_, monitor, 0, 0, mode->width, mode->height, mode->refreshRate);
}

void Window::set_title(const std::string& title) {
  glfwSetWindowTitle(window_, title.c_str());
}

std::pair<uint32_t, uint32_t> Window::size() const {
  int width = before_full_screen_[2], height = before_full_screen_[3];
  if (width == 0) glfwGetWindowSize(window_, &width, &height);
  return {static_cast<uint32_t>(std::max(width, 1)), static_cast<uint32_t>(std::max(height, 1))};
}

bool Window::begin_picture() {
  if (minimised()) return false;
  int width = 0, height = 0;
  glfwGetFramebufferSize(window_, &width, &height);
  // Some drivers never call a swapchain out of date: compare sizes as well.
  if (static_cast<uint32_t>(width) != extent_.width || static_cast<uint32_t>(height) != extent_.height)
    stale_ = true;
  if (stale_) create_swapchain();
  if (stale_) return false;
  Slot& s = slot();
  assert(!s.pending);

  constexpr uint64_t kPatience_ns = 200'000'000;  // a hidden window may give no image
  const VkResult result = vkAcquireNextImageKHR(context_.device(), swapchain_, kPatience_ns, s.acquired,
                                                VK_NULL_HANDLE, &target_);
  if (result == VK_TIMEOUT || result == VK_NOT_READY) return false;
  if (result == VK_ERROR_OUT_OF_DATE_KHR) {
    stale_ = true;
    return false;
  }
  if (result == VK_SUBOPTIMAL_KHR) {
    stale_ = true;  // this picture can still be shown
  } else {
    check_present(result, "the next picture of the window");
  }
  VkCommandBufferBeginInfo begin{};
  begin.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
  begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
  gpu::check(vkBeginCommandBuffer(s.cmd, &begin), "recording a picture");
  return true;
}

VkCommandBuffer Window::cmd() const {
  return slots_[next_picture_ % kPicturesInFlight].cmd;
}

void Window::begin_pass() {
  pass_->begin(cmd(), targets_[target_].framebuffer, extent_);
}

void Window::copy_target(VkCommandBuffer cmd, VkImage image) {
  readback_ = gpu::DeviceBuffer(context_, "screenshot", uint64_t{4} * extent_.width * extent_.height,
                                gpu::Memory::Readback);
  readback_extent_ = extent_;
  VkImageMemoryBarrier2 barrier{};
  barrier.sType = VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER_2;
  barrier.srcStageMask = VK_PIPELINE_STAGE_2_COLOR_ATTACHMENT_OUTPUT_BIT | VK_PIPELINE_STAGE_2_TRANSFER_BIT;
  barrier.srcAccessMask = VK_ACCESS_2_COLOR_ATTACHMENT_WRITE_BIT;
  barrier.dstStageMask = VK_PIPELINE_STAGE_2_COPY_BIT;
  barrier.dstAccessMask = VK_ACCESS_2_TRANSFER_READ_BIT;
  barrier.oldLayout = VK_IMAGE_LAYOUT_PRESENT_SRC_KHR;
  barrier.newLayout = VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL;
  barrier.srcQueueFamilyIndex = barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
  barrier.image = image;
  barrier.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
  VkDependencyInfo dependency{};
  dependency.sType = VK_STRUCTURE_TYPE_DEPENDENCY_INFO;
  dependency.imageMemoryBarrierCount = 1;
  dependency.pImageMemoryBarriers = &barrier;
  context_.pipeline_barrier(cmd, dependency);

  VkBufferImageCopy region{};
  region.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
  region.imageExtent = {extent_.width, extent_.height, 1};
  vkCmdCopyImageToBuffer(cmd, image, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, readback_.handle(), 1, &region);

  barrier.srcStageMask = VK_PIPELINE_STAGE_2_COPY_BIT;
  barrier.srcAccessMask = 0;
  barrier.dstStageMask = VK_PIPELINE_STAGE_2_NONE;
  barrier.dstAccessMask = 0;
  barrier.oldLayout = VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL;
  barrier.newLayout = VK_IMAGE_LAYOUT_PRESENT_SRC_KHR;
  VkMemoryBarrier2 to_host{};
  to_host.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER_2;
  to_host.srcStageMask = VK_PIPELINE_STAGE_2_COPY_BIT;
  to_host.srcAccessMask = VK_ACCESS_2_TRANSFER_WRITE_BIT;
  to_host.dstStageMask = VK_PIPELINE_STAGE_2_HOST_BIT;
  to_host.dstAccessMask = VK_ACCESS_2_HOST_READ_BIT;
  dependency.memoryBarrierCount = 1;
  dependency.pMemoryBarriers = &to_host;
  context_.pipeline_barrier(cmd, dependency);
}

uint64_t Window::end_picture(bool capture) {
  Slot& s = slot();
  vkCmdEndRenderPass(s.cmd);
  if (capture && can_copy_) {
    copy_target(s.cmd, targets_[target_].image);
    captured_picture_ = next_picture_;
  }
  gpu::check(vkEndCommandBuffer(s.cmd), "recording a picture");
  gpu::check(vkResetFences(context_.device(), 1, &s.fence), "resetting a fence");

  VkSemaphoreSubmitInfo wait{};
  wait.sType = VK_STRUCTURE_TYPE_SEMAPHORE_SUBMIT_INFO;
  wait.semaphore = s.acquired;
  wait.stageMask = VK_PIPELINE_STAGE_2_COLOR_ATTACHMENT_OUTPUT_BIT;
  VkSemaphoreSubmitInfo signal{};
  signal.sType = VK_STRUCTURE_TYPE_SEMAPHORE_SUBMIT_INFO;
  signal.semaphore = targets_[target_].drawn;
  signal.stageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT;
  VkCommandBufferSubmitInfo commands{};
  commands.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_SUBMIT_INFO;
  commands.commandBuffer = s.cmd;
  VkSubmitInfo2 submit{};
  submit.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO_2;
  submit.waitSemaphoreInfoCount = 1;
  submit.pWaitSemaphoreInfos = &wait;
  submit.commandBufferInfoCount = 1;
  submit.pCommandBufferInfos = &commands;
  submit.signalSemaphoreInfoCount = 1;
  submit.pSignalSemaphoreInfos = &signal;
  s.submitted = Clock::now();
  s.picture = next_picture_;
  context_.submit(submit, s.fence);
  s.pending = true;
  // A CPU driver would draw inside the present call, holding the queue against the engine's submissions: wait
  // here instead.
  if (context_.is_software()) {
    context_.wait(s.fence, "a drawn picture");
    s.drawn = Clock::now();
  }

  VkPresentInfoKHR present{};
  present.sType = VK_STRUCTURE_TYPE_PRESENT_INFO_KHR;
  present.waitSemaphoreCount = 1;
  present.pWaitSemaphores = &targets_[target_].drawn;
  present.swapchainCount = 1;
  present.pSwapchains = &swapchain_;
  present.pImageIndices = &target_;
  const VkResult result = context_.present(present);
  if (result == VK_ERROR_OUT_OF_DATE_KHR || result == VK_SUBOPTIMAL_KHR) {
    stale_ = true;
  } else {
    check_present(result, "showing a picture");
  }
  return next_picture_++;
}

std::optional<Finished> Window::poll_finished(bool wait) {
  if (oldest_unfinished_ == next_picture_) return std::nullopt;
  Slot& s = slots_[oldest_unfinished_ % kPicturesInFlight];
  if (wait) {
    context_.wait(s.fence, "a drawn picture");
  } else {
    const VkResult result = vkGetFenceStatus(context_.device(), s.fence);
    if (result == VK_NOT_READY) return std::nullopt;
    gpu::check(result, "a drawn picture");
  }
  s.pending = false;
  ++oldest_unfinished_;
  const Clock::time_point now = Clock::now();
  const Clock::time_point drawn = context_.is_software() ? s.drawn : now;
  return Finished{s.picture, std::chrono::duration<double, std::milli>(drawn - s.submitted).count(), now};
}

std::optional<RgbImage> Window::captured() {
  if (!captured_picture_) return std::nullopt;
  const Slot& s = slots_[*captured_picture_ % kPicturesInFlight];
  context_.wait(s.fence, "a drawn picture");
  captured_picture_.reset();
  readback_.invalidate();
  RgbImage image{readback_extent_.width, readback_extent_.height, {}};
  const size_t count = size_t{image.width} * image.height;
  image.rgb.resize(3 * count);
  const uint8_t* from = readback_.as<uint8_t>().data();
  const bool blue_first = format_.format != VK_FORMAT_R8G8B8A8_UNORM;
  for (size_t i = 0; i < count; ++i) {
    image.rgb[3 * i] = from[4 * i + (blue_first ? 2 : 0)];
    image.rgb[3 * i + 1] = from[4 * i + 1];
    image.rgb[3 * i + 2] = from[4 * i + (blue_first ? 0 : 2)];
  }
  return image;
}

}  // namespace palpate::viz
