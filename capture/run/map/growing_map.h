// Growing map: the map of an object (engine/map) made beside a live run, in a thread of its own.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "palpate/frame.h"
#include "palpate/touch.h"

namespace palpate {

/// The largest piece of a map as it is looked at, halved until it has at most kMost pixels; row-major, places
/// as FusedMap's.
struct SeenMap {
  static constexpr size_t kMost = 500'000;

  uint32_t width = 0, height = 0;  ///< px; 0: there is nothing yet
  double pitch_mm = 0, left_mm = 0, top_mm = 0;
  std::vector<float> height_mm;               ///< NaN where nothing was seen
  double low_mm = 0, high_mm = 0;             ///< all but a hundredth at each end lie between
  std::vector<std::array<double, 2>> way_mm;  ///< places of the pad's middle at the key frames
  // The whole map:
  double covered_mm2 = 0;  ///< of the largest piece
  double error_mm = 0;     ///< its standard error, RMS; NaN: not known
  uint32_t pieces = 0;
  uint32_t keys = 0;    ///< key frames of the largest piece
  uint32_t closed = 0;  ///< loops that agree with the rest
  uint32_t missed = 0;  ///< key frames that found no room
};

/// All from one thread, but write(), which may come from another once there is a map.
class GrowingMap {
 public:
  /// Frames are those of a sensor of `pitch_mm` a pixel. Nothing is allocated, and no thread begins, before
  /// the first frame with a track.
  explicit GrowingMap(double pitch_mm);
  ~GrowingMap();
  GrowingMap(const GrowingMap&) = delete;
  GrowingMap& operator=(const GrowingMap&) = delete;

  /// The frame shows an object on a track (Output::Motion), and there is room for its depths.
  bool wants(const Touch& touch) const;
  /// Takes a copy of the depths of a frame that is wanted, frames in order and of one format; never waits.
  /// `round`: tracks of another round (a device that was opened anew) are others.
  void add(const Touch& touch, const FrameFormat& format, std::span<const float> depth_mm,
           uint32_t round = 0);
  /// Begins anew: with the next track.
  void restart();
  /// Until all that was added is in the map: for tests, and an end.
  void finish();

  /// The newest map, another object where it has changed; null before there is one.
  std::shared_ptr<const SeenMap> seen() const;
  /// Where the four corners of the pad lie on the largest piece now, mm, x and y; empty: not known.
  std::vector<std::array<double, 2>> pad_mm() const;
  /// Writes what `palpate map` writes of a map, map.json too, into `folder`, which is made; returns the
  /// names. Throws Error(Failure::Output); empty where there is no map.
  std::vector<std::string> write(const std::filesystem::path& folder) const;

 private:
  struct Work;

  const double pitch_mm_;
  uint64_t last_track_ = 0, ended_track_ = 0;
  std::unique_ptr<Work> work_;
};

}  // namespace palpate
