#include "viz/display/pair_window.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <algorithm>
#include <chrono>
#include <deque>
#include <mutex>
#include <optional>
#include <string_view>
#include <utility>

#include "capture/files/event_log.h"
#include "engine/base/background_work.h"
#include "engine/gpu/context.h"
#include "engine/pipeline/surface_map.h"
#include "palpate/error.h"
#include "viz/display/pair_view.h"
#include "viz/display/picture.h"
#include "viz/display/snapshot.h"
#include "viz/live/rate.h"
#include "viz/live/tare.h"
#include "viz/panels/actions/actions.h"
#include "viz/panels/drag_view.h"
#include "viz/panels/settings.h"
#include "viz/render/drawing.h"
#include "viz/render/format.h"
#include "viz/render/window.h"

namespace palpate::viz {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

// Limit of a picture on a CPU driver, where two fingers measure on the same cores.
constexpr double kPairBudget_ms = 22;
constexpr size_t kMostRows = 4096;  // that wait for a picture

/// What a window of two fingers has of the actions of one.
bool is_of_two(const Action& action) {
  constexpr std::string_view kLetters = "RTOAELGYKJPZWSMUVHQ";
  static const std::vector<KeyPress> kOthers = {with_shift('Z'),
                                                {GLFW_KEY_PAGE_UP},
                                                {GLFW_KEY_PAGE_DOWN},
                                                {GLFW_KEY_EQUAL},
                                                {GLFW_KEY_MINUS},
                                                {GLFW_KEY_LEFT_BRACKET},
                                                {GLFW_KEY_RIGHT_BRACKET},
                                                {GLFW_KEY_F11},
                                                {GLFW_KEY_ESCAPE},
                                                control(GLFW_KEY_EQUAL),
                                                control(GLFW_KEY_MINUS),
                                                with_alt(GLFW_KEY_PAGE_UP),
                                                with_alt(GLFW_KEY_PAGE_DOWN)};
  if (action.chords.empty()) return false;
  const KeyPress& chord = action.chords.front();
  if (chord == KeyPress{chord.key} && chord.key < 128 &&
      kLetters.find(static_cast<char>(chord.key)) != std::string_view::npos)
    return true;
  // With Alt the arrows turn the surface, with Shift as well they move it.
  const bool arrow = chord.key == GLFW_KEY_LEFT || chord.key == GLFW_KEY_RIGHT || chord.key == GLFW_KEY_UP ||
                     chord.key == GLFW_KEY_DOWN;
  return (arrow && chord == with_alt(chord.key, chord.shift)) ||
         std::ranges::find(kOthers, chord) != kOthers.end();
}

struct Button {
  const char* face;
  KeyPress key;
};
constexpr Button kButtons[] = {
    {"Record", {'W'}}, {"Zero", {'Z'}}, {"Snapshot", {'S'}}, {"Mark", {'M'}}, {"Help", {'H'}}};

}  // namespace

std::vector<KeyHelp> pair_keys() {
  return key_help({.has_surface = true}, is_of_two);
}

struct PairWindow::Impl {
  Impl(gpu::Context& device, PairWindowRun given)
      : context(device),
        run(std::move(given)),
        governor(!device.is_software(), kPairBudget_ms),
        meter(run.grip) {
    if (!run.window.window) {
      WindowOptions as{run.window.title, run.window.width, run.window.height, run.window.vsync};
      if (run.window.settings) as.width = run.window.settings->width, as.height = run.window.settings->height;
      run.window.window = &own.emplace(context, as);
    }
    make_view();
    if (run.window.settings) view->state().choose(run.window.settings->view);
    view->state().quantity = Quantity::Depth;
    if (!run.window.notes.empty()) note = "snapshots (S) and marks (M) go to " + run.window.notes.string();
  }

  /// A result's picture in flight.
  struct Drawing {
    std::array<std::optional<FrameTimes>, 2> times;  ///< of results that it is the first picture of
    std::array<std::vector<Measured>, 2> replaced;   ///< in use until this picture's predecessor is finished
  };

