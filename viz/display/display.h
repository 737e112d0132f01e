// The main thread of a live session: window, mouse, keys, pictures, statistics.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "capture/files/measurements.h"
#include "capture/live/live_options.h"
#include "capture/live/session.h"
#include "capture/run/map/growing_map.h"
#include "engine/base/background_work.h"
#include "engine/pipeline/surface_map.h"
#include "viz/display/depth_strip.h"
#include "viz/display/scene.h"
#include "viz/display/window_run.h"
#include "viz/live/rate.h"
#include "viz/render/window.h"

namespace palpate::viz {

/// The measurements, for display.
struct DisplayedSensor {
  const Sensor& sensor;
  const Frame& background;
  Outputs outputs = {};
  bool separate = false;      ///< as PipelineOptions::separate
  GrowingMap* map = nullptr;  ///< of what the pad moves over; null: none is made
};

class Display {
 public:
  /// All must outlive it.
  Display(gpu::Context& context, const DisplayedSensor& what, const LiveOptions& options,
          const WindowRun& shown, LiveSession& session, LatencyLog& latency);

  /// Shows what comes until the window is closed or the session ends; rethrows what the other threads threw.
  LiveReport run();
  /// Results of presses since then, once no more frames come.
  void finish_presses();

 private:
  using Clock = std::chrono::steady_clock;
  struct Drawing {
    uint64_t picture = 0;
    bool is_new = false;  ///< first picture of its result
    bool still = false;   ///< of a picture that stays, with a finer mesh
    FrameTimes times;
    std::vector<Measured> replaced;  ///< earlier result, in use until this picture's predecessor is finished
  };

  void show(LiveReport& report);
  bool draw(bool is_new, bool still);
  bool is_still() const;
  void retire(const Finished& finished);
  void handle_input();
  void handle_key(const KeyPress& press);
  bool has_surface() const { return current_ && surface_of(current_->result).buffer; }
  void go_on_playing();
  void go_to(const PlayRequest& play);
  void jump(double seconds);
  void carry_out_requests();
  void switch_recording();
  void save_snapshot();
  void save_charts(bool table, bool picture);
  void save_chart_picture();
  void switch_zero(bool on);
  void mark_event();
  void log_event(const char* kind, const std::string& words);
  void update_presses();
  void follow_thumbnail();
  void follow_map(bool is_new);
  std::filesystem::path notes_folder() const;
  bool write_event(const Event& event);
  void update_stats();
  void follow_scan();
  void update_player();
  void give_back(Measured& m) { session_.give_back(m); }

  gpu::Context& context_;
  const LiveOptions& options_;
  const WindowRun& shown_;
  LiveSession& session_;
  LatencyLog& latency_;
  Window& window_;
  const MeasuredColumns columns_;
  const double pitch_mm_per_px_;
  Scene scene_;
  const bool software_;  ///< the device draws on the processor
  MeshGovernor governor_;
  bool finest_ = false;           ///< the picture that is shown has the finest mesh
  Clock::time_point drawn_ = {};  ///< when its drawing began
  std::optional<Measured> current_;
  std::vector<Measured> replaced_;  ///< no longer current; perhaps still read by pictures in flight
  std::deque<Drawing> drawing_;
  LiveStats stats_;
  Rate captured_rate_, processed_rate_, shown_rate_;
  Clock::time_point stats_due_{};
  RecentDurations recent_to_measured_, recent_to_shown_;
  Durations draw_;
  bool field_ = false;  ///< letters were typed in a field in the picture before
  int restless_ = 3;    ///< pictures still to draw after an input: ImGui settles over two
  std::pair<double, double> last_mouse_{-1, -1};
  std::pair<int, int> last_size_{0, 0};
  std::optional<RgbImage> thumbnail_;  ///< of the largest contact so far
  double thumbnail_px_ = -1;           ///< area of that contact
  double largest_N_ = 0;               ///< of valid forces
  int snapshots_ = 0, charts_ = 0;
  std::filesystem::path chart_picture_;  ///< of the next picture, in which their menu is closed; empty: none
  int marks_ = 0;
  uint64_t presses_ = 0;  ///< answers that were seen
  GrowingMap* const map_;
  GrowingScan* const scan_;  ///< of presses by hand, in the map's place; null: there are none
  bool sources_requested_ = false;
  bool started_ = false;  ///< the first frame has come
  Clock::time_point start_ = Clock::now(), end_ = start_;
  std::optional<DepthStrip> strip_;  ///< of a recording that is played
  uint32_t strip_looks_ = 0;
  BackgroundWork background_;  ///< last: what it still does may use the rest
};

}  // namespace palpate::viz
