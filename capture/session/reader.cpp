#include <algorithm>
#include <atomic>
#include <charconv>
#include <fstream>
#include <map>
#include <opencv2/core.hpp>

#include "capture/files/images/images.h"
#include "capture/files/measurements.h"
#include "capture/rectify.h"
#include "capture/session/info.h"
#include "capture/session/session.h"
#include "capture/video/session_video.h"
#include "engine/base/readable.h"
#include "palpate/error.h"

namespace fs = std::filesystem;

namespace palpate {
namespace {

/// A whole small file. Throws where it is none or cannot be read.
std::string read_text(const fs::path& file, uintmax_t most_bytes) {
  const auto refuse = [&](const std::string& found) {
    throw Error(Failure::Input, "a readable file '" + file.string() + "' of a session", found,
                "checking the path and its permissions");
  };
  std::error_code error;
  if (!fs::is_regular_file(file, error))
    refuse(fs::exists(file, error) ? "no file but something else" : "nothing");
  const uintmax_t size = fs::file_size(file, error);
  if (error) refuse(system_words(error));
  if (size > most_bytes) refuse(std::to_string(size) + " bytes, more than it can have");
  std::string text(static_cast<size_t>(size), '\0');
  std::ifstream in(file, std::ios::binary);
  if (!in.read(text.data(), static_cast<std::streamsize>(size))) refuse("a read error");
  return text;
}

/// As recorded: nothing is cut or turned any more.
Sensor as_recorded(const FrameFormat& format) {
  Sensor sensor;
  sensor.channels = format.channels;
  sensor.bit_depth = format.bit_depth;
  return sensor;
}

}  // namespace

struct Session::Impl {
  fs::path folder;
  SessionText text;
  std::unique_ptr<SessionVideoReader> video;
  std::string copy_used;           ///< why the text in frames.mkv stands in for session.json
  std::optional<uint64_t> frames;  ///< that can be read
  uint64_t damaged_found = 0;      ///< by looking through a session that is not complete
  bool whole = false;
  std::optional<Rectifier> rectifier;  ///< of sessions without a sensor that are read with one
  Frame raw;
  bool jumped = false;
  std::atomic<uint64_t> damaged{0};
  std::string rows;  ///< frames.csv
  std::string_view cell_names;
  std::map<uint64_t, std::string_view> cells;
  std::vector<int64_t> times_ns;  ///< of all rows

