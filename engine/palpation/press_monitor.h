// Presses of a block of tissue as they happen: the loads of each, and an estimate of the lump when it ends.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/background_work.h"
#include "engine/lump/observation/pad_tilt.h"
#include "engine/palpation/press_detector.h"
#include "engine/palpation/press_observation.h"
#include "palpate/touch.h"

namespace palpate {

class GrowingScan;

/// Result of one press.
struct PressAnswer {
  uint64_t press = 0;  ///< number, from 1
  uint64_t first_frame = 0, last_frame = 0;
  double time_s = 0;                         ///< of the last frame
  double highest_N = 0;                      ///< on the whole block
  std::vector<double> loads_N;               ///< that the estimate was made from
  double saturated_fraction = 0;             ///< of the window's nodes, at the highest load
  std::array<double, 2> window_mm = {0, 0};  ///< the window's middle from the block's
  bool unfinished = false;                   ///< frames ended while it still pressed
  std::string trouble;                       ///< why there is no estimate; empty: there is one
  std::optional<lump::Estimate> estimate;
};

/// Present state of the monitor, for the window.
struct PressStatus {
  BlockSetting block;   ///< what presses are read with
  std::string trouble;  ///< why no estimate is possible at present; empty: one is
  bool pressing = false, estimating = false;
  double force_N = 0, highest_N = 0;  ///< on the whole block, of this press
  uint32_t loads = 0, wanted = 0;     ///< even shares of the highest force that frames were seen at
  /// Of the pad while it presses; none where it cannot be told: too light, or half of the window untouched.
  std::optional<lump::PadTilt> tilt;
  std::optional<PressAnswer> last;  ///< newest answer
};

struct PressSetup {
  BlockSetting block;
  uint32_t loads = 4;  ///< even shares of a press's highest force
  /// The window's place in the block is that of `block`; else no press has an estimate, and a scan by hand
  /// puts them together.
  bool placed = true;
  /// On the whole block at a frame, N; none where it is not known. Null: what the window sees, where it sees
  /// the whole block.
  std::function<std::optional<double>(uint64_t sequence)> force;
};

/// Frames of one press.
struct PressFrames {
  std::vector<double> force_N;
  std::vector<NodeSums> nodes;
};

/// Estimates the lump from the frames of one press; loads that no frame was near are left out. Fills loads_N,
/// saturated_fraction, window_mm, and estimate or trouble of `answer`.
void read_press(const PressureNodes& nodes, const PressFrames& frames, const PressSetup& setup,
                PressAnswer& answer);

class PressMonitor {
 public:
  /// `background`: the untouched image. A sensor or a force that allows no estimate is a state, see status().
  PressMonitor(const Sensor& sensor, const Frame& background, PressSetup setup);
  ~PressMonitor();

  /// Presses that begin from now on are read with this block; the window's place in it stays. Any thread.
  /// Throws Error(Failure::Usage) where a size or the modulus is not above 0.
  void set_block(const BlockSetting& block);
  /// The next frame and what was measured in it, from one thread; never waits for an estimate.
  void add(const Frame& frame, const Touch& touch);
  /// Any thread.
  PressStatus status() const;
  /// Of presses by hand; off at first. Null where the window's place is known, or nothing can be read.
  GrowingScan* scan() { return scan_.get(); }
  /// No more frames come: a press that goes on is read as far as it was seen. All answers in their order.
  std::vector<PressAnswer> finish();

 private:
  std::optional<double> force_at(const Frame& frame, std::optional<NodeSums>& read) const;
  void begin();
  void take_block();
  void keep(double force_N, NodeSums nodes);
  void end(const std::string& trouble);
  void publish(PressAnswer answer);
  void report(std::optional<double> force_N, uint64_t frame);
  std::optional<lump::PadTilt> tilt(double force_N) const;

  PressSetup setup_;
  std::optional<PressureNodes> nodes_;  ///< none where the sensor is not calibrated in pascals
  std::string lacking_;                 ///< why no press of this block can be estimated
  std::unique_ptr<GrowingScan> scan_;
  PressDetector detector_;
  PressFrames frames_;
  PressAnswer now_;                  ///< of the press that goes on
  bool contact_ = false;             ///< the sensor has seen it
  uint64_t stride_ = 1, taken_ = 0;  ///< of a long press every so many frames are kept
  uint64_t presses_ = 0;
  mutable std::mutex mutex_;  ///< of what follows
  PressStatus status_;
  std::optional<BlockSetting> next_block_;
  uint64_t pending_ = 0;
  std::vector<PressAnswer> answers_;
  BackgroundWork background_;  ///< last: what it still does uses the rest
};

/// "press 2, frames 60 to 150, 4 loads up to 1.99 N: a lump; size 8.1 mm (90 %: 7.6 to 8.7); ..."
std::string describe(const PressAnswer& answer);

}  // namespace palpate
