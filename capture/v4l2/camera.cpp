#include "capture/v4l2/camera.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <sstream>

#include "capture/camera/camera_loop.h"
#include "capture/camera/camera_picture.h"
#include "capture/v4l2/camera_setup.h"
#include "capture/v4l2/stream.h"
#include "capture/v4l2/usb_budget.h"
#include "engine/base/clock.h"
#include "palpate/error.h"

namespace palpate {
namespace {

using v4l2::Stream;

constexpr int64_t kRetry_ns = 250'000'000;
constexpr uint32_t kStayWithDriver = 2;
constexpr double kUnknownRate_Hz = 30;

std::string brief(double value) {
  std::ostringstream s;
  s.precision(4);
  s << value;
  return s.str();
}

}  // namespace

struct Camera::Impl : CameraLoop {
  Impl(const CameraOptions& o, const Sensor& s) : CameraLoop(kRetry_ns), options(o), sensor(s) {}
  ~Impl() override {
    if (stream) stream->stop();
  }

  CameraOptions options;
  const Sensor sensor;
  v4l2::Identity identity;
  std::shared_ptr<v4l2::Device> device;
  std::optional<v4l2::UsbShare> share;
  std::shared_ptr<Stream> stream;  // null while the camera is away
  CameraSetup setup;
  std::optional<CameraPicture> picture;
  std::atomic<bool> start_of_frame = false, stamps_believed = false;
  std::atomic<uint64_t> stamps_refused = 0;
  std::atomic<uint32_t> stride_bytes = 0;  // of `setup`, for other threads

  void open_first() {
    device = std::make_shared<v4l2::Device>(camera_node(options.node));
    identity = device->identity();
    setup = set_up(*device, options, needs_of(sensor));
    picture.emplace(sensor, *setup.format, setup.channels, setup.image.width, setup.image.height,
                    identity.path);
    // From here on the same is wanted whenever it is opened.
    options.format = setup.format->name;
    options.width = setup.image.width;
    options.height = setup.image.height;
    const double period_s = setup.rate_Hz > 0 ? 1 / setup.rate_Hz : 0;
    timeout_ns =
        std::llround(1e9 * (options.timeout_s > 0 ? options.timeout_s : std::max(2.0, 5 * period_s)));
    start();
  }

  /// The bus must carry it beside the cameras that stream already.
  void take_share() {
    share.reset();
    const std::optional<v4l2::UsbPlace> place = v4l2::usb_place(device->identity().path);
    // How much a compressed stream takes, the camera alone knows.
    if (!place || setup.format->layout == PixelLayout::Jpeg) return;
    const auto bytes_per_px =
        static_cast<double>(setup.image.image_bytes) / (double{1} * setup.image.width * setup.image.height);
    const auto mode = [&](uint32_t width, uint32_t height, double rate_Hz) {
      return v4l2::UsbMode{
          "--size " + std::to_string(width) + "x" + std::to_string(height) + " --fps " + rate_text(rate_Hz),
          bytes_per_px * width * height * rate_Hz};
    };
    const auto offers = [&] {
      std::vector<v4l2::UsbMode> modes;
      for (const v4l2::SizeRange& size : device->sizes(setup.format->fourcc))
        for (const v4l2::RateRange& rate :
             device->rates(setup.format->fourcc, size.most_width, size.most_height))
          modes.push_back(mode(size.most_width, size.most_height, rate.most_Hz));
      return modes;
    };
    share.emplace(*place, identity.card + " at " + device->identity().path,
                  mode(setup.image.width, setup.image.height, rate_Hz()), offers);
  }

  void start() {
    take_share();
    stream = Stream::start(device, options.buffers);
    stride_bytes = setup.image.stride_bytes;
    log.note_start();
    log.note_promise(setup.rate_Hz, exposure_s(setup.controls));
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
        {"rate", setup.rate_Hz > 0 ? rate_text(setup.rate_Hz) + " Hz" : "not known"},
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
    log.set_facts(std::move(list));
  }

  double rate_Hz() const {
    if (setup.rate_Hz > 0) return setup.rate_Hz;
    return options.rate_Hz > 0 ? options.rate_Hz : kUnknownRate_Hz;
  }

  bool is_open() const override { return stream != nullptr; }
  bool restart() override { return stream->restart(); }
  void close() override {
    stream->stop();
    stream.reset();
    share.reset();
    device.reset();
  }

