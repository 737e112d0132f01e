// GenICam cameras by Aravis.
#include <arv.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>

#include "capture/genicam/aravis/parts.h"
#include "engine/base/text.h"
#include "palpate/error.h"

namespace palpate::genicam {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kNoAnswer{1};  // a software trigger after which no frame came is given again

/// Aravis's way to report: an error of its call, or none.
class Trouble {
 public:
  Trouble() = default;
  ~Trouble() { g_clear_error(&error_); }
  Trouble(const Trouble&) = delete;
  Trouble& operator=(const Trouble&) = delete;

  GError** operator&() {
    g_clear_error(&error_);
    return &error_;
  }
  explicit operator bool() const { return error_ != nullptr; }
  bool is(GQuark domain, int code) const { return g_error_matches(error_, domain, code); }
  std::string words() const { return error_ ? error_->message : ""; }

 private:
  GError* error_ = nullptr;
};

struct Unref {
  void operator()(gpointer object) const { g_object_unref(object); }
};
struct Free {
  void operator()(gpointer memory) const { g_free(memory); }
};

std::string text_or_empty(const char* text) {
  return text ? text : "";
}

/// A list of names that Aravis allocates.
template <typename Call>
std::vector<std::string> names_of(const Call& call) {
  guint count = 0;
  Trouble trouble;
  const std::unique_ptr<const char*, Free> names(call(&count, &trouble));
  if (!names || trouble) return {};
  return {names.get(), names.get() + count};
}

std::vector<Identity> listed() {
  arv_update_device_list();
  std::vector<Identity> list;
  for (unsigned i = 0; i < arv_get_n_devices(); ++i)
    list.push_back({text_or_empty(arv_get_device_id(i)), text_or_empty(arv_get_device_vendor(i)),
                    text_or_empty(arv_get_device_model(i)), text_or_empty(arv_get_device_serial_nbr(i)),
                    text_or_empty(arv_get_device_address(i)), text_or_empty(arv_get_device_protocol(i))});
  return list;
}

Identity identity_of(ArvCamera* camera, const std::string& id) {
  Identity is{id,
              text_or_empty(arv_camera_get_vendor_name(camera, nullptr)),
              text_or_empty(arv_camera_get_model_name(camera, nullptr)),
              text_or_empty(arv_camera_get_device_serial_number(camera, nullptr)),
              "",
              "Fake"};
  if (arv_camera_is_uv_device(camera)) is.protocol = "USB3Vision";
  if (!arv_camera_is_gv_device(camera)) return is;
  is.protocol = "GigEVision";
  GSocketAddress* address = arv_gv_device_get_device_address(ARV_GV_DEVICE(arv_camera_get_device(camera)));
  const std::unique_ptr<char, Free> words(
      g_inet_address_to_string(g_inet_socket_address_get_address(G_INET_SOCKET_ADDRESS(address))));
  is.address = text_or_empty(words.get());
  return is;
}

/// The stream and its buffers: a lease keeps it alive.
class Stream {
 public:
  Stream(ArvStream* stream, uint32_t buffers, size_t bytes) : stream_(stream) {
    for (uint32_t i = 0; i < buffers; ++i) arv_stream_push_buffer(stream, arv_buffer_new_allocate(bytes));
  }

  ArvBuffer* pop(int timeout_ms) {
    return arv_stream_timeout_pop_buffer(stream_.get(), static_cast<guint64>(timeout_ms) * 1000);
  }
  void push(ArvBuffer* buffer) { arv_stream_push_buffer(stream_.get(), buffer); }
  uint32_t with_camera() const {
    gint waiting = 0, filled = 0;
    arv_stream_get_n_buffers(stream_.get(), &waiting, &filled);
    return static_cast<uint32_t>(std::max(waiting, 0));
  }
  std::optional<uint64_t> info(const char* name) const {
    for (guint i = 0; i < arv_stream_get_n_infos(stream_.get()); ++i)
      if (text_or_empty(arv_stream_get_info_name(stream_.get(), i)) == name &&
          arv_stream_get_info_type(stream_.get(), i) == G_TYPE_UINT64)
        return arv_stream_get_info_uint64(stream_.get(), i);
    return std::nullopt;
  }

