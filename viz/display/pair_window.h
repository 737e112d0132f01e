// Two fingers live in one window.
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "capture/pair/pair_recording.h"
#include "capture/pair/pair_run.h"
#include "palpate/sensor.h"
#include "viz/display/window_run.h"
#include "viz/panels/actions/help.h"

namespace palpate::viz {

/// What the window shows and does.
struct PairWindowRun {
  WindowRun window;                    ///< of replays nothing; notes: for snapshots and marks
  std::array<Sensor, 2> sensors;       ///< left, right
  std::optional<KnownGrip> grip;       ///< for what it shows of both
  PairRecording* recording = nullptr;  ///< what W starts and ends; null: nothing can be
};

/// Keys of the window, for its help.
std::vector<KeyHelp> pair_keys();

/// Main thread, but for add().
class PairWindow : public PairViewer {
 public:
  /// Opens the window. Throws Error.
  PairWindow(gpu::Context& context, PairWindowRun run);
  ~PairWindow() override;
  PairWindow(const PairWindow&) = delete;
  PairWindow& operator=(const PairWindow&) = delete;

  /// Each pair and each frame alone, in order; any thread.
  void add(const Matched<FingerTouch>& pair);
  /// Why a finger gives no frames; empty: it does.
  void set_state(Side side, const std::string& state);

  bool show(const std::array<RunningFinger*, 2>& fingers) override;
  LiveReport let_go(Side side, RunningFinger& finger) override;
  void detach() override;
  void attach() override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate::viz