  /// Whatever its node is called by then.
  bool reopen(std::string& but) override {
    std::string path;
    for (const v4l2::NodeReport& node : v4l2::list_nodes())
      if (node.capture && node.identity.same_camera(identity)) path = node.path;
    if (path.empty()) return false;
    try {
      device = std::make_shared<v4l2::Device>(path);
      const std::string unset = restore_controls(*device, setup.controls);
      setup = set_up(*device, options, needs_of(sensor));
      start();
      if (!unset.empty()) but = "not its controls " + unset;
    } catch (const Error&) {
      device.reset();
      throw;
    }
    return true;
  }

  /// Pixels of the frame.
  CameraPicture::Fault fill(const Stream::Filled& filled, Frame& frame) {
    const RawImage raw{filled.bytes, setup.image.width, setup.image.height, setup.image.stride_bytes};
    const bool lent = picture->is_frame(raw.stride_bytes) && stream->with_driver() >= kStayWithDriver;
    CameraPicture::Fault fault = lent ? picture->look_at(raw) : picture->fill(raw, frame);
    if (!fault.words.empty()) return fault;
    if (lent) {
      frame.format = picture->format();
      frame.pages = stream->pages(filled.buffer);
      frame.leased = stream->lend(filled.buffer);
    }
    log.note_pixels(lent);
    return {};
  }

  Event take(Frame& frame) override {
    Stream::Filled filled;
    Stream::Event event = stream->wait(kWait_ms);
    if (event == Stream::Event::Ready) event = stream->take(filled);
    const int64_t delivered = monotonic_ns();
    if (event != Stream::Event::Ready)
      return event == Stream::Event::Gone     ? Event::Gone
             : event == Stream::Event::Broken ? Event::Broken
                                              : Event::Nothing;
    const CameraPicture::Fault fault =
        filled.damaged ? CameraPicture::Fault{"marked by the driver"} : fill(filled, frame);
    // A lent buffer goes back by itself.
    if (!frame.leased) stream->requeue(filled.buffer);
    if (fault.words.empty()) {
      log.stamp(filled.sequence, filled.stamp_ns, filled.monotonic, delivered, rate_Hz(), frame);
      start_of_frame = filled.start_of_frame;
      stamps_believed = log.clock().believed() > 0;
      stamps_refused = log.clock().refused();
      return Event::Ready;
    }
    if (log.frames() == 0 && fault.of_format)
      throw Error(
          Failure::Input,
          "frames of " + std::to_string(picture->format().bit_depth) + " bits in format " +
              setup.format->name,
          identity.path + " with " + fault.words,
          "format Y16 and \"bit_depth\": 16 in the sensor file (some cameras write their bits at the high "
          "end)");
    log.note_damage(filled.sequence, fault.words);
    return Event::Nothing;
  }
};

Camera::Camera(const CameraOptions& options, const Sensor& sensor)
    : impl_(std::make_unique<Impl>(options, sensor)) {
  impl_->open_first();
}

Camera::~Camera() = default;

FrameFormat Camera::format() const {
  return impl_->picture->format();
}
double Camera::rate_Hz() const {
  return impl_->rate_Hz();
}
void Camera::watch(const std::function<bool()>& cancelled) {
  impl_->cancelled = cancelled;
}

bool Camera::next(Frame& frame) {
  return impl_->next(frame);
}

std::string Camera::warning() const {
  return impl_->log.warning();
}

CaptureCounts Camera::counts() const {
  return impl_->log.counts();
}

std::string Camera::state() const {
  return impl_->log.state();
}

std::vector<std::pair<std::string, std::string>> Camera::details() const {
  const Impl& m = *impl_;
  std::string clock = "driver, CLOCK_MONOTONIC, ";
  clock += m.start_of_frame ? "at the start of exposure" : "at the end of the frame";
  if (!m.stamps_believed && m.stamps_refused > 0)
    clock = "delivery: the driver's time stamps are not of this clock";
  if (m.stamps_believed && m.stamps_refused > 0)
    clock += "; " + std::to_string(m.stamps_refused) + " impossible stamps replaced by delivery";
  return m.log.details(clock, m.picture->copies(m.stride_bytes));
}

FrameFormat linux_camera_format(const CameraOptions& options) {
  v4l2::Device device(camera_node(options.node));
  const CameraSetup setup = set_up(device, options, {});
  return {setup.image.width, setup.image.height, setup.channels, setup.format->bit_depth};
}

}  // namespace palpate
