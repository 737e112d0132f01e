// Latency of each frame from exposure to measurement to picture, and its distribution over a whole run.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <exception>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>

#include "capture/files/output_file.h"
#include "engine/base/clock.h"
#include "palpate/frame.h"

namespace palpate {

/// Half, 95 % and 99 % of the samples lie below; 0 without samples.
struct Percentiles {
  double p50_ms = 0;
  double p95_ms = 0;
  double p99_ms = 0;
  uint64_t count = 0;
};

/// A distribution of durations in constant memory, however long the run: bins 1 % wide from 1 us to 1000 s,
/// so that a percentile is right to 1 %.
class Durations {
 public:
  void add(double ms);
  Percentiles percentiles() const;

 private:
  static constexpr size_t kBins = 2100;
  std::array<uint64_t, kBins> bins_{};
  uint64_t count_ = 0;
};

/// The last `kRecent` durations, for a display.
class RecentDurations {
 public:
  void add(double ms);
  Percentiles percentiles() const;

 private:
  static constexpr size_t kRecent = 240;
  std::deque<double> ms_;
};

/// When what happened to one frame, host's CLOCK_MONOTONIC.
struct FrameTimes {
  uint64_t sequence = 0;
  int64_t exposed_ns = 0;  ///< by the camera's driver; 0: the source does not know
  int64_t delivered_ns = 0;
  int64_t measured_ns = 0;  ///< Touch in hand
  int64_t shown_ns = 0;     ///< its first picture finished and handed to the display; 0: not shown

  FrameTimes() = default;
  FrameTimes(const Frame& frame, int64_t measured)
      : sequence(frame.sequence),
        exposed_ns(frame.exposed_ns),
        delivered_ns(frame.delivered_ns),
        measured_ns(measured) {}
  /// Start of the latencies: the exposure where it is known, else the delivery.
  int64_t start_ns() const { return exposed_ns != 0 ? exposed_ns : delivered_ns; }
  double to_measured_ms() const { return 1e-6 * static_cast<double>(measured_ns - start_ns()); }
  double to_shown_ms() const { return 1e-6 * static_cast<double>(shown_ns - start_ns()); }
};

/// Distributions of a run, and one row a measured frame in a file where one is wanted. Any thread.
class LatencyLog {
 public:
  /// `file`: a CSV whose rows are whole as they are written; empty: none. `on_times` is called for every
  /// frame. Throws Error(Failure::Output).
  explicit LatencyLog(const std::filesystem::path& file,
                      std::function<void(const FrameTimes&)> on_times = nullptr);

  /// Once a measured frame, when it was shown or will not be. A disk that refuses ends the file, not the run.
  void add(const FrameTimes& times);
  /// Hands the rows to the disk. Throws Error(Failure::Output) where one could not be written.
  void close();

  Percentiles to_measured() const;
  Percentiles to_shown() const;
  /// True while every frame had its time of exposure; false: latencies count from delivery.
  bool from_exposure() const;

 private:
  mutable std::mutex mutex_;
  std::function<void(const FrameTimes&)> on_times_;
  std::optional<LineFile> file_;
  std::exception_ptr refused_;
  Durations measured_, shown_;
  bool from_exposure_ = true;
};

}  // namespace palpate
