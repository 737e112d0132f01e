// A simulated camera for hours, as fast as the machine can: memory, handles, threads, latency and drift over
// time, with sessions that begin and end meanwhile.
#include <dirent.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>

#include "capture/files/output_file.h"
#include "capture/live/live.h"
#include "capture/live/recorder.h"
#include "capture/synthetic/synthetic.h"
#include "engine/base/text.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "perf/tools/program.h"
#include "viz/commands/support/options.h"
#include "viz/report/gnuplot.h"
#include "viz/report/plot.h"

namespace palpate::perf {
namespace {

struct Options {
  double hours = 1;
  double rate_Hz = 60;
  uint32_t width = 640, height = 480;
  double sample_s = 10;    ///< of simulated time
  double session_s = 2;    ///< length of each recorded session, of simulated time
  double sessions_s = 60;  ///< from one to the next
  std::string device;
  std::filesystem::path out;
};

/// One round of a palpation in memory, again and again, numbers and times going on like a camera's.
class EndlessCamera : public Source {
 public:
  EndlessCamera(const std::vector<Frame>& round, double rate_Hz, uint64_t count)
      : round_(round), rate_Hz_(rate_Hz), count_(count) {}
  FrameFormat format() const override { return round_.front().format; }
  double rate_Hz() const override { return rate_Hz_; }
  std::optional<uint64_t> frame_count() const override { return count_; }
  bool next(Frame& frame) override {
    if (next_ == count_) return false;
    frame.reshape(format());
    frame.bytes = round_[next_ % round_.size()].bytes;
    frame.sequence = next_;
    frame.time_ns = std::llround(static_cast<double>(next_) / rate_Hz_ * 1e9);
    ++next_;
    return true;
  }

