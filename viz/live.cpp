#include "viz/live.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <deque>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include "engine/error.h"
#include "engine/gpu/context.h"
#include "viz/mailbox.h"
#include "viz/picture.h"
#include "viz/scene.h"
#include "viz/window.h"

namespace palpate::viz {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

double seconds_between(Clock::time_point a, Clock::time_point b) {
  return std::chrono::duration<double>(b - a).count();
}

struct Captured {
  Frame frame;
  Clock::time_point at;  ///< when the source delivered it
};
using CapturedPtr = std::unique_ptr<Captured>;

struct Measured {
  CapturedPtr captured;
  Result result;
};

/// Things handed back to the thread that owns them.
template <typename T>
class ReturnTray {
 public:
  void put(T item) {
    const std::lock_guard lock(mutex_);
    items_.push_back(std::move(item));
  }
  std::vector<T> take_all() {
    const std::lock_guard lock(mutex_);
    return std::exchange(items_, {});
  }

 private:
  std::mutex mutex_;
  std::vector<T> items_;
};

/// Median and 95th percentile; zeros without samples.
std::pair<double, double> median_p95(std::vector<double> samples) {
  if (samples.empty()) return {0, 0};
  std::sort(samples.begin(), samples.end());
  const auto at = [&](double q) {
    return samples[static_cast<size_t>(q * static_cast<double>(samples.size() - 1))];
  };
  return {at(0.5), at(0.95)};
}

/// Events a second over the last second or two.
class Rate {
 public:
  double update(uint64_t count, Clock::time_point now) {
    marks_.push_back({now, count});
    while (marks_.size() > 2 && seconds_between(marks_.front().at, now) > 2) marks_.pop_front();
    const double span_s = seconds_between(marks_.front().at, now);
    return span_s > 0.2 ? static_cast<double>(count - marks_.front().count) / span_s : 0;
  }

 private:
  struct Mark {
    Clock::time_point at;
    uint64_t count;
  };
  std::deque<Mark> marks_;
};

/// What the threads share. Threads end when `stop` is set or their input is finished; the first error wins.
struct Shared {
  Mailbox<CapturedPtr> to_engine;
  Mailbox<Measured> to_display;
  ReturnTray<Result> results;      ///< back to the engine, which releases their slots
  ReturnTray<CapturedPtr> frames;  ///< back to capture, which fills them again
  std::atomic<bool> stop{false};
  std::atomic<bool> paused{false};
  std::atomic<uint64_t> captured{0};
  std::atomic<uint64_t> processed{0};

  void fail(std::exception_ptr error) {
    const std::lock_guard lock(mutex_);
    if (!error_) error_ = error;
  }
  void rethrow() {
    const std::lock_guard lock(mutex_);
    if (error_) std::rethrow_exception(error_);
  }

 private:
  std::mutex mutex_;
  std::exception_ptr error_;
};

void capture_loop(Shared& shared, std::unique_ptr<Source> source,
                  const std::function<std::unique_ptr<Source>()>& open, const LiveOptions& options) {
  const double rate_Hz = options.rate_Hz > 0     ? options.rate_Hz
                         : source->rate_Hz() > 0 ? source->rate_Hz()
                                                 : 10;
  const auto period = std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1 / rate_Hz));
  Clock::time_point due = Clock::now();
  std::vector<CapturedPtr> spare;
  int64_t loop_offset_ns = 0, last_time_ns = 0;
  uint64_t frames_in_this_round = 0, sequence = 0;
  while (!shared.stop) {
    if (shared.paused) {
      std::this_thread::sleep_for(milliseconds(10));
      due = Clock::now();
      continue;
    }
    for (CapturedPtr& used : shared.frames.take_all()) spare.push_back(std::move(used));
    CapturedPtr item = spare.empty() ? std::make_unique<Captured>() : std::move(spare.back());
    if (!spare.empty()) spare.pop_back();
    if (!source->next(item->frame)) {
      if (!options.loop || frames_in_this_round == 0) break;
      source = open();
      // Time goes on across the seam, one period after the last frame.
      loop_offset_ns = last_time_ns + std::chrono::nanoseconds(period).count();
      frames_in_this_round = 0;
      spare.push_back(std::move(item));
      continue;
    }
    ++frames_in_this_round;
    if (options.loop) {
      item->frame.time_ns += loop_offset_ns;
      item->frame.sequence = sequence;
    }
    ++sequence;
    last_time_ns = item->frame.time_ns;
    std::this_thread::sleep_until(due);
    const Clock::time_point now = Clock::now();
    due = std::max(due + period, now - period);  // a slow source is not chased
    item->at = now;
    if (auto displaced = shared.to_engine.put(std::move(item))) spare.push_back(std::move(*displaced));
    if (++shared.captured == options.max_frames) break;
  }
}

