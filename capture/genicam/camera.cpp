#include "capture/genicam/camera.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <thread>

#include "capture/camera/camera_log.h"
#include "capture/camera/camera_picture.h"
#include "capture/camera/choose_format.h"
#include "capture/clock.h"
#include "capture/genicam/module.h"
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
  std::optional<CameraPicture> picture;
  std::function<bool()> cancelled;
  CameraLog log;
  DeviceClock device_clock;
  int64_t timeout_ns = 0, retry_ns = 0;
  std::atomic<uint32_t> stride_bytes = 0;
  std::atomic<bool> stamped = false;
  std::atomic<int64_t> resent = -1;  // packets; below 0: there are none

  void open_first() {
    device = genicam::module().open(id_of(options));
    identity = device->identity();
    start();
    picture.emplace(sensor, *pixel_format, channels, settings.width, settings.height, identity.id);
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
    log.note_start();
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
    log.set_facts(std::move(list));
  }

  double rate_Hz() const {
    if (settings.rate_Hz > 0) return settings.rate_Hz;
    return options.rate_Hz > 0 ? options.rate_Hz : kUnknownRate_Hz;
  }

  void start_again(const std::string& why) {
    log.interrupt(why + "; starting the stream again");
    const int64_t now = monotonic_ns();
    if (now - retry_ns < kRetry_ns) std::this_thread::sleep_for(std::chrono::milliseconds(kWait_ms));
    retry_ns = now;
    log.note_start();
    if (!device->restart()) let_go(why);
  }

  void let_go(const std::string& why) {
    log.interrupt(why + "; waiting for the camera");
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
      log.say("the camera is back");
    } catch (const Error& error) {
      const bool there = device != nullptr;
      device.reset();
      if (there) log.say(std::string("the camera is back, but: ") + error.what());
    }
  }

  /// Pixels of the frame; says what is wrong with them, nothing where all is well.
  std::string fill(const Filled& filled, Frame& frame) {
    if (!filled.pixels) return filled.damage;
    if (filled.width != settings.width || filled.height != settings.height)
      return text("a frame of %ux%u px", filled.width, filled.height);
    stride_bytes = filled.stride_bytes;
    const RawImage raw{{filled.pixels.get(), filled.bytes}, filled.width, filled.height, filled.stride_bytes};
    const bool lent = picture->is_frame(raw.stride_bytes) && device->with_camera() >= kStayWithCamera;
    const CameraPicture::Fault fault = lent ? picture->look_at(raw) : picture->fill(raw, frame);
    if (fault.of_format && log.frames() == 0)
      throw Error(
          Failure::Input, text("frames of %u bits in format ", picture->format().bit_depth) + settings.format,
          identity.id + " with " + fault.words, "format Mono16 and \"bit_depth\": 16 in the sensor file");
    if (!fault.words.empty()) return fault.words;
    if (lent) {
      frame.format = picture->format();
      frame.leased = filled.pixels;
    }
    log.note_pixels(lent);
    return {};
  }

  /// True where `frame` was filled.
  bool receive(const Filled& filled, Frame& frame) {
    const int64_t delivered = monotonic_ns();
    const auto number = static_cast<uint32_t>(filled.number);
    if (const std::string fault = fill(filled, frame); !fault.empty()) {
      log.note_damage(number, fault);
      return false;
    }
    if (log.interrupted()) device_clock = {};
    stamped = filled.stamp_ns != 0;
    log.stamp(number, stamped ? device_clock.on_host(filled.stamp_ns, delivered) : 0, stamped, delivered,
              rate_Hz(), frame);
    if (const std::optional<uint64_t> packets = device->resent_packets())
      resent = static_cast<int64_t>(*packets);
    return true;
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
  return impl_->picture->format();
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
    if (m.log.silent(m.timeout_ns)) m.start_again(m.log.words_of_silence(m.timeout_ns));
  }
  return false;
}

CaptureCounts GenicamCamera::counts() const {
  return impl_->log.counts();
}

std::string GenicamCamera::state() const {
  return impl_->log.state();
}

std::vector<std::pair<std::string, std::string>> GenicamCamera::details() const {
  const Impl& m = *impl_;
  auto list = m.log.details(m.stamped ? "the camera's, on the host's by the shortest way of a frame"
                                      : "delivery: the camera has no time stamps",
                            m.picture->copies(m.stride_bytes));
  if (m.resent >= 0) list.emplace_back("packets sent again", std::to_string(m.resent));
  return list;
}

}  // namespace palpate