  Window& window() { return *run.window.window; }
  void make_view() {
    view.emplace(context, window().pass(), run.sensors, Window::kPicturesInFlight, window().handle(),
                 window().scale());
    if (remade) view->state() = *std::exchange(remade, std::nullopt);
  }

  void take(const std::array<RunningFinger*, 2>& fingers);
  bool draw();
  void retire(double draw_ms);
  void drain();
  void words(const PairLayout& layout);
  void keys();
  void carry_out();
  void switch_recording();
  void zero(bool on);
  void mark();
  void snapshot();
  void log_event(const char* kind, const std::string& words);
  std::filesystem::path notes() const {
    return run.recording && run.recording->on() ? run.recording->latest().folder : run.window.notes;
  }
  PairContent content();
  bool moved();

  gpu::Context& context;
  PairWindowRun run;
  std::optional<Window> own;
  std::optional<ViewState> remade;  ///< while there is no view
  std::optional<PairView> view;
  MeshGovernor governor;
  std::array<RunningFinger*, 2> running{};
  std::array<std::optional<Measured>, 2> current;
  std::array<bool, 2> is_new{};
  std::array<std::vector<Measured>, 2> replaced;
  std::deque<Drawing> drawing;
  std::array<LiveReport, 2> shown;
  std::array<Clock::time_point, 2> began{}, ended{};
  std::array<Rate, 2> rates;
  std::array<double, 2> per_s{};
  std::array<std::string, 2> states;
  Clock::time_point stats_due{};
  std::string note, failed;
  bool recording = false;
  int restless = 3, snapshots = 0, marks = 0;
  std::array<double, 5> mouse{};
  BackgroundWork background;

  std::mutex mutex;  ///< of what add() has
  PairMeter meter;
  std::array<Tare, 2> tares;
  std::deque<GripFrame> rows;
  std::optional<GripFrame> newest;
};

PairWindow::PairWindow(gpu::Context& context, PairWindowRun run)
    : impl_(std::make_unique<Impl>(context, std::move(run))) {}

PairWindow::~PairWindow() {
  Settings* settings = impl_->run.window.settings;
  if (!settings) return;
  if (impl_->view)
    settings->view = impl_->view->state().chosen(settings->view);
  else if (impl_->remade)
    settings->view = impl_->remade->chosen(settings->view);
  std::tie(settings->width, settings->height) = impl_->window().size();
}

void PairWindow::add(const Matched<FingerTouch>& pair) {
  Impl& m = *impl_;
  const std::lock_guard lock(m.mutex);
  Matched<FingerTouch> less = pair;
  for (size_t i = 0; i < 2; ++i)
    if (less.of[i]) less.of[i]->touch = tared(less.of[i]->touch, m.tares[i]);
  const GripFrame row = m.meter.add(less);
  if (row.grip) m.newest = row;
  m.rows.push_back(row);
  if (m.rows.size() > kMostRows) m.rows.pop_front();
}

void PairWindow::set_state(Side side, const std::string& state) {
  impl_->states[index(side)] = state;
  impl_->restless = 3;
}

/// The newest results of both.
void PairWindow::Impl::take(const std::array<RunningFinger*, 2>& fingers) {
  running = fingers;
  bool any = false;
  for (size_t i = 0; i < 2; ++i) {
    if (!fingers[i]) continue;
    auto measured = fingers[i]->session.to_display.take(milliseconds(restless > 0 || any || i == 0 ? 0 : 4));
    if (!measured) continue;
    any = is_new[i] = true;
    if (current[i]) replaced[i].push_back(std::move(*current[i]));
    current[i] = std::move(measured);
    if (const auto& tell = fingers[i]->options.on_newest)
      tell(current[i]->captured->frame, current[i]->result);
    view->follow(current[i]->result.touch);
    if (began[i] == Clock::time_point{}) began[i] = Clock::now();
    ended[i] = Clock::now();
    restless = std::max(restless, 1);
  }
  std::deque<GripFrame> fresh;
  {
    const std::lock_guard lock(mutex);
    fresh.swap(rows);
  }
  for (const GripFrame& row : fresh) view->follow(row);
  if (const auto wrote = background.take_note()) note = *wrote, restless = 3;
  const Clock::time_point now = Clock::now();
  if (now < stats_due) return;
  stats_due = now + milliseconds(250);
  for (size_t i = 0; i < 2; ++i)
    if (fingers[i]) per_s[i] = rates[i].update(fingers[i]->session.processed, now);
  if (!run.recording) return;
  recording = run.recording->on();
  failed = run.recording->latest().error();
}

