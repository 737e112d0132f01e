// One frame of Dear ImGui on a render pass, with or without a window.
#pragma once

#include <vulkan/vulkan.h>

#include <array>
#include <span>
#include <vector>

#include "viz/render/fonts.h"
#include "viz/render/render_target.h"

struct GLFWwindow;
struct ImGuiContext;

namespace palpate::viz {

/// Owns one ImGui context. Main thread only.
class HudFrame {
 public:
  /// `window`: null off-screen. `scale`: of all text, 1 for 96 dpi. `pictures`: small ones, for draw_picture.
  HudFrame(gpu::Context& context, const RenderPass& pass, uint32_t frames_in_flight, GLFWwindow* window,
           float scale, std::span<const RgbImage> pictures = {});
  ~HudFrame();
  HudFrame(const HudFrame&) = delete;
  HudFrame& operator=(const HudFrame&) = delete;

  /// Starts a picture; ImGui calls follow.
  void begin(VkExtent2D extent);
  /// Forgets what was described since begin.
  void abandon();
  /// Draws what was described since begin; inside the render pass.
  void draw(VkCommandBuffer cmd);

  /// Picture `index`, where there is one, from `low` to `high`, px, in ImGui's present window.
  void draw_picture(size_t index, std::array<float, 2> low, std::array<float, 2> high) const;

  ImFont* small() const { return fonts_.small; }
  ImFont* large() const { return fonts_.large; }
  float scale() const { return scale_; }
  bool has_window() const { return window_ != nullptr; }

 private:
  gpu::Context& context_;
  GLFWwindow* window_;
  float scale_;
  ImGuiContext* imgui_ = nullptr;
  Fonts fonts_;
  std::vector<int> pictures_;  ///< their places in the fonts' texture
  VkDescriptorPool pool_ = VK_NULL_HANDLE;
};

}  // namespace palpate::viz
