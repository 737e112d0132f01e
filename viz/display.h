// The main thread of a live session: window, mouse, keys, pictures, statistics.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "viz/live.h"
#include "viz/live_session.h"
#include "viz/scene.h"
#include "viz/window.h"

namespace palpate::viz {

/// Events a second over the last second or two.
class Rate {
 public:
  /// `count`: events so far.
  double update(uint64_t count, std::chrono::steady_clock::time_point now);

 private:
  struct Mark {
    std::chrono::steady_clock::time_point at;
    uint64_t count;
  };
  std::deque<Mark> marks_;
};

class Display {
 public:
  /// Opens the window. Throws as Window does.
  Display(gpu::Context& context, const Sensor& sensor, const LiveOptions& options, LiveSession& session,
          LatencyLog& latency);

  /// Shows what comes until the window is closed or the session ends; rethrows what the other threads threw.
  LiveReport run();

 private:
  using Clock = std::chrono::steady_clock;
  struct Drawing {
    uint64_t picture = 0;
    bool is_new = false;  ///< first picture of its result
    FrameTimes times;
    std::vector<Measured> replaced;  ///< earlier result, in use until this picture's predecessor is finished
  };

  bool draw(bool is_new);
  void retire(const Finished& finished);
  void handle_input();
  void handle_key(int key, bool shift);
  void handle_player_key(int key, bool shift);
  void jump(double seconds);
  void switch_recording();
  void save_screenshot();
  void update_stats();
  void update_player();
  void give_back(Measured& m) {
    session_.results.put(m.result);
    session_.frames.put(std::move(m.captured));
  }

  const LiveOptions& options_;
  LiveSession& session_;
  LatencyLog& latency_;
  Window window_;
  Scene scene_;
  MeshGovernor governor_;
  std::optional<Measured> current_;
  std::vector<Measured> replaced_;  ///< no longer current; perhaps still read by pictures in flight
  std::deque<Drawing> drawing_;
  LiveStats stats_;
  Rate captured_rate_, processed_rate_, shown_rate_;
  Clock::time_point stats_due_{};
  RecentDurations recent_to_measured_, recent_to_shown_;
  Durations draw_;
  int restless_ = 3;  ///< pictures still to draw after an input: ImGui settles over two
  std::pair<double, double> last_mouse_{-1, -1};
  std::pair<int, int> last_size_{0, 0};
  int screenshots_ = 0;
};

}  // namespace palpate::viz
