#include "capture/genicam/camera.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <mutex>
#include <opencv2/core.hpp>
#include <thread>

#include "capture/camera/camera_clock.h"
#include "capture/camera/choose_format.h"
#include "capture/clock.h"
#include "capture/genicam/module.h"
#include "capture/rectify.h"
#include "engine/base/text.h"
#include "palpate/error.h"

namespace palpate {
namespace {

using genicam::Event;
using genicam::Filled;

constexpr const char* kGenicam = "genicam:";
constexpr int kWait_ms = 40;                // between looks at `cancelled`
constexpr int64_t kRetry_ns = 500'000'000;  // between tries to open an absent camera: each asks the network
constexpr uint32_t kStayWithCamera = 2;
constexpr double kEnough_Hz = 60;  // unless more is asked for
constexpr double kUnknownRate_Hz = 30;

std::string id_of(const CameraOptions& options) {
  return options.node.substr(std::string_view(kGenicam).size());
}

std::vector<OfferedFormat> offered_by(const genicam::Abilities& abilities) {
  std::vector<OfferedFormat> offered;
  for (const std::string& name : abilities.formats) {
    const PixelFormat* known = find_pixel_format(name);
    offered.push_back({known ? known->fourcc : 0, name, false, false, known});
  }
  return offered;
}

uint32_t size_of(const genicam::WholeRange& range, uint32_t asked, uint32_t needed, const char* side,
                 const std::string& where) {
  const uint32_t wanted = asked != 0 ? asked : needed;
  if (wanted == 0) return static_cast<uint32_t>(range.most);
  if (!range.holds(wanted))
    throw Error(Failure::Device, text("a %s of %u px from ", side, wanted) + where,
                text("%lld to %lld px in steps of %lld", static_cast<long long>(range.least),
                     static_cast<long long>(range.most), static_cast<long long>(range.step)),
                "--size WxH in that range");
  return wanted;
}

/// The request to a camera with these abilities, and the format that frames come in.
struct Plan {
  genicam::Request request;
  const PixelFormat* format = nullptr;
  uint32_t channels = 1;

  Plan(const genicam::Device& device, const CameraOptions& options, const CameraNeeds& needs) {
    const genicam::Abilities can = device.abilities();
    const std::string& where = device.identity().id;
    format = &choose_format(offered_by(can), where, options, needs);
    channels = needs.channels != 0 ? needs.channels : format->channels;
    request.format = format->genicam;
    request.width = size_of(can.width_px, options.width, needs.size_px[0], "width", where);
    request.height = size_of(can.height_px, options.height, needs.size_px[1], "height", where);
    request.options = options;
    if (options.rate_Hz > 0 && can.rate_Hz &&
        (options.rate_Hz < can.rate_Hz->least || options.rate_Hz > can.rate_Hz->most))
      throw Error(Failure::Device, text("%.4g frames/s from ", options.rate_Hz) + where,
                  text("%.4g to %.4g", can.rate_Hz->least, can.rate_Hz->most), "a rate in that range");
    if (options.rate_Hz > 0 && !can.rate_Hz)
      throw Error(Failure::Device, text("%.4g frames/s from ", options.rate_Hz) + where,
                  "no rate that can be set", "no --fps");
    if (can.rate_Hz)
      request.rate_Hz = options.rate_Hz > 0 ? options.rate_Hz : std::min(kEnough_Hz, can.rate_Hz->most);
  }
};

}  // namespace

struct GenicamCamera::Impl {
  Impl(const CameraOptions& o, const Sensor& s) : options(o), sensor(s) {}

  CameraOptions options;
  const Sensor sensor;
  genicam::Identity identity;
  std::unique_ptr<genicam::Device> device;  // null while the camera is away
  const PixelFormat* pixel_format = nullptr;
  uint32_t channels = 1;
  genicam::Settings settings;
  std::optional<Rectifier> rectifier;
  FrameFormat frame_format;
  bool straight = false;  // the camera's pixels are the frame's: no crop, no perspective, one plane
  cv::Mat image;
  std::function<bool()> cancelled;

  SequenceCounter counter;
  FrameClock clock;
  DeviceClock device_clock;
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
  std::optional<uint64_t> resent;

  void say(const std::string& words) {
    const std::lock_guard lock(mutex);
    state = words;
  }

  void open_first() {
    device = genicam::module().open(id_of(options));
    identity = device->identity();
    start();
    const int type = CV_MAKETYPE(pixel_format->bit_depth > 8 ? CV_16U : CV_8U, static_cast<int>(channels));
    image.create(static_cast<int>(settings.height), static_cast<int>(settings.width), type);
    rectifier.emplace(sensor, image, identity.id);
    frame_format = rectifier->format();
    straight = !sensor.crop_px && !sensor.quad_px && !sensor.lens && !sensor.flat && channels == 1;
    if (straight) image.release();
    // From here on the same is wanted whenever it is opened.
    options.node = kGenicam + identity.id;
    options.format = pixel_format->name;
    options.width = settings.width;
    options.height = settings.height;
    timeout_ns =
        std::llround(1e9 * (options.timeout_s > 0 ? options.timeout_s : std::max(2.0, 5 / rate_Hz())));
  }

