// Runs at the pace of a camera whose frames are in memory beforehand, so that making them takes no time from
// what is measured.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "capture/live/live.h"
#include "capture/synthetic/synthetic.h"
#include "palpate/pipeline.h"
#include "perf/profile/profile.h"

namespace palpate::perf {

/// The frames that `next` gives, without end, at `rate_Hz`.
std::unique_ptr<Source> frames_in_memory(const std::function<const Frame&()>& next, double rate_Hz);

/// Frames at the start of a run that do not count, since the pipeline is still warming up.
inline constexpr uint64_t kWarmUpFrames = 3;

/// A synthetic scene and what is measured of it.
struct PacedScene {
  const char* name;
  const char* input;  ///< with its rate
  Outputs outputs;
};

/// The middle of a scene, where it touches: a few frames, played forwards and backwards without end.
class Film {
 public:
  explicit Film(const PacedScene& scene);

  /// What is known before it runs; `Figure` begins as a RateFigure.
  template <typename Figure>
  Figure figure() const {
    Figure figure;
    figure.scene = name_;
    figure.width_px = options_.width;
    figure.height_px = options_.height;
    figure.rate_Hz = options_.rate_Hz;
    return figure;
  }
  const SyntheticOptions& options() const { return options_; }
  const Sensor& sensor() const { return sensor_; }
  const Frame& background() const { return background_; }
  std::unique_ptr<Source> play() const;

  /// The calling thread draws.
  LiveReport run(gpu::Context& context, Outputs outputs, const LiveOptions& live) const;
  /// Frames measured a second as fast as it goes; 0 where there were too few.
  double frames_per_s(gpu::Context& context, Outputs outputs, double seconds,
                      const std::function<bool()>& stopped) const;

 private:
  std::string name_;
  SyntheticOptions options_;
  Sensor sensor_;
  Frame background_;
  std::vector<Frame> frames_;
};

/// Ages of the frames of a run, without its first.
class Ages {
 public:
  explicit Ages(uint64_t left_out = 0) : left_out_(left_out) {}
  /// True from the first frame that counts.
  bool add(const FrameTimes& times);
  bool empty() const { return measured_ms_.empty(); }
  void into(const LiveReport& report, PacedRun& run) const;
  double mean_to_picture_ms() const;

 private:
  uint64_t left_out_, seen_ = 0;
  std::vector<double> measured_ms_, shown_ms_;
};

}  // namespace palpate::perf
