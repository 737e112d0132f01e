// Rates of cameras: as fractions, as text, and as they are kept.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace palpate {

/// A rate as a fraction of whole numbers.
struct RateFraction {
  uint32_t frames = 0;
  uint32_t seconds = 1;
  bool operator==(const RateFraction&) const = default;
};

/// The fraction that is meant: N/1001 where the rate is one of television's, otherwise the simplest within
/// 2e-6 of it. `rate_Hz` from 0.001 to 100000.
RateFraction rate_fraction(double rate_Hz);
/// "30", "7.5", or "29.97 (30000/1001)".
std::string rate_text(double rate_Hz);
/// A number or a fraction, such as "7.5" or "30000/1001"; nothing where it is neither.
std::optional<double> parse_rate(std::string_view text);

/// "an exposure of 50 ms allows at most 20 frames/s, not 30"; empty where the exposure fits the rate. Either
/// may be 0: not known.
std::string exposure_warning(double exposure_s, double rate_Hz);

/// The rate at which frames come, against the one that was promised.
class RateWatch {
 public:
  /// The stream starts anew. 0: nothing is promised.
  void restart(double promised_Hz);
  /// A frame, by number and time. Returns a warning once, after a second and at least 5 frames, where the
  /// rate is off by more than 5 %.
  std::string add(uint64_t sequence, int64_t time_ns);

 private:
  double promised_Hz_ = 0;
  bool begun_ = false, judged_ = false;
  uint64_t first_ = 0;
  int64_t first_ns_ = 0;
};

}  // namespace palpate
