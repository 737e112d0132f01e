#include "capture/session/info.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <tuple>

#include "engine/base/json.h"
#include "palpate/error.h"

namespace palpate {
namespace {

using Json = json::Value;

constexpr int kVersion = 1;
constexpr std::array<std::pair<const char*, Output>, 7> kOutputs = {{{"force", Output::Force},
                                                                     {"surface", Output::Surface},
                                                                     {"confidence", Output::Confidence},
                                                                     {"contacts", Output::Contacts},
                                                                     {"skin", Output::Skin},
                                                                     {"traction", Output::Traction},
                                                                     {"motion", Output::Motion}}};
// The last two are in older sessions only.
constexpr std::array<std::pair<const char*, std::pair<SurfaceSolver, SolveBy>>, 6> kSolvers = {
    {{"live", {SurfaceSolver::Live, SolveBy::Auto}},
     {"best", {SurfaceSolver::Best, SolveBy::Auto}},
     {"converged", {SurfaceSolver::Best, SolveBy::Device}},
     {"exact", {SurfaceSolver::Best, SolveBy::Host}},
     {"auto", {SurfaceSolver::Best, SolveBy::Auto}},
     {"fine", {SurfaceSolver::Best, SolveBy::Auto}}}};

[[noreturn]] void fail(const std::string& where, const std::string& wanted, const std::string& found,
                       const char* remedy = "another session; this one was changed or damaged") {
  throw Error(Failure::Input, where + ": " + wanted, found, remedy);
}

std::string shown(const Json& value) {
  if (value.is_structured()) return value.is_array() ? "a list" : "an object";
  const std::string text = value.dump(-1, json::Utf8::Ascii);
  return text.size() > 60 ? text.substr(0, 57) + "..." : text;
}

/// One JSON object whose keys are asked for by name and type.
class Reader {
 public:
  Reader(const Json& object, std::string where) : object_(object), where_(std::move(where)) {
    if (!object.is_object()) fail(where_, "an object { ... }", shown(object));
  }
  bool has(const char* key) const { return object_.contains(key) && !object_[key].is_null(); }
  const Json& at(const char* key) const {
    if (!has(key)) fail(path(key), "this key", "none");
    return object_[key];
  }
  std::string path(const std::string& key) const { return where_ + "." + key; }
  uint64_t whole(const char* key, uint64_t low, uint64_t high) const {
    const Json& value = at(key);
    if (!value.is_unsigned() || value.get<uint64_t>() < low || value.get<uint64_t>() > high)
      fail(path(key), "a whole number from " + std::to_string(low) + " to " + std::to_string(high),
           shown(value));
    return value.get<uint64_t>();
  }
  int64_t integer(const char* key) const {
    try {
      return at(key).get<int64_t>();
    } catch (const json::Error&) {
      fail(path(key), "a whole number", shown(at(key)));
    }
  }
  double number(const char* key, double low, double high) const {
    const Json& value = at(key);
    if (!value.is_number() || !(value.get<double>() >= low && value.get<double>() <= high))
      fail(path(key), "a number from " + std::to_string(low) + " to " + std::to_string(high), shown(value));
    return value.get<double>();
  }
  bool truth(const char* key) const {
    if (!at(key).is_boolean()) fail(path(key), "true or false", shown(at(key)));
    return at(key).get<bool>();
  }
  std::string text(const char* key) const { return text(at(key), path(key)); }
  static std::string text(const Json& value, const std::string& where) {
    if (!value.is_string()) fail(where, "a text", shown(value));
    return value.get<std::string>();
  }
  template <typename Names>
  static auto choice(const std::string& found, const Names& names, const std::string& where) {
    for (const auto& [name, value] : names)
      if (found == name) return value;
    std::string list;
    for (const auto& [name, value] : names) list += (list.empty() ? "" : ", ") + std::string(name);
    fail(where, "one of " + list, shown(Json(found)));
  }