/// Something that changes the picture has happened.
bool PairWindow::Impl::moved() {
  double x = 0, y = 0;
  int width = 0, height = 0;
  GLFWwindow* handle = window().handle();
  glfwGetCursorPos(handle, &x, &y);
  glfwGetFramebufferSize(handle, &width, &height);
  const double held = glfwGetMouseButton(handle, GLFW_MOUSE_BUTTON_LEFT) == GLFW_PRESS ||
                      glfwGetMouseButton(handle, GLFW_MOUSE_BUTTON_RIGHT) == GLFW_PRESS;
  const std::array<double, 5> now{x, y, double(width), double(height), held};
  return std::exchange(mouse, now) != now || held > 0 || window().has_keys() ||
         ImGui::GetIO().MouseWheel != 0;
}

void PairWindow::Impl::retire(double draw_ms) {
  Drawing done = std::move(drawing.front());
  drawing.pop_front();
  governor.record(draw_ms);
  const int64_t now_ns = monotonic_ns();
  for (size_t i = 0; i < 2; ++i) {
    if (done.times[i]) {
      done.times[i]->shown_ns = now_ns;
      if (running[i]) running[i]->latency.add(*done.times[i]);
      ++shown[i].shown;
    }
    for (Measured& m : done.replaced[i])
      if (running[i]) running[i]->session.give_back(m);
  }
}

/// Waits until no picture is drawn any more; on a lost device none is.
void PairWindow::Impl::drain() {
  try {
    while (const auto finished = window().poll_finished(true)) retire(finished->draw_ms);
  } catch (const DeviceLost&) {
  }
  while (!drawing.empty()) retire(governor.typical_ms());
}

PairContent PairWindow::Impl::content() {
  PairContent content;
  content.note = note;
  content.recording = recording;
  content.failed = failed;
  const std::lock_guard lock(mutex);
  content.grip = newest;
  content.zeroed = tares[0].on || tares[1].on;
  for (size_t i = 0; i < 2; ++i) {
    ShownTouch& finger = content.fingers[i];
    finger.state = states[i];
    finger.measured_per_s = per_s[i];
    if (!current[i]) continue;
    finger.frame = &current[i]->captured->frame;
    finger.touch = &current[i]->result.touch;
    finger.result = &current[i]->result;
    finger.tared = tared(*finger.touch, tares[i]);
  }
  return content;
}

void PairWindow::Impl::keys() {
  ViewState& state = view->state();
  for (size_t i = 0; i < 2; ++i) {
    drag_view(view->eye(i), view->layout().surfaces[i], state.camera);
    if (ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left) &&
        inside(view->layout().surfaces[i], ImGui::GetIO().MousePos))
      state.camera = {};
  }
  const Circumstances now{.has_surface = true};
  for (const KeyPress& press : window().take_keys())
    if (const Action* action = action_of(press, now); action && is_of_two(*action)) action->run(state);
}