 private:
  const std::vector<Frame>& round_;
  double rate_Hz_;
  uint64_t count_, next_ = 0;
};

double resident_MB() {
  std::ifstream file("/proc/self/statm");
  double size = 0, resident = 0;
  file >> size >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

uint64_t entries(const char* folder) {
  uint64_t count = 0;
  if (DIR* dir = opendir(folder)) {
    while (const dirent* entry = readdir(dir)) count += entry->d_name[0] != '.';
    closedir(dir);
    if (std::string(folder) == "/proc/self/fd") --count;  // that of reading it
  }
  return count;
}

struct Sample {
  double simulated_h, real_s, resident_MB, frames_per_s, p50_ms, p99_ms, gray_drift, depth_drift_mm;
  uint64_t files, threads, sessions;
};

/// Follows the run from its results: each round's measurements must be those of the second round.
class Watch {
 public:
  Watch(size_t round, uint64_t every, double rate_Hz, LineFile* rows)
      : reference_(round), every_(every), rate_Hz_(rate_Hz), rows_(rows), start_ns_(monotonic_ns()) {
    last_ns_ = start_ns_;
  }

  void add(const Touch& touch, uint64_t sessions) {
    const uint64_t round = touch.sequence / reference_.size();
    Touch& reference = reference_[touch.sequence % reference_.size()];
    if (round == 1) {
      reference = touch;
    } else if (round > 1) {
      gray_drift_ = std::max(gray_drift_, std::abs(touch.gray_sum - reference.gray_sum));
      depth_drift_mm_ =
          std::max(depth_drift_mm_, std::abs(touch.surface->depth_max_mm - reference.surface->depth_max_mm));
    }
    const int64_t now = monotonic_ns();
    between_.add(1e-6 * static_cast<double>(now - previous_ns_));
    previous_ns_ = now;
    if ((touch.sequence + 1) % every_ == 0) sample(touch.sequence + 1, now, sessions);
  }
  const std::vector<Sample>& samples() const { return samples_; }

 private:
  void sample(uint64_t frames, int64_t now, uint64_t sessions) {
    const Percentiles p = between_.percentiles();
    between_ = {};
    const Sample s{.simulated_h = static_cast<double>(frames) / rate_Hz_ / 3600,
                   .real_s = 1e-9 * static_cast<double>(now - start_ns_),
                   .resident_MB = perf::resident_MB(),
                   .frames_per_s = static_cast<double>(every_) * 1e9 / static_cast<double>(now - last_ns_),
                   .p50_ms = p.p50_ms,
                   .p99_ms = p.p99_ms,
                   .gray_drift = gray_drift_,
                   .depth_drift_mm = depth_drift_mm_,
                   .files = entries("/proc/self/fd"),
                   .threads = entries("/proc/self/task"),
                   .sessions = sessions};
    last_ns_ = now;
    samples_.push_back(s);
    if (!rows_) return;
    const std::string row = text(
        "%.5f,%.2f,%.2f,%llu,%llu,%.1f,%.3f,%.3f,%g,%g,%llu", s.simulated_h, s.real_s, s.resident_MB,
        static_cast<unsigned long long>(s.files), static_cast<unsigned long long>(s.threads), s.frames_per_s,
        s.p50_ms, s.p99_ms, s.gray_drift, s.depth_drift_mm, static_cast<unsigned long long>(s.sessions));
    rows_->append(row);
  }

  std::vector<Touch> reference_;
  uint64_t every_;
  double rate_Hz_;
  LineFile* rows_;
  int64_t start_ns_, last_ns_, previous_ns_ = monotonic_ns();
  Durations between_;
  double gray_drift_ = 0, depth_drift_mm_ = 0;
  std::vector<Sample> samples_;
};

std::vector<Frame> round_of_touch(const Options& options, Sensor& sensor, Frame& background) {
  SyntheticOptions scene;
  scene.scene = "slide";
  scene.mode = SyntheticMode::Lambert;
  scene.width = options.width;
  scene.height = options.height;
  scene.rate_Hz = options.rate_Hz;
  const SyntheticSensor synthetic(scene);
  sensor = synthetic_sensor(scene);
  background = *synthetic.own_background();
  // As many as fit into a quarter of a gigabyte, from all over the scene.
  const uint64_t all = synthetic.frame_count().value_or(1);
  const uint64_t fit = std::max<uint64_t>(8, (uint64_t{1} << 28) / synthetic.format().frame_bytes());
  const uint64_t step = std::max<uint64_t>(1, all / std::min(all, fit));
  std::vector<Frame> round;
  for (uint64_t i = 0; i < all; i += step) synthetic.render(i, round.emplace_back());
  return round;
}

Plot plot_of(const std::vector<Sample>& samples, const std::string& title) {
  PlotCurve memory{.title = "resident memory"}, files{.title = "files and devices"},
      threads{.title = "threads", .colour = 6}, rate{.title = "frames a second", .colour = 2},
      time{.title = "99 % of frames within, ms", .colour = 1}, gray{.title = "gray sum, gray levels"},
      depth{.title = "depth, mm", .colour = 3, .dashed = true};
  for (const Sample& s : samples) {
    const auto add = [&](PlotCurve& curve, double value) { curve.add(s.simulated_h, value); };
    add(memory, s.resident_MB);
    add(files, static_cast<double>(s.files));
    add(threads, static_cast<double>(s.threads));
    add(rate, s.frames_per_s);
    add(time, s.p99_ms);
    add(gray, s.gray_drift);
    add(depth, s.depth_drift_mm);
  }
  Plot plot{.title = title, .width_px = 900, .height_px = 1000};
  const auto add = [&](const char* label, std::vector<PlotCurve> curves, PlotRange range) {
    plot.panels.push_back(
        {.x_label = "simulated time, h", .y_label = label, .curves = std::move(curves), .y_range = range});
    plot.panels.back().key = "above";
  };
  const PlotRange from_0 = {{0, kPlotAuto}};
  add("resident memory, MB", {memory}, from_0);
  add("open handles", {files, threads}, from_0);
  add("frames/s and ms", {rate, time}, from_0);
  add("drift", {gray, depth}, {{-1, 1}});
  return plot;
}

/// Slope of resident memory over the second half of the run, MB an hour.
double growth_MB_per_h(const std::vector<Sample>& samples) {
  const size_t from = samples.size() / 2;
  double n = 0, x = 0, y = 0, xx = 0, xy = 0;
  for (size_t i = from; i < samples.size(); ++i) {
    const double a = samples[i].simulated_h, b = samples[i].resident_MB;
    n += 1, x += a, y += b, xx += a * a, xy += a * b;
  }
  const double spread = n * xx - x * x;
  return spread > 0 ? (n * xy - x * y) / spread : 0;
}

void add_options(CommandLine& app, Options& options) {
  app.add_option("--hours", options.hours, "of simulated time")->check(Check::positive());
  app.add_option("--rate", options.rate_Hz, "of the simulated camera, Hz")->check(Check::positive());
  app.add_option("--width", options.width, "px")->check(Check::range(16, 4096));
  app.add_option("--height", options.height, "px")->check(Check::range(16, 4096));
  app.add_option("--device", options.device, "index or part of a name");
  app.add_option("--out", options.out, "folder for soak.csv and soak.png; sessions pass through it")
      ->required();
}

/// Sessions that begin and end all along: what they leave behind would show.
class PassingSessions {
 public:
  PassingSessions(const Options& options, const SessionInfo& info)
      : options_(options), due_(in_frames(options.sessions_s) / 2) {
    recording_.emplace([this] { return options_.out / "session"; }, info, SessionOptions{.no_drop = true});
  }

  Recording* recording() { return &*recording_; }
  uint64_t count() const { return count_; }
  uint64_t unread() const { return unread_; }

  /// On the capturing thread, with the number of frames so far.
  void update(uint64_t captured) {
    if (!recording_->on() && captured >= due_) {
      recording_->start();
      until_ = captured + in_frames(options_.session_s);
      due_ += in_frames(options_.sessions_s);
    } else if (recording_->on() && captured >= until_) {
      for (const auto& written : recording_->finish()) {
        unread_ += !written.status.error.empty() || written.status.written != written.status.recorded;
        std::filesystem::remove_all(written.folder);
      }
      ++count_;
    }
  }
  void end() {
    recording_.reset();
    std::filesystem::remove_all(options_.out / "session");
  }

 private:
  uint64_t in_frames(double seconds) const { return static_cast<uint64_t>(seconds * options_.rate_Hz); }

  const Options& options_;
  std::optional<Recording> recording_;
  std::atomic<uint64_t> count_{0};
  uint64_t unread_ = 0, due_, until_ = 0;
};

SessionInfo session_info(const Sensor& sensor, const Frame& background, const FrameFormat& format,
                         double rate_Hz) {
  SessionInfo info;
  info.sensor = sensor;
  info.format = format;
  info.rate_Hz = rate_Hz;
  info.background = background;
  info.outputs = Output::Force | Output::Surface;
  return info;
}

void draw(const std::vector<Sample>& samples, const std::string& title, const std::filesystem::path& out) {
  const Picture picture = run_gnuplot(plot_script(plot_of(samples, title), PlotKind::Png));
  if (picture.bytes.empty()) std::fprintf(stderr, "palpate_soak: no plot: %s\n", picture.error.c_str());
  if (!picture.bytes.empty()) write_whole(out / "soak.png", std::string_view(picture.bytes));
}

/// Prints what the run was like; true where nothing grew, drifted or was lost.
bool judge(const std::vector<Sample>& s, const std::string& title, const LiveReport& report, uint64_t frames,
           const PassingSessions& sessions) {
  const Sample &first = s[s.size() / 4], &last = s.back();
  std::printf(
      "%s\n%llu of %llu frames measured, %.0f frames/s, %llu sessions (%llu failed)\nresident memory %.1f MB "
      "after a quarter, %.1f MB at the end, %+.2f MB an hour over the second half\nopen files %llu, then "
      "%llu; "
      "threads %llu, then %llu\nlargest drift: gray sum %g gray levels, depth %g mm\n",
      title.c_str(), static_cast<unsigned long long>(report.processed),
      static_cast<unsigned long long>(frames), static_cast<double>(frames) / report.seconds,
      static_cast<unsigned long long>(sessions.count()), static_cast<unsigned long long>(sessions.unread()),
      first.resident_MB, last.resident_MB, growth_MB_per_h(s), static_cast<unsigned long long>(first.files),
      static_cast<unsigned long long>(last.files), static_cast<unsigned long long>(first.threads),
      static_cast<unsigned long long>(last.threads), last.gray_drift, last.depth_drift_mm);
  return last.files == first.files && last.threads <= first.threads && last.gray_drift == 0 &&
         last.depth_drift_mm == 0 && sessions.unread() == 0 && report.processed == frames;
}

int run(int argc, char** argv) {
  CommandLine app("A simulated camera for hours, compressed as far as the machine allows.");
  Options options;
  add_options(app, options);
  if (const std::optional<int> code = app.parse_or_exit(argc, argv)) return *code;

  Sensor sensor;
  Frame background;
  const std::vector<Frame> round = round_of_touch(options, sensor, background);
  const auto frames = static_cast<uint64_t>(options.hours * 3600 * options.rate_Hz);
  gpu::ContextOptions device;
  device.device = options.device;
  gpu::Context context(device);
  make_output_folder(options.out);
  LineFile rows(options.out / "soak.csv");
  rows.append(
      "simulated_h,real_s,resident_MB,open_files,threads,frames_per_s,frame_p50_ms,frame_p99_ms,gray_drift,"
      "depth_drift_mm,sessions");
  const auto every = static_cast<uint64_t>(options.sample_s * options.rate_Hz);
  Watch watch(round.size(), every, options.rate_Hz, &rows);
  PassingSessions sessions(options, session_info(sensor, background, round.front().format, options.rate_Hz));
  LiveOptions live;
  live.unpaced = live.measure_all = true;
  live.recording = sessions.recording();
  live.on_result = [&](const Touch& touch) { watch.add(touch, sessions.count()); };
  live.on_progress = [&](uint64_t captured) { sessions.update(captured); };
  const LiveReport report = run_without_window(
      context, [&] { return std::make_unique<EndlessCamera>(round, options.rate_Hz, frames); },
      {sensor, background, {}}, live);
  rows.close();
  sessions.end();

  if (watch.samples().size() < 4)
    throw Error(Failure::Usage, "a run of four samples at least", "fewer", "more --hours");
  const std::string title =
      text("%.3g h of a camera at %g frames/s, %ux%u px, in %.0f s: %s", options.hours, options.rate_Hz,
           options.width, options.height, report.seconds, context.report().name.c_str());
  draw(watch.samples(), title, options.out);
  return judge(watch.samples(), title, report, frames, sessions) ? 0 : 1;
}

}  // namespace
}  // namespace palpate::perf

int main(int argc, char** argv) {
  return palpate::perf::run_program("palpate_soak", palpate::perf::run, argc, argv);
}
