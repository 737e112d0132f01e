#include "perf/profile/photon.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <numeric>
#include <optional>

#include "capture/live/recorder.h"
#include "capture/run/record_session.h"
#include "engine/base/json.h"
#include "engine/base/readable.h"
#include "engine/base/trace.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "perf/profile/paced.h"

namespace palpate::perf {
namespace {

namespace fs = std::filesystem;

constexpr double kLeast_s = 2;  // of a scene
constexpr double kPaced = 0.7;  // of a scene's time; the rest is as fast as it goes

constexpr PacedScene kScenes[] = {
    {"waveguide: force, contacts", "synthetic:fingers?size=320x240&rate=60",
     Output::Force | Output::Contacts},
    {"colour gel: surface", "synthetic:fingers?size=640x480&mode=gel&rate=30",
     Output::Force | Output::Contacts | Output::Surface},
    {"marker gel: traction", "synthetic:slide?size=640x480&mode=gel&skin=markers&rate=30",
     Output::Force | Output::Contacts | Output::Surface | Output::Skin | Output::Traction}};

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

constexpr const char* kDrawing = "drawing";

/// A film as a camera's frames, with drawing and recording; false where no frame counted.
bool run_at_the_cameras_pace(gpu::Context& context, const Film& film, Outputs outputs,
                             const MakeDrawer& drawer, double seconds, const std::function<bool()>& stopped,
                             PhotonFigure& figure) {
  const ScratchFolder scratch;
  const fs::path trace_file = scratch.path / "trace.json";
  PipelineOptions pipeline;
  pipeline.outputs = outputs;
  const std::unique_ptr<Source> source = film.play();
  Recording recording([&] { return scratch.path / "session"; },
                      session_info({to_string(film.options()), film.sensor(), std::nullopt, outputs}, *source,
                                   film.background(), pipeline, context),
                      SessionOptions{});
  recording.start();
  std::optional<TraceFile> trace;
  Ages ages(kWarmUpFrames);
  LiveOptions live;
  live.max_seconds = seconds;
  live.interrupted = stopped;
  live.recording = &recording;
  live.draw = drawer(context, film.sensor());
  live.on_times = [&](const FrameTimes& times) {
    if (ages.add(times) && !trace) trace.emplace(trace_file);
  };
  name_trace_thread(kDrawing);
  const LiveReport report = film.run(context, outputs, live);
  recording.finish();
  if (!trace) return false;
  trace.reset();
  std::ifstream in(trace_file, std::ios::binary);
  figure.parts = thread_parts({std::istreambuf_iterator<char>(in), {}});
  ages.into(report, figure);
  double work_ms = 0;
  for (const ThreadPart& part : figure.parts)
    if (part.thread == "engine" || part.thread == kDrawing) work_ms += part.ms_per_turn;
  figure.waits_ms = std::max(0.0, ages.mean_to_picture_ms() - work_ms);
  return !figure.parts.empty();
}

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
  for (const PacedScene& scene : kScenes) {
    if (watch.stopped()) return;
    const double start_s = wall_now_s();
    const Film film(scene);
    auto figure = film.figure<PhotonFigure>();
    const double left_s = std::max(kLeast_s, each_s - (wall_now_s() - start_s));
    bool any = false;
    try {
      any = run_at_the_cameras_pace(context, film, scene.outputs, drawer, kPaced * left_s, watch.stopped,
                                    figure);
    } catch (const Error& e) {  // nothing can be recorded here: the rest of the profile stands
      if (e.failure() != Failure::Output && e.failure() != Failure::Input) throw;
      return skip("from photon to picture", watch, profile, e.what());
    }
    figure.frames_per_s = film.frames_per_s(context, scene.outputs, (1 - kPaced) * left_s, watch.stopped);
    if (any) profile.photon.push_back(figure);
    watch.say(std::string("from photon to picture, ") + scene.name + ": done");
  }
  watch.leave(context);
}

}  // namespace palpate::perf