 private:
  const Json& object_;
  std::string where_;
};

Json parse(const std::string& text, const std::string& where) {
  try {
    return json::parse(text, {.deepest = 32});
  } catch (const json::TooDeep&) {
    fail(where, "a session's text", "lists in lists beyond reason");
  } catch (const json::Error& e) {
    fail(where, "valid JSON", std::string(e.what()).substr(0, 129),
         "removing it: frames.mkv holds a copy of what it said at the start");
  }
}

FrameFormat read_format(const Reader& frame) {
  FrameFormat format;
  format.width = static_cast<uint32_t>(frame.whole("width", 1, kMaxSide_px));
  format.height = static_cast<uint32_t>(frame.whole("height", 1, kMaxSide_px));
  format.channels = static_cast<uint32_t>(frame.whole("channels", 1, 3));
  format.bit_depth = static_cast<uint32_t>(frame.whole("bit_depth", 8, 16));
  if (format.channels == 2 || (format.channels == 3 && format.bit_depth != 8))
    fail(frame.path("channels"), "1, or 3 of 8 bits",
         std::to_string(format.channels) + " of " + std::to_string(format.bit_depth) + " bits");
  return format;
}

Json clock_json(const WallClock& clock) {
  return {{"realtime_ahead_ns", clock.ahead_ns}, {"error_ns", clock.error_ns}};
}

std::optional<WallClock> read_clock(const Reader& of) {
  if (!of.has("clock")) return std::nullopt;
  const Reader clock(of.at("clock"), of.path("clock"));
  return WallClock{clock.integer("realtime_ahead_ns"), clock.integer("error_ns")};
}

void read_end(const Reader& end, SessionEnd& read) {
  constexpr uint64_t kMost = uint64_t{1} << 62;
  read.frames = end.whole("frames", 0, kMost);
  read.dropped = end.whole("dropped", 0, kMost);
  read.measured = end.whole("measured", 0, kMost);
  read.unmatched = end.whole("unmatched", 0, kMost);
  read.video_bytes = end.whole("video_bytes", 0, kMost);
  if (end.has("ended_by")) read.ended_by = end.text("ended_by");
  read.clock = read_clock(end);
}

}  // namespace

std::string to_text(const SessionInfo& info, const SessionEnd& end, const SessionStart& start) {
  Json outputs = Json::array(), details = Json::array();
  for (const auto& [name, output] : kOutputs)
    if (wants(info.outputs, output)) outputs.push_back(name);
  for (const auto& [name, value] : info.details) details.push_back(Json::array({name, value}));
  const auto solver = std::ranges::find_if(kSolvers, [&](const auto& one) {
    return one.second.first == info.solver &&
           (info.solver == SurfaceSolver::Live || one.second.second == info.solve_by);
  });
  const FrameFormat& f = info.format;
  Json json{
      {"palpate_session", kVersion},
      {"complete", end.complete},
      {"started", start.date},
      {"clock", clock_json(start.clock)},
      {"input", info.input},
      {"frame",
       {{"width", f.width}, {"height", f.height}, {"channels", f.channels}, {"bit_depth", f.bit_depth}}},
      {"rate_Hz", info.rate_Hz},
      {"background", info.background ? Json(kSessionBackground) : Json()},
      {"measured",
       {{"outputs", outputs},
        {"solver", solver->first},
        {"fixed_background", info.fixed_light},
        {"separate_pictures", info.separate}}},
      {"program_version", info.program_version},
      {"device", info.device},
      {"details", details},
      {"sensor", info.sensor ? json::parse(sensor_text(*info.sensor)) : Json()}};
  if (end.complete || !end.ended_by.empty()) {
    json["end"] = {{"frames", end.frames},           {"dropped", end.dropped},
                   {"measured", end.measured},       {"unmatched", end.unmatched},
                   {"video_bytes", end.video_bytes}, {"ended_by", end.ended_by}};
    if (end.clock) json["end"]["clock"] = clock_json(*end.clock);
  }
  return json.dump(2, json::Utf8::Replace) + "\n";
}

std::string session_json(const std::filesystem::path& folder) {
  std::ifstream in(folder / kSessionJson, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

SessionText session_from_text(const std::string& text, const std::string& where) {
  const Json json = parse(text, where);
  const Reader top(json, where);
  const uint64_t version = top.whole("palpate_session", 1, UINT32_MAX);
  if (version != kVersion)
    fail(top.path("palpate_session"), "version " + std::to_string(kVersion), std::to_string(version),
         "a newer palpate");
  SessionText read;
  read.info.format = read_format(Reader(top.at("frame"), top.path("frame")));
  read.info.input = top.text("input");
  read.info.rate_Hz = top.number("rate_Hz", 0, 1e6);
  read.info.program_version = top.text("program_version");
  read.info.device = top.text("device");
  read.has_background = top.has("background");
  if (read.has_background && top.text("background") != kSessionBackground)
    fail(top.path("background"), std::string("'") + kSessionBackground + "' or null",
         shown(top.at("background")));
  const Reader measured(top.at("measured"), top.path("measured"));
  if (!measured.at("outputs").is_array())
    fail(measured.path("outputs"), "a list", shown(measured.at("outputs")));
  for (const Json& output : measured.at("outputs"))
    read.info.outputs |=
        Reader::choice(Reader::text(output, measured.path("outputs")), kOutputs, measured.path("outputs"));
  std::tie(read.info.solver, read.info.solve_by) =
      Reader::choice(measured.text("solver"), kSolvers, measured.path("solver"));
  // Sessions of before it was followed do not say so.
  read.info.fixed_light = !measured.has("fixed_background") || measured.truth("fixed_background");
  read.info.separate = measured.has("separate_pictures") && measured.truth("separate_pictures");
  if (!top.at("details").is_array()) fail(top.path("details"), "a list", shown(top.at("details")));
  for (const Json& detail : top.at("details")) {
    if (!detail.is_array() || detail.size() != 2) fail(top.path("details"), "pairs of texts", shown(detail));
    read.info.details.emplace_back(Reader::text(detail[0], top.path("details")),
                                   Reader::text(detail[1], top.path("details")));
  }
  if (top.has("sensor")) {
    read.info.sensor = sensor_from_text(top.at("sensor").dump(), top.path("sensor"));
    const Sensor& s = *read.info.sensor;
    if (s.channels != read.info.format.channels || s.bit_depth != read.info.format.bit_depth)
      fail(top.path("sensor"), "channels and bit_depth as those of \"frame\"",
           std::to_string(s.channels) + " of " + std::to_string(s.bit_depth) + " bits");
  }
  read.clock = read_clock(top);
  read.end.complete = top.truth("complete");
  if (read.end.complete || top.has("end")) read_end(Reader(top.at("end"), top.path("end")), read.end);
  return read;
}

}  // namespace palpate
