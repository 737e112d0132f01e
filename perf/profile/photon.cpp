#include "perf/profile/photon.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <numeric>
#include <optional>

#include "capture/live/live.h"
#include "capture/live/recorder.h"
#include "capture/run/record_session.h"
#include "capture/synthetic/synthetic.h"
#include "engine/base/json.h"
#include "engine/base/readable.h"
#include "engine/base/trace.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"

namespace palpate::perf {
namespace {

namespace fs = std::filesystem;

constexpr uint64_t kFrames = 16;  // held in memory, played forwards and backwards
constexpr uint64_t kWarmUp = 3;   // frames before the first that counts
constexpr double kLeast_s = 2;    // of a scene
constexpr double kPaced = 0.7;    // of a scene's time; the rest is as fast as it goes

struct PhotonScene {
  const char* name;
  const char* input;
  Outputs outputs;
};
const PhotonScene kScenes[] = {
    {"waveguide: force, contacts", "synthetic:fingers?size=320x240&rate=60",
     Output::Force | Output::Contacts},
    {"colour gel: surface", "synthetic:fingers?size=640x480&mode=gel&rate=30",
     Output::Force | Output::Contacts | Output::Surface},
    {"marker gel: traction", "synthetic:slide?size=640x480&mode=gel&skin=markers&rate=30",
     Output::Force | Output::Contacts | Output::Surface | Output::Skin | Output::Traction}};

/// Frames that are there already, played forwards and backwards without end.
class FilmSource : public Source {
 public:
  FilmSource(const std::vector<Frame>& film, double rate_Hz) : film_(film), rate_Hz_(rate_Hz) {}
  FrameFormat format() const override { return film_.front().format; }
  double rate_Hz() const override { return rate_Hz_; }
  std::optional<uint64_t> frame_count() const override { return std::nullopt; }
  bool next(Frame& frame) override {
    const uint64_t last = film_.size() - 1, turn = next_ % (2 * last);
    frame.reshape(format());
    frame.bytes = film_[std::min(turn, 2 * last - turn)].bytes;
    frame.sequence = next_;
    frame.time_ns = static_cast<int64_t>(1e9 * static_cast<double>(next_) / rate_Hz_);
    ++next_;
    return true;
  }

