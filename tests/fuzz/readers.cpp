#include "tests/fuzz/readers.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <boost/asio/buffer.hpp>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <opencv2/core.hpp>
#include <stdexcept>
#include <vector>

#include "capture/files/event_log.h"
#include "capture/files/images/images.h"
#include "capture/files/light_files.h"
#include "capture/files/lump_maps.h"
#include "capture/files/match_files.h"
#include "capture/files/npy.h"
#include "capture/files/tables/csv_table.h"
#include "capture/files/tables/gauge.h"
#include "capture/files/video.h"
#include "capture/log/log_table.h"
#include "capture/run/modulus/modulus_frames.h"
#include "capture/sensors/nominal_sensors.h"
#include "capture/serve/foxglove.h"
#include "capture/serve/handshake.h"
#include "capture/session/info.h"
#include "capture/synthetic/object_mesh.h"
#include "capture/video/session_video.h"
#include "engine/base/json.h"
#include "engine/lump/network/network.h"
#include "palpate/error.h"
#include "palpate/sensor.h"
#include "perf/lab/dataset/journal.h"
#include "perf/lab/judge/judged_table.h"
#include "perf/profile/profile.h"
#ifdef PALPATE_WHOLE_PROGRAM
#include "capture/calibrate/photometric/presses.h"
#include "capture/run/palpation/scan_recording.h"
#include "viz/panels/settings.h"
#endif

