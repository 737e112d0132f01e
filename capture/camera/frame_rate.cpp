#include "capture/camera/frame_rate.h"

#include <charconv>
#include <cmath>
#include <utility>

#include "engine/base/text.h"

namespace palpate {
namespace {

constexpr double kSame = 2e-6;  // of the rate: cameras count in steps of 100 ns
constexpr double kOff = 0.05;
constexpr uint64_t kLeastFrames = 5;

std::optional<double> take_whole(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

bool is_of_television(double rate_Hz) {
  const double thousands = rate_Hz * 1.001;
  return std::abs(rate_Hz - std::round(rate_Hz)) > kSame * rate_Hz && thousands >= 1 &&
         std::abs(thousands - std::round(thousands)) < kSame * thousands;
}

}  // namespace

RateFraction rate_fraction(double rate_Hz) {
  if (is_of_television(rate_Hz)) return {static_cast<uint32_t>(std::lround(rate_Hz * 1.001)) * 1000, 1001};
  // Continued fractions.
  uint64_t n0 = 0, n1 = 1, d0 = 1, d1 = 0;
  for (double rest = rate_Hz;;) {
    const auto whole = static_cast<uint64_t>(rest);
    const uint64_t n = whole * n1 + n0, d = whole * d1 + d0;
    if (n > UINT32_MAX || d > 1'000'000) break;
    n0 = std::exchange(n1, n);
    d0 = std::exchange(d1, d);
    const double fraction = rest - static_cast<double>(whole);
    if (std::abs(static_cast<double>(n) / static_cast<double>(d) - rate_Hz) < kSame * rate_Hz ||
        fraction < 1e-9)
      break;
    rest = 1 / fraction;
  }
  return {static_cast<uint32_t>(n1), static_cast<uint32_t>(d1)};
}

std::string rate_text(double rate_Hz) {
  std::string number = text("%.4g", rate_Hz);
  if (is_of_television(rate_Hz)) {
    const RateFraction f = rate_fraction(rate_Hz);
    number += text(" (%u/%u)", f.frames, f.seconds);
  }
  return number;
}

std::optional<double> parse_rate(std::string_view text) {
  const size_t slash = text.find('/');
  const std::optional<double> frames = take_whole(text.substr(0, slash));
  if (slash == std::string_view::npos || !frames) return frames;
  const std::optional<double> seconds = take_whole(text.substr(slash + 1));
  if (!seconds || *seconds <= 0) return std::nullopt;
  return *frames / *seconds;
}

std::string exposure_warning(double exposure_s, double rate_Hz) {
  if (exposure_s * rate_Hz <= 1.001) return {};
  return text("an exposure of %.4g ms allows at most %.4g frames/s, not ", 1e3 * exposure_s, 1 / exposure_s) +
         rate_text(rate_Hz);
}

void RateWatch::restart(double promised_Hz) {
  *this = {};
  promised_Hz_ = promised_Hz;
}

std::string RateWatch::add(uint64_t sequence, int64_t time_ns) {
  if (judged_ || promised_Hz_ <= 0) return {};
  if (!std::exchange(begun_, true)) {
    first_ = sequence;
    first_ns_ = time_ns;
  }
  const double passed_s = static_cast<double>(time_ns - first_ns_) * 1e-9;
  if (passed_s < 1 || sequence - first_ < kLeastFrames) return {};
  judged_ = true;
  const double rate_Hz = static_cast<double>(sequence - first_) / passed_s;
  if (std::abs(rate_Hz - promised_Hz_) <= kOff * promised_Hz_) return {};
  return "the camera promises " + rate_text(promised_Hz_) + text(" frames/s and takes %.4g", rate_Hz);
}

}  // namespace palpate