void engine_loop(Shared& shared, Pipeline& pipeline, const LiveOptions& options) {
  const auto release_returned = [&] {
    for (const Result& r : shared.results.take_all()) pipeline.release(r);
  };
  while (!shared.stop && !shared.to_engine.finished()) {
    release_returned();
    auto captured = shared.to_engine.take(milliseconds(20));
    if (!captured) continue;
    while (!pipeline.submit((*captured)->frame)) {
      if (shared.stop) return;
      std::this_thread::sleep_for(milliseconds(1));  // every slot is held by the display
      release_returned();
    }
    Result result = pipeline.wait().value();
    ++shared.processed;
    if (options.on_result) options.on_result(result.touch);
    if (auto displaced = shared.to_display.put({std::move(*captured), result})) {
      pipeline.release(displaced->result);
      shared.frames.put(std::move(displaced->captured));
    }
  }
}

/// The main thread's part: window, mouse, keys, pictures.
class Display {
 public:
  Display(gpu::Context& context, const Sensor& sensor, const LiveOptions& options, Shared& shared)
      : options_(options),
        shared_(shared),
        window_(context, {options.title, options.width, options.height, options.vsync}),
        scene_(context, window_.pass(), sensor, Window::kPicturesInFlight, window_.handle(), window_.scale()),
        governor_(!context.is_software(), 22) {
    scene_.state().vsync = window_.vsync();
  }

  LiveReport run();

 private:
  struct Drawing {
    uint64_t picture = 0;
    bool is_new = false;  ///< first picture of its result
    Clock::time_point captured_at;
    std::vector<Measured> replaced;  ///< earlier result, in use until this picture's predecessor is finished
  };

  bool draw(bool is_new, std::vector<Measured>& replaced);
  void retire(const Finished& finished);
  void handle_input();
  void handle_key(int key);
  void save_screenshot();
  void update_stats();
  void give_back(Measured& m) {
    shared_.results.put(m.result);
    shared_.frames.put(std::move(m.captured));
  }

  const LiveOptions& options_;
  Shared& shared_;
  Window window_;
  Scene scene_;
  MeshGovernor governor_;
  std::optional<Measured> current_;
  std::vector<Measured> replaced_;  ///< no longer current; perhaps still read by pictures in flight
  std::deque<Drawing> drawing_;
  LiveStats stats_;
  Rate captured_rate_, processed_rate_, shown_rate_;
  Clock::time_point stats_due_{};
  std::deque<double> recent_latency_ms_;
  std::vector<double> latency_ms_, draw_ms_;
  int restless_ = 3;  ///< pictures still to draw after an input: ImGui settles over two
  std::pair<double, double> last_mouse_{-1, -1};
  std::pair<int, int> last_size_{0, 0};
  int screenshots_ = 0;
};

void Display::retire(const Finished& finished) {
  draw_ms_.push_back(finished.draw_ms);
  governor_.record(finished.draw_ms);
  Drawing done = std::move(drawing_.front());
  drawing_.pop_front();
  if (done.is_new) {
    const double ms = 1e3 * seconds_between(done.captured_at, finished.at);
    latency_ms_.push_back(ms);
    recent_latency_ms_.push_back(ms);
    if (recent_latency_ms_.size() > 120) recent_latency_ms_.pop_front();
    ++stats_.shown;
  }
  // Whatever this picture's result replaced was drawn before it, and is finished too.
  for (Measured& m : done.replaced) give_back(m);
}

bool Display::draw(bool is_new, std::vector<Measured>& replaced) {
  while (window_.in_flight() >= Window::kPicturesInFlight) retire(*window_.poll_finished(true));
  if (!window_.begin_picture()) return false;
  Drawing d;
  d.is_new = is_new;
  d.captured_at = current_->captured->at;
  scene_.record(window_.cmd(), window_.extent(),
                {current_->captured->frame, current_->result.touch, current_->result.surface},
                governor_.columns(), &stats_, [&] {
                  handle_input();  // between ImGui's begin and end, while its input is fresh
                  window_.begin_pass();
                });
  const bool screenshot = std::exchange(scene_.state().wants_screenshot, false);
  d.picture = window_.end_picture(screenshot);
  d.replaced = std::exchange(replaced, {});
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
    if (!io.WantTextInput) handle_key(key);
  }
}

