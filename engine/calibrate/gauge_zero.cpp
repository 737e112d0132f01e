#include "engine/calibrate/gauge_zero.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace palpate {
namespace {

constexpr size_t kFewest = 2;
constexpr size_t kEnough = 3;          // readings of a stretch that all count
constexpr double kErrors = 3;          // standard errors that an offset may be from 0
constexpr double kNegligible = 0.002;  // of the range
constexpr double kSteady = 0.1;        // of the range
constexpr double kAlikeZero = 0.005;   // of the range: stretches of one zero
constexpr double kFlat = 0.5;          // of its distance from the zero: a stretch that is no unseen touch
constexpr double kTrimmed = 0.1;       // of a stretch's readings at each end: spikes of a gauge
constexpr double kMostCorrelated = 0.98;

struct Mean {
  double value = 0, variance = 0;  // variance of the mean
  double width = 0;                // between the readings, but for the extremes
  double rise = 0;                 // of a straight line through them, from the first to the last
  size_t count = 0;
};

/// Rise of the line of least squares, from the first reading to the last.
double rise_of(const std::vector<double>& readings) {
  const auto n = static_cast<double>(readings.size());
  if (readings.size() < 2) return 0;
  double product = 0, squares = 0;
  for (size_t i = 0; i < readings.size(); ++i) {
    const double x = static_cast<double>(i) - (n - 1) / 2;
    product += x * readings[i];
    squares += x * x;
  }
  return product / squares * (n - 1);
}

/// Mean of what is left without the extremes, and its variance with neighbours that err alike.
Mean trimmed_mean_of(const std::vector<double>& readings) {
  std::vector<double> sorted = readings;
  std::sort(sorted.begin(), sorted.end());
  const auto cut = static_cast<size_t>(kTrimmed * static_cast<double>(sorted.size()));
  Mean m;
  m.count = readings.size();
  for (size_t i = cut; i < sorted.size() - cut; ++i) m.value += sorted[i];
  m.value /= static_cast<double>(sorted.size() - 2 * cut);
  const double low = sorted[cut], high = sorted[sorted.size() - 1 - cut];
  m.width = high - low;
  m.rise = rise_of(readings);
  double squares = 0, lagged = 0, before = 0;
  for (const double r : readings) {
    const double off = std::clamp(r, low, high) - m.value;
    squares += off * off;
    lagged += off * before;
    before = off;
  }
  const double rho = squares > 0 ? std::clamp(lagged / squares, 0.0, kMostCorrelated) : 0;
  const auto n = static_cast<double>(m.count);
  const bool equal = std::sqrt(squares / n) <= 1e-12 * std::abs(m.value);  // but for rounding
  if (m.count > 1 && !equal) m.variance = squares / (n - 1) / n * (1 + rho) / (1 - rho);
  return m;
}

/// The half of the untouched frames from..to (less one) that lies farthest from a touch.
std::pair<size_t, size_t> farther_half(size_t from, size_t to, size_t frames) {
  const size_t half = std::max((to - from + 1) / 2, std::min(to - from, kEnough));
  if (from == 0 && to == frames) return {from, to};
  if (from == 0) return {from, from + half};
  if (to == frames) return {to - half, to};
  const size_t first = from + (to - from - half) / 2;
  return {first, first + half};
}

}  // namespace

bool GaugeZero::differs() const {
  return std::abs(offset) > std::max(kErrors * sd, kNegligible * range) &&
         std::abs(rise) <= kFlat * std::abs(offset);
}

bool GaugeZero::steady() const {
  return spread <= kSteady * range;
}

std::optional<GaugeZero> find_gauge_zero(std::span<const double> reading, const std::vector<bool>& touched,
                                         Pressed pressed, double least_range) {
  assert(reading.size() == touched.size());
  std::vector<Mean> stretches;
  for (size_t from = 0; from < touched.size();) {
    size_t to = from;
    while (to < touched.size() && touched[to] == touched[from]) ++to;
    if (!touched[from]) {
      const auto [first, end] = farther_half(from, to, touched.size());
      std::vector<double> readings;
      for (size_t i = first; i < end; ++i)
        if (std::isfinite(reading[i])) readings.push_back(reading[i]);
      if (!readings.empty()) stretches.push_back(trimmed_mean_of(readings));
    }
    from = to;
  }
  if (stretches.empty()) return std::nullopt;
  const auto by_value = [](const Mean& a, const Mean& b) { return a.value < b.value; };
  const Mean lowest = *std::min_element(stretches.begin(), stretches.end(), by_value);
  GaugeZero zero;
  zero.range = least_range;
  for (const double r : reading)
    if (std::isfinite(r)) zero.range = std::max(zero.range, std::abs(r - lowest.value));
  std::vector<Mean> used;
  for (const Mean& m : stretches) {
    const double alike = std::max(kErrors * std::sqrt(m.variance + lowest.variance), kAlikeZero * zero.range);
    if (pressed == Pressed::Either || m.value <= lowest.value + alike) used.push_back(m);
  }
  for (const Mean& m : used) {
    zero.readings += m.count;
    zero.offset += static_cast<double>(m.count) * m.value;
    zero.rise += static_cast<double>(m.count) * m.rise;
  }
  if (zero.readings < kFewest) return std::nullopt;
  const auto all = static_cast<double>(zero.readings);
  zero.offset /= all;
  zero.rise /= all;
  double variance = 0, between = 0;
  for (const Mean& m : used) {
    const double weight = static_cast<double>(m.count) / all;
    variance += weight * weight * m.variance;
    between += weight * (m.value - zero.offset) * (m.value - zero.offset);
  }
  if (used.size() > 1) variance = std::max(variance, between / static_cast<double>(used.size() - 1));
  zero.sd = std::sqrt(variance);
  double low = zero.offset, high = zero.offset;
  for (const Mean& m : stretches) {
    // A stretch that rises or falls is a touch that is not seen; the mean of a short one is only noise.
    if (m.width > kFlat * std::abs(m.value - zero.offset)) continue;
    const double noise = kErrors * std::sqrt(m.variance);
    low = std::min(low, m.value + noise);
    high = std::max(high, m.value - noise);
  }
  zero.spread = high - low;
  return zero;
}

}  // namespace palpate