namespace palpate::fuzz {
namespace {

namespace fs = std::filesystem;

constexpr int kMostFrames = 32;

void expect(bool kept, const char* promise) {
  if (!kept) throw std::logic_error(std::string("broken: ") + promise);
}

std::string slurp(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void read_picture(const fs::path& file) {
  const cv::Mat image = read_image(file);
  expect(!image.empty() && image.rows <= int{kMaxSide_px} && image.cols <= int{kMaxSide_px},
         "an image has a size");
  expect(image.channels() == 1 || image.channels() == 3, "an image is gray or coloured");
}

Sensor any_sensor() {
  Sensor sensor;
  sensor.name = "any";
  sensor.pitch_mm_per_px = 0.1;
  return sensor;
}

void read_film(const fs::path& file) {
  VideoFile film(file, any_sensor());
  Frame frame;
  int frames = 0;
  const auto read = [&] {
    while (frames < kMostFrames && film.next(frame)) {
      ++frames;
      expect(frame.format == film.format() && frame.bytes.size() == frame.format.frame_bytes(),
             "a frame has the film's format");
    }
  };
  read();
  static_cast<void>(film.warning());
  static_cast<void>(film.cut_short());
  if (film.seek(1)) read();
}

void read_numbers(const fs::path& file) {
  const NpyArray array = read_npy(file);
  size_t count = 1;
  for (const size_t size : array.shape) count *= size;
  expect(array.values.size() == count, "values fill the shape");
}

void read_mesh(const fs::path& file) {
  const ObjectMesh mesh = read_stl(file);
  expect(!mesh.triangles.empty(), "there are triangles");
  for (const auto& triangle : mesh.triangles)
    for (const uint32_t corner : triangle) expect(corner < mesh.vertices.size(), "corners are there");
  for (const auto& vertex : mesh.vertices) expect(vertex.allFinite(), "places are finite");
}

void read_cells(const fs::path& file) {
  CsvTable table(file, "a table");
  while (table.next()) {
    expect(table.cells().size() == table.columns().size(), "a cell for each column");
    for (size_t i = 0; i < table.cells().size(); ++i)
      if (const auto number = table.number_if_any(i)) expect(std::isfinite(*number), "numbers are finite");
  }
}

void read_any_gauge(const fs::path& file) {
  for (const GaugeColumns wanted : {GaugeColumns::Normal, GaugeColumns::Tangential, GaugeColumns::Both}) {
    try {
      const Gauge gauge = read_gauge(file, wanted);
      expect(gauge.force_N.empty() || gauge.force_N.size() == gauge.size(), "a force for each time");
      expect(gauge.fx_N.size() == gauge.fy_N.size(), "two forces along the pad");
      expect(std::is_sorted(gauge.time_s.begin(), gauge.time_s.end()), "times rise");
      for (const auto* column : {&gauge.time_s, &gauge.force_N, &gauge.fx_N, &gauge.fy_N})
        for (const double value : *column) expect(std::isfinite(value), "readings are finite");
      static_cast<void>(describe_gaps(gauge));
    } catch (const Error&) {
      if (wanted == GaugeColumns::Both) throw;
    }
  }
}

/// What a client of the server sends, a message a line; what begins with the opcode of a call is bytes.
void read_client(const fs::path& file) {
  ServedOffer offer{.name = "pad",
                    .session = "1",
                    .topics = std::vector<Topic>(3),
                    .requests = {{"/pad/zero", "Zero", "{}"}}};
  FoxgloveClient client(offer);
  const std::string all = slurp(file);
  for (size_t from = 0, to = 0; from <= all.size(); from = to + 1) {
    to = std::min(all.find('\n', from), all.size());
    const std::string line = all.substr(from, to - from);
    const bool binary = !line.empty() && line[0] == 2;
    const FoxgloveClient::Answer answer =
        binary ? client.take_binary({reinterpret_cast<const uint8_t*>(line.data()), line.size()})
               : client.take_text(line);
    expect(client.subscriptions().size() <= FoxgloveClient::kMostSubscriptions, "subscriptions are bounded");
    for (const auto& [id, topic] : client.subscriptions())
      expect(topic < offer.topics.size(), "of channels that exist");
    for (const FoxgloveCall& call : answer.calls)
      expect(call.service < offer.requests.size(), "calls of requests that exist");
    for (const uint32_t id : answer.ready)
      expect(client.subscriptions().contains(id), "ready for subscriptions that exist");
    for (const std::string& text : answer.texts) static_cast<void>(json::parse(text));
  }
}

/// A request that a connection to the server begins with, judged as on this machine alone, with a token, and
/// where there is no more room.
void read_handshake(const fs::path& file) {
  const std::string bytes = slurp(file);
  RequestParser parser;
  bound(parser);
  parser.eager(true);
  boost::beast::error_code error;
  parser.put(boost::asio::buffer(bytes), error);
  if (error || !parser.is_done()) return;
  const HttpRequest& request = parser.get();
  const std::string host(view(request[boost::beast::http::field::host]));
  const std::string origin(view(request[boost::beast::http::field::origin]));
  const auto holds = [&](std::string_view part) { return bytes.find(part) != std::string::npos; };
  ServeOptions options;
  options.origins = {"https://app.foxglove.dev"};
  for (const bool loopback : {true, false})
    for (const bool full : {true, false}) {
      options.token = loopback ? "" : "0123456789abcdef0123456789abcdef";
      const Verdict verdict = judged(request, options, loopback, full);
      const bool let_in = verdict.kind != Verdict::Kind::Refused;
      const bool own = std::ranges::any_of(
          std::array{"localhost", "127.0.0.1", "[::1]"},
          [&](const char* name) { return host == name || host.starts_with(std::string(name) + ":"); });
      expect(!let_in || !loopback || own, "this machine alone");
      expect(!let_in || holds(options.token), "nobody without the token");
      expect(let_in || (static_cast<int>(verdict.status) >= 400 && *verdict.why), "a refusal says why");
      if (verdict.kind != Verdict::Kind::Client) continue;
      expect(!full, "no more clients than can be served");
      expect(origin.empty() || origin == options.origins[0] || origin.ends_with("://" + host),
             "pages of this server, or of those that were named");
    }
  const std::string_view protocol = protocol_of(request);
  expect(protocol.empty() || std::ranges::find(kFoxgloveProtocols, protocol) != kFoxgloveProtocols.end(),
         "a protocol that is spoken");
  expect(holds(protocol), "a protocol that was offered");
}

void read_any_log(const fs::path& file) {
  const LogTable log = read_log(file, "any");
  expect(log.rows() > 0 && !log.columns.empty() && log.columns.size() <= 2 * kMostLogColumns,
         "rows of columns");
  expect(log.stamps == LogStamps::None || log.stamp_s.size() == log.rows(), "a time for each row");
  for (const LogColumn& column : log.columns) {
    expect(column.values.size() == log.rows(), "a value for each row");
    for (const double value : column.values) expect(!std::isinf(value), "values are finite or missing");
  }
  for (size_t s = 0; s < log.stretches.size(); ++s) {
    const size_t end = s + 1 < log.stretches.size() ? log.stretches[s + 1] : log.rows();
    expect(log.stretches[s] < end, "stretches have rows");
    if (log.stamps == LogStamps::None) continue;
    expect(std::is_sorted(log.stamp_s.begin() + static_cast<ptrdiff_t>(log.stretches[s]),
                          log.stamp_s.begin() + static_cast<ptrdiff_t>(end)),
           "times rise");
  }
}

void read_set(const fs::path& file) {
  const PointSet set = read_points(file);
  expect(set.size() > set.axes && set.coordinates.size() == set.size() * set.axes, "points have coordinates");
}

void read_list_of_pairs(const fs::path& file) {
  expect(!read_pairs(file).empty(), "a list has pairs");
}

void read_cases(const fs::path& file) {
  const judge::Cases cases = read_judged_table(file, {});
  for (const judge::JudgedCase& one : cases.cases)
    expect(one.values.size() == cases.quantities.size() && one.conditions.size() == cases.conditions.size(),
           "a case has all its values");
}

void read_event_log(const fs::path& file) {
  for (const viz::Event& event : viz::read_events(file.parent_path()))
    expect(std::isfinite(event.time_s), "an event has a time");
}

void read_light_file(const fs::path& file) {
  const LightCalibration lights = load_light_calibration(file);
  for (const double weight : lights.stack.wx) expect(std::isfinite(weight), "weights are finite");
}

void read_scan(const fs::path& file) {
  LightImages images;
  images.width = 5;
  images.height = 4;
  expect(read_heights(file, images).size() == 20, "a height for each pixel");
}

void read_map(const fs::path& file) {
  const PressureMap map = read_pressure_map(file, 1);
  expect(map.values.size() == size_t{map.width} * map.height, "a value for each node");
}

void read_sensor(const fs::path& file) {
  const Sensor sensor = load_sensor(file);
  validate(sensor, "what was loaded");
  const std::string text = sensor_text(sensor);
  expect(sensor_text(sensor_from_text(text, "its own text")) == text, "a sensor's text reads back");
}

void read_session_text(const fs::path& file) {
  const SessionText text = session_from_text(slurp(file), "session.json");
  expect(text.info.format.frame_bytes() > 0, "frames have a size");
}

void read_session(const fs::path& folder) {
  Session session(folder);
  Frame frame;
  uint64_t frames = 0;
  while (session.next(frame)) {
    ++frames;
    expect(frame.format == session.format() && frame.bytes.size() == frame.format.frame_bytes(),
           "a frame has the session's format");
    static_cast<void>(session.recorded(frame.sequence));
  }
  expect(frames <= session.frame_count().value_or(0), "no more frames than were counted");
  static_cast<void>(session.warning());
  if (session.seek(0)) static_cast<void>(session.next(frame));
}

void read_session_video(const fs::path& file) {
  static_cast<void>(is_session(file));
  read_session(file.parent_path());
}

/// Makes the video that the file needs at its side.
void add_session_video(const fs::path& folder) {
  const fs::path video = folder / kSessionFrames;
  if (fs::exists(video)) return;
  Frame frame;
  frame.reshape({.width = 16, .height = 12, .channels = 1, .bit_depth = 8});
  SessionInfo info;
  info.format = frame.format;
  info.rate_Hz = 25;
  const auto writer = SessionVideoWriter::create(video, frame.format, info.rate_Hz, to_text(info, {}, {}));
  for (frame.sequence = 0; frame.sequence < 3; ++frame.sequence) {
    std::fill(frame.bytes.begin(), frame.bytes.end(), static_cast<uint8_t>(40 * frame.sequence));
    frame.time_ns = static_cast<int64_t>(frame.sequence) * 40'000'000;
    writer->write(frame);
  }
  writer->finish();
}

void read_session_rows(const fs::path& file) {
  add_session_video(file.parent_path());
  Session session(file.parent_path());
  for (const uint64_t sequence : session.measured_sequences())
    expect(session.recorded(sequence).has_value(), "measured frames have cells");
}

void read_network(const fs::path& file) {
  const std::string bytes = lump::Network::read(file).bytes();
  expect(lump::Network::parse(bytes, "its own bytes").bytes() == bytes, "a network's bytes read back");
}

void read_profile(const fs::path& file) {
  const perf::Profile profile = perf::load_profile(file);
  const std::string text = perf::file_text(profile);
  expect(perf::file_text(perf::parse_profile(text, file)) == text, "a profile's text reads back");
}

void read_kind_of_sensor(const fs::path& file) {
  const NominalSensor kind = load_nominal(file.string());
  for (const NominalSensor::Mode& mode : kind.modes) {
    const FrameFormat camera{
        .width = mode.size_px[0], .height = mode.size_px[1], .channels = kind.channels, .bit_depth = 8};
    Sensor sensor = any_sensor();
    sensor.channels = kind.channels;
    apply_nominal(kind, camera, sensor);
    validate(sensor, "a kind of sensor");
  }
}

void read_press_rows(const fs::path& file) {
  std::vector<std::string> notes;
  for (const PressFrame& frame : read_press_table(file, notes))
    expect(std::isfinite(frame.force_N), "a press has a force");
}

void read_approaches(const fs::path& file) {
  std::vector<std::string> notes;
  const std::vector<uint64_t> frames{0, 1, 5, 1000};
  expect(read_approach_table(file, frames, notes).size() == frames.size(), "an approach for each frame");
}

void read_journal(const fs::path& file) {
  const lump::Journal::Glance glance = lump::Journal::glance(file);
  if (glance.cases == 0) return;
  const lump::Journal journal(file, glance.sweep, glance.program);
  for (const auto& [number, at] : journal.cases())
    expect(journal.read(number).what.number == number, "a case has its number");
}

// These lead on to cameras, simulated sensors and the window.
#ifdef PALPATE_WHOLE_PROGRAM
void read_settings(const fs::path& file) {
  const viz::LoadedSettings loaded = viz::load_settings(file);
  expect(std::ranges::none_of(loaded.warning, [](unsigned char c) { return c < ' ' || c == 0x7f; }),
         "a warning is one line");
  expect(loaded.warning.size() < 700, "a warning is short");
  viz::save_settings(loaded.settings, file);
  const std::string text = slurp(file);
  const viz::LoadedSettings again = viz::load_settings(file);
  expect(again.warning.empty(), "settings read back");
  viz::save_settings(again.settings, file);
  expect(slurp(file) == text, "settings stay as they are");
}

void read_pressed_balls(const fs::path& file) {
  static_cast<void>(read_presses(file, file.parent_path() / "none", any_sensor(), false));
}

void read_scan_places(const fs::path& file) {
  for (const RecordedPress& press : read_places(file, {}, "gauge.csv"))
    expect(std::isfinite(press.place_mm[0]) && std::isfinite(press.place_mm[1]), "a press has a place");
}

#endif

void put_big_endian(std::span<uint8_t> to, uint32_t value) {
  for (int i = 0; i < 4; ++i) to[static_cast<size_t>(i)] = static_cast<uint8_t>(value >> (24 - 8 * i));
}

/// The check sums of PNG's chunks, as far as their lengths lead.
void mend_png(std::span<uint8_t> bytes) {
  constexpr size_t kSignature = 8, kOutside = 12;
  for (size_t at = kSignature; at + kOutside <= bytes.size();) {
    const size_t length =
        uint32_t{bytes[at]} << 24 | bytes[at + 1] << 16 | bytes[at + 2] << 8 | bytes[at + 3];
    if (length > bytes.size() - at - kOutside) return;
    const auto covered = bytes.subspan(at + 4, length + 4);
    put_big_endian(bytes.subspan(at + 8 + length, 4),
                   static_cast<uint32_t>(crc32(0, covered.data(), static_cast<uInt>(covered.size()))));
    at += length + kOutside;
  }
}

/// The sums of the records that lie next to a session's frames: 48 bytes that begin with a mark, then the sum
/// of these.
void mend_records(std::span<uint8_t> bytes) {
  constexpr std::array<uint8_t, 4> kMark{0x50, 0x4C, 0x50, 0x01};
  constexpr size_t kCovered = 48;
  for (auto at = bytes.begin();; ++at) {
    at = std::search(at, bytes.end(), kMark.begin(), kMark.end());
    if (static_cast<size_t>(bytes.end() - at) < kCovered + 4) return;
    const auto sum = static_cast<uint32_t>(crc32(0, &*at, kCovered));
    std::memcpy(&*at + kCovered, &sum, sizeof sum);
  }
}

/// The sum of a journal's head, and those of its records where all have the length that the first one states.
void mend_journal(std::span<uint8_t> bytes) {
  constexpr size_t kMagic = 16, kFrame = 8;
  const auto number = [&](size_t at) {
    uint32_t value = 0;
    std::memcpy(&value, &bytes[at], sizeof value);
    return size_t{value};
  };
  for (size_t at = kMagic; at + kFrame <= bytes.size();) {
    const size_t length = number(at);
    if (length > bytes.size() - at - kFrame) return;
    const auto sum = static_cast<uint32_t>(crc32(0, bytes.data() + at + kFrame, static_cast<uInt>(length)));
    std::memcpy(&bytes[at + 4], &sum, sizeof sum);
    at += kFrame + length;
  }
}

/// The sum at the end of a lump network (FNV-1a).
void mend_network(std::span<uint8_t> bytes) {
  constexpr size_t kSum = 8;
  if (bytes.size() < kSum) return;
  uint64_t sum = 0xcbf29ce484222325;
  for (size_t i = 0; i + kSum < bytes.size(); ++i) sum = (sum ^ bytes[i]) * 0x100000001b3;
  std::memcpy(bytes.data() + bytes.size() - kSum, &sum, kSum);
}

constexpr std::array kReaders{
    Reader{"png", "image", read_picture, mend_png},
    Reader{"jpeg", "image", read_picture},
    Reader{"tiff", "image", read_picture},
    Reader{"bmp", "image", read_picture},
    Reader{"pnm", "image", read_picture},
    Reader{"film", "film", read_film},
    Reader{"npy", "array.npy", read_numbers},
    Reader{"stl", "mesh.stl", read_mesh},
    Reader{"table", "table.csv", read_cells},
    Reader{"gauge", "gauge.csv", read_any_gauge},
    Reader{"client", "client.txt", read_client},
    Reader{"handshake", "request.txt", read_handshake},
    Reader{"log", "log.csv", read_any_log},
    Reader{"log_lines", "log.lines", read_any_log},
    Reader{"points", "points.csv", read_set},
    Reader{"pairs", "pairs.csv", read_list_of_pairs},
    Reader{"judged", "judged.csv", read_cases},
    Reader{"events", "events.csv", read_event_log},
    Reader{"lights", "lights.json", read_light_file, nullptr, false, true},
    Reader{"heights", "heights.tmd", read_scan},
    Reader{"pressures", "pressures.csv", read_map},
    Reader{"sensor", "sensor.json", read_sensor, nullptr, false, true},
    Reader{"session_text", "session.json", read_session_text, nullptr, true, true},
    Reader{"session_video", "frames.mkv", read_session_video, mend_records, true, true},
    Reader{"session_rows", "frames.csv", read_session_rows},
    Reader{"network", "model.lump", read_network, mend_network},
    Reader{"profile", "profile.json", read_profile},
    Reader{"kind", "kind.json", read_kind_of_sensor, nullptr, true, true},
    Reader{"presses", "presses.csv", read_press_rows},
    Reader{"approaches", "approaches.csv", read_approaches},
    Reader{"journal", "set.part", read_journal, mend_journal},
#ifdef PALPATE_WHOLE_PROGRAM
    Reader{"settings", "window.json", read_settings},
    Reader{"balls", "balls.csv", read_pressed_balls},
    Reader{"places", "places.csv", read_scan_places},
#endif
};

/// Missing parts of an error's line; empty: none.
std::string fault_of(const Reader& reader, const Error& error) {
  constexpr size_t kLongest = 700;
  const std::string line = error.what();
  const Failure failure = error.failure();
  if (!(failure == Failure::Input && reader.may_blame_input) &&
      !(failure == Failure::Sensor && reader.may_blame_sensor))
    return "another kind of failure: " + line;
  if (line.size() > kLongest) return "a line of " + std::to_string(line.size()) + " characters: " + line;
  if (std::any_of(line.begin(), line.end(), [](unsigned char c) { return c < ' ' || c == 0x7f; }))
    return "a line with control characters: " + line;
  for (const char* word : {"wanted ", "; found ", "; try "})
    if (line.find(word) == std::string::npos) return "a line without '" + std::string(word) + "': " + line;
  return {};
}

}  // namespace

std::span<const Reader> readers() {
  return kReaders;
}

const Reader& reader(std::string_view name) {
  const auto* const found =
      std::find_if(kReaders.begin(), kReaders.end(), [name](const Reader& one) { return one.name == name; });
  if (found == kReaders.end()) throw std::out_of_range("no reader of that name");
  return *found;
}

std::string trouble_of(const Reader& reader, std::span<const uint8_t> bytes, const fs::path& folder) {
  const fs::path file = folder / reader.file;
  std::ofstream(file, std::ios::binary | std::ios::trunc)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  try {
    reader.read(file);
    return {};
  } catch (const Error& error) {
    return fault_of(reader, error);
  } catch (const std::exception& error) {
    return std::string("an exception that is no Error: ") + error.what();
  }
}

}  // namespace palpate::fuzz