void Display::handle_key(int key) {
  ViewState& state = scene_.state();
  switch (key) {
    case GLFW_KEY_ESCAPE:
    case GLFW_KEY_Q:
      glfwSetWindowShouldClose(window_.handle(), GLFW_TRUE);
      break;
    case GLFW_KEY_SPACE:
      state.paused = !state.paused;
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

void Display::update_stats() {
  const Clock::time_point now = Clock::now();
  if (now < stats_due_) return;
  stats_due_ = now + milliseconds(250);
  stats_.captured = shared_.captured;
  stats_.processed = shared_.processed;
  stats_.dropped_before_engine = shared_.to_engine.displaced();
  stats_.dropped_before_display = shared_.to_display.displaced();
  stats_.captured_per_s = captured_rate_.update(stats_.captured, now);
  stats_.processed_per_s = processed_rate_.update(stats_.processed, now);
  stats_.shown_per_s = shown_rate_.update(stats_.shown, now);
  std::tie(stats_.latency_median_ms, stats_.latency_p95_ms) =
      median_p95({recent_latency_ms_.begin(), recent_latency_ms_.end()});
  stats_.draw_ms = governor_.typical_ms();
}

LiveReport Display::run() {
  LiveReport report;
  Clock::time_point start = Clock::now(), end = start;
  bool started = false, at_end = false;
  while (!window_.wants_close() && !shared_.stop) {
    glfwPollEvents();
    double x = 0, y = 0;
    int width = 0, height = 0;
    glfwGetCursorPos(window_.handle(), &x, &y);
    glfwGetFramebufferSize(window_.handle(), &width, &height);
    const ImGuiIO& io = ImGui::GetIO();
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

    auto newest = shared_.to_display.take(restless_ > 0 ? milliseconds(0) : milliseconds(5));
    const bool is_new = newest.has_value();
    if (is_new) {
      if (current_) replaced_.push_back(std::move(*current_));
      current_ = std::move(newest);
      scene_.follow(current_->result.touch);
      if (!started) start = current_->captured->at;
      started = true;
      end = Clock::now();
    } else if (!at_end && shared_.to_display.finished()) {
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
    if (!draw(is_new, replaced_)) continue;
    ViewState& state = scene_.state();
    window_.set_vsync(state.vsync);
    state.vsync = window_.vsync();
    if (state.paused != shared_.paused) {
      shared_.paused = state.paused;
      stats_.note = state.paused ? "paused" : "";
      restless_ = 3;
    }
  }
  while (auto finished = window_.poll_finished(true)) retire(*finished);
  shared_.rethrow();

  update_stats();
  report.captured = shared_.captured;
  report.processed = shared_.processed;
  report.shown = stats_.shown;
  report.dropped_before_engine = shared_.to_engine.displaced();
  report.dropped_before_display = shared_.to_display.displaced();
  report.seconds = started ? seconds_between(start, end) : 0;
  report.shown_per_s = report.seconds > 0 ? static_cast<double>(report.shown) / report.seconds : 0;
  std::tie(report.latency_median_ms, report.latency_p95_ms) = median_p95(latency_ms_);
  report.draw_median_ms = median_p95(draw_ms_).first;
  report.mesh_columns = governor_.columns();
  return report;
}

}  // namespace

LiveReport run_live(gpu::Context& context, const std::function<std::unique_ptr<Source>()>& open,
                    const Sensor& sensor, const Frame& background, PipelineOptions pipeline_options,
                    const LiveOptions& options) {
  std::unique_ptr<Source> source = open();
  Shared shared;
  // Current picture, pictures in flight, mailbox, engine.
  pipeline_options.slots =
      std::max(pipeline_options.slots, context.is_software() ? 4u : Window::kPicturesInFlight + 3);
  Pipeline pipeline(context, sensor, source->format(), pipeline_options);
  pipeline.set_background(background);
  Display display(context, sensor, options, shared);

  const auto guarded = [&shared](auto work, auto finish) {
    try {
      work();
    } catch (...) {
      shared.fail(std::current_exception());
      shared.stop = true;
    }
    finish();
  };
  std::thread engine(
      [&] { guarded([&] { engine_loop(shared, pipeline, options); }, [&] { shared.to_display.close(); }); });
  std::thread capture([&] {
    guarded([&] { capture_loop(shared, std::move(source), open, options); },
            [&] { shared.to_engine.close(); });
  });
  struct Join {
    Shared& shared;
    std::thread& capture;
    std::thread& engine;
    void now() {
      shared.stop = true;
      if (capture.joinable()) capture.join();
      if (engine.joinable()) engine.join();
    }
    ~Join() { now(); }
  } join{shared, capture, engine};
  LiveReport report = display.run();
  join.now();
  shared.rethrow();
  return report;
}

}  // namespace palpate::viz
