#include "viz/commands/workflow/serving.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <utility>

#include "capture/files/event_log.h"
#include "engine/base/clock.h"
#include "engine/base/json.h"
#include "palpate/error.h"
#include "viz/commands/workflow/web_page.h"

namespace palpate {
namespace {

using Json = json::Value;

enum Request : size_t { Zero, Mark, Start, Stop };
struct KnownRequest {
  const char* name;
  const char* type;
  const char* argument;
};
constexpr std::array kRequests = {
    KnownRequest{"zero", "palpate.Zero",
                 R"({"type":"object","properties":{"on":{"type":"boolean","default":true}}})"},
    KnownRequest{"mark", "palpate.Mark", R"({"type":"object","properties":{"text":{"type":"string"}}})"},
    KnownRequest{"start", "palpate.Start", R"({"type":"object"})"},
    KnownRequest{"stop", "palpate.Stop", R"({"type":"object"})"}};
constexpr size_t kLongestMark = 200;

std::vector<ServedRequest> requests_of(const std::vector<LiveHub::Publisher>& publishers) {
  const std::string root = publishers.size() > 1 ? "grip" : topic_name(publishers.front().sensor.name);
  std::vector<ServedRequest> requests;
  requests.reserve(kRequests.size());
  for (const KnownRequest& known : kRequests)
    requests.push_back({"/" + root + "/" + known.name, known.type, known.argument});
  return requests;
}

std::vector<LiveHub::Publisher> publishers_of(const PairParts& parts) {
  std::vector<LiveHub::Publisher> publishers;
  for (const Side side : kSides) {
    const OpenFinger& finger = parts.fingers[index(side)];
    const Outputs outputs = finger.pipeline.outputs;
    publishers.push_back(
        {finger.found.sensor, outputs, MeasuredColumns::of(finger.found.sensor, outputs), to_string(side)});
  }
  return publishers;
}

/// Its forces less those of `zero`.
GripFrame tared(GripFrame frame, const Grip& zero) {
  if (!frame.grip) return frame;
  for (const auto force :
       {&Grip::force_N, &Grip::imbalance_N, &Grip::load_x_N, &Grip::load_y_N, &Grip::load_z_N})
    (*frame.grip).*force = viz::tared((*frame.grip).*force, zero.*force);
  return frame;
}

Json argument_of(const std::string& text) {
  if (text.empty()) return Json::object();
  try {
    Json json = json::parse(text, {.deepest = 8});
    if (json.is_object()) return json;
  } catch (const json::Error&) {
    // Said below.
  }
  throw Error(Failure::Usage, "an object of JSON as the request's argument", "something else", "{}");
}

std::string dumped(const Json& json) {
  return json.dump(-1, json::Utf8::Replace);
}

}  // namespace

Serving::Serving(ServeOptions options, std::vector<LiveHub::Publisher> publishers,
                 std::filesystem::path notes)
    : hub_(publishers), notes_(std::move(notes)), open_(!options.token.empty()), fingers_(publishers.size()) {
  options.page = web_page();
  options.name = "palpate: " + (publishers.size() > 1 ? "two fingers" : publishers.front().sensor.name);
  server_.emplace(hub_, std::move(options), requests_of(publishers));
}

Serving::Serving(ServeOptions options, const LiveHub::Publisher& sensor, std::filesystem::path notes)
    : Serving(std::move(options), std::vector{sensor}, std::move(notes)) {}

Serving::Serving(ServeOptions options, const PairParts& parts, std::filesystem::path notes)
    : Serving(std::move(options), publishers_of(parts), std::move(notes)) {
  meter_.emplace(parts.grip);
  take(parts.recording);
  for (size_t i = 0; i < parts.fingers.size(); ++i)
    parts.fingers[i].live.on_newest = [this, i](const Frame& frame, const Result& result) {
      show(i, frame, result);
    };
  parts.options.on_pair = [this,
                           before = std::move(parts.options.on_pair)](const Matched<FingerTouch>& pair) {
    if (before) before(pair);
    int64_t host_ns = 0;
    for (const std::optional<FingerTouch>& finger : pair.of)
      if (finger) host_ns = host_ns == 0 ? finger->host_ns : host_ns + (finger->host_ns - host_ns) / 2;
    show(meter_->add(pair), host_ns);
  };
  parts.options.on_state = [this, before = std::move(parts.options.on_state)](Side side,
                                                                              const std::string& state) {
    event("finger", std::string(to_string(side)) + ": " + (state.empty() ? "frames come again" : state));
    if (before) before(side, state);
  };
  watch(parts.options);
}

Serving::~Serving() = default;

void Serving::attach(LiveOptions& options, Recording* recording) {
  take(recording);
  options.on_newest = [this, before = std::move(options.on_newest)](const Frame& frame,
                                                                    const Result& result) {
    if (before) before(frame, result);
    show(0, frame, result);
  };
  watch(options);
}

void Serving::attach(ProcessRequest& request) {
  static constexpr int64_t kApart_ns = 1'000'000'000 / 30, kShare = 33;
  request.on_result = [this, before = std::move(request.on_result), next_ns = int64_t{0}](
                          const Pipeline& pipeline, const Result& result, const Frame& frame) mutable {
    if (before) before(pipeline, result, frame);
    const int64_t start_ns = monotonic_ns();
    if (start_ns < next_ns) return;
    carry_out();
    show(0, frame, result);
    const int64_t end_ns = monotonic_ns();
    next_ns = end_ns + std::max(kApart_ns, kShare * (end_ns - start_ns));
  };
}

template <typename Switch>
void Serving::take(Switch* recording) {
  if (!recording) return;
  sessions_ = {[recording] { recording->start(); }, [recording] { recording->stop(); },
               [recording] { return recording->on(); }, [recording] { return recording->latest().folder; }};
}

template <typename Options>
void Serving::watch(Options& options) {
  options.interrupted = [this, before = std::move(options.interrupted)] {
    carry_out();
    return before && before();
  };
  options.on_device_lost = [this, before = std::move(options.on_device_lost)](const DeviceLost& lost) {
    event("device lost", lost.what());
    if (before) before(lost);
  };
}

void Serving::carry_out() {
  server_->carry_out(
      [this](size_t request, const std::string& argument) { return handle(request, argument); });
}

void Serving::show(size_t finger, const Frame& frame, const Result& result) {
  viz::Tare tare;
  {
    const std::lock_guard lock(mutex_);
    fingers_[finger].newest = result.touch;
    tare = fingers_[finger].tare;
  }
  hub_.publish(finger, frame, result, tare.on ? viz::tared(result.touch, tare) : result.touch, tare.on);
}

void Serving::show(const GripFrame& frame, int64_t host_ns) {
  std::optional<Grip> zero;
  {
    const std::lock_guard lock(mutex_);
    if (frame.grip) grip_ = frame.grip;
    zero = grip_zero_;
  }
  hub_.publish_grip(zero ? tared(frame, *zero) : frame, host_ns, zero.has_value());
}

std::string Serving::where() const {
  return "serving at " + server_->url() +
         (open_ ? "; the connection is not encrypted: whoever hears it hears the token" : "");
}

std::string Serving::handle(size_t request, const std::string& argument) {
  const Json given = argument_of(argument);
  switch (request) {
    case Zero: {
      const Json* on = given.find("on");
      if (on && !on->is_boolean())
        throw Error(Failure::Usage, "\"on\": true or false", "another kind", "{\"on\": true}");
      return zero(!on || on->boolean());
    }
    case Mark: {
      const Json* text = given.find("text");
      if (text && (!text->is_string() || text->text().size() > kLongestMark))
        throw Error(Failure::Usage, "\"text\" of at most 200 letters", "something else",
                    "{\"text\": \"here\"}");
      return mark(text ? text->text() : "");
    }
    case Start: {
      if (!sessions_)
        throw Error(Failure::Usage, "a folder for sessions", "none", "palpate serve --out FOLDER");
      sessions_->start();
      const std::string name = sessions_->folder().filename().string();
      event("session begun", name);
      return dumped({{"session", name}});
    }
    case Stop: {
      if (!sessions_ || !sessions_->on()) throw Error(Failure::Usage, "a session to stop", "none", "start");
      const std::string name = sessions_->folder().filename().string();
      sessions_->stop();
      event("session ended", name);
      return dumped({{"session", name}});
    }
    default:
      throw Error(Failure::Usage, "a request that is offered", "another", "zero, mark, start or stop");
  }
}

std::string Serving::zero(bool on) {
  bool was = false, set = false;
  {
    const std::lock_guard lock(mutex_);
    for (Finger& finger : fingers_) {
      was = was || finger.tare.on;
      if (!on)
        finger.tare = {};
      else if (finger.newest)
        set = finger.tare.set(*finger.newest) || set;
    }
    if (set || !on) grip_zero_ = on ? grip_ : std::nullopt;
  }
  if (on && !set)
    throw Error(Failure::Usage, "a force to make zero", "none: nothing touches, or it is not calibrated",
                "again while something touches");
  if (on)
    event("zero", [](const Finger& finger) { return finger.tare.words(); });
  else if (was)
    event("zero ended", "");
  return dumped({{"on", on}});
}

std::string Serving::mark(const std::string& text) {
  Json answer = Json::object();
  {
    const std::lock_guard lock(mutex_);
    for (size_t i = 0; i < fingers_.size(); ++i)
      if (fingers_[i].newest)
        answer[fingers_.size() > 1 ? to_string(kSides[i]) : "frame"] = fingers_[i].newest->sequence;
  }
  if (answer.empty()) throw Error(Failure::Usage, "a frame to mark", "none yet", "again");
  event("mark", text.empty() ? "client" : text);
  return dumped(answer);
}

void Serving::event(const std::string& kind, const std::string& text) {
  event(kind, [&](const Finger&) { return text; });
}

void Serving::event(const std::string& kind, const std::function<std::string(const Finger&)>& text) {
  const std::filesystem::path folder = sessions_ && sessions_->on() ? sessions_->folder() : notes_;
  for (size_t i = 0; i < fingers_.size(); ++i) {
    viz::Event event{.frame = 0, .time_s = 0, .kind = kind, .text = {}};
    {
      const std::lock_guard lock(mutex_);
      const Finger& finger = fingers_[i];
      if (finger.newest) event.frame = finger.newest->sequence;
      if (finger.newest) event.time_s = 1e-9 * static_cast<double>(finger.newest->time_ns);
      event.text = text(finger);
    }
    hub_.publish_event(i, {event.frame, event.time_s, kind, event.text});
    if (folder.empty()) continue;
    try {
      viz::append_event(fingers_.size() > 1 ? finger_folder(folder, kSides[i]) : folder, event);
    } catch (const Error& error) {
      spdlog::warn("{}", error.what());
    }
  }
}

Facts Serving::finish() {
  server_->stop();
  const ServeSummary s = server_->summary();
  Facts facts;
  facts.add("served",
            {{"clients", s.clients},
             {"messages", s.sent},
             {"bytes", s.bytes},
             {"dropped", s.dropped},
             {"stalled", s.stalled},
             {"refused", s.refused}},
            describe(s) + "\n");
  return facts;
}

}  // namespace palpate