  /// Sets up the open camera and starts its stream.
  void start() {
    const Plan plan(*device, options, needs_of(sensor));
    settings = device->start(plan.request);
    pixel_format = plan.format;
    channels = plan.channels;
    if (settings.format != plan.request.format || settings.width != plan.request.width ||
        settings.height != plan.request.height)
      throw Error(Failure::Device,
                  plan.request.format + text(" of %ux%u px from ", plan.request.width, plan.request.height) +
                      identity.id,
                  settings.format + text(" of %ux%u px", settings.width, settings.height), "what it keeps");
    if (options.rate_Hz > 0 && settings.rate_Hz > 0 &&
        std::abs(settings.rate_Hz - options.rate_Hz) > 0.01 * options.rate_Hz)
      throw Error(Failure::Device, text("%.4g frames/s from ", options.rate_Hz) + identity.id,
                  text("%.4g", settings.rate_Hz), "a shorter exposure or a smaller --size");
    sign_ns = monotonic_ns();
    note_facts();
  }

  void note_facts() {
    std::vector<std::pair<std::string, std::string>> list = {
        {"node", kGenicam + identity.id},
        {"camera", identity.vendor + " " + identity.model},
        {"serial number", identity.serial},
        {"driver", identity.protocol + " by Aravis"},
        {"address", identity.address},
        {"format", std::string(pixel_format->name) + " (" + settings.format + ")"},
        {"size", text("%ux%u px", settings.width, settings.height)},
        {"rate", settings.rate_Hz > 0 ? text("%.4g Hz", settings.rate_Hz) : "not known"},
        {"trigger", options.trigger.empty() ? "none" : options.trigger},
        {"buffers", std::to_string(options.buffers)}};
    list.insert(list.end(), settings.facts.begin(), settings.facts.end());
    const std::lock_guard lock(mutex);
    facts = std::move(list);
  }

  double rate_Hz() const {
    if (settings.rate_Hz > 0) return settings.rate_Hz;
    return options.rate_Hz > 0 ? options.rate_Hz : kUnknownRate_Hz;
  }

  void start_again(const std::string& why) {
    away = true;
    say(why + "; starting the stream again");
    const int64_t now = monotonic_ns();
    if (now - retry_ns < kRetry_ns) std::this_thread::sleep_for(std::chrono::milliseconds(kWait_ms));
    retry_ns = sign_ns = now;
    if (!device->restart()) let_go(why);
  }

  void let_go(const std::string& why) {
    away = true;
    say(why + "; waiting for the camera");
    device.reset();
    retry_ns = monotonic_ns();
  }

  /// Opens the camera once it answers again.
  void come_back() {
    const int64_t now = monotonic_ns();
    if (now - retry_ns < kRetry_ns) {
      std::this_thread::sleep_for(std::chrono::milliseconds(kWait_ms));
      return;
    }
    retry_ns = now;
    try {
      device = genicam::module().open(id_of(options));
      start();
      say("the camera is back");
    } catch (const Error& error) {
      const bool there = device != nullptr;
      device.reset();
      if (there) say(std::string("the camera is back, but: ") + error.what());
    }
  }

  /// Numbers and times of a good frame.
  void stamp(const Filled& filled, int64_t delivered, Frame& frame) {
    frame.after_gap = away;
    if (away) {
      counter.restart(static_cast<double>(delivered - delivered_ns) * 1e-9, rate_Hz());
      device_clock = {};
    }
    const auto [sequence, lost] = counter.next(static_cast<uint32_t>(filled.number));
    const bool stamped = filled.stamp_ns != 0;
    const auto [time_ns, exposed_ns] =
        clock.next(stamped ? device_clock.on_host(filled.stamp_ns, delivered) : 0, stamped, delivered);
    frame.sequence = sequence;
    frame.time_ns = time_ns;
    frame.exposed_ns = exposed_ns;
    frame.delivered_ns = sign_ns = delivered_ns = delivered;
    ++frames;
    const std::optional<uint64_t> packets = device->resent_packets();
    const std::lock_guard lock(mutex);
    resent = packets;
    counts.lost += lost;
    if (away && frames > 1) ++counts.gaps;
    state.clear();
    away = false;
  }

  void note_damage(const Filled& filled, const std::string& what) {
    damage = what;
    const uint64_t lost = away ? 0 : counter.next(static_cast<uint32_t>(filled.number)).lost;
    const std::lock_guard lock(mutex);
    counts.lost += lost;
    ++counts.damaged;
  }

