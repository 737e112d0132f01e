// The camera's options as text.
#include <charconv>
#include <cmath>
#include <sstream>

#include "capture/camera/camera_options.h"
#include "capture/camera/frame_rate.h"
#include "palpate/error.h"
#include "palpate/frame.h"

namespace palpate {
namespace {

constexpr const char* kCamera = "camera:";
constexpr const char* kCameraKeys =
    "format=NAME, size=WxH, fps=HZ (7.5, 30000/1001), exposure=8ms|500us|auto|locked, gain=N|auto|locked, "
    "white_balance=4500|auto|locked, trigger=Line0|Software, timeout=2s, buffers=3..32, control.NAME=N";

Error bad(const std::string& key, const std::string& value, const std::string& wanted) {
  return {Failure::Usage, wanted + " for '" + key + "' of a camera", "'" + value + "'", kCameraKeys};
}

/// A number at the start of `text`, which is left with what follows.
std::optional<double> take_number(std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || !std::isfinite(value)) return std::nullopt;
  text.erase(0, static_cast<size_t>(end - text.data()));
  return value;
}

double number(const std::string& key, const std::string& text, double least, double most) {
  std::string rest = text;
  const std::optional<double> value = take_number(rest);
  if (!value || !rest.empty() || *value < least || *value > most) {
    std::ostringstream range;
    range << "a number from " << least << " to " << most;
    throw bad(key, text, range.str());
  }
  return *value;
}

double whole(const std::string& key, const std::string& text, double least, double most) {
  const double value = number(key, text, least, most);
  if (value != std::floor(value)) throw bad(key, text, "a whole number");
  return value;
}

double seconds(const std::string& key, const std::string& text) {
  std::string unit = text;
  const std::optional<double> value = take_number(unit);
  const double scale = unit == "s" ? 1 : unit == "ms" ? 1e-3 : unit == "us" ? 1e-6 : 0;
  if (!value || scale == 0 || !(*value > 0) || *value * scale > 3600)
    throw bad(key, text, "a time with its unit (8ms, 500us, 0.01s)");
  return *value * scale;
}

template <class Read>
Automatic automatic(const std::string& text, const Read& read) {
  if (text == "auto") return {.automatic = true, .value = {}};
  if (text == "locked") return {};
  return {.automatic = false, .value = read(text)};
}

void set_size(CameraOptions& o, const std::string& text) {
  const size_t cross = text.find('x');
  if (cross == std::string::npos) throw bad("size", text, "WIDTHxHEIGHT");
  o.width = static_cast<uint32_t>(whole("size", text.substr(0, cross), 1, kMaxSide_px));
  o.height = static_cast<uint32_t>(whole("size", text.substr(cross + 1), 1, kMaxSide_px));
}

void set(CameraOptions& o, const std::string& key, const std::string& value) {
  constexpr double kLargest = 2147483647;
  if (key == "format") {
    o.format = value;
  } else if (key == "size") {
    set_size(o, value);
  } else if (key == "fps") {
    const std::optional<double> rate_Hz = parse_rate(value);
    if (!rate_Hz || *rate_Hz < 0.001 || *rate_Hz > 100000)
      throw bad(key, value, "a number from 0.001 to 100000, or a fraction such as 30000/1001,");
    o.rate_Hz = *rate_Hz;
  } else if (key == "exposure") {
    o.exposure = automatic(value, [&](const std::string& t) { return seconds(key, t); });
  } else if (key == "gain") {
    o.gain = automatic(value, [&](const std::string& t) { return whole(key, t, -kLargest, kLargest); });
  } else if (key == "white_balance") {
    o.white_balance = automatic(value, [&](const std::string& t) {
      return whole(key, !t.empty() && t.back() == 'K' ? t.substr(0, t.size() - 1) : t, 1000, 40000);
    });
  } else if (key == "trigger") {
    if (value.empty()) throw bad(key, value, "the name of a source");
    o.trigger = value;
  } else if (key == "timeout") {
    o.timeout_s = seconds(key, value);
  } else if (key == "buffers") {
    o.buffers = static_cast<uint32_t>(whole(key, value, 3, 32));
  } else if (key.rfind("control.", 0) == 0 && key.size() > 8) {
    o.controls.emplace_back(key.substr(8), static_cast<int64_t>(whole(key, value, -9e15, 9e15)));
  } else {
    throw Error(Failure::Usage, "an option of a camera", "'" + key + "'", kCameraKeys);
  }
}

/// As few digits as give the number back.
std::string digits(double value) {
  char text[32];
  const auto [end, error] = std::to_chars(text, text + sizeof text, value);
  return {text, end};
}

std::string text_of(const Automatic& setting, const char* unit) {
  if (setting.automatic) return "auto";
  return setting.value ? digits(*setting.value) + unit : std::string();
}

}  // namespace

bool is_camera(const std::string& input) {
  return input.rfind(kCamera, 0) == 0;
}

CameraOptions parse_camera(const std::string& input) {
  CameraOptions o;
  const std::string rest = is_camera(input) ? input.substr(7) : input;
  const size_t question = rest.find('?');
  o.node = rest.substr(0, question);
  std::istringstream pairs(question == std::string::npos ? "" : rest.substr(question + 1));
  for (std::string pair; std::getline(pairs, pair, '&');) {
    const size_t equals = pair.find('=');
    set(o, pair.substr(0, equals), equals == std::string::npos ? "" : pair.substr(equals + 1));
  }
  return o;
}

std::string to_string(const CameraOptions& o) {
  std::string text = kCamera + o.node;
  char mark = '?';
  const auto add = [&](const std::string& key, const std::string& value) {
    if (value.empty()) return;
    text += mark + key + "=" + value;
    mark = '&';
  };
  add("format", o.format);
  if (o.width != 0) add("size", std::to_string(o.width) + "x" + std::to_string(o.height));
  if (const RateFraction f = rate_fraction(o.rate_Hz > 0 ? o.rate_Hz : 1); o.rate_Hz > 0)
    add("fps", f.seconds == 1001 ? std::to_string(f.frames) + "/1001" : digits(o.rate_Hz));
  add("exposure", text_of(o.exposure, "s"));
  add("gain", text_of(o.gain, ""));
  add("white_balance", text_of(o.white_balance, ""));
  add("trigger", o.trigger);
  if (o.timeout_s > 0) add("timeout", digits(o.timeout_s) + "s");
  if (o.buffers != CameraOptions{}.buffers) add("buffers", std::to_string(o.buffers));
  for (const auto& [name, value] : o.controls) add("control." + name, std::to_string(value));
  return text;
}

}  // namespace palpate
