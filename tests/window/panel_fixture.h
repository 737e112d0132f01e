// Panels described to ImGui without a window.
#pragma once

#include <gtest/gtest.h>
#include <imgui.h>

#include <functional>
#include <memory>
#include <string>

#include "tests/support/gpu_fixture.h"
#include "viz/render/drawing.h"
#include "viz/render/hud_frame.h"

namespace palpate::viz {

class PanelTest : public GpuTest {
 protected:
  /// Describes pictures one after the other: a window has its size from the second on.
  void describe(float scale, const std::function<void()>& content, VkExtent2D extent = {1280, 720}) {
    if (!frame_ || frame_->scale() != scale) {
      frame_.reset();
      frame_ = std::make_unique<HudFrame>(context(), pass_, 1, nullptr, scale);
    }
    for (int i = 0; i < 3; ++i) {
      frame_->begin(extent);
      content();
      frame_->abandon();
    }
  }
  /// All words that ImGui writes while `content` is described, in their order.
  std::string words_of(const std::function<void()>& content) {
    static std::string copied;
    copied.clear();
    describe(1, [&] {
      ImGui::GetIO().SetClipboardTextFn = [](void*, const char* text) { copied = text; };
      ImGui::LogToClipboard();
      content();
    });
    return copied;
  }
  static size_t count(const std::string& words, const std::string& what) {
    size_t found = 0;
    for (size_t at = words.find(what); at != std::string::npos; at = words.find(what, at + 1)) ++found;
    return found;
  }

  RenderPass pass_{context(), OffscreenTarget::kFormat, VK_SAMPLE_COUNT_1_BIT,
                   VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL};
  std::unique_ptr<HudFrame> frame_;
};

}  // namespace palpate::viz
