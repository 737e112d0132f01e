#include "engine/measure/picture/light_change.h"

#include <algorithm>
#include <cmath>

#include "engine/base/nth_value.h"

namespace palpate {
namespace {

constexpr float kDark_gray = 4;  // a gain shows too little below
constexpr double kParts = 12;    // of a picture, that a touch changes independently
constexpr double kPulled = 0.3;  // of a picture's scatter, by which a touch pulls its light
constexpr double kLeastError_gray = 0.2;
constexpr double kSurely = 2;  // standard deviations that two lights differ by

bool follows(const LightChange& light, float change, float untouched) {
  return std::abs(double{change} - light.at(double{untouched})) < LightEstimate::kInlier_gray;
}

/// Standard deviation of the places about `light`, by their median; `sorted` is overwritten.
double scatter_about(const LightChange& light, std::span<const float> change,
                     std::span<const float> untouched, std::vector<float>& sorted) {
  for (size_t i = 0; i < change.size(); ++i)
    sorted[i] = std::abs(change[i] - static_cast<float>(light.at(double{untouched[i]})));
  return 1.4826 * double{nth_value(sorted, sorted.size() / 2)};
}

/// The line through what follows `light`, by least squares; a slope only as far as kParts parts of the
/// picture, each of which a touch may change by `scatter_gray` (0: none does), do not make it by chance.
LightChange line_through(const LightChange& light, double scatter_gray, std::span<const float> change,
                         std::span<const float> untouched) {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0;
  // Without a branch on what noise decides: adding 0 changes nothing.
  for (size_t i = 0; i < change.size(); ++i) {
    const double of = follows(light, change[i], untouched[i]) ? 1 : 0;
    const double u = of * double{untouched[i]}, c = of * double{change[i]};
    n += of, x += u, y += c, xx += u * u, xy += u * c;
  }
  if (n < 2) return light;
  const double spread = xx - x * x / n;
  double slope = spread > n ? (xy - x * y / n) / spread : 0;
  if (slope != 0)
    slope *= std::max(0.0, 1 - scatter_gray * scatter_gray * n / (kParts * spread * slope * slope));
  return {.gain = 1 + slope, .offset_gray = (y - slope * x) / n};
}

}  // namespace

LightChange LightEstimate::find(std::span<const float> change, std::span<const float> untouched, Gain gain) {
  const size_t count = change.size();
  sorted_.assign(change.begin(), change.end());
  const LightChange shifted{.offset_gray = double{nth_value(sorted_, count / 2)}};
  for (size_t i = 0; i < count; ++i) sorted_[i] = change[i] / std::max(untouched[i], kDark_gray);
  const LightChange scaled{.gain = 1 + double{nth_value(sorted_, count / 2)}};
  const auto followers = [&](const LightChange& light) {
    size_t n = 0;
    for (size_t i = 0; i < count; ++i) n += follows(light, change[i], untouched[i]);
    return n;
  };
  const size_t by_shift = followers(shifted), by_scale = followers(scaled);
  // A gain has to be seen: it explains a tenth of the places more.
  LightChange light = by_scale > by_shift + count / 10 ? scaled : shifted;
  const double share = static_cast<double>(std::max(by_shift, by_scale)) / static_cast<double>(count);
  if (share >= kFewInliers)
    for (int pass = 0; pass < 3; ++pass) {
      const double feigned_gray =
          gain == Gain::BeyondTouch ? scatter_about(light, change, untouched, sorted_) : 0;
      light = line_through(light, feigned_gray, change, untouched);
    }
  light.known = share >= kFewInliers;
  light.share = share;
  light.scatter_gray = scatter_about(light, change, untouched, sorted_);
  return light;
}

double LightChange::variance() const {
  if (!known) return std::numeric_limits<double>::infinity();
  return std::pow(kLeastError_gray, 2) + std::pow(kPulled * scatter_gray, 2);
}

LightChange ExpectedLight::with(const LightChange& own, double gray) const {
  const double of_own = own.variance();
  if (!std::isfinite(variance)) return own;
  LightChange both = own;
  double from_own = 0;
  if (std::isfinite(of_own)) {
    const double apart = std::pow(own.at(gray) - light.at(gray), 2);
    const double may_be = variance + std::max(0.0, apart - std::pow(kSurely, 2) * (variance + of_own));
    from_own = may_be / (may_be + of_own);
  }
  both.gain = light.gain + from_own * (own.gain - light.gain);
  both.offset_gray = light.offset_gray + from_own * (own.offset_gray - light.offset_gray);
  return both;
}

// DerSimonian and Laird's estimate of what differs between pictures.
ExpectedLight LightSeries::expected(double gray) const {
  double weights = 0, squares = 0, gain = 0, offset = 0;
  size_t known = 0;
  const auto mean = [&](double between) {
    weights = squares = gain = offset = 0, known = 0;
    for (const LightChange& one : lights_) {
      if (!one.known) continue;
      const double weight = 1 / (one.variance() + between);
      weights += weight, squares += weight * weight, ++known;
      gain += weight * one.gain, offset += weight * one.offset_gray;
    }
    return LightChange{.gain = gain / weights, .offset_gray = offset / weights};
  };
  LightChange light = mean(0);
  if (known < kFewest) return {};
  double misfit = 0;
  for (const LightChange& one : lights_)
    if (one.known) misfit += std::pow(one.at(gray) - light.at(gray), 2) / one.variance();
  const double between =
      std::max(0.0, (misfit - static_cast<double>(known - 1)) / (weights - squares / weights));
  light = mean(between);
  return {light, between + 1 / weights};
}

bool LightTrust::enough(double share) {
  matched_ = matched_ || share >= kSureInliers;
  return share >= (matched_ ? LightEstimate::kFewInliers : kSureInliers);
}

}  // namespace palpate
