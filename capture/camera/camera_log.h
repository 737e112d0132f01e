// Log of a camera's stream: numbers and times of its frames, its faults, and why no frames come.
#pragma once

#include <cstdint>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "capture/camera/camera_clock.h"
#include "capture/camera/frame_rate.h"
#include "capture/source.h"

namespace palpate {

/// Written by the thread that takes the frames; counts, state and details are read from any thread.
class CameraLog {
 public:
  /// Why no frames come; empty: they do.
  void say(const std::string& words);
  /// The next frame comes after a gap.
  void interrupt(const std::string& words);
  void set_facts(std::vector<std::pair<std::string, std::string>> facts);

  /// Fills number and times of a good frame: `number` and `stamp_ns` are the camera's, which is
  /// CLOCK_MONOTONIC where `monotonic` says so.
  void stamp(uint32_t number, int64_t stamp_ns, bool monotonic, int64_t delivered_ns, double rate_Hz,
             Frame& frame);
  /// A frame that is left out, and what is wrong with it.
  void note_damage(uint32_t number, const std::string& what);
  void note_pixels(bool leased);

  /// The stream has started, now.
  void note_start();
  /// Rate and exposure that the camera was set to, 0 where not known: warns where they do not fit each other,
  /// and later where frames come at another rate.
  void note_promise(double rate_Hz, double exposure_s);
  /// Warnings so far, in one line; each has been logged once.
  std::string warning() const;
  /// True where no frame has come for so long.
  bool silent(int64_t timeout_ns) const;
  /// "no frame for 2 s", or "no whole frame for 2 s (a damaged JPEG)"; what was damaged is forgotten.
  std::string words_of_silence(int64_t timeout_ns);

  uint64_t frames() const { return frames_; }
  bool interrupted() const { return away_; }
  const FrameClock& clock() const { return clock_; }

  CaptureCounts counts() const;
  std::string state() const;
  /// The facts, the clock in these words, and how often pixels are copied.
  std::vector<std::pair<std::string, std::string>> details(const std::string& clock,
                                                           const std::string& copies) const;

 private:
  void warn(const std::string& words);

  SequenceCounter counter_;
  RateWatch rate_;
  FrameClock clock_;
  int64_t sign_ns_ = 0;       // last frame, or start of the stream
  int64_t delivered_ns_ = 0;  // last frame
  uint64_t frames_ = 0;
  bool away_ = false;
  std::string damage_;  // what was wrong with the last damaged frame

  mutable std::mutex mutex_;  // of all below
  CaptureCounts counts_;
  std::string state_, warning_;
  std::vector<std::pair<std::string, std::string>> facts_;
  uint64_t leased_ = 0, copied_ = 0;
};

}  // namespace palpate