  explicit Impl(const fs::path& path)
      : folder(path), video(SessionVideoReader::open(path / kSessionFrames)) {}
  void load();
  void load_rows();
  void apply(const Sensor& sensor);
  Frame rectified(const Frame& frame);
};

void Session::Impl::load() {
  std::error_code error;
  const fs::path json = folder / kSessionJson;
  if (fs::exists(json, error)) {
    constexpr uintmax_t kMost_bytes = 8 << 20;
    text = session_from_text(read_text(json, kMost_bytes), json.string());
  } else {
    copy_used = "session.json is missing (its copy in frames.mkv is used); ";
    text = session_from_text(video->session_text(), (folder / kSessionFrames).string());
  }
  video->expect(text.info.format);
  load_rows();
  const uintmax_t bytes = fs::file_size(folder / kSessionFrames, error);
  if (text.end.complete && video->indexed() == text.end.frames) {
    frames = text.end.frames;
  } else {
    const SessionVideoReader::Found found = video->scan();
    frames = found.frames;
    damaged_found = found.damaged;
  }
  whole = text.end.complete && bytes == text.end.video_bytes && *frames == text.end.frames;
  if (*frames == 0)
    throw Error(Failure::Input, "a session with frames", folder.string() + ", of which none was recorded",
                "another session");
}

/// Whole rows only: the last one may be cut. Cells follow the column "measured".
void Session::Impl::load_rows() {
  std::error_code error;
  const fs::path file = folder / kSessionRows;
  if (!fs::exists(file, error)) return;
  rows = read_text(file, uintmax_t{1} << 32);
  const size_t head_end = rows.find('\n');
  if (head_end == std::string::npos) return;
  const std::string_view head(rows.data(), head_end);
  constexpr std::string_view kLast = ",measured,";
  const size_t last = head.find(kLast);
  if (head.rfind("frame,", 0) != 0 || last == std::string_view::npos)
    throw Error(Failure::Input, file.string() + " to begin with the names of its columns", "something else",
                "removing it: frames.mkv is read without it, recorded measurements are not");
  cell_names = head.substr(last + kLast.size());
  const auto commas = [](std::string_view part) { return std::count(part.begin(), part.end(), ','); };
  const auto columns = commas(head), before = commas(head.substr(0, last + 1));
  for (size_t at = head_end + 1, end = 0; (end = rows.find('\n', at)) != std::string::npos; at = end + 1) {
    const std::string_view line(rows.data() + at, end - at);
    if (commas(line) != columns) continue;
    const size_t time_at = line.find(',') + 1;
    int64_t time_ns = 0;
    std::from_chars(line.data() + time_at, line.data() + line.size(), time_ns);
    times_ns.push_back(time_ns);
    size_t mark = 0;
    for (auto i = before; i > 0; --i) mark = line.find(',', mark) + 1;
    if (line.substr(mark, 2) != "1,") continue;
    uint64_t sequence = 0;
    const char* number_end = line.data() + line.find(',');
    if (std::from_chars(line.data(), number_end, sequence).ptr == number_end)
      cells[sequence] = line.substr(mark + 2);
  }
}

static bool same_lens(const Lens& a, const Lens& b) {
  return a.fx_px == b.fx_px && a.fy_px == b.fy_px && a.cx_px == b.cx_px && a.cy_px == b.cy_px &&
         a.distortion == b.distortion;
}

void Session::Impl::apply(const Sensor& sensor) {
  const FrameFormat& f = text.info.format;
  if (!text.info.sensor) {
    raw.reshape(f);
    rectifier.emplace(sensor, to_image(raw), folder.string());
    return;
  }
  const Sensor& recorded = *text.info.sensor;
  if ((sensor.crop_px && sensor.crop_px != recorded.crop_px) ||
      (sensor.quad_px && sensor.quad_px != recorded.quad_px) ||
      (sensor.lens && !(recorded.lens && same_lens(*sensor.lens, *recorded.lens))) ||
      (sensor.flat && !(recorded.flat && sensor.flat->gain == recorded.flat->gain)))
    throw Error(Failure::Input,
                "a sensor with the crop_px, quad_px, lens and flat that this session was recorded with",
                "other ones in '" + sensor.name + "'",
                "the sensor file without them: the recorded frames are rectified already");
  const bool fits =
      sensor.channels == f.channels && sensor.bit_depth == f.bit_depth &&
      (sensor.size_px[0] == 0 || (sensor.size_px[0] == f.width && sensor.size_px[1] == f.height));
  if (!fits)
    throw Error(Failure::Input,
                "a sensor for the frames of " + folder.string() + " (" + std::to_string(f.width) + "x" +
                    std::to_string(f.height) + " px, " + std::to_string(f.channels) + " channels of " +
                    std::to_string(f.bit_depth) + " bits)",
                "sensor '" + sensor.name + "'", "the sensor of this session, which needs no --sensor");
}

Frame Session::Impl::rectified(const Frame& frame) {
  if (!rectifier) return frame;
  Frame made;
  rectifier->apply(to_image(frame), folder.string(), made);
  return made;
}

bool is_session(const fs::path& path) {
  std::error_code error;
  if (fs::is_directory(path, error))
    return fs::exists(path / kSessionJson, error) || fs::exists(path / kSessionFrames, error);
  if (path.filename() == kSessionJson) return fs::exists(path.parent_path() / kSessionFrames, error);
  if (path.filename() != kSessionFrames || !fs::is_regular_file(path, error)) return false;
  if (fs::exists(path.parent_path() / kSessionJson, error)) return true;
  try {
    SessionVideoReader::open(path);
    return true;
  } catch (const Error&) {
    return false;
  }
}

fs::path session_folder(const fs::path& session) {
  std::error_code error;
  const bool file = session.filename() == kSessionFrames || session.filename() == kSessionJson;
  if (fs::is_directory(session, error) || !file) return session;
  return session.has_parent_path() ? session.parent_path() : fs::path(".");
}

Session::Session(const fs::path& folder) {
  std::error_code error;
  const fs::path home = session_folder(folder);
  if (!fs::is_regular_file(home / kSessionFrames, error))
    throw Error(Failure::Input, "a session with '" + (home / kSessionFrames).string() + "'",
                fs::exists(home / kSessionFrames, error) ? "no file but something else" : "no such file",
                "another session, or copying this one again");
  impl_ = std::make_unique<Impl>(home);
  impl_->load();
}

Session::Session(const fs::path& folder, const Sensor& sensor) : Session(folder) {
  impl_->apply(sensor);
}

Session::~Session() = default;

const SessionInfo& Session::info() const {
  return impl_->text.info;
}
bool Session::complete() const {
  return impl_->whole;
}

std::optional<std::string> Session::recorded(uint64_t sequence) const {
  const auto found = impl_->cells.find(sequence);
  if (found == impl_->cells.end()) return std::nullopt;
  return std::string(found->second);
}

std::string Session::recorded_names() const {
  return std::string(impl_->cell_names);
}

std::vector<uint64_t> Session::measured_sequences() const {
  std::vector<uint64_t> sequences;
  for (const auto& [sequence, cells] : impl_->cells) sequences.push_back(sequence);
  return sequences;
}

FrameFormat Session::format() const {
  return impl_->rectifier ? impl_->rectifier->format() : impl_->text.info.format;
}
double Session::rate_Hz() const {
  return impl_->text.info.rate_Hz;
}
std::vector<double> Session::uneven_times_s() const {
  return impl_->times_ns.size() == impl_->frames ? uneven_times(impl_->times_ns, rate_Hz())
                                                 : std::vector<double>{};
}
bool Session::pictures() const {
  return impl_->text.info.separate;
}
std::optional<uint64_t> Session::frame_count() const {
  return impl_->frames;
}
std::vector<std::pair<std::string, std::string>> Session::details() const {
  return impl_->text.info.details;
}

bool Session::next(Frame& frame) {
  Impl& m = *impl_;
  FrameStamp stamp;
  while (true) {
    const SessionVideoReader::Step step = m.video->step(stamp);
    if (step == SessionVideoReader::Step::End) return false;
    Frame& decoded = m.rectifier ? m.raw : frame;
    if (step == SessionVideoReader::Step::Damaged || !m.video->decode(decoded)) {
      ++m.damaged;
      continue;
    }
    if (m.rectifier) {
      m.rectifier->apply(to_image(m.raw), m.folder.string() + " frame " + std::to_string(stamp.sequence),
                         frame);
      put_stamp(stamp, frame);
    }
    if (std::exchange(m.jumped, false)) frame.after_gap = true;
    return true;
  }
}

std::string Session::warning() const {
  const Impl& m = *impl_;
  std::string said = m.copy_used;
  const uint64_t damaged = std::max(m.damaged.load(), m.damaged_found);
  if (!m.whole) {
    const SessionEnd& end = m.text.end;
    if (end.complete || end.frames > 0)
      said +=
          std::to_string(*m.frames) + " of " + std::to_string(end.frames) + " recorded frames can be read";
    else
      said += "the recording was cut short; its first " + std::to_string(*m.frames) + " frames can be read";
    if (!end.ended_by.empty()) said += " (recording ended by: " + end.ended_by + ")";
    said += "; ";
  }
  if (damaged > 0)
    said += std::to_string(damaged) + (damaged == 1 ? " damaged frame is" : " damaged frames are") +
            " left out; ";
  if (said.empty()) return {};
  return m.folder.string() + ": " + said.substr(0, said.size() - 2);
}

std::optional<Frame> Session::own_background() const {
  const Impl& m = *impl_;
  if (!m.text.has_background) return std::nullopt;
  const fs::path file = m.folder / kSessionBackground;
  const cv::Mat image = read_image(file);
  Frame background;
  Rectifier(as_recorded(m.text.info.format), image, file.string()).apply(image, file.string(), background);
  if (background.format != m.text.info.format)
    throw Error(Failure::Input, "a background of the frames' size", file.string() + ", of another size",
                "copying the session again");
  return impl_->rectified(background);
}

CaptureCounts Session::counts() const {
  return {.lost = 0, .damaged = impl_->damaged, .gaps = 0};
}

std::optional<uint64_t> Session::place() const {
  return impl_->video->place();
}

bool Session::seek(uint64_t index) {
  if (!impl_->video->seek(index)) return false;
  impl_->jumped = true;
  return true;
}

}  // namespace palpate