 private:
  std::unique_ptr<ArvStream, Unref> stream_;
};

const char* words_of(ArvBufferStatus status) {
  switch (status) {
    case ARV_BUFFER_STATUS_TIMEOUT:
      return "not all of it came in time";
    case ARV_BUFFER_STATUS_MISSING_PACKETS:
      return "packets were lost";
    case ARV_BUFFER_STATUS_WRONG_PACKET_ID:
      return "packets in a wrong order";
    case ARV_BUFFER_STATUS_SIZE_MISMATCH:
      return "another size than announced";
    case ARV_BUFFER_STATUS_ABORTED:
      return "broken off";
    default:
      return "not filled";
  }
}

class AravisDevice : public Device {
 public:
  AravisDevice(ArvCamera* camera, const std::string& id)
      : camera_(camera), identity_(identity_of(camera, id)) {
    lost_ = g_signal_connect(arv_camera_get_device(camera), "control-lost", G_CALLBACK(&on_lost), &gone_);
  }
  ~AravisDevice() override {
    stop();
    g_signal_handler_disconnect(arv_camera_get_device(camera_.get()), lost_);
  }

  const Identity& identity() const override { return identity_; }
  Abilities abilities() const override;
  Settings start(const Request& request) override;
  Event wait(int timeout_ms, Filled& filled) override;
  uint32_t with_camera() const override { return stream_ ? stream_->with_camera() : 0; }
  bool restart() override;
  std::optional<uint64_t> resent_packets() const override {
    return stream_ ? stream_->info("n_resent_packets") : std::nullopt;
  }

 private:
  static void on_lost(ArvDevice*, gpointer gone) { *static_cast<std::atomic<bool>*>(gone) = true; }

  bool has(const char* feature) const {
    return arv_camera_is_feature_available(camera_.get(), feature, nullptr);
  }
  [[noreturn]] void refuse(const std::string& wanted, const std::string& found,
                           const std::string& try_this) const {
    throw Error(Failure::Device, wanted + " from " + identity_.id, found, try_this);
  }
  /// Of a call that sets something.
  void check(const Trouble& trouble, const std::string& wanted) const {
    if (trouble) refuse(wanted, trouble.words(), "palpate cameras genicam:" + identity_.id);
  }
  void set_region(const Request& request);
  void set_automatic(const Automatic& wanted, const char* name, bool there,
                     void (*set)(ArvCamera*, ArvAuto, GError**)) const;
  void set_values(const CameraOptions& options) const;
  void set_control(const std::string& name, int64_t value) const;
  void set_trigger(const std::string& source) const;
  Settings read_back() const;
  void acquire();
  void stop();
  int trigger_if_due(int timeout_ms);

