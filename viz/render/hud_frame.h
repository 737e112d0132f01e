// One frame of Dear ImGui on a render pass, with or without a window.
#pragma once

#include <vulkan/vulkan.h>

#include "viz/render/render_target.h"

struct GLFWwindow;
struct ImGuiContext;
struct ImFont;

namespace palpate::viz {

/// Owns one ImGui context. Main thread only.
class HudFrame {
 public:
  /// `window`: null off-screen. `scale`: of all text, 1 for 96 dpi.
  HudFrame(gpu::Context& context, const RenderPass& pass, uint32_t frames_in_flight, GLFWwindow* window,
           float scale);
  ~HudFrame();
  HudFrame(const HudFrame&) = delete;
  HudFrame& operator=(const HudFrame&) = delete;

  /// Starts a picture; ImGui calls follow.
  void begin(VkExtent2D extent);
  /// Forgets what was described since begin.
  void abandon();
  /// Draws what was described since begin; inside the render pass.
  void draw(VkCommandBuffer cmd);

  ImFont* body() const { return body_; }
  ImFont* large() const { return large_; }
  float scale() const { return scale_; }
  bool has_window() const { return window_ != nullptr; }

 private:
  gpu::Context& context_;
  GLFWwindow* window_;
  float scale_;
  ImGuiContext* imgui_ = nullptr;
  ImFont* body_ = nullptr;
  ImFont* large_ = nullptr;
  VkDescriptorPool pool_ = VK_NULL_HANDLE;
};

}  // namespace palpate::viz
