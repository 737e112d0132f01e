#include "viz/display.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "engine/error.h"
#include "engine/gpu/context.h"
#include "viz/picture.h"
#include "viz/recording.h"

namespace palpate::viz {
namespace {

using std::chrono::milliseconds;

// Of a picture on a CPU driver, so that measuring has its share of the cores at 25 pictures a second.
constexpr double kDrawBudget_ms = 22;

double seconds_between(std::chrono::steady_clock::time_point a, std::chrono::steady_clock::time_point b) {
  return std::chrono::duration<double>(b - a).count();
}

}  // namespace

double Rate::update(uint64_t count, std::chrono::steady_clock::time_point now) {
  marks_.push_back({now, count});
  while (marks_.size() > 2 && seconds_between(marks_.front().at, now) > 2) marks_.pop_front();
  const double span_s = seconds_between(marks_.front().at, now);
  return span_s > 0.2 ? static_cast<double>(count - marks_.front().count) / span_s : 0;
}

Display::Display(gpu::Context& context, const Sensor& sensor, const LiveOptions& options,
                 LiveSession& session, LatencyLog& latency)
    : options_(options),
      session_(session),
      latency_(latency),
      window_(context, {options.title, options.width, options.height, options.vsync}),
      scene_(context, window_.pass(), sensor, Window::kPicturesInFlight, window_.handle(), window_.scale()),
      governor_(!context.is_software(), kDrawBudget_ms) {
  scene_.state().vsync = window_.vsync();
}

void Display::retire(const Finished& finished) {
  draw_.add(finished.draw_ms);
  governor_.record(finished.draw_ms);
  Drawing done = std::move(drawing_.front());
  drawing_.pop_front();
  if (done.is_new) {
    done.times.shown_ns =
        std::chrono::duration_cast<std::chrono::nanoseconds>(finished.at.time_since_epoch()).count();
    latency_.add(done.times);
    recent_to_measured_.add(done.times.to_measured_ms());
    recent_to_shown_.add(done.times.to_shown_ms());
    ++stats_.shown;
  }
  // Whatever this picture's result replaced was drawn before it, and is finished too.
  for (Measured& m : done.replaced) give_back(m);
}

bool Display::draw(bool is_new) {
  while (window_.in_flight() >= Window::kPicturesInFlight) retire(*window_.poll_finished(true));
  if (!window_.begin_picture()) return false;
  Drawing d;
  d.is_new = is_new;
  d.times = current_->times;
  scene_.record(window_.cmd(), window_.extent(),
                {current_->captured->frame, current_->result.touch, current_->result.surface},
                governor_.columns(), &stats_, [&] {
                  handle_input();  // between ImGui's begin and end, while its input is fresh
                  window_.begin_pass();
                });
  const bool screenshot = std::exchange(scene_.state().wants_screenshot, false);
  d.picture = window_.end_picture(screenshot);
  d.replaced = std::exchange(replaced_, {});
  drawing_.push_back(std::move(d));
  if (screenshot) save_screenshot();
  return true;
}

void Display::save_screenshot() {
  const auto image = window_.captured();
  if (!image) {
    stats_.note = "this display gives no screenshots";
    return;
  }
  std::filesystem::path file;
  do {
    char name[32];
    std::snprintf(name, sizeof name, "palpate-%04d.png", ++screenshots_);
    file = options_.screenshots / name;
  } while (std::filesystem::exists(file));
  try {
    write_png(*image, file);
    stats_.note = "wrote " + file.string();
  } catch (const Error& e) {
    stats_.note = e.what();  // a full disk must not end a measurement
  }
}

void Display::handle_input() {
  ViewState& state = scene_.state();
  const ImGuiIO& io = ImGui::GetIO();
  Camera& camera = state.camera;
  if (!io.WantCaptureMouse) {
    const double height = std::max(1.0, static_cast<double>(scene_.layout().surface.height));
    // In the picture of the click itself the mouse may have come from anywhere.
    const auto held = [&](int button) { return io.MouseDownDuration[button] > 0; };
    const bool left = held(0), right = held(1) || held(2);
    if (left && !io.KeyShift) {
      camera.orbit(-0.008 * io.MouseDelta.x, 0.008 * io.MouseDelta.y);
    } else if (left || right) {
      const Eye& eye = scene_.eye();
      const double mm_per_px = 2 * eye.distance_mm * std::tan(Camera::kFieldOfView_rad / 2) / height;
      camera.target =
          camera.target - eye.right * (io.MouseDelta.x * mm_per_px) + eye.up * (io.MouseDelta.y * mm_per_px);
    }
    if (io.MouseWheel != 0) camera.magnify(std::pow(1.12, io.MouseWheel));
  }
  for (const int key : window_.take_keys()) {
    if (!io.WantTextInput) handle_key(key, io.KeyShift);
  }
}

/// In a replay: to `seconds` before or after the present frame.
void Display::jump(double seconds) {
  const std::shared_ptr<Source> source = session_.source();
  const double rate_Hz = source->rate_Hz() > 0 ? source->rate_Hz() : 10;
  const auto frames = static_cast<int64_t>(std::llround(seconds * rate_Hz));
  Transport& transport = session_.transport;
  transport.seek_to = std::max<int64_t>(0, static_cast<int64_t>(transport.position) + frames);
}

void Display::handle_player_key(int key, bool shift) {
  Transport& transport = session_.transport;
  const auto frames = static_cast<int64_t>(session_.source()->frame_count().value_or(0));
  switch (key) {
    case GLFW_KEY_LEFT:
      jump(shift ? -10 : -1);
      break;
    case GLFW_KEY_RIGHT:
      jump(shift ? 10 : 1);
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
      transport.steps += key == GLFW_KEY_PERIOD ? 1 : -1;
      break;
    case GLFW_KEY_HOME:
      transport.seek_to = 0;
      break;
    case GLFW_KEY_END:
      transport.seek_to = std::max<int64_t>(0, frames - 1);
      break;
    default:
      break;
  }
}

void Display::switch_recording() {
  if (!options_.recording) {
    stats_.note = "nothing to record to: --out names a folder";
    return;
  }
  try {
    if (options_.recording->on()) {
      options_.recording->stop();
      stats_.note = "wrote " + options_.recording->latest().folder.string();
    } else {
      options_.recording->start();
      stats_.note.clear();
    }
  } catch (const Error& e) {
    stats_.note = e.what();  // a full disk must not end a measurement
  }
}

void Display::handle_key(int key, bool shift) {
  if (options_.replay) handle_player_key(key, shift);
  ViewState& state = scene_.state();
  switch (key) {
    case GLFW_KEY_ESCAPE:
    case GLFW_KEY_Q:
      glfwSetWindowShouldClose(window_.handle(), GLFW_TRUE);
      break;
    case GLFW_KEY_SPACE:
      state.paused = !state.paused;
      break;
    case GLFW_KEY_W:
      state.wants_recording_switched = true;
      break;
    case GLFW_KEY_S:
      state.wants_screenshot = true;
      break;
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
    case GLFW_KEY_A:
      state.automatic_range = !state.automatic_range;
      break;
    case GLFW_KEY_E:
      state.automatic_exaggeration = !state.automatic_exaggeration;
      break;
    case GLFW_KEY_L:
      state.lit = !state.lit;
      break;
    case GLFW_KEY_G:
      state.grid = !state.grid;
      break;
    case GLFW_KEY_C:
      state.controls = !state.controls;
      break;
    case GLFW_KEY_H:
    case GLFW_KEY_F1:
      state.help = !state.help;
      break;
    case GLFW_KEY_V:
      do {
        state.vsync = static_cast<Vsync>((static_cast<int>(state.vsync) + 1) % 3);
      } while (!window_.offers(state.vsync));  // On is always offered
      break;
    default:
      break;
  }
}

void Display::update_player() {
  const Transport& transport = session_.transport;
  PlayerStats now{.frames = session_.source()->frame_count().value_or(0),
                  .position = transport.position,
                  .speed = transport.speed,
                  .at_end = transport.at_end};
  if (stats_.player && now.at_end != stats_.player->at_end) {
    stats_.note = now.at_end ? "end of recording" : scene_.state().paused ? "paused" : "";
    restless_ = 3;
  }
  if (stats_.player && now.speed != stats_.player->speed) restless_ = 3;
  stats_.player = now;
}

void Display::update_stats() {
  const Clock::time_point now = Clock::now();
  if (now < stats_due_) return;
  stats_due_ = now + milliseconds(250);
  stats_.captured = session_.captured;
  stats_.processed = session_.processed;
  stats_.dropped_before_engine = session_.to_engine.displaced() + session_.passed_over;
  stats_.dropped_before_display = session_.to_display.displaced();
  stats_.captured_per_s = captured_rate_.update(stats_.captured, now);
  stats_.processed_per_s = processed_rate_.update(stats_.processed, now);
  stats_.shown_per_s = shown_rate_.update(stats_.shown, now);
  stats_.to_measured = recent_to_measured_.percentiles();
  stats_.to_shown = recent_to_shown_.percentiles();
  const std::shared_ptr<Source> source = session_.source();
  stats_.camera = source->counts();
  stats_.state = source->state();
  if (options_.recording) {
    stats_.recording = options_.recording->on();
    stats_.session = options_.recording->latest().status;
  }
  stats_.draw_ms = governor_.typical_ms();
}

LiveReport Display::run() {
  LiveReport report;
  Clock::time_point start = Clock::now(), end = start;
  bool started = false, at_end = false;
  while (!window_.wants_close() && !session_.stop) {
    glfwPollEvents();
    double x = 0, y = 0;
    int width = 0, height = 0;
    glfwGetCursorPos(window_.handle(), &x, &y);
    glfwGetFramebufferSize(window_.handle(), &width, &height);
    const ImGuiIO& io = ImGui::GetIO();
    if (options_.replay) update_player();
    if (last_mouse_ != std::pair{x, y} || last_size_ != std::pair{width, height} || window_.has_keys() ||
        io.MouseWheel != 0 || glfwGetMouseButton(window_.handle(), GLFW_MOUSE_BUTTON_LEFT) == GLFW_PRESS ||
        glfwGetMouseButton(window_.handle(), GLFW_MOUSE_BUTTON_RIGHT) == GLFW_PRESS) {
      restless_ = 3;
    }
    last_mouse_ = {x, y};
    last_size_ = {width, height};

    if (options_.interrupted && options_.interrupted()) report.interrupted = true;
    if (report.interrupted) break;
    if (options_.max_seconds > 0 && seconds_between(start, Clock::now()) >= options_.max_seconds) break;
    while (auto finished = window_.poll_finished(false)) retire(*finished);
    if (drawing_.empty()) {
      for (Measured& m : std::exchange(replaced_, {})) give_back(m);
    }

    auto newest = session_.to_display.take(restless_ > 0 ? milliseconds(0) : milliseconds(5));
    const bool is_new = newest.has_value();
    if (is_new) {
      if (current_) replaced_.push_back(std::move(*current_));
      current_ = std::move(newest);
      scene_.follow(current_->result.touch);
      if (!started) start = Clock::now();
      started = true;
      end = Clock::now();
    } else if (!at_end && session_.to_display.finished()) {
      at_end = true;
      stats_.note = "end of recording";
      restless_ = 3;
      if (options_.close_at_end) break;
    }
    update_stats();
    if (!current_ || (!is_new && restless_ == 0)) {
      if (at_end) glfwWaitEventsTimeout(0.05);  // a closed mailbox no longer waits for us
      continue;
    }
    if (!is_new) --restless_;

    if (window_.minimised()) {
      glfwWaitEventsTimeout(0.05);
      continue;
    }
    if (!draw(is_new)) continue;
    ViewState& state = scene_.state();
    window_.set_vsync(state.vsync);
    state.vsync = window_.vsync();
    if (std::exchange(state.wants_recording_switched, false)) {
      switch_recording();
      stats_due_ = {};
      restless_ = 3;
    }
    if (state.seek_to) session_.transport.seek_to = static_cast<int64_t>(*std::exchange(state.seek_to, {}));
    if (state.paused != session_.paused) {
      session_.paused = state.paused;
      stats_.note = state.paused ? "paused" : "";
      restless_ = 3;
    }
  }
  while (auto finished = window_.poll_finished(true)) retire(*finished);
  session_.rethrow();

  update_stats();
  report.shown = stats_.shown;
  report.seconds = started ? seconds_between(start, end) : 0;
  report.shown_per_s = report.seconds > 0 ? static_cast<double>(report.shown) / report.seconds : 0;
  report.draw_median_ms = draw_.percentiles().p50_ms;
  report.mesh_columns = governor_.columns();
  return report;
}

}  // namespace palpate::viz
