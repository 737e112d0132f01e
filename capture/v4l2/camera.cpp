#include "capture/v4l2/camera.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <mutex>
#include <opencv2/core.hpp>
#include <sstream>
#include <thread>

#include "capture/camera/camera_clock.h"
#include "capture/clock.h"
#include "capture/rectify.h"
#include "capture/v4l2/camera_setup.h"
#include "capture/v4l2/stream.h"
#include "palpate/error.h"

namespace palpate {
namespace {

using v4l2::Stream;

constexpr int kWait_ms = 40;                // between looks at `cancelled`
constexpr int64_t kRetry_ns = 250'000'000;  // between tries to open an absent camera
constexpr uint32_t kStayWithDriver = 2;
constexpr double kUnknownRate_Hz = 30;

std::string brief(double value) {
  std::ostringstream s;
  s.precision(4);
  s << value;
  return s.str();
}

}  // namespace

struct Camera::Impl {
  Impl(const CameraOptions& o, const Sensor& s) : options(o), sensor(s) {}

  CameraOptions options;
  const Sensor sensor;
  v4l2::Identity identity;
  std::shared_ptr<v4l2::Device> device;
  std::shared_ptr<Stream> stream;  // null while the camera is away
  CameraSetup setup;
  std::optional<Rectifier> rectifier;
  FrameFormat frame_format;
  bool straight = false;  // the driver's pixels are the frame's: no crop, no perspective, one plane
  bool leasable = false;  // and so are its rows
  cv::Mat image;
  std::function<bool()> cancelled;

  SequenceCounter counter;
  FrameClock clock;
  int64_t timeout_ns = 0;
  int64_t sign_ns = 0;       // last frame, or start of the stream
  int64_t delivered_ns = 0;  // last frame
  int64_t retry_ns = 0;
  uint64_t frames = 0;
  bool away = false;   // the next frame comes after a gap
  std::string damage;  // what was wrong with the last damaged frame

  mutable std::mutex mutex;  // of all below
  CaptureCounts counts;
  std::string state;
  std::vector<std::pair<std::string, std::string>> facts;
  uint64_t leased = 0, copied = 0;
  uint64_t believed_times = 0, refused_times = 0;
  bool start_of_frame = false;

  void say(const std::string& words) {
    const std::lock_guard lock(mutex);
    state = words;
  }

  void open_first() {
    device = std::make_shared<v4l2::Device>(camera_node(options.node));
    identity = device->identity();
    setup = set_up(*device, options, needs_of(sensor));
    const int type =
        CV_MAKETYPE(setup.format->bit_depth > 8 ? CV_16U : CV_8U, static_cast<int>(setup.channels));
    image.create(static_cast<int>(setup.image.height), static_cast<int>(setup.image.width), type);
    rectifier.emplace(sensor, image, identity.path);
    frame_format = rectifier->format();
    straight = !sensor.crop_px && !sensor.quad_px && !sensor.lens && !sensor.flat && setup.channels == 1;
    const PixelLayout layout = setup.format->layout;
    leasable = straight && (layout == PixelLayout::Gray8 || layout == PixelLayout::Gray16) &&
               setup.image.stride_bytes == least_stride_bytes(*setup.format, setup.image.width);
    if (straight) image.release();
    // From here on the same is wanted whenever it is opened.
    options.format = setup.format->name;
    options.width = setup.image.width;
    options.height = setup.image.height;
    const double period_s = setup.rate_Hz > 0 ? 1 / setup.rate_Hz : 0;
    timeout_ns =
        std::llround(1e9 * (options.timeout_s > 0 ? options.timeout_s : std::max(2.0, 5 * period_s)));
    start();
  }

  void start() {
    stream = Stream::start(device, options.buffers);
    sign_ns = monotonic_ns();
    note_facts();
  }

  void note_facts() {
    std::vector<std::pair<std::string, std::string>> list = {
        {"node", device->identity().path},
        {"camera", identity.card},
        {"driver", identity.driver},
        {"bus", identity.bus},
        {"format", setup.format->name},
        {"size", std::to_string(setup.image.width) + "x" + std::to_string(setup.image.height) + " px"},
        {"stride", std::to_string(setup.image.stride_bytes) + " bytes"},
        {"rate", setup.rate_Hz > 0 ? brief(setup.rate_Hz) + " Hz" : "not known"},
        {"buffers", std::to_string(stream->buffers())},
        {"time-out", brief(static_cast<double>(timeout_ns) * 1e-9) + " s"}};
    for (const v4l2::Control& c : setup.controls) {
      if (!c.value) continue;
      std::string value = std::to_string(*c.value);
      for (const auto& [item, name] : c.items)
        if (item == *c.value) value += " (" + name + ")";
      if (const std::string unit = v4l2::unit_of(c.id); !unit.empty()) value += " x " + unit;
      list.emplace_back("control." + c.name, value);
    }
    const std::lock_guard lock(mutex);
    facts = std::move(list);
  }