/// Buttons and the note at the foot; the help over all.
void PairWindow::Impl::words(const PairLayout& layout) {
  keys();
  ViewState& state = view->state();
  const Circumstances now{.has_surface = true};
  ImGui::SetNextWindowPos(corner(layout.foot));
  ImGui::SetNextWindowSize(size_of(layout.foot));
  ImGui::Begin("buttons", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
                   ImGuiWindowFlags_NoBackground | ImGuiWindowFlags_NoNav);
  for (const Button& button : kButtons) {
    const Action* action = action_of(button.key, now);
    const bool ends = recording && button.key.key == 'W';
    const std::string face =
        std::string(ends ? "Stop" : button.face) + " (" + words_of(button.key) + ")##" + button.face;
    if (ImGui::Button(face.c_str())) action->run(state);
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", action->name.c_str());
    ImGui::SameLine();
  }
  ImGui::TextDisabled("%s", shortened(note, std::max(1.0f, ImGui::GetContentRegionAvail().x)).c_str());
  ImGui::End();
  if (state.help) help_window(window().extent(), view->frame().scale(), pair_keys(), state.help);
}

bool PairWindow::Impl::draw() {
  if (!window().begin_picture()) return false;
  const PairContent shown_now = content();
  Drawing picture;
  for (size_t i = 0; i < 2; ++i)
    if (std::exchange(is_new[i], false) && current[i]) picture.times[i] = current[i]->times;
  view->record(
      window().cmd(), window().extent(), shown_now, governor.columns(),
      [this](const PairLayout& layout) { words(layout); }, [this] { window().begin_pass(); });
  const bool saves = std::exchange(view->state().snapshot_requested, false);
  window().end_picture(saves);
  picture.replaced = std::exchange(replaced, {});
  drawing.push_back(std::move(picture));
  if (saves) snapshot();
  return true;
}

void PairWindow::Impl::snapshot() {
  auto image = window().captured();
  if (!image || notes().empty()) {
    note = image ? kNoFolder : "snapshots are not possible on this display";
    return;
  }
  const std::filesystem::path stem = next_file(notes(), "palpate", snapshots);
  background.add([image = std::move(*image), file = stem.string() + ".png"] {
    make_output_folder(std::filesystem::path(file).parent_path());
    write_png(image, file);
    return std::string();
  });
  for (const Side side : kSides) {
    const auto& measured = current[index(side)];
    if (!measured) continue;
    const Sensor& sensor = run.sensors[index(side)];
    const Outputs outputs =
        surface_of(measured->result).buffer ? Output::Force | Output::Surface : Outputs(Output::Force);
    Snapshot one = snapshot_of(measured->captured->frame, measured->result,
                               MeasuredColumns::of(sensor, outputs), sensor.pitch_mm_per_px);
    background.add([one = std::make_shared<Snapshot>(std::move(one)), stem, side] {
      write_snapshot(*one, stem.string() + "-" + to_string(side));
      return "wrote " + stem.string() + ".png, and frame, depth and numbers of both";
    });
  }
}

void PairWindow::Impl::switch_recording() {
  if (!run.recording) {
    note = kNoFolder;
    return;
  }
  try {
    if (run.recording->on()) {
      run.recording->stop();
      note = "wrote " + run.recording->latest().folder.string();
    } else {
      run.recording->start();
      note.clear();
    }
  } catch (const Error& error) {
    note = error.what();  // a full disk must not end a measurement
  }
  stats_due = {};
}

void PairWindow::Impl::log_event(const char* kind, const std::string& words) {
  std::optional<GripFrame> row;
  {
    const std::lock_guard lock(mutex);
    row = newest;
  }
  const Event event{row && row->left ? *row->left : 0, row ? 1e-9 * static_cast<double>(row->time_ns) : 0,
                    kind, words};
  const std::filesystem::path folder = notes();
  if (folder.empty()) {
    note = kNoFolder;
    return;
  }
  background.add([folder, event] {
    append_event(folder, event);
    return text("'%s' in %s", label_of(event).c_str(), (folder / "events.csv").c_str());
  });
}

void PairWindow::Impl::mark() {
  log_event("mark", std::to_string(++marks));
}

