#include "capture/genicam/camera.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "capture/camera/camera_loop.h"
#include "capture/camera/camera_picture.h"
#include "capture/camera/choose_format.h"
#include "capture/genicam/module.h"
#include "engine/base/clock.h"
#include "engine/base/text.h"
#include "palpate/error.h"

namespace palpate {
namespace {

using genicam::Filled;

constexpr const char* kGenicam = "genicam:";
constexpr int64_t kRetry_ns = 500'000'000;  // each try asks the network
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
    // By the name that the camera has for it, where there are two.
    request.format = format->genicam;
    for (const std::string& name : can.formats)
      if (find_pixel_format(name) == format) request.format = name;
    request.width = size_of(can.width_px, options.width, needs.size_px[0], "width", where);
    request.height = size_of(can.height_px, options.height, needs.size_px[1], "height", where);
    request.options = options;
    if (options.rate_Hz > 0 && can.rate_Hz &&
        (options.rate_Hz < can.rate_Hz->least || options.rate_Hz > can.rate_Hz->most))
      throw Error(Failure::Device, rate_text(options.rate_Hz) + " frames/s from " + where,
                  text("%.4g to %.4g", can.rate_Hz->least, can.rate_Hz->most), "a rate in that range");
    if (options.rate_Hz > 0 && !can.rate_Hz)
      throw Error(Failure::Device, rate_text(options.rate_Hz) + " frames/s from " + where,
                  "no rate that can be set", "no --fps");
    if (can.rate_Hz)
      request.rate_Hz = options.rate_Hz > 0 ? options.rate_Hz : std::min(kEnough_Hz, can.rate_Hz->most);
  }
};

}  // namespace

struct GenicamCamera::Impl : CameraLoop {
  Impl(const CameraOptions& o, const Sensor& s) : CameraLoop(kRetry_ns), options(o), sensor(s) {}

  CameraOptions options;
  const Sensor sensor;
  genicam::Identity identity;
  std::unique_ptr<genicam::Device> device;  // null while the camera is away
  const PixelFormat* pixel_format = nullptr;
  uint32_t channels = 1;
  genicam::Settings settings;
  std::optional<CameraPicture> picture;
  DeviceClock device_clock;
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
    device_clock = {};  // that of a camera that was off begins anew
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
      throw Error(Failure::Device, rate_text(options.rate_Hz) + " frames/s from " + identity.id,
                  rate_text(settings.rate_Hz), "a shorter exposure or a smaller --size");
    log.note_start();
    // Frames that a trigger starts come at the trigger's rate.
    log.note_promise(options.trigger.empty() ? settings.rate_Hz : 0, settings.exposure_s);
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
        {"rate", settings.rate_Hz > 0 ? rate_text(settings.rate_Hz) + " Hz" : "not known"},
        {"trigger", options.trigger.empty() ? "none" : options.trigger},
        {"buffers", std::to_string(options.buffers)}};
    list.insert(list.end(), settings.facts.begin(), settings.facts.end());
    log.set_facts(std::move(list));
  }

  double rate_Hz() const {
    if (settings.rate_Hz > 0) return settings.rate_Hz;
    return options.rate_Hz > 0 ? options.rate_Hz : kUnknownRate_Hz;
  }

  bool is_open() const override { return device != nullptr; }
  bool restart() override { return device->restart(); }
  void close() override { device.reset(); }

  bool reopen(std::string& /*but*/) override {
    try {
      device = genicam::module().open(id_of(options));
    } catch (const Error&) {
      return false;  // it does not answer yet
    }
    try {
      start();
    } catch (const Error&) {
      device.reset();
      throw;
    }
    return true;
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

  Event take(Frame& frame) override {
    Filled filled;
    const genicam::Event event = device->wait(kWait_ms, filled);
    if (event != genicam::Event::Ready) return event == genicam::Event::Gone ? Event::Gone : Event::Nothing;
    const int64_t delivered = monotonic_ns();
    const auto number = static_cast<uint32_t>(filled.number);
    if (const std::string fault = fill(filled, frame); !fault.empty()) {
      log.note_damage(number, fault);
      return Event::Nothing;
    }
    if (log.interrupted()) device_clock = {};
    stamped = filled.stamp_ns != 0;
    log.stamp(number, stamped ? device_clock.on_host(filled.stamp_ns, delivered) : 0, stamped, delivered,
              rate_Hz(), frame);
    if (const std::optional<uint64_t> packets = device->resent_packets())
      resent = static_cast<int64_t>(*packets);
    return Event::Ready;
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
  return impl_->next(frame);
}

std::string GenicamCamera::warning() const {
  return impl_->log.warning();
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