  /// Fills the pixels; says what is wrong with them, nothing where all is well.
  std::string fill(const Filled& filled, Frame& frame) {
    if (!filled.pixels) return filled.damage;
    const RawImage raw{{filled.pixels.get(), filled.bytes}, filled.width, filled.height, filled.stride_bytes};
    if (raw.width != settings.width || raw.height != settings.height)
      return text("a frame of %ux%u px", raw.width, raw.height);
    if (raw.bytes.size() < needed_bytes(*pixel_format, raw))
      return text("%zu bytes in place of %zu", raw.bytes.size(), needed_bytes(*pixel_format, raw));
    const bool gray16 = pixel_format->layout == PixelLayout::Gray16;
    const uint32_t bits = std::min(pixel_format->bit_depth, frame_format.bit_depth);
    if (gray16 && bits < 16 && largest_value(raw) >> bits != 0) {
      if (frames > 0) return text("a value above %u bits", bits);
      throw Error(Failure::Input, text("frames of %u bits in format ", bits) + settings.format,
                  identity.id + text(" with a value of %u", largest_value(raw)),
                  "format Mono16 and \"bit_depth\": 16 in the sensor file");
    }
    const bool tight = raw.stride_bytes == least_stride_bytes(*pixel_format, raw.width);
    if (straight && tight && (gray16 || pixel_format->layout == PixelLayout::Gray8) &&
        device->with_camera() >= kStayWithCamera) {
      frame.format = frame_format;
      frame.leased = filled.pixels;
      const std::lock_guard lock(mutex);
      ++leased;
      return {};
    }
    frame.reshape(frame_format);
    if (straight)
      image = cv::Mat(static_cast<int>(frame_format.height), static_cast<int>(frame_format.width),
                      frame_format.bit_depth > 8 ? CV_16UC1 : CV_8UC1, frame.row(0, 0));
    if (std::string fault = decode(*pixel_format, raw, channels, image); !fault.empty()) return fault;
    if (straight)
      image.release();
    else
      rectifier->apply(image, identity.id, frame);
    const std::lock_guard lock(mutex);
    ++copied;
    return {};
  }

  /// True where `frame` was filled.
  bool receive(const Filled& filled, Frame& frame) {
    const int64_t delivered = monotonic_ns();
    const std::string fault = fill(filled, frame);
    if (fault.empty())
      stamp(filled, delivered, frame);
    else
      note_damage(filled, fault);
    return fault.empty();
  }
};

bool is_genicam(const CameraOptions& options) {
  return options.node.starts_with(kGenicam);
}

FrameFormat genicam_format(const CameraOptions& options) {
  const std::unique_ptr<genicam::Device> device = genicam::module().open(id_of(options));
  const Plan plan(*device, options, {});
  return {plan.request.width, plan.request.height, plan.channels, plan.format->bit_depth};
}

GenicamCamera::GenicamCamera(const CameraOptions& options, const Sensor& sensor)
    : impl_(std::make_unique<Impl>(options, sensor)) {
  impl_->open_first();
}

GenicamCamera::~GenicamCamera() = default;

FrameFormat GenicamCamera::format() const {
  return impl_->frame_format;
}
double GenicamCamera::rate_Hz() const {
  return impl_->rate_Hz();
}
void GenicamCamera::watch(const std::function<bool()>& cancelled) {
  impl_->cancelled = cancelled;
}

bool GenicamCamera::next(Frame& frame) {
  Impl& m = *impl_;
  frame.give_back();
  while (!m.cancelled || !m.cancelled()) {
    if (!m.device) {
      m.come_back();
      continue;
    }
    Filled filled;
    const Event event = m.device->wait(kWait_ms, filled);
    if (event == Event::Gone) {
      m.let_go("the camera was unplugged");
      continue;
    }
    if (event == Event::Ready && m.receive(filled, frame)) return true;
    if (monotonic_ns() - m.sign_ns > m.timeout_ns) {
      const std::string silence = text(" for %.4g s", static_cast<double>(m.timeout_ns) * 1e-9);
      const std::string why =
          m.damage.empty() ? "no frame" + silence : "no whole frame" + silence + " (" + m.damage + ")";
      m.damage.clear();
      m.start_again(why);
    }
  }
  return false;
}

CaptureCounts GenicamCamera::counts() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->counts;
}

std::string GenicamCamera::state() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->state;
}

std::vector<std::pair<std::string, std::string>> GenicamCamera::details() const {
  const Impl& m = *impl_;
  const std::lock_guard lock(m.mutex);
  auto list = m.facts;
  list.emplace_back("clock", m.clock.believed() > 0
                                 ? "the camera's, on the host's by the shortest way of a frame"
                                 : "delivery: the camera has no time stamps");
  list.emplace_back("copies per frame", m.leased > 0 ? "0 (leased)"
                                        : m.straight ? "1 (decoded)"
                                                     : "2 (decoded, rectified)");
  if (m.leased > 0 && m.copied > 0)
    list.emplace_back("copied frames", std::to_string(m.copied) + " of " +
                                           std::to_string(m.copied + m.leased) +
                                           ", since too many buffers were out");
  if (m.resent) list.emplace_back("packets sent again", std::to_string(*m.resent));
  return list;
}

}  // namespace palpate
