// A page of forms and lists that fills the window: drawn only when something happens.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "viz/panels/actions/help.h"
#include "viz/render/hud_frame.h"
#include "viz/render/render_target.h"
#include "viz/render/view_settings.h"
#include "viz/render/window.h"

namespace palpate::viz {

/// Main thread. One at a time, and none while a Scene draws into the same window.
class FormWindow {
 public:
  /// `settings`: text and theme of the person's, followed from picture to picture.
  FormWindow(gpu::Context& context, Window& window, const ViewSettings& settings);
  ~FormWindow();
  FormWindow(const FormWindow&) = delete;
  FormWindow& operator=(const FormWindow&) = delete;

  /// For HudFrame::draw_picture, from the next picture on in which no text is being typed.
  void set_pictures(std::vector<RgbImage> pictures);
  /// Describes the page to ImGui by `content` until `done`, the window's close or `interrupted`. `changed` is
  /// asked ten times a second whether there is something new to show.
  void run(const std::function<void()>& content, const std::function<bool()>& done,
           const std::function<bool()>& changed, const std::function<bool()>& interrupted);
  /// Shows the words until `done`; false where the person gave up (Escape), which is offered where
  /// `can_be_cancelled`.
  bool wait(const std::string& words, const std::function<bool()>& done, bool can_be_cancelled = true);

  /// Begins the window that is the whole page, with its heading and a message, if any; `trouble`: about what
  /// went wrong. ImGui::End() ends it.
  void begin_page(const char* name, const char* heading, const std::string& message, bool trouble) const;
  /// Help over the page while `open`.
  void help(const std::vector<KeyHelp>& lines, bool& open) const;

  const HudFrame& frame() const { return *frame_; }

 private:
  bool draw(const std::function<void()>& content);

  gpu::Context& context_;
  Window& window_;
  const ViewSettings& settings_;
  std::vector<RgbImage> pictures_;
  std::optional<std::vector<RgbImage>> next_pictures_;
  std::unique_ptr<HudFrame> frame_;
};

}  // namespace palpate::viz