  double rate_Hz() const {
    if (setup.rate_Hz > 0) return setup.rate_Hz;
    return options.rate_Hz > 0 ? options.rate_Hz : kUnknownRate_Hz;
  }

  /// The stream is dead but the camera is there.
  void start_again(const std::string& why) {
    away = true;
    say(why + "; starting the stream again");
    const int64_t now = monotonic_ns();
    // A stream that fails as soon as it starts is not tried without end in one go.
    if (now - retry_ns < kRetry_ns) std::this_thread::sleep_for(std::chrono::milliseconds(kWait_ms));
    retry_ns = sign_ns = now;
    if (!stream->restart()) let_go(why);
  }

  void let_go(const std::string& why) {
    away = true;
    say(why + "; waiting for the camera");
    stream->stop();
    stream.reset();
    device.reset();
    retry_ns = monotonic_ns();
  }

  /// Opens the camera once it is back, whatever its node is called by then.
  void come_back() {
    const int64_t now = monotonic_ns();
    if (now - retry_ns < kRetry_ns) {
      std::this_thread::sleep_for(std::chrono::milliseconds(kWait_ms));
      return;
    }
    retry_ns = now;
    std::string path;
    for (const v4l2::NodeReport& node : v4l2::list_nodes())
      if (node.capture && node.identity.same_camera(identity)) path = node.path;
    if (path.empty()) return;
    try {
      device = std::make_shared<v4l2::Device>(path);
      const std::string unset = v4l2_restore();
      CameraSetup again = set_up(*device, options, needs_of(sensor));
      if (again.image.stride_bytes != setup.image.stride_bytes)
        leasable =
            leasable && again.image.stride_bytes == least_stride_bytes(*setup.format, again.image.width);
      setup = std::move(again);
      start();
      say("the camera is back" + (unset.empty() ? "" : ", but not its controls " + unset));
    } catch (const Error& error) {
      device.reset();
      say(std::string("the camera is back, but: ") + error.what());
    }
  }

  std::string v4l2_restore() { return restore_controls(*device, setup.controls); }

  /// Numbers and times of a good frame.
  void stamp(const Stream::Filled& filled, int64_t delivered, Frame& frame) {
    frame.after_gap = away;
    if (away) counter.restart(static_cast<double>(delivered - delivered_ns) * 1e-9, rate_Hz());
    const auto [sequence, lost] = counter.next(filled.sequence);
    const auto [time_ns, exposed_ns] = clock.next(filled.stamp_ns, filled.monotonic, delivered);
    frame.sequence = sequence;
    frame.time_ns = time_ns;
    frame.exposed_ns = exposed_ns;
    frame.delivered_ns = delivered;
    sign_ns = delivered_ns = delivered;
    ++frames;
    const std::lock_guard lock(mutex);
    counts.lost += lost;
    if (away && frames > 1) ++counts.gaps;
    state.clear();
    away = false;
    start_of_frame = filled.start_of_frame;
    believed_times = clock.believed();
    refused_times = clock.refused();
  }

  void note_damage(const Stream::Filled& filled, const std::string& what) {
    damage = what;
    const uint64_t lost = away ? 0 : counter.next(filled.sequence).lost;
    const std::lock_guard lock(mutex);
    counts.lost += lost;
    ++counts.damaged;
  }

  /// Fault of pixels; without words there is none.
  struct Fault {
    std::string words;
    bool of_format = false;  ///< values that the format does not have
  };

  /// Pixels of the frame.
  Fault fill(const Stream::Filled& filled, Frame& frame) {
    const RawImage raw{filled.bytes, setup.image.width, setup.image.height, setup.image.stride_bytes};
    const bool spare = stream->with_driver() >= kStayWithDriver;
    if (leasable && spare) {
      if (const size_t needed = needed_bytes(*setup.format, raw); raw.bytes.size() < needed)
        return {std::to_string(raw.bytes.size()) + " bytes in place of " + std::to_string(needed)};
      if (Fault fault = too_bright(raw); fault.of_format) return fault;
      frame.format = frame_format;
      frame.pages = stream->pages(filled.buffer);
      frame.leased = stream->lend(filled.buffer);
      const std::lock_guard lock(mutex);
      ++leased;
      return {};
    }
    frame.reshape(frame_format);
    if (straight)
      image = cv::Mat(static_cast<int>(frame_format.height), static_cast<int>(frame_format.width),
                      frame_format.bit_depth > 8 ? CV_16UC1 : CV_8UC1, frame.row(0, 0));
    Fault fault{decode(*setup.format, raw, setup.channels, image)};
    if (fault.words.empty()) fault = too_bright(raw);
    if (!fault.words.empty()) return fault;
    if (straight) {
      image.release();
    } else {
      rectifier->apply(image, identity.path, frame);
    }
    const std::lock_guard lock(mutex);
    ++copied;
    return {};
  }

