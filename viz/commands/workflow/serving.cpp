#include "viz/commands/workflow/serving.h"

#include <spdlog/spdlog.h>

#include <array>
#include <utility>

#include "capture/files/event_log.h"
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

std::vector<ServedRequest> requests_of(const std::string& sensor) {
  std::vector<ServedRequest> requests;
  requests.reserve(kRequests.size());
  for (const KnownRequest& known : kRequests)
    requests.push_back({"/" + topic_name(sensor) + "/" + known.name, known.type, known.argument});
  return requests;
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

Serving::Serving(ServeOptions options, const LiveHub::Publisher& sensor, std::filesystem::path notes)
    : hub_({sensor}), notes_(std::move(notes)), open_(!options.token.empty()) {
  options.page = web_page();
  options.name = "palpate: " + sensor.sensor.name;
  server_.emplace(hub_, std::move(options), requests_of(sensor.sensor.name));
}

Serving::~Serving() = default;

void Serving::attach(LiveOptions& options, Recording* recording) {
  recording_ = recording;
  options.on_newest = [this, before = std::move(options.on_newest)](const Frame& frame,
                                                                    const Result& result) {
    if (before) before(frame, result);
    newest_ = result.touch;
    if (tare_.on)
      hub_.publish(0, frame, result, viz::tared(result.touch, tare_), true);
    else
      hub_.publish(0, frame, result, result.touch);
  };
  options.interrupted = [this, before = std::move(options.interrupted)] {
    server_->carry_out(
        [this](size_t request, const std::string& argument) { return handle(request, argument); });
    return before && before();
  };
  options.on_device_lost = [this, before = std::move(options.on_device_lost)](const DeviceLost& lost) {
    event("device lost", lost.what());
    if (before) before(lost);
  };
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
    case Start:
      if (!recording_)
        throw Error(Failure::Usage, "a folder for sessions", "none", "palpate serve --out FOLDER");
      recording_->start();
      event("session begun", recording_->latest().folder.filename().string());
      return dumped({{"session", recording_->latest().folder.filename().string()}});
    case Stop: {
      if (!recording_ || !recording_->on()) throw Error(Failure::Usage, "a session to stop", "none", "start");
      const std::string name = recording_->latest().folder.filename().string();
      recording_->stop();
      event("session ended", name);
      return dumped({{"session", name}});
    }
    default:
      throw Error(Failure::Usage, "a request that is offered", "another", "zero, mark, start or stop");
  }
}

std::string Serving::zero(bool on) {
  if (!on) {
    if (std::exchange(tare_, {}).on) event("zero ended", "");
  } else if (!newest_ || !tare_.set(*newest_)) {
    throw Error(Failure::Usage, "a force to make zero", "none: nothing touches, or it is not calibrated",
                "again while something touches");
  } else {
    event("zero", tare_.words());
  }
  return dumped({{"on", tare_.on}});
}

std::string Serving::mark(const std::string& text) {
  if (!newest_) throw Error(Failure::Usage, "a frame to mark", "none yet", "again");
  event("mark", text.empty() ? "client" : text);
  return dumped({{"frame", newest_->sequence}});
}

/// Sent, and written where events are.
void Serving::event(const std::string& kind, const std::string& text) {
  const viz::Event event{newest_ ? newest_->sequence : 0,
                         newest_ ? 1e-9 * static_cast<double>(newest_->time_ns) : 0, kind, text};
  hub_.publish_event(0, {event.frame, event.time_s, kind, text});
  const std::filesystem::path folder = recording_ && recording_->on() ? recording_->latest().folder : notes_;
  if (folder.empty()) return;
  try {
    viz::append_event(folder, event);
  } catch (const Error& error) {
    spdlog::warn("{}", error.what());
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