void PairWindow::Impl::zero(bool on) {
  std::string words;
  {
    const std::lock_guard lock(mutex);
    if (!on && !tares[0].on && !tares[1].on) return;
    for (const Side side : kSides) {
      Tare& tare = tares[index(side)];
      if (!on)
        tare = {};
      else if (current[index(side)] && tare.set(current[index(side)]->result.touch))
        words += (words.empty() ? "" : "; ") + std::string(to_string(side)) + " " + tare.words();
    }
    meter.restart();
  }
  if (on && words.empty())
    note = "nothing to zero: nothing touches the pads, or there is no force calibration";
  else
    log_event(on ? "zero" : "zero ended", on ? words : "as measured");
}

/// Between two pictures.
void PairWindow::Impl::carry_out() {
  ViewState& state = view->state();
  const auto requested = [this](bool& request) {
    if (!std::exchange(request, false)) return false;
    restless = 3;
    return true;
  };
  if (requested(state.next_vsync_requested)) {
    do {
      state.vsync = static_cast<Vsync>((static_cast<int>(state.vsync) + 1) % 3);
    } while (!window().offers(state.vsync));
    window().set_vsync(state.vsync);
  }
  if (requested(state.recording_switched_requested)) switch_recording();
  if (requested(state.zero_requested)) zero(true);
  if (requested(state.zero_cleared_requested)) zero(false);
  if (requested(state.mark_requested)) mark();
  if (requested(state.full_screen_requested)) window().switch_full_screen();
  if (state.close_requested) glfwSetWindowShouldClose(window().handle(), GLFW_TRUE);
}

bool PairWindow::show(const std::array<RunningFinger*, 2>& fingers) {
  Impl& m = *impl_;
  glfwPollEvents();
  if (m.window().close_requested()) return false;
  if (m.moved()) m.restless = 3;
  while (const auto finished = m.window().poll_finished(m.window().in_flight() >= Window::kPicturesInFlight))
    m.retire(finished->draw_ms);
  if (m.drawing.empty())
    for (size_t i = 0; i < 2; ++i)
      for (Measured& one : std::exchange(m.replaced[i], {}))
        if (m.running[i]) m.running[i]->session.give_back(one);
  m.take(fingers);
  const bool any = m.is_new[0] || m.is_new[1];
  if (!any && m.restless <= 0) {
    if (!fingers[1]) std::this_thread::sleep_for(milliseconds(4));
    return true;
  }
  if (m.window().minimised()) {
    glfwWaitEventsTimeout(0.05);
    return true;
  }
  if (!any) --m.restless;
  if (m.draw()) m.carry_out();
  return true;
}

LiveReport PairWindow::let_go(Side side, RunningFinger& finger) {
  Impl& m = *impl_;
  const size_t i = index(side);
  m.drain();
  for (Measured& one : std::exchange(m.replaced[i], {})) finger.session.give_back(one);
  if (m.current[i]) {
    if (std::exchange(m.is_new[i], false)) finger.latency.add(m.current[i]->times);
    finger.session.give_back(*m.current[i]);
    m.current[i].reset();
  }
  m.running[i] = nullptr;
  LiveReport report = std::exchange(m.shown[i], {});
  report.seconds = std::chrono::duration<double>(m.ended[i] - m.began[i]).count();
  report.shown_per_s = report.seconds > 0 ? static_cast<double>(report.shown) / report.seconds : 0;
  report.draw_median_ms = m.governor.typical_ms();
  report.mesh_columns = m.governor.columns();
  m.began[i] = m.ended[i] = {};
  m.restless = 3;
  return report;
}

void PairWindow::detach() {
  Impl& m = *impl_;
  if (!m.view) return;
  m.drain();
  m.background.finish();
  m.remade = m.view->state();
  m.view.reset();
  m.window().detach();
}

void PairWindow::attach() {
  Impl& m = *impl_;
  m.window().attach();
  m.make_view();
  m.note = "the device was lost and opened anew: the terminal says more";
  m.restless = 3;
}

}  // namespace palpate::viz
