#include "viz/display/display.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "capture/live/recorder.h"
#include "capture/run/largest.h"
#include "engine/base/trace.h"
#include "engine/gpu/context.h"
#include "engine/pipeline/surface_map.h"
#include "viz/panels/actions/actions.h"
#include "viz/panels/actions/palette.h"
#include "viz/panels/actions/text_field.h"
#include "viz/panels/drag_view.h"
#include "viz/panels/numbers/hand_scan.h"
#include "viz/panels/settings.h"
#include "viz/panels/start/thumbnails.h"
#include "viz/render/drawing.h"

namespace palpate::viz {
namespace {

using std::chrono::milliseconds;

// Limit of a picture on a CPU driver, so that measuring has its fraction of the cores at 25 pictures a
// second.
constexpr double kDrawBudget_ms = 22;

double seconds_between(std::chrono::steady_clock::time_point a, std::chrono::steady_clock::time_point b) {
  return std::chrono::duration<double>(b - a).count();
}

}  // namespace

Display::Display(gpu::Context& context, const DisplayedSensor& what, const LiveOptions& options,
                 const WindowRun& shown, LiveSession& session, LatencyLog& latency)
    : context_(context),
      options_(options),
      shown_(shown),
      session_(session),
      latency_(latency),
      window_(*shown.window),
      columns_(MeasuredColumns::of(what.sensor, what.outputs, what.separate)),
      pitch_mm_per_px_(what.sensor.pitch_mm_per_px),
      scene_(context, window_.pass(), what.sensor, &what.background, Window::kPicturesInFlight,
             window_.handle(), window_.scale()),
      software_(context.is_software()),
      governor_(!context.is_software(), kDrawBudget_ms),
      map_(what.map),
      scan_(options.presses ? options.presses->scan() : nullptr) {
  if (shown.settings) scene_.state().choose(shown.settings->view);
  scene_.state().vsync = window_.vsync();
  scene_.state().replay = options.replay;
  scene_.state().has_object_map = map_ || scan_;
  const std::shared_ptr<Source> source = session.source();
  const bool timed = source->live() || source->rate_Hz() > 0;
  scene_.set_timeline({.timed = timed,
                       .frames = options.replay ? source->frame_count().value_or(0) : 0,
                       .rate_Hz = source->rate_Hz(),
                       .start_s = shown.replay_start_s,
                       .uneven_s = options.replay ? source->uneven_times_s() : std::vector<double>{},
                       .separate = what.separate});
  if (options.replay && source->frame_count().value_or(0) > 1)
    scene_.show_strip(
        strip_.emplace(context, StripInput{options.input, what.sensor, what.background, what.outputs}));
  for (const Event& event : shown.known_events) scene_.mark(event);
  if (!shown.notes.empty()) stats_.note = "snapshots (S) and marks (M) go to " + shown.notes.string();
  if (session.device_losses > 0) stats_.note = "the device was lost and opened anew: the terminal says more";
  stats_.from_list = shown.from_list;
}

void Display::retire(const Finished& finished) {
  Drawing done = std::move(drawing_.front());
  drawing_.pop_front();
  if (!done.still) {
    draw_.add(finished.draw_ms);
    governor_.record(finished.draw_ms);
  }
  if (done.is_new) {
    done.times.shown_ns =
        std::chrono::duration_cast<std::chrono::nanoseconds>(finished.at.time_since_epoch()).count();
    latency_.add(done.times);
    recent_to_measured_.add(done.times.to_measured_ms());
    recent_to_shown_.add(done.times.to_shown_ms());
    stats_.recent.push_back({done.times.to_measured_ms(), done.times.to_shown_ms(), finished.draw_ms});
    if (stats_.recent.size() > PictureTimes::kKept) stats_.recent.pop_front();
    ++stats_.shown;
  }
  // Whatever this picture's result replaced was drawn before it, and is finished too.
  for (Measured& m : done.replaced) give_back(m);
}

/// Whether the picture has stayed for a while, and can be drawn as fine as it was measured.
bool Display::is_still() const {
  constexpr milliseconds kPatience{300};
  return software_ && !finest_ && current_ && surface_of(current_->result).buffer &&
         Clock::now() - drawn_ > kPatience;
}

bool Display::draw(bool is_new, bool still) {
  const TraceSpan span("draw");
  if (!window_.begin_picture()) return false;
  finest_ = still;
  drawn_ = Clock::now();
  Drawing d;
  d.is_new = is_new;
  d.still = still;
  d.times = current_->times;
  scene_.record(window_.cmd(), window_.extent(),
                {current_->captured->frame, current_->result.touch, current_->result, still},
                still ? MeshGovernor::kFinest : governor_.columns(), &stats_, [&] {
                  handle_input();  // between ImGui's begin and end, while its input is fresh
                  window_.begin_pass();
                });
  const bool snapshot = std::exchange(scene_.state().snapshot_requested, false);
  const bool charts = !snapshot && !chart_picture_.empty();
  d.picture = window_.end_picture(snapshot || charts);
  d.replaced = std::exchange(replaced_, {});
  drawing_.push_back(std::move(d));
  if (snapshot) save_snapshot();
  if (charts) save_chart_picture();
  return true;
}

void Display::handle_input() {
  ViewState& state = scene_.state();
  const ImGuiIO& io = ImGui::GetIO();
  if (!state.mouse_taken) drag_view(scene_.eye(), scene_.layout().surface, state.camera);
  if (!state.mouse_taken && scene_.layout().has_map) drag_map(scene_.map_fit(), state.map_eye);
  // In the order of the presses, which ImGui does not keep: it sees only keys that are down when a picture
  // begins, and says of a text that is closed for one picture more that it is typed.
  const bool field = state.labelling || state.palette, closed = std::exchange(field_, field) && !field;
  const bool typing = io.WantTextInput && !field && !closed;
  for (const KeyPress& press : window_.take_keys()) {
    const bool enter = press.key == GLFW_KEY_ENTER || press.key == GLFW_KEY_KP_ENTER;
    if (state.palette) {
      palette_key(press, circumstances(&stats_, has_surface(), state), state);
    } else if (!state.labelling) {
      if (!typing) handle_key(press);
    } else if (enter || press.key == GLFW_KEY_ESCAPE) {
      end_labelling(state, enter);
    }
  }
}

void Display::handle_key(const KeyPress& press) {
  ViewState& state = scene_.state();
  const Circumstances now = circumstances(&stats_, has_surface(), state);
  const Action* action = action_of(press, now);
  if (!action) return;
  if (action->possible(now))
    action->run(state);
  else
    stats_.note = reason_against(action->needs);
}

/// The list of sources shows the largest force, and the largest contact: its depth, else its frame. Without a
/// contact it shows the first frame.
void Display::follow_thumbnail() {
  const Touch& touch = current_->result.touch;
  const Estimate& force = force_of_touch(touch);
  if (force.validity == Validity::Valid) largest_N_ = std::max(largest_N_, force.value);
  const double area_px = touch.contact ? static_cast<double>(touch.area_px) : 0;
  if (!shown_.settings || area_px <= 1.2 * thumbnail_px_) return;
  const ViewState& state = scene_.state();
  if (touch.contact && has_surface())
    thumbnail_ = depth_thumbnail(context_, surface_of(current_->result), touch.surface->depth_offset_mm,
                                 state.map, std::max(touch.surface->depth_max_mm, ViewState::kLeastRange_mm));
  else
    thumbnail_ = thumbnail_of(current_->captured->frame);
  thumbnail_px_ = area_px;
}

/// Frames go to the map as long as it is shown, and what there is of it to the picture.
void Display::follow_map(bool is_new) {
  if (scan_) return follow_scan();
  if (!map_ || !scene_.state().object_map) return;
  const TraceSpan span("map");
  if (is_new && map_->wants(current_->result.touch))
    map_->add(current_->result.touch, current_->captured->frame.format, current_->result.depth_mm(),
              session_.device_losses);
  MapLook look;
  look.map = map_->seen();
  look.pad_mm = map_->pad_mm();
  if (look.map != scene_.map().map) restless_ = std::max(restless_, 1);
  scene_.show_map(std::move(look));
}

/// Presses are put together as long as their map is shown.
void Display::follow_scan() {
  scan_->switch_on(scene_.state().object_map);
  ScanStatus now = scan_->status();
  if (!stats_.scan || now.seen != stats_.scan->seen || now.working != stats_.scan->working) {
    restless_ = std::max(restless_, 2);
    scene_.show_map(scan_look(now));
  }
  stats_.scan = std::move(now);
}

void Display::update_player() {
  const Transport& transport = session_.transport;
  const std::shared_ptr<Source> source = session_.source();
  PlayerStats now{.name = current_ ? source->frame_name(current_->result.touch.sequence) : "",
                  .timed = source->rate_Hz() > 0,
                  .frames = source->frame_count().value_or(0),
                  .position = current_ ? current_->captured->position : transport.position.load(),
                  .speed = transport.speed,
                  .at_end = transport.at_end};
  if (stats_.player && now.at_end != stats_.player->at_end) {
    stats_.note = now.at_end ? "end of recording" : scene_.state().paused ? "paused" : "";
    restless_ = 3;
  }
  if (stats_.player && now.speed != stats_.player->speed) restless_ = 3;
  if (strip_) {
    strip_->give_way(!session_.paused && !now.at_end);
    if (std::exchange(strip_looks_, strip_->measured()) != strip_looks_) restless_ = std::max(restless_, 1);
  }
  stats_.player = now;
}

void Display::update_stats() {
  const Clock::time_point now = Clock::now();
  if (const auto note = background_.take_note()) {
    stats_.note = *note;
    restless_ = 3;
  }
  if (options_.presses) update_presses();
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
  stats_.state = session_.transport.at_end ? source->warning() : source->state();
  if (options_.recording) {
    stats_.recording = options_.recording->on();
    stats_.session = options_.recording->latest().status;
  }
  stats_.notes = notes_folder().string();
  stats_.draw_ms = governor_.typical_ms();
}

LiveReport Display::run() {
  LiveReport report;
  try {
    show(report);
  } catch (const DeviceLost& error) {
    session_.lose_device(error);
  }
  if (shown_.settings) {
    shown_.settings->view = scene_.state().chosen(shown_.settings->view);
    if (!shown_.settings->recent.empty()) {
      Settings::Recent& recent = shown_.settings->recent.front();
      if (started_) recent.largest_N = largest_N_;
      if (thumbnail_) keep_thumbnail(recent.input, *thumbnail_, *shown_.settings);
    }
    std::tie(shown_.settings->width, shown_.settings->height) = window_.size();
  }
  background_.finish();
  session_.rethrow();

  update_stats();
  report.shown = stats_.shown;
  report.seconds = started_ ? seconds_between(start_, end_) : 0;
  report.shown_per_s = report.seconds > 0 ? static_cast<double>(report.shown) / report.seconds : 0;
  report.draw_median_ms = draw_.percentiles().p50_ms;
  report.mesh_columns = governor_.columns();
  report.sources_requested = sources_requested_;
  return report;
}

void Display::show(LiveReport& report) {
  bool at_end = false;
  while (!window_.close_requested() && !session_.ending()) {
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
    if (options_.max_seconds > 0 && seconds_between(start_, Clock::now()) >= options_.max_seconds) break;
    // The newest result is taken when there is room for its picture, not before it has to wait for that.
    while (auto finished = window_.poll_finished(window_.in_flight() >= Window::kPicturesInFlight))
      retire(*finished);
    if (drawing_.empty()) {
      for (Measured& m : std::exchange(replaced_, {})) give_back(m);
    }

    auto newest = session_.to_display.take(restless_ > 0 ? milliseconds(0) : milliseconds(5));
    const bool is_new = newest.has_value();
    if (is_new) {
      if (current_) replaced_.push_back(std::move(*current_));
      current_ = std::move(newest);
      if (options_.on_newest) options_.on_newest(current_->captured->frame, current_->result);
      scene_.follow(current_->result.touch, current_->captured->position);
      follow_thumbnail();
      if (!started_) start_ = Clock::now();
      started_ = true;
      end_ = Clock::now();
    } else if (!at_end && session_.to_display.finished()) {
      if (session_.failed()) break;
      at_end = true;
      stats_.note = "end of recording";
      restless_ = 3;
      if (options_.close_at_end) break;
    }
    follow_map(is_new);
    update_stats();
    const bool still = !is_new && restless_ == 0 && is_still();
    if (!current_ || (!is_new && restless_ == 0 && !still)) {
      if (at_end) glfwWaitEventsTimeout(0.05);  // a closed mailbox no longer waits for us
      continue;
    }
    if (!is_new && !still) --restless_;

    if (window_.minimised()) {
      glfwWaitEventsTimeout(0.05);
      continue;
    }
    if (!draw(is_new, still)) continue;
    carry_out_requests();
    if (sources_requested_) break;
  }
  while (auto finished = window_.poll_finished(true)) retire(*finished);
}

}  // namespace palpate::viz
