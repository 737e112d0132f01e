// Keys of the live window; viz/panels/controls.cpp lists them for people.
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <algorithm>
#include <cmath>
#include <variant>
#include <vector>

#include "viz/display/display.h"

namespace palpate::viz {

/// In a replay: to `seconds` before or after the present frame.
void Display::jump(double seconds) {
  const std::shared_ptr<Source> source = session_.source();
  const double rate_Hz = source->rate_Hz() > 0 ? source->rate_Hz() : 10;
  Transport& transport = session_.transport;
  const auto position = static_cast<int64_t>(transport.position);
  int64_t to = position + std::llround(seconds * rate_Hz);
  const std::vector<double> times_s = source->uneven_times_s();
  if (position < static_cast<int64_t>(times_s.size()))
    to =
        std::ranges::lower_bound(times_s, times_s[static_cast<size_t>(position)] + seconds) - times_s.begin();
  transport.steps = 0;  // those asked for before it are not taken from there
  transport.seek_to = std::max<int64_t>(0, to);
}

void Display::handle_player_key(const KeyPress& press) {
  Transport& transport = session_.transport;
  const auto frames = static_cast<int64_t>(session_.source()->frame_count().value_or(0));
  switch (press.key) {
    case GLFW_KEY_LEFT:
      jump(press.shift ? -10 : -1);
      break;
    case GLFW_KEY_RIGHT:
      jump(press.shift ? 10 : 1);
      break;
    case GLFW_KEY_UP:
      transport.speed = std::min(transport.speed * 2, LiveOptions::kFastest);
      break;
    case GLFW_KEY_DOWN:
      transport.speed = std::max(transport.speed / 2, LiveOptions::kSlowest);
      break;
    case GLFW_KEY_COMMA:
    case GLFW_KEY_PERIOD:
      scene_.state().paused = session_.paused = true;
      stats_.note = "paused";
      transport.steps += press.key == GLFW_KEY_PERIOD ? 1 : -1;
      break;
    case GLFW_KEY_HOME:
      transport.steps = 0;
      transport.seek_to = 0;
      break;
    case GLFW_KEY_END:
      transport.steps = 0;
      transport.seek_to = std::max<int64_t>(0, frames - 1);
      break;
    default:
      break;
  }
}

/// With Ctrl the arrows move the section line; true where the key was one of those.
bool Display::handle_section_key(const KeyPress& press) {
  ViewState& state = scene_.state();
  if (!press.control || !state.section) return false;
  constexpr double kStep = 0.01, kTurn_rad = 0.05;  // of the frame
  const double aspect =
      static_cast<double>(current_->captured->frame.format.width) / current_->captured->frame.format.height;
  switch (press.key) {
    case GLFW_KEY_LEFT:
      press.shift ? state.line.turn(-kTurn_rad, aspect) : state.line.move(-kStep, 0);
      return true;
    case GLFW_KEY_RIGHT:
      press.shift ? state.line.turn(kTurn_rad, aspect) : state.line.move(kStep, 0);
      return true;
    case GLFW_KEY_UP:
      state.line.move(0, -kStep);
      return true;
    case GLFW_KEY_DOWN:
      state.line.move(0, kStep);
      return true;
    default:
      return false;
  }
}

namespace {

/// Camera, scale and colours; true where the key was one of those, as below.
bool handle_look_key(int key, ViewState& state) {
  switch (key) {
    case GLFW_KEY_R:
      state.camera = {};
      break;
    case GLFW_KEY_T:
      state.camera = {};
      state.camera.azimuth_rad = 0;
      state.camera.elevation_rad = Camera::kMaxElevation_rad;
      break;
    case GLFW_KEY_EQUAL:
    case GLFW_KEY_KP_ADD:
      state.automatic_exaggeration = false;
      state.exaggeration = std::min(state.exaggeration * 1.25, 200.0);
      break;
    case GLFW_KEY_MINUS:
    case GLFW_KEY_KP_SUBTRACT:
      state.automatic_exaggeration = false;
      state.exaggeration = std::max(state.exaggeration * 0.8, 1.0);
      break;
    case GLFW_KEY_PAGE_UP:
      state.widen_range(1.25);
      break;
    case GLFW_KEY_PAGE_DOWN:
      state.widen_range(0.8);
      break;
    case GLFW_KEY_A:
      if (bool* follows = state.automatic()) *follows = !*follows;
      break;
    case GLFW_KEY_E:
      state.automatic_exaggeration = !state.automatic_exaggeration;
      break;
    case GLFW_KEY_D:
      state.next_quantity();
      break;
    case GLFW_KEY_O:
      state.map = static_cast<ColourMap>((static_cast<int>(state.map) + 1) % kColourMaps);
      break;
    case GLFW_KEY_N:
      if (!state.can_show_skin) break;  // Display says why
      state.skin_strain = static_cast<SkinStrain>((static_cast<int>(state.skin_strain) + 1) % kSkinStrains);
      break;
    default:
      return false;
  }
  return true;
}

/// Keys that switch a setting on or off; those of letters are the letters to GLFW.
bool handle_switch_key(int key, ViewState& state) {
  for (const ViewSetting& setting : view_settings())
    if (const auto* flag = std::get_if<bool ViewSettings::*>(&setting.member); flag && *setting.key == key) {
      state.** flag = !(state.**flag);
      return true;
    }
  return false;
}

/// Time axis of the charts, panels and help.
bool handle_panel_key(int key, bool replay, ViewState& state) {
  switch (key) {
    case GLFW_KEY_LEFT_BRACKET:
      state.change_chart_span(-1, replay);
      break;
    case GLFW_KEY_RIGHT_BRACKET:
      state.change_chart_span(1, replay);
      break;
    case GLFW_KEY_I:
      state.sensor_panel = !state.sensor_panel;
      break;
    case GLFW_KEY_H:
    case GLFW_KEY_F1:
      state.help = !state.help;
      break;
    default:
      return false;
  }
  return true;
}

}  // namespace

void Display::handle_view_key(const KeyPress& press) {
  ViewState& state = scene_.state();
  if (press.key == GLFW_KEY_N && !state.can_show_skin)
    stats_.note = "no strain of the skin: this sensor does not follow its skin";
  if (handle_look_key(press.key, state) || handle_switch_key(press.key, state) ||
      handle_panel_key(press.key, options_.replay, state) || press.key != GLFW_KEY_V)
    return;
  do {
    state.vsync = static_cast<Vsync>((static_cast<int>(state.vsync) + 1) % 3);
  } while (!window_.offers(state.vsync));  // On is always offered
}

void Display::handle_key(const KeyPress& press) {
  ViewState& state = scene_.state();
  const bool larger = press.key == GLFW_KEY_EQUAL || press.key == GLFW_KEY_KP_ADD;
  const bool smaller = press.key == GLFW_KEY_MINUS || press.key == GLFW_KEY_KP_SUBTRACT;
  if (press.control && (larger || smaller)) {
    state.enlarge_text(larger);
    return;
  }
  if (handle_section_key(press)) return;
  if (options_.replay) handle_player_key(press);
  switch (press.key) {
    case GLFW_KEY_ESCAPE:
      if (state.help || state.sensor_panel) {
        state.help = state.sensor_panel = false;
        break;
      }
      [[fallthrough]];
    case GLFW_KEY_Q:
      glfwSetWindowShouldClose(window_.handle(), GLFW_TRUE);
      break;
    case GLFW_KEY_SPACE:
      state.paused = !state.paused;
      break;
    case GLFW_KEY_W:
      state.recording_switched_requested = true;
      break;
    case GLFW_KEY_S:
      state.snapshot_requested = true;
      break;
    case GLFW_KEY_Z:
      (press.shift ? state.zero_cleared_requested : state.zero_requested) = true;
      break;
    case GLFW_KEY_M:
      (press.shift ? state.labelling : state.mark_requested) = true;
      break;
    case GLFW_KEY_B:
      state.sources_requested = true;
      break;
    case GLFW_KEY_F11:
      state.full_screen_requested = true;
      break;
    default:
      handle_view_key(press);
  }
}

}  // namespace palpate::viz
