// Thumbnails of depth along a recording, measured in the background while it is played.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <string>
#include <thread>

#include "palpate/frame.h"
#include "palpate/options.h"
#include "palpate/sensor.h"
#include "viz/render/colour_map.h"

namespace palpate {
class Result;
namespace gpu {
class Context;
}
}  // namespace palpate

namespace palpate::viz {

/// A recording as it is measured for its thumbnails.
struct StripInput {
  std::string input;  ///< as open_source takes it
  Sensor sensor;
  Frame background;  ///< the untouched image
  Outputs outputs;   ///< of the run; without a surface the thumbnails are the frames themselves
};

/// Opens the recording a second time and measures frames in the middle of equal parts, each as a picture by
/// itself, coarse places first. They are kept in a file next to the thumbnails of the list of sources, which
/// is read again while recording and sensor are the same. What cannot be opened or measured has no thumbnail.
class DepthStrip {
 public:
  static constexpr uint32_t kLooks = 24;   ///< thumbnails
  static constexpr uint32_t kHeight = 48;  ///< px of each

  DepthStrip(gpu::Context& context, StripInput input);
  /// Ends after the frame in hand.
  ~DepthStrip();
  DepthStrip(const DepthStrip&) = delete;
  DepthStrip& operator=(const DepthStrip&) = delete;

  /// While the recording is played, four fifths of the time are left to it.
  void give_way(bool playing);
  uint32_t measured() const { return measured_; }
  bool finished() const { return finished_; }  ///< nothing more will come
  bool from_file() const { return from_file_; }
  /// Deepest place of look `index` (0 to kLooks - 1), mm; 0: nothing touches, or it is not measured.
  double deepest_mm(uint32_t index) const;
  /// As many thumbnails as have room side by side, each at its time, 3 planes of 8 bits; the deepest of all
  /// has the last colour.
  void draw(Frame& picture, uint32_t width, uint32_t height, ColourMap map) const;

 private:
  void run();
  void measure();
  void take(uint32_t look, const Frame& frame, const Result& result);
  void rest(double ms);
  bool load();
  void keep() const;
  uint32_t nearest_measured(double part) const;

  gpu::Context& context_;
  const StripInput input_;
  const std::filesystem::path file_;  ///< empty: nothing is kept
  const bool has_depth_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool stop_ = false, playing_ = true;
  /// One below another: depth in micrometres (gray, 16 bits), or the frames (3 planes of 8 bits).
  Frame looks_;
  uint32_t done_ = 0;  ///< a bit for each look
  std::atomic<uint32_t> measured_ = 0;
  std::atomic<bool> finished_ = false, from_file_ = false;
  std::thread thread_;  ///< last: it uses the rest
};

}  // namespace palpate::viz
