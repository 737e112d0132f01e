#include "perf/profile/paced.h"

#include <algorithm>
#include <numeric>

#include "engine/gpu/context.h"
#include "perf/profile/sampling.h"

namespace palpate::perf {
namespace {

constexpr uint64_t kFrames = 16;  // of a film

class FramesInMemory : public Source {
 public:
  FramesInMemory(const std::function<const Frame&()>& next, double rate_Hz)
      : next_(next), first_(next()), rate_Hz_(rate_Hz) {}
  FrameFormat format() const override { return first_.format; }
  double rate_Hz() const override { return rate_Hz_; }
  std::optional<uint64_t> frame_count() const override { return std::nullopt; }
  bool next(Frame& frame) override {
    frame.reshape(format());
    frame.bytes = next_().bytes;
    frame.sequence = count_;
    frame.time_ns = static_cast<int64_t>(1e9 * static_cast<double>(count_) / rate_Hz_);
    ++count_;
    return true;
  }

 private:
  std::function<const Frame&()> next_;
  const Frame& first_;
  double rate_Hz_;
  uint64_t count_ = 0;
};

}  // namespace

std::unique_ptr<Source> frames_in_memory(const std::function<const Frame&()>& next, double rate_Hz) {
  return std::make_unique<FramesInMemory>(next, rate_Hz);
}

Film::Film(const PacedScene& scene)
    : name_(scene.name),
      options_(parse_synthetic(scene.input)),
      sensor_(synthetic_sensor(options_)),
      frames_(kFrames) {
  const SyntheticSensor simulated(options_);
  background_ = *simulated.own_background();
  const uint64_t first = simulated.frame_count().value_or(2 * kFrames) / 2;
  for (uint64_t i = 0; i < kFrames; ++i) simulated.render(first + i, frames_[i]);
}

std::unique_ptr<Source> Film::play() const {
  const auto next = [this, count = uint64_t{0}]() mutable -> const Frame& {
    const uint64_t last = frames_.size() - 1, turn = count++ % (2 * last);
    return frames_[std::min(turn, 2 * last - turn)];
  };
  return frames_in_memory(next, options_.rate_Hz);
}

LiveReport Film::run(gpu::Context& context, Outputs outputs, const LiveOptions& live) const {
  PipelineOptions pipeline;
  pipeline.outputs = outputs;
  return run_without_window(
      context, [&] { return std::shared_ptr<Source>(play()); }, {sensor_, background_, pipeline}, live);
}

double Film::frames_per_s(gpu::Context& context, Outputs outputs, double seconds,
                          const std::function<bool()>& stopped) const {
  std::vector<int64_t> measured_ns;
  LiveOptions live;
  live.max_seconds = seconds;
  live.interrupted = stopped;
  live.unpaced = live.measure_all = true;
  live.on_times = [&](const FrameTimes& times) { measured_ns.push_back(times.measured_ns); };
  run(context, outputs, live);
  if (measured_ns.size() <= kWarmUpFrames + 1) return 0;
  const auto frames = static_cast<double>(measured_ns.size() - kWarmUpFrames - 1);
  std::ranges::sort(measured_ns);
  return frames / (1e-9 * static_cast<double>(measured_ns.back() - measured_ns[kWarmUpFrames]));
}

bool Ages::add(const FrameTimes& times) {
  if (++seen_ <= left_out_) return false;
  measured_ms_.push_back(times.to_measured_ms());
  if (times.shown_ns != 0) shown_ms_.push_back(times.to_shown_ms());
  return true;
}

void Ages::into(const LiveReport& report, PacedRun& run) const {
  run.frames = report.captured;
  run.dropped_before_engine = report.dropped_before_engine;
  run.dropped_before_display = report.dropped_before_display;
  run.to_measured = distribution_of(measured_ms_);
  if (!shown_ms_.empty()) run.to_picture = distribution_of(shown_ms_);
}

double Ages::mean_to_picture_ms() const {
  if (shown_ms_.empty()) return 0;
  return std::accumulate(shown_ms_.begin(), shown_ms_.end(), 0.0) / static_cast<double>(shown_ms_.size());
}

}  // namespace palpate::perf
