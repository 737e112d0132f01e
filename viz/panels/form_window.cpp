#include "viz/panels/form_window.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <cmath>
#include <utility>

#include "engine/gpu/context.h"
#include "viz/render/drawing.h"
#include "viz/render/format.h"

namespace palpate::viz {

namespace {

/// Of a window that is the whole page.
ImGuiWindowFlags page_flags() {
  return ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
         ImGuiWindowFlags_NoBackground | ImGuiWindowFlags_NoNav;
}

}  // namespace

FormWindow::FormWindow(gpu::Context& context, Window& window, const ViewSettings& settings)
    : context_(context), window_(window), settings_(settings) {}

FormWindow::~FormWindow() {
  while (window_.poll_finished(true)) {
  }
}

void FormWindow::set_pictures(std::vector<RgbImage> pictures) {
  next_pictures_ = std::move(pictures);
}

/// One picture; false where there is nothing to draw to.
bool FormWindow::draw(const std::function<void()>& content) {
  use_theme(settings_.light_theme);
  const float scale = window_.scale() * settings_.text_scale;
  if (next_pictures_ && !(frame_ && ImGui::GetIO().WantTextInput)) {
    while (window_.poll_finished(true)) {
    }
    frame_.reset();
    pictures_ = *std::exchange(next_pictures_, {});
  }
  if (!frame_ || std::abs(frame_->scale() / scale - 1) > 1e-3f) {
    frame_.reset();
    frame_ = std::make_unique<HudFrame>(context_, window_.pass(), Window::kPicturesInFlight, window_.handle(),
                                        scale, pictures_);
  }
  while (window_.in_flight() >= Window::kPicturesInFlight) window_.poll_finished(true);
  if (!window_.begin_picture()) return false;
  frame_->begin(window_.extent());
  content();
  window_.begin_pass();
  frame_->draw(window_.cmd());
  window_.end_picture(false);
  return true;
}

void FormWindow::run(const std::function<void()>& content, const std::function<bool()>& done,
                     const std::function<bool()>& changed, const std::function<bool()>& interrupted) {
  int restless = 3, quiet = 0;
  while (!window_.close_requested() && !(interrupted && interrupted()) && !done()) {
    // Sleeps until something happens; what the threads find is looked at ten times a second.
    glfwWaitEventsTimeout(restless > 0 ? 0.01 : 0.1);
    const ImGuiIO* io = frame_ ? &ImGui::GetIO() : nullptr;
    if (!io || changed() || window_.has_keys() || window_.has_drops() || io->MouseDelta.x != 0 ||
        io->MouseDelta.y != 0 || io->MouseWheel != 0 || io->WantTextInput)
      restless = 3;
    double x = 0, y = 0;
    glfwGetCursorPos(window_.handle(), &x, &y);
    if (io && (io->MousePos.x != static_cast<float>(x) || io->MousePos.y != static_cast<float>(y)))
      restless = 3;
    for (const int button : {GLFW_MOUSE_BUTTON_LEFT, GLFW_MOUSE_BUTTON_RIGHT})
      if (glfwGetMouseButton(window_.handle(), button) == GLFW_PRESS) restless = 3;
    if (static_cast<uint32_t>(io ? io->DisplaySize.x : 0) != window_.extent().width) restless = 3;
    if (window_.minimised()) continue;
    if (restless-- <= 0) {
      restless = 0;
      // A picture a second also at rest: a window that was covered may have lost its content.
      if (++quiet % 10 != 0) continue;
    }
    draw(content);
  }
}

void FormWindow::begin_page(const char* name, const char* heading, const std::string& message,
                            bool trouble) const {
  ImGui::SetNextWindowPos({0, 0});
  ImGui::SetNextWindowSize(ImGui::GetIO().DisplaySize);
  ImGui::Begin(name, nullptr, page_flags() | ImGuiWindowFlags_NoBringToFrontOnFocus);
  ImGui::PushFont(frame_->large());
  ImGui::TextUnformatted("palpate");
  ImGui::PopFont();
  ImGui::SameLine();
  ImGui::TextDisabled("%s", heading);
  if (!message.empty()) wrapped_text(message, trouble ? tint(theme().wrong) : tint(theme().chosen));
}

void FormWindow::help(const std::vector<KeyHelp>& lines, bool& open) const {
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  if (open)
    help_window({static_cast<uint32_t>(size.x), static_cast<uint32_t>(size.y)}, frame_->scale(), lines, open);
}

bool FormWindow::wait(const std::string& words, const std::function<bool()>& done, bool can_be_cancelled) {
  while (!done()) {
    if (window_.close_requested() && can_be_cancelled) return false;
    glfwWaitEventsTimeout(0.05);
    bool given_up = false;
    draw([&] {
      for (const KeyPress& press : window_.take_keys()) given_up = given_up || press.key == GLFW_KEY_ESCAPE;
      const ImVec2 size = ImGui::GetIO().DisplaySize;
      ImGui::SetNextWindowPos({size.x / 2, size.y / 2}, ImGuiCond_Always, {0.5f, 0.5f});
      ImGui::Begin("waiting", nullptr, page_flags() | ImGuiWindowFlags_AlwaysAutoResize);
      ImGui::TextUnformatted(shortened(words, 0.8f * size.x).c_str());
      if (can_be_cancelled && ImGui::Button("Cancel (Esc)")) given_up = true;
      ImGui::End();
    });
    if (given_up && can_be_cancelled) return false;
  }
  return true;
}

}  // namespace palpate::viz
