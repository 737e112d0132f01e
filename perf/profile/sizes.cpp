#include "perf/profile/sizes.h"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <fstream>
#include <map>

#include "engine/base/text.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "engine/pipeline/pipeline_access.h"
#include "palpate/error.h"
#include "palpate/pipeline.h"
#include "perf/profile/frames.h"
#include "perf/profile/growth.h"

namespace palpate::perf {
namespace {

// Single frames and frames in flight take turns in blocks, so that a machine that drifts drifts for both.
constexpr int kSingleFrames = 5, kFlowFrames = 6, kLeastBlocks = 2, kMostBlocks = 100;
constexpr int kStageFrames = 60;
constexpr int kLeastStageFrames = 5;
constexpr size_t kHistogramBins = 24;

/// Bytes that a process may still take without swapping; 0 where the system does not say.
uint64_t available_memory_bytes() {
  std::ifstream in("/proc/meminfo");
  for (std::string key; in >> key;) {
    uint64_t kibibytes = 0;
    if (key == "MemAvailable:" && in >> kibibytes) return kibibytes << 10;
  }
  return 0;
}

Pipeline make_pipeline(gpu::Context& context, const Scene& scene) {
  Pipeline pipeline(context, scene.sensor, scene.background.format, {});
  pipeline.set_background(scene.background);
  return pipeline;
}

class SizeMeter {
 public:
  SizeMeter(const gpu::ContextOptions& device, const Ceiling& ceiling, const Watch& watch)
      : watch_(watch), ceiling_(ceiling), plain_(device), timed_(with_timers(device, ceiling)) {}

  const gpu::Context& context() const { return plain_; }
  void leave() const {
    watch_.leave(plain_);
    watch_.leave(timed_);
  }

  /// False where it was stopped; then `figure` is not whole.
  bool measure(Scene& scene, double seconds, SizeFigure& figure) {
    return frame(scene, seconds, figure) && stages(scene, seconds / 4, figure);
  }

 private:
  static gpu::ContextOptions with_timers(gpu::ContextOptions options, const Ceiling& ceiling) {
    options.timers = ceiling.clock == "GPU";
    options.host_timers = !options.timers;
    return options;
  }

  /// Latency, CPU time and throughput, without timers: they cost a tenth of a frame on some drivers.
  bool frame(Scene& scene, double seconds, SizeFigure& figure) {
    const double start_s = wall_now_s();
    Pipeline pipeline = make_pipeline(plain_, scene);
    figure.setup_ms = (wall_now_s() - start_s) * 1e3;
    figure.memory_bytes = pipeline.memory_bytes();
    std::vector<Contender> frames{{"frame", [&] { pipeline.process(scene.next()); }}};
    std::vector<double> rates;
    const double first_s = wall_now_s();
    for (int block = 0; block < kMostBlocks; ++block) {
      if (block >= kLeastBlocks && wall_now_s() - first_s > 3 * seconds / 4) break;
      if (!take_turns(frames, {kSingleFrames, kSingleFrames, 0, false, block == 0}, watch_)) return false;
      const double flow_s = wall_now_s();
      for (int i = 0; i < kFlowFrames; ++i) {
        if (watch_.stopped()) return false;
        while (!pipeline.submit(scene.next())) pipeline.wait();
      }
      while (pipeline.wait()) {
      }
      rates.push_back(kFlowFrames / (wall_now_s() - flow_s));
    }
    figure.latency = distribution_of(frames[0].wall_ms);
    figure.histogram = histogram_of(frames[0].wall_ms, kHistogramBins);
    figure.cpu_ms = quantile(frames[0].cpu_ms, 0.5);
    figure.frames_per_s = quantile(rates, 0.5);
    return true;
  }

  bool stages(Scene& scene, double seconds, SizeFigure& figure) {
    Pipeline pipeline = make_pipeline(timed_, scene);
    std::map<std::string, std::vector<double>> samples;
    const double start_s = wall_now_s();
    for (int i = -1; i < kStageFrames; ++i) {
      if (watch_.stopped()) return false;
      if (i >= kLeastStageFrames && wall_now_s() - start_s > seconds) break;
      pipeline.submit(scene.next());
      const auto result = pipeline.wait();
      std::map<std::string, double> frame_ms;
      for (const gpu::ScopeTime& t : PipelineAccess::times(pipeline, *result)) frame_ms[t.name] += t.ms;
      if (i >= 0)  // the first one is cold
        for (const auto& [name, ms] : frame_ms) samples[name].push_back(ms);
    }
    for (const gpu::ScopeTraffic& traffic : PipelineAccess::traffic(pipeline))
      add_stage(traffic, samples[traffic.name], figure);
    return true;
  }

  void add_stage(const gpu::ScopeTraffic& traffic, const std::vector<double>& samples, SizeFigure& figure) {
    // Where the host writes straight into device memory there is no upload.
    if (traffic.dispatches == 0 || samples.empty()) return;
    StageFigure stage;
    stage.stage = traffic.name;
    stage.time = distribution_of(samples);
    stage.read_bytes = traffic.read_bytes;
    stage.written_bytes = traffic.written_bytes;
    stage.dispatches = traffic.dispatches;
    if (stage.time.median_ms > 0)
      stage.GB_per_s =
          static_cast<double>(stage.read_bytes + stage.written_bytes) / (stage.time.median_ms * 1e6);
    if (ceiling_.GB_per_s > 0) stage.ceiling_fraction = stage.GB_per_s / ceiling_.GB_per_s;
    figure.stages.push_back(stage);
  }