  std::unique_ptr<ArvCamera, Unref> camera_;
  Identity identity_;
  gulong lost_ = 0;
  std::atomic<bool> gone_ = false;
  std::shared_ptr<Stream> stream_;
  uint32_t buffers_ = 0;
  bool software_trigger_ = false, awaited_ = false;
  Clock::duration period_{};
  Clock::time_point triggered_;
  uint64_t number_ = 0, raw_number_ = 0;
  bool numbered_ = false;
};

Abilities AravisDevice::abilities() const {
  ArvCamera* c = camera_.get();
  Abilities a;
  a.formats = names_of(
      [&](guint* n, GError** e) { return arv_camera_dup_available_pixel_formats_as_strings(c, n, e); });
  a.triggers =
      names_of([&](guint* n, GError** e) { return arv_camera_dup_available_trigger_sources(c, n, e); });
  const auto whole = [&](auto bounds, auto increment) {
    gint least = 0, most = 0;
    bounds(c, &least, &most, nullptr);
    return WholeRange{least, most, std::max(1, increment(c, nullptr))};
  };
  a.width_px = whole(arv_camera_get_width_bounds, arv_camera_get_width_increment);
  a.height_px = whole(arv_camera_get_height_bounds, arv_camera_get_height_increment);
  const auto range = [&](bool there, auto bounds) -> std::optional<Range> {
    Trouble trouble;
    Range r;
    if (there) bounds(c, &r.least, &r.most, &trouble);
    return there && !trouble ? std::optional(r) : std::nullopt;
  };
  a.rate_Hz = range(arv_camera_is_frame_rate_available(c, nullptr), arv_camera_get_frame_rate_bounds);
  a.exposure_us =
      range(arv_camera_is_exposure_time_available(c, nullptr), arv_camera_get_exposure_time_bounds);
  a.gain_dB = range(arv_camera_is_gain_available(c, nullptr), arv_camera_get_gain_bounds);
  a.exposure_auto = arv_camera_is_exposure_auto_available(c, nullptr);
  a.gain_auto = arv_camera_is_gain_auto_available(c, nullptr);
  a.white_balance_auto = has("BalanceWhiteAuto");
  return a;
}

/// The middle of the chip, as much of it as is wanted.
void AravisDevice::set_region(const Request& request) {
  ArvCamera* c = camera_.get();
  gint chip_width = 0, chip_height = 0;
  arv_camera_get_sensor_size(c, &chip_width, &chip_height, nullptr);
  const auto middle = [](gint chip, uint32_t wanted, gint step) {
    const gint left = std::max(0, (chip - static_cast<gint>(wanted)) / 2);
    return left - left % std::max(1, step);
  };
  Trouble trouble;
  const bool offset = arv_camera_is_region_offset_available(c, nullptr);
  const gint x = offset ? middle(chip_width, request.width, arv_camera_get_x_offset_increment(c, nullptr))
                        : -1,
             y = offset ? middle(chip_height, request.height, arv_camera_get_y_offset_increment(c, nullptr))
                        : -1;
  arv_camera_set_region(c, x, y, static_cast<gint>(request.width), static_cast<gint>(request.height),
                        &trouble);
  check(trouble, text("%u x %u px", request.width, request.height));
}

void AravisDevice::set_automatic(const Automatic& wanted, const char* name, bool there,
                                 void (*set)(ArvCamera*, ArvAuto, GError**)) const {
  if (!there && wanted.automatic)
    refuse(std::string("an automatic ") + name, "none", "a value in its place, or locked");
  if (!there) return;
  Trouble trouble;
  set(camera_.get(), wanted.automatic ? ARV_AUTO_CONTINUOUS : ARV_AUTO_OFF, &trouble);
  check(trouble, std::string(wanted.automatic ? "an automatic " : "a locked ") + name);
}

void AravisDevice::set_values(const CameraOptions& options) const {
  ArvCamera* c = camera_.get();
  const Abilities a = abilities();
  const auto in = [&](const std::optional<Range>& range, double value, const std::string& what) {
    if (!range) refuse(what, "none that can be set", "palpate cameras genicam:" + identity_.id);
    if (value < range->least || value > range->most)
      refuse(what, text("%.6g to %.6g", range->least, range->most), "a value in that range");
  };
  set_automatic(options.exposure, "exposure", a.exposure_auto, arv_camera_set_exposure_time_auto);
  set_automatic(options.gain, "gain", a.gain_auto, arv_camera_set_gain_auto);
  set_automatic(options.white_balance, "white balance", a.white_balance_auto,
                [](ArvCamera* camera, ArvAuto mode, GError** error) {
                  arv_camera_set_string(camera, "BalanceWhiteAuto",
                                        mode == ARV_AUTO_OFF ? "Off" : "Continuous", error);
                });
  if (options.white_balance.value)
    refuse("a white balance in K", "a GenICam camera, which balances its channels one by one",
           "--control BalanceRatioRaw=N, or locked");
  Trouble trouble;
  if (options.exposure.value) {
    const double us = *options.exposure.value * 1e6;
    in(a.exposure_us, us, text("an exposure of %.6g us", us));
    arv_camera_set_exposure_time(c, us, &trouble);
    check(trouble, text("an exposure of %.6g us", us));
  }
  if (options.gain.value) {
    in(a.gain_dB, *options.gain.value, text("a gain of %.6g", *options.gain.value));
    arv_camera_set_gain(c, *options.gain.value, &trouble);
    check(trouble, text("a gain of %.6g", *options.gain.value));
  }
  for (const auto& [name, value] : options.controls) set_control(name, value);
}

void AravisDevice::set_control(const std::string& name, int64_t value) const {
  ArvCamera* c = camera_.get();
  const std::string wanted = "control " + name + " at " + std::to_string(value);
  ArvGcNode* node = arv_device_get_feature(arv_camera_get_device(c), name.c_str());
  if (!node)
    refuse(wanted, "no feature of that name", "the names in the camera's manual, as GenICam writes them");
  Trouble trouble;
  if (ARV_IS_GC_BOOLEAN(node))
    arv_camera_set_boolean(c, name.c_str(), value != 0, &trouble);
  else if (ARV_IS_GC_ENUMERATION(node))
    arv_gc_enumeration_set_int_value(ARV_GC_ENUMERATION(node), value, &trouble);
  else if (ARV_IS_GC_FLOAT(node))
    arv_camera_set_float(c, name.c_str(), static_cast<double>(value), &trouble);
  else
    arv_camera_set_integer(c, name.c_str(), value, &trouble);
  check(trouble, wanted);
}

void AravisDevice::set_trigger(const std::string& source) const {
  ArvCamera* c = camera_.get();
  Trouble trouble;
  if (source.empty()) {
    if (has("TriggerMode")) arv_camera_clear_triggers(c, nullptr);
    return;
  }
  const std::vector<std::string> sources = abilities().triggers;
  if (std::ranges::find(sources, source) == sources.end()) {
    std::string list;
    for (const std::string& name : sources) list += (list.empty() ? "" : ", ") + name;
    refuse("frames triggered by " + source, list.empty() ? "no trigger" : "the triggers " + list,
           "one of those, or none");
  }
  arv_camera_set_trigger(c, source.c_str(), &trouble);
  check(trouble, "frames triggered by " + source);
}

Settings AravisDevice::read_back() const {
  ArvCamera* c = camera_.get();
  Settings s;
  gint x = 0, y = 0, width = 0, height = 0;
  arv_camera_get_region(c, &x, &y, &width, &height, nullptr);
  s.width = static_cast<uint32_t>(width);
  s.height = static_cast<uint32_t>(height);
  s.format = text_or_empty(arv_camera_get_pixel_format_as_string(c, nullptr));
  if (arv_camera_is_frame_rate_available(c, nullptr)) s.rate_Hz = arv_camera_get_frame_rate(c, nullptr);
  s.facts.emplace_back("offset", text("%d, %d px", x, y));
  if (arv_camera_is_exposure_time_available(c, nullptr)) {
    const double exposure_us = arv_camera_get_exposure_time(c, nullptr);
    const bool by_itself = arv_camera_is_exposure_auto_available(c, nullptr) &&
                           arv_camera_get_exposure_time_auto(c, nullptr) != ARV_AUTO_OFF;
    if (!by_itself) s.exposure_s = exposure_us * 1e-6;
    s.facts.emplace_back("exposure", text("%.6g us", exposure_us));
  }
  if (arv_camera_is_gain_available(c, nullptr))
    s.facts.emplace_back("gain", text("%.6g", arv_camera_get_gain(c, nullptr)));
  if (arv_camera_is_gv_device(c))
    s.facts.emplace_back("packet size", text("%u bytes", arv_camera_gv_get_packet_size(c, nullptr)));
  return s;
}

Settings AravisDevice::start(const Request& request) {
  ArvCamera* c = camera_.get();
  stop();
  Trouble trouble;
  arv_camera_set_pixel_format_from_string(c, request.format.c_str(), &trouble);
  check(trouble, "format " + request.format);
  set_region(request);
  arv_camera_set_acquisition_mode(c, ARV_ACQUISITION_MODE_CONTINUOUS, nullptr);
  set_values(request.options);
  if (request.rate_Hz > 0) {
    arv_camera_set_frame_rate(c, request.rate_Hz, &trouble);
    check(trouble, text("%.4g frames/s", request.rate_Hz));
  }
  // After the rate, which some cameras set by clearing their triggers.
  set_trigger(request.options.trigger);
  software_trigger_ = request.options.trigger == "Software";
  period_ = std::chrono::nanoseconds(request.rate_Hz > 0 ? std::llround(1e9 / request.rate_Hz) : 0);
  buffers_ = request.options.buffers;
  if (arv_camera_is_gv_device(c)) arv_camera_gv_auto_packet_size(c, nullptr);
  acquire();
  return read_back();
}

void AravisDevice::acquire() {
  Trouble trouble;
  ArvStream* stream = arv_camera_create_stream(camera_.get(), nullptr, nullptr, &trouble);
  if (!stream) refuse("a stream of frames", trouble.words(), "closing other programs that use the camera");
  const guint bytes = arv_camera_get_payload(camera_.get(), &trouble);
  stream_ = std::make_shared<Stream>(stream, buffers_, bytes);
  check(trouble, "the size of a frame");
  numbered_ = awaited_ = false;
  arv_camera_start_acquisition(camera_.get(), &trouble);
  if (trouble) stream_.reset();
  check(trouble, "frames");
}

void AravisDevice::stop() {
  if (!stream_) return;
  arv_camera_stop_acquisition(camera_.get(), nullptr);
  stream_.reset();
}

bool AravisDevice::restart() {
  try {
    stop();
    acquire();
    return true;
  } catch (const Error&) {
    return false;
  }
}

/// Starts the next frame where nobody else does; returns how long to wait for one, ms.
int AravisDevice::trigger_if_due(int timeout_ms) {
  const Clock::time_point now = Clock::now();
  if (awaited_ && now - triggered_ < kNoAnswer) return timeout_ms;
  if (const auto left = period_ - (now - triggered_); left > Clock::duration::zero())
    return std::min(timeout_ms, static_cast<int>(std::chrono::ceil<std::chrono::milliseconds>(left).count()));
  arv_camera_software_trigger(camera_.get(), nullptr);
  triggered_ = now;
  awaited_ = true;
  return timeout_ms;
}

Event AravisDevice::wait(int timeout_ms, Filled& filled) {
  if (gone_ || !stream_) return Event::Gone;
  if (software_trigger_) timeout_ms = trigger_if_due(timeout_ms);
  ArvBuffer* buffer = stream_->pop(timeout_ms);
  if (!buffer) return gone_ ? Event::Gone : Event::Nothing;
  awaited_ = false;
  // Older GigE cameras count from 1 to 65 535 and anew.
  const uint64_t raw = arv_buffer_get_frame_id(buffer);
  constexpr uint64_t kNumbers = UINT16_MAX;
  if (!numbered_)
    number_ = raw;
  else if (raw < raw_number_ && raw_number_ <= kNumbers && raw_number_ - raw > kNumbers / 2)
    number_ += raw + kNumbers - raw_number_;
  else
    number_ += raw - raw_number_;
  raw_number_ = raw;
  numbered_ = true;
  filled = {};
  filled.number = number_;
  filled.stamp_ns = static_cast<int64_t>(arv_buffer_get_timestamp(buffer));
  const ArvBufferStatus status = arv_buffer_get_status(buffer);
  if (status != ARV_BUFFER_STATUS_SUCCESS) {
    filled.damage = words_of(status);
    stream_->push(buffer);
    return Event::Ready;
  }
  size_t bytes = 0;
  const void* data = arv_buffer_get_image_data(buffer, &bytes);
  gint x_padding = 0, y_padding = 0;
  arv_buffer_get_image_padding(buffer, &x_padding, &y_padding);
  filled.bytes = bytes;
  filled.width = static_cast<uint32_t>(std::max(0, arv_buffer_get_image_width(buffer)));
  filled.height = static_cast<uint32_t>(std::max(0, arv_buffer_get_image_height(buffer)));
  const auto bits =
      static_cast<uint32_t>(ARV_PIXEL_FORMAT_BIT_PER_PIXEL(arv_buffer_get_image_pixel_format(buffer)));
  filled.stride_bytes = (filled.width * bits + 7) / 8 + static_cast<uint32_t>(x_padding);
  filled.pixels = {static_cast<const uint8_t*>(data),
                   [stream = stream_, buffer](const uint8_t*) { stream->push(buffer); }};
  return Event::Ready;
}

}  // namespace