 private:
  const std::vector<Frame>& film_;
  double rate_Hz_;
  uint64_t next_ = 0;
};

/// Frames from the middle of a scene, where it touches.
std::vector<Frame> film_of(const SyntheticSensor& sensor) {
  std::vector<Frame> film(kFrames);
  const uint64_t first = sensor.frame_count().value_or(2 * kFrames) / 2;
  for (uint64_t i = 0; i < kFrames; ++i) sensor.render(first + i, film[i]);
  return film;
}

/// A folder of the system's for files that nobody keeps.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::string pattern = (fs::temp_directory_path() / "palpate-profile-XXXXXX").string();
    if (!::mkdtemp(pattern.data()))
      throw Error(Failure::Output, "a folder for a recording that is thrown away",
                  "none could be made as '" + pattern + "'", "TMPDIR=DIR of a folder with room");
    path = pattern;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  fs::path path;
};

double mean(const std::vector<double>& values) {
  return values.empty()
             ? 0
             : std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

struct Span {
  std::string name;
  double begin_ms = 0, end_ms = 0;
};

const char* step_of(const std::string& part) {
  static const std::map<std::string, const char*> steps = {
      {"capture", "capture"},    {"begin frame", "submit"}, {"check picture", "submit"},
      {"light", "submit"},       {"upload", "submit"},      {"submit", "submit"},
      {"device wait", "device"}, {"finish", "finish"},      {"rest correction", "finish"},
      {"traction", "finish"},    {"write", "draw"},         {"draw", "draw"},
      {"encode", "record"},      {"deliver", "hand over"}};
  const auto at = steps.find(part);
  return at == steps.end() ? "finish" : at->second;
}

/// Each span's time less that of the spans within it, by name.
std::map<std::string, std::vector<double>> own_times(std::vector<Span> spans) {
  std::ranges::sort(spans, [](const Span& a, const Span& b) {
    return a.begin_ms != b.begin_ms ? a.begin_ms < b.begin_ms : a.end_ms > b.end_ms;
  });
  std::vector<double> own_ms;
  std::vector<size_t> open;
  for (size_t i = 0; i < spans.size(); ++i) {
    const double long_ms = spans[i].end_ms - spans[i].begin_ms;
    while (!open.empty() && spans[open.back()].end_ms <= spans[i].begin_ms) open.pop_back();
    if (!open.empty()) own_ms[open.back()] -= long_ms;
    own_ms.push_back(long_ms);
    open.push_back(i);
  }
  std::map<std::string, std::vector<double>> times;
  for (size_t i = 0; i < spans.size(); ++i) times[spans[i].name].push_back(std::max(0.0, own_ms[i]));
  return times;
}

/// A live run of a scene's frames: as a camera's with drawing and recording, or as fast as it goes.
class PhotonRun {
 public:
  PhotonRun(gpu::Context& context, const PhotonScene& scene, const MakeDrawer& drawer)
      : context_(context),
        options_(parse_synthetic(scene.input)),
        simulated_(options_),
        sensor_(synthetic_sensor(options_)),
        background_(*simulated_.own_background()),
        film_(film_of(simulated_)),
        draw_(drawer(context, sensor_)) {
    pipeline_.outputs = scene.outputs;
    figure_.scene = scene.name;
    figure_.width_px = options_.width;
    figure_.height_px = options_.height;
    figure_.rate_Hz = options_.rate_Hz;
  }

  void at_the_cameras_pace(double seconds, const std::function<bool()>& stopped) {
    const ScratchFolder scratch;
    const fs::path trace_file = scratch.path / "trace.json";
    FilmSource source(film_, options_.rate_Hz);
    Recording recording([&] { return scratch.path / "session"; },
                        session_info({scene_input(), sensor_, std::nullopt, pipeline_.outputs}, source,
                                     background_, pipeline_, context_),
                        SessionOptions{});
    recording.start();
    std::optional<TraceFile> trace;
    uint64_t seen = 0;
    std::vector<double> measured_ms, shown_ms;
    LiveOptions live;
    live.max_seconds = seconds;
    live.interrupted = stopped;
    live.recording = &recording;
    live.draw = draw_;
    live.on_times = [&](const FrameTimes& times) {
      if (++seen <= kWarmUp) return;
      if (!trace) trace.emplace(trace_file);
      measured_ms.push_back(times.to_measured_ms());
      if (times.shown_ns != 0) shown_ms.push_back(times.to_shown_ms());
    };
    const LiveReport report = run(live);
    recording.finish();
    if (!trace) return;
    trace.reset();
    std::ifstream in(trace_file, std::ios::binary);
    figure_.parts = thread_parts({std::istreambuf_iterator<char>(in), {}});
    figure_.frames = report.captured;
    figure_.dropped_before_engine = report.dropped_before_engine;
    figure_.dropped_before_display = report.dropped_before_display;
    figure_.to_measured = distribution_of(measured_ms);
    figure_.to_picture = distribution_of(shown_ms);
    double work_ms = 0;
    for (const ThreadPart& part : figure_.parts)
      if (part.thread == "engine" || part.thread == kDrawing) work_ms += part.ms_per_turn;
    figure_.waits_ms = std::max(0.0, mean(shown_ms) - work_ms);
  }

  void as_fast_as_it_goes(double seconds, const std::function<bool()>& stopped) {
    std::vector<int64_t> measured_ns;
    LiveOptions live;
    live.max_seconds = seconds;
    live.interrupted = stopped;
    live.unpaced = live.measure_all = true;
    live.on_times = [&](const FrameTimes& times) { measured_ns.push_back(times.measured_ns); };
    run(live);
    if (measured_ns.size() <= kWarmUp + 1) return;
    const auto frames = static_cast<double>(measured_ns.size() - kWarmUp - 1);
    std::ranges::sort(measured_ns);
    figure_.frames_per_s = frames / (1e-9 * static_cast<double>(measured_ns.back() - measured_ns[kWarmUp]));
  }

  const PhotonFigure& figure() const { return figure_; }

 private:
  static constexpr const char* kDrawing = "drawing";

  std::string scene_input() const { return to_string(options_); }
  /// The calling thread draws.
  LiveReport run(const LiveOptions& live) {
    name_trace_thread(kDrawing);
    return run_without_window(
        context_, [&] { return std::make_shared<FilmSource>(film_, options_.rate_Hz); },
        {sensor_, background_, pipeline_}, live);
  }

  gpu::Context& context_;
  SyntheticOptions options_;
  SyntheticSensor simulated_;
  Sensor sensor_;
  Frame background_;
  std::vector<Frame> film_;
  DrawResult draw_;
  PipelineOptions pipeline_;
  PhotonFigure figure_;
};

}  // namespace

std::vector<ThreadPart> thread_parts(const std::string& trace) {
  std::map<int64_t, std::string> names;
  std::map<std::string, std::vector<Span>> threads;
  double from_ms = INFINITY, to_ms = 0;
  for (const json::Value& event : json::parse(trace, {.deepest = 8})) {
    const int64_t number = event.at("tid").get<int64_t>();
    if (event.at("ph") == json::Value("M")) {
      names[number] = event.at("args").at("name").get<std::string>();
      continue;
    }
    const double begin_ms = 1e-3 * event.at("ts").number(), long_ms = 1e-3 * event.at("dur").number();
    threads[names[number]].push_back({event.at("name").get<std::string>(), begin_ms, begin_ms + long_ms});
    from_ms = std::min(from_ms, begin_ms);
    to_ms = std::max(to_ms, begin_ms + long_ms);
  }
  std::vector<ThreadPart> parts;
  for (const auto& [thread, spans] : threads) {
    const std::map<std::string, std::vector<double>> times = own_times(spans);
    // A thread's turns: how often it did what it does most often, once a frame that came to it.
    size_t turns = 1;
    for (const auto& [part, own_ms] : times) turns = std::max(turns, own_ms.size());
    for (const auto& [part, own_ms] : times) {
      const double sum_ms = std::accumulate(own_ms.begin(), own_ms.end(), 0.0);
      parts.push_back({thread, step_of(part), part, distribution_of(own_ms),
                       sum_ms / static_cast<double>(turns), sum_ms / (to_ms - from_ms)});
    }
  }
  const auto place = [](const ThreadPart& p) {
    return std::ranges::find(kPhotonSteps, p.step) - std::begin(kPhotonSteps);
  };
  std::ranges::stable_sort(parts, {}, [&](const ThreadPart& p) { return std::pair(p.thread, place(p)); });
  return parts;
}

void measure_photon(const gpu::ContextOptions& device, const MakeDrawer& drawer, double seconds,
                    const Watch& watch, Profile& profile) {
  const double each_s = seconds / static_cast<double>(std::size(kScenes));
  if (each_s < kLeast_s) return skip("from photon to picture", watch, profile);
  gpu::Context context(device);
  for (const PhotonScene& scene : kScenes) {
    if (watch.stopped()) return;
    const double start_s = wall_now_s();
    PhotonRun run(context, scene, drawer);
    const double left_s = std::max(kLeast_s, each_s - (wall_now_s() - start_s));
    try {
      run.at_the_cameras_pace(kPaced * left_s, watch.stopped);
    } catch (const Error& e) {  // nothing can be recorded here: the rest of the profile stands
      if (e.failure() != Failure::Output && e.failure() != Failure::Input) throw;
      return skip("from photon to picture", watch, profile, e.what());
    }
    run.as_fast_as_it_goes((1 - kPaced) * left_s, watch.stopped);
    if (!run.figure().parts.empty()) profile.photon.push_back(run.figure());
    watch.say(std::string("from photon to picture, ") + scene.name + ": done");
  }
  watch.leave(context);
}

}  // namespace palpate::perf