  const Watch& watch_;
  const Ceiling& ceiling_;
  gpu::Context plain_;
  gpu::Context timed_;
};

double pixels_of(const FrameSize& size) {
  return static_cast<double>(size.width_px) * size.height_px;
}

/// Time that the least number of frames would take at `size`, building everything twice, judged by a smaller
/// one.
double least_s(const SizeFigure& smaller, const FrameSize& size) {
  const int frames = 1 + kLeastBlocks * (kSingleFrames + kFlowFrames) + 1 + kLeastStageFrames;
  const double larger = std::max(1.0, pixels_of(size) / static_cast<double>(smaller.pixels()));
  return 1e-3 * (2 * smaller.setup_ms + frames * smaller.latency.median_ms * larger);
}

/// Why a size is not worth starting, judged by the last one measured; empty: nothing against it.
std::string reason_to_skip(const SizeFigure& last, const FrameSize& size, const gpu::Context& context,
                           double seconds_left) {
  std::string line;
  const double bytes =
      static_cast<double>(last.memory_bytes) * pixels_of(size) / static_cast<double>(last.pixels());
  double room = 0.95 * static_cast<double>(context.report().memory_bytes);
  if (context.is_software()) {
    const uint64_t available = available_memory_bytes();
    if (available > 0) room = std::min(room, 0.7 * static_cast<double>(available));
  }
  if (bytes > room) {
    line = palpate::text("needs about %.1f GB of device memory, %.1f GB are to spare", bytes * 1e-9,
                         room * 1e-9);
    return line;
  }
  const double seconds = least_s(last, size);
  if (seconds > seconds_left) {
    line = palpate::text("needs about %.0f s, %.0f s of the budget are left", seconds,
                         std::max(0.0, seconds_left));
    return line;
  }
  return "";
}

}  // namespace

std::vector<FrameSize> default_sizes(bool quick) {
  std::vector<FrameSize> sizes{{160, 120}, {320, 240}, {640, 480}};
  if (!quick) sizes.insert(sizes.end(), {{1392, 1042}, {2048, 2048}, {4096, 4096}, {8192, 8192}});
  return sizes;
}

FrameSize parse_size(const std::string& text) {
  FrameSize size;
  const char* end = text.data() + text.size();
  const auto width = std::from_chars(text.data(), end, size.width_px);
  const bool crossed = width.ec == std::errc{} && width.ptr != end && *width.ptr == 'x';
  const auto height = crossed ? std::from_chars(width.ptr + 1, end, size.height_px) : width;
  const uint64_t pixels = uint64_t{size.width_px} * size.height_px;
  constexpr uint64_t kMostPixels = uint64_t{1} << 26;
  if (!crossed || height.ec != std::errc{} || height.ptr != end || pixels == 0 || pixels > kMostPixels ||
      size.width_px > kMaxSide_px || size.height_px > kMaxSide_px) {
    throw Error(Failure::Usage, "sizes WIDTHxHEIGHT of 1 to 67108864 pixels, sides up to 16384",
                "'" + text + "'", "--sizes 640x480,1392x1042");
  }
  return size;
}

void measure_sizes(const gpu::ContextOptions& device, const std::vector<FrameSize>& sizes,
                   const std::vector<SurfaceReading>& readings, double seconds, const Watch& watch,
                   Profile& profile) {
  std::vector<FrameSize> ascending = sizes;
  std::sort(ascending.begin(), ascending.end(), [](const FrameSize& a, const FrameSize& b) {
    return uint64_t{a.width_px} * a.height_px < uint64_t{b.width_px} * b.height_px;
  });
  struct Task {
    FrameSize size;
    SurfaceReading reading;
  };
  std::vector<Task> tasks;
  for (const FrameSize& size : ascending)
    for (const SurfaceReading reading : readings) tasks.push_back({size, reading});

  SizeMeter meter(device, profile.ceiling, watch);
  const double end_s = wall_now_s() + seconds;
  std::map<SurfaceReading, SizeFigure> last;
  for (size_t i = 0; i < tasks.size(); ++i) {
    if (watch.stopped()) return;
    const auto& [size, reading] = tasks[i];
    const double seconds_left = end_s - wall_now_s();
    std::string why;
    double share_s = seconds_left / static_cast<double>(tasks.size() - i);
    if (const auto before = last.find(reading); before != last.end()) {
      why = reason_to_skip(before->second, size, meter.context(), seconds_left);
      // Time left over when the larger sizes get their least.
      double needed_s = 0;
      for (size_t later = i; later < tasks.size(); ++later)
        if (last.count(tasks[later].reading))
          needed_s += least_s(last[tasks[later].reading], tasks[later].size);
      share_s = std::max(seconds_left - needed_s, 0.0) / static_cast<double>(tasks.size() - i) +
                least_s(before->second, size);
    }
    const std::string what = size_text(size.width_px, size.height_px) + ", " + to_string(reading);
    SizeFigure figure;
    figure.reading = to_string(reading);
    figure.width_px = size.width_px;
    figure.height_px = size.height_px;
    if (why.empty()) {
      try {
        Scene scene = timing_scene(size.width_px, size.height_px, reading, kUsualTouch);
        if (!meter.measure(scene, share_s, figure)) return;
      } catch (const Error& error) {
        if (error.failure() != Failure::Device) throw;
        why = error.what();
      }
    }
    if (why.empty()) {
      const std::string line = palpate::text("%s: %.3g ms a frame, %.3g frames/s", what.c_str(),
                                             figure.latency.median_ms, figure.frames_per_s);
      watch.say(line);
      last[reading] = figure;
      profile.sizes.push_back(std::move(figure));
      profile.growth = growth_of(profile.sizes);
    } else {
      std::string line = what;
      line.append(": skipped, ").append(why);
      watch.say(line);
      profile.skipped.push_back({what, why});
    }
  }
  meter.leave();
}

}  // namespace palpate::perf