  /// Values that neither the format nor the sensor has.
  Fault too_bright(const RawImage& raw) const {
    const uint32_t bits = std::min(setup.format->bit_depth, frame_format.bit_depth);
    if (setup.format->layout != PixelLayout::Gray16 || bits >= 16) return {};
    const uint32_t largest = largest_value(raw);
    if (largest >> bits == 0) return {};
    return {"a value of " + std::to_string(largest) + " in " + std::to_string(bits) + " bits", true};
  }

  /// True where `frame` was filled.
  bool receive(Frame& frame) {
    Stream::Filled filled;
    const Stream::Event event = stream->take(filled);
    const int64_t delivered = monotonic_ns();
    if (event == Stream::Event::Gone) let_go("the camera was unplugged");
    if (event == Stream::Event::Broken) start_again("the camera's stream failed");
    if (event != Stream::Event::Ready) return false;
    const Fault fault = filled.damaged ? Fault{"marked by the driver"} : fill(filled, frame);
    // A lent buffer goes back by itself.
    if (!frame.leased) stream->requeue(filled.buffer);
    if (fault.words.empty()) {
      stamp(filled, delivered, frame);
      return true;
    }
    if (frames == 0 && fault.of_format)
      throw Error(
          Failure::Input,
          "frames of " + std::to_string(frame_format.bit_depth) + " bits in format " + setup.format->name,
          identity.path + " with " + fault.words,
          "format Y16 and \"bit_depth\": 16 in the sensor file (some cameras write their bits at the high "
          "end)");
    note_damage(filled, fault.words);
    return false;
  }
};

Camera::Camera(const CameraOptions& options, const Sensor& sensor)
    : impl_(std::make_unique<Impl>(options, sensor)) {
  impl_->open_first();
}

Camera::~Camera() {
  if (impl_->stream) impl_->stream->stop();
}

FrameFormat Camera::format() const {
  return impl_->frame_format;
}
double Camera::rate_Hz() const {
  return impl_->rate_Hz();
}
void Camera::watch(const std::function<bool()>& cancelled) {
  impl_->cancelled = cancelled;
}

bool Camera::next(Frame& frame) {
  Impl& m = *impl_;
  frame.leased.reset();
  frame.pages.reset();
  while (!m.cancelled || !m.cancelled()) {
    if (!m.stream) {
      m.come_back();
      continue;
    }
    switch (m.stream->wait(kWait_ms)) {
      case Stream::Event::Gone:
        m.let_go("the camera was unplugged");
        continue;
      case Stream::Event::Broken:
        m.start_again("the camera's stream failed");
        continue;
      case Stream::Event::Ready:
        if (m.receive(frame)) return true;
        break;
      case Stream::Event::Nothing:
        break;
    }
    if (m.stream && monotonic_ns() - m.sign_ns > m.timeout_ns) {
      const std::string silence = " for " + brief(static_cast<double>(m.timeout_ns) * 1e-9) + " s";
      const std::string why =
          m.damage.empty() ? "no frame" + silence : "no whole frame" + silence + " (" + m.damage + ")";
      m.damage.clear();
      m.start_again(why);
    }
  }
  return false;
}

CaptureCounts Camera::counts() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->counts;
}

std::string Camera::state() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->state;
}

std::vector<std::pair<std::string, std::string>> Camera::details() const {
  const Impl& m = *impl_;
  const std::lock_guard lock(m.mutex);
  auto list = m.facts;
  std::string clock = "driver, CLOCK_MONOTONIC, ";
  clock += m.start_of_frame ? "at the start of exposure" : "at the end of the frame";
  if (m.believed_times == 0 && m.refused_times > 0)
    clock = "delivery: the driver's time stamps are not of this clock";
  if (m.believed_times > 0 && m.refused_times > 0)
    clock += "; " + std::to_string(m.refused_times) + " impossible stamps replaced by delivery";
  list.emplace_back("clock", clock);
  const bool jpeg_or_colour = !m.straight;
  const std::string copies = jpeg_or_colour ? "2 (decoded, rectified)" : "1 (decoded)";
  list.emplace_back("copies per frame", m.leasable ? "0 (leased)" : copies);
  if (m.leasable && m.copied > 0)
    list.emplace_back("copied frames", std::to_string(m.copied) + " of " +
                                           std::to_string(m.copied + m.leased) +
                                           ", since too many buffers were out");
  return list;
}

FrameFormat linux_camera_format(const CameraOptions& options) {
  v4l2::Device device(camera_node(options.node));
  const CameraSetup setup = set_up(device, options, {});
  return {setup.image.width, setup.image.height, setup.channels, setup.format->bit_depth};
}

}  // namespace palpate