std::vector<Identity> list_cameras(bool with_fake) {
  if (with_fake) arv_enable_interface("Fake");
  return listed();
}

std::unique_ptr<Device> open_camera(const std::string& asked) {
  if (asked.starts_with("Fake")) arv_enable_interface("Fake");
  std::string id = asked;
  if (const std::vector<Identity> list = asked.empty() ? listed() : std::vector<Identity>(); !list.empty())
    id = list.front().id;
  Trouble trouble;
  ArvCamera* camera = id.empty() ? nullptr : arv_camera_new(id.c_str(), &trouble);
  if (camera) return std::make_unique<AravisDevice>(camera, id);
  if (!id.empty() && !trouble.is(ARV_DEVICE_ERROR, ARV_DEVICE_ERROR_NOT_FOUND))
    throw Error(Failure::Device, "the GenICam camera " + id, trouble.words(),
                "closing other programs that use it; for USB the right to use it (a udev rule)");
  std::string ids;
  for (const Identity& other : listed()) ids += (ids.empty() ? "" : ", ") + other.id;
  throw Error(
      Failure::Device, id.empty() ? "a GenICam camera" : "the GenICam camera '" + id + "'",
      ids.empty() ? "none that answers" : "the cameras " + ids,
      "palpate cameras; for GigE an address in the camera's own network; for USB the right to use it");
}

}  // namespace palpate::genicam
