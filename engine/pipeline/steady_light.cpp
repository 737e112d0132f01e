#include "engine/pipeline/steady_light.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numeric>

#include "engine/base/nth_value.h"
#include "engine/base/simd.h"

namespace palpate {
namespace {

constexpr double kPlaces = 1500;
constexpr double kLeastMisfit_gray = 0.4;  // of the best quarter of the places, before a change is believed
constexpr double kClearly = 0.5;           // of that, which the change leaves
// Thresholds of ordered dither, sixteenths: the mean of 4 x 4 pixels keeps fractions of a gray level.
constexpr int kThresholds[4][4] = {{0, 8, 2, 10}, {12, 4, 14, 6}, {3, 11, 1, 9}, {15, 7, 13, 5}};

float raise_of(int threshold) {
  return (static_cast<float>(threshold) + 0.5f) / 16;
}

PALPATE_INLINE uint8_t dithered(float gray, float raise, float most) {
  return static_cast<uint8_t>(std::clamp(std::floor(gray + raise), 0.0f, most));
}

/// A curve with one threshold, from its exact values.
struct Dither {
  const float* steady;
  float raise, most;
  uint8_t* to;

  PALPATE_INLINE void run() const {
    for (uint32_t gray = 0; gray < 256; ++gray) to[gray] = dithered(steady[gray], raise, most);
  }
};

constexpr int kFractionBits = 22;  // bits of a gray level behind the point

constexpr int32_t fixed_raise(int threshold) {
  return (2 * threshold + 1) * (1 << (kFractionBits - 5));
}

/// A row by whole numbers, `raise` of each of four columns included in `offset`.
struct SteadyRow {
  const uint8_t* from;
  uint8_t* to;
  uint32_t width;
  int32_t per_gray;
  std::array<int32_t, 4> offset;
  int32_t most, saturation;

  PALPATE_INLINE void run() const {
    constexpr uint32_t kBlock = 32;
    int32_t offsets[kBlock];
    for (uint32_t x = 0; x < kBlock; ++x) offsets[x] = offset[x % 4];
    const int32_t times = per_gray, highest = most, kept = saturation;
    const uint8_t* in = from;
    uint8_t* out = to;
    for (uint32_t left = width; left > 0;) {
      const uint32_t pixels = left < kBlock ? left : kBlock;
      PALPATE_INDEPENDENT
      for (uint32_t x = 0; x < pixels; ++x) {
        const int32_t gray = in[x];
        int32_t steady = (gray * times + offsets[x]) >> kFractionBits;
        steady = steady < 0 ? 0 : steady;
        steady = steady > highest ? highest : steady;
        const int32_t keeps = -static_cast<int32_t>(gray >= kept);  // no branch: it would not be vectorised
        out[x] = static_cast<uint8_t>((steady & ~keeps) | (gray & keeps));
      }
      left -= pixels, in += pixels, out += pixels;
    }
  }
};

/// Sum of 4 x 4 pixels.
uint32_t sum_of_square(const uint8_t* first, size_t stride) {
  constexpr uint32_t kEven = 0x00FF00FFu;
  uint32_t pairs = 0;  // two sums of 16 bits
  for (size_t y = 0; y < 4; ++y) {
    uint32_t row = 0;
    std::memcpy(&row, first + y * stride, sizeof row);
    pairs += (row & kEven) + (row >> 8 & kEven);
  }
  return (pairs & 0xFFFFu) + (pairs >> 16);
}

uint32_t places_along(uint32_t length, uint32_t side, uint32_t step) {
  return length < side ? 1 : (length - side) / step + 1;
}

}  // namespace

SteadyLight::SteadyLight(const FrameFormat& format, uint32_t saturation_gray, bool separate)
    : format_(format),
      saturation_gray_(saturation_gray),
      separate_(separate),
      most_gray_(static_cast<float>(std::min(saturation_gray, 256u) - 1)),
      step_(std::max(2 * kSide, static_cast<uint32_t>(
                                    std::sqrt(static_cast<double>(format.width) * format.height / kPlaces)))),
      places_x_(places_along(format.width, kSide, step_)),
      places_y_(places_along(format.height, kSide, step_)),
      estimate_(size_t{places_x_} * places_y_) {
  const size_t places = size_t{places_x_} * places_y_;
  for (auto* values : {&untouched_, &change_, &drift_})
    for (std::vector<float>& of_colour : *values) of_colour.assign(places, 0);
  scratch_.resize(places);
  row_.resize(format.width);
  corrected_.reshape(format);
}

void SteadyLight::set_background(const Frame& background) {
  for (auto* values : {&untouched_, &drift_})
    for (std::vector<float>& of_colour : *values) std::fill(of_colour.begin(), of_colour.end(), 0.0f);
  look_at(background);
  untouched_ = change_;
  for (uint32_t colour = 0; colour < 3; ++colour)
    gray_[colour] = std::accumulate(untouched_[colour].begin(), untouched_[colour].end(), 0.0) /
                    static_cast<double>(untouched_[colour].size());
  light_ = {};
  if (!separate_) expected_ = {};
  trust_.restart();
  drifts_ = false;
}

void SteadyLight::look_ahead(const Frame& picture) {
  look_at(picture);
  double share = 1;
  for (uint32_t colour = 0; colour < 3; ++colour) {
    const LightChange light =
        estimate_.find(change_[colour], untouched_[colour], LightEstimate::Gain::BeyondTouch);
    share = std::min(share, light.share);
    if (light.share < kSeriesInliers) continue;
    series_[colour].add(light);
    expected_[colour] = series_[colour].expected(gray_[colour]);
  }
  series_known_ = series_known_ || share >= LightTrust::kSureInliers;
}

void SteadyLight::forget_series() {
  series_ = {};
  series_known_ = false;
  expected_ = {};
}

const Frame& SteadyLight::steady(const Frame& frame) {
  before_.light = light_, before_.expected = expected_, before_.drift = drift_, before_.trust = trust_;
  look_at(frame);
  if (separate_) {
    light_ = {};
    trust_.restart();
  }
  const bool known = find_light();
  if (!known && separate_) light_ = {};
  if (known && !separate_) follow_drift();
  summary_.change_gray = largest_change();
  const bool changed = summary_.change_gray >= kLeast_gray;
  summary_.state = !known ? LightState::Unknown : changed ? LightState::Changed : LightState::Steady;
  if (!changed) {
    summary_.change_gray = 0;
    return frame;
  }
  correct(frame);
  return corrected_;
}

void SteadyLight::forget_last() {
  light_ = before_.light, expected_ = before_.expected, drift_ = before_.drift, trust_ = before_.trust;
}

// Means of places less those of the untouched image and its drift.
void SteadyLight::look_at(const Frame& frame) {
  const uint32_t width = std::min(kSide, format_.width), height = std::min(kSide, format_.height);
  const float share = 1 / static_cast<float>(width * height);
  const size_t stride = format_.width;
  for (uint32_t colour = 0; colour < 3; ++colour)
    for (uint32_t j = 0; j < places_y_; ++j) {
      const uint8_t* first = frame.row(colour, j * step_);
      const size_t row = size_t{j} * places_x_;
      const float *untouched = untouched_[colour].data() + row, *drift = drift_[colour].data() + row;
      float* change = change_[colour].data() + row;
      const size_t next = j + 1 < places_y_ ? step_ * stride : 0;  // the camera's memory is far
      for (uint32_t i = 0; i < places_x_; ++i, first += step_) {
        uint32_t sum = 0;
        for (uint32_t y = 0; y < height; ++y) __builtin_prefetch(first + next + y * stride);
        if (width == kSide && height == kSide)
          sum = sum_of_square(first, stride);
        else
          for (uint32_t y = 0; y < height; ++y)
            for (uint32_t x = 0; x < width; ++x) sum += first[y * stride + x];
        change[i] = static_cast<float>(sum) * share - untouched[i] - drift[i];
      }
    }
}

bool SteadyLight::find_light() {
  bool known = true;
  double share = 1;
  for (uint32_t colour = 0; colour < 3; ++colour) {
    const LightChange light = find_light(colour);
    share = std::min(share, light.share);
    known = known && light.known;
  }
  if (separate_ && series_known_) return share >= kSeriesInliers;
  return trust_.enough(share) && known;
}

// That of the frame alone; what is taken out goes by what is expected too.
LightChange SteadyLight::find_light(uint32_t colour) {
  LightChange own = estimate_.find(change_[colour], untouched_[colour], LightEstimate::Gain::BeyondTouch);
  ExpectedLight& expected = expected_[colour];
  const bool in_series = separate_ && std::isfinite(expected.variance);
  if (!separate_) expected.variance = std::pow(std::sqrt(expected.variance) + kDrift_gray, 2);
  if (!own.known) return own;
  if (!in_series && !changes_clearly(colour, own)) own.gain = 1, own.offset_gray = 0;
  light_[colour] = expected.with(own, gray_[colour]);
  if (!separate_ && own.variance() <= expected.variance) expected = {light_[colour], own.variance()};
  return own;
}

// By the best quarter of the places: a touch that covers less than the rest does not count.
bool SteadyLight::changes_clearly(uint32_t colour, const LightChange& light) {
  const auto misfit = [&](const LightChange& of) {
    for (size_t i = 0; i < scratch_.size(); ++i)
      scratch_[i] = std::abs(change_[colour][i] - static_cast<float>(of.at(double{untouched_[colour][i]})));
    return double{nth_value(scratch_, scratch_.size() / 4)};
  };
  const auto small = std::ranges::count_if(
      change_[colour], [](float gray) { return std::abs(double{gray}) <= kLeastMisfit_gray; });
  if (static_cast<size_t>(small) > change_[colour].size() / 4) return false;
  return misfit(light) < kClearly * misfit({});
}

void SteadyLight::follow_drift() {
  size_t still = 0;
  for (uint32_t colour = 0; colour < 3; ++colour)
    for (size_t i = 0; i < change_[colour].size(); ++i) {
      change_[colour][i] -= static_cast<float>(light_[colour].at(double{untouched_[colour][i]}));
      still += std::abs(double{change_[colour][i]}) <= kUntouched_gray;
    }
  const size_t all = 3 * change_[0].size();
  if (static_cast<double>(still) < kUntouchedShare * static_cast<double>(all)) return;
  for (uint32_t colour = 0; colour < 3; ++colour)
    for (size_t i = 0; i < change_[colour].size(); ++i)
      drift_[colour][i] += std::clamp(change_[colour][i], -static_cast<float>(kUntouched_gray),
                                      static_cast<float>(kUntouched_gray)) /
                           kMemory_frames;
}

// RMS of what is taken out, of the colour where it is largest. Drift that is noise does not count.
double SteadyLight::largest_change() {
  double largest = 0, drift = 0;
  for (uint32_t colour = 0; colour < 3; ++colour) {
    double squares = 0, of_drift = 0;
    for (size_t i = 0; i < change_[colour].size(); ++i) {
      const double by_drift = drift_[colour][i];
      squares += std::pow(light_[colour].at(double{untouched_[colour][i]}) + by_drift, 2);
      of_drift += by_drift * by_drift;
    }
    const auto places = static_cast<double>(change_[colour].size());
    largest = std::max(largest, std::sqrt(squares / places));
    drift = std::max(drift, std::sqrt(of_drift / places));
  }
  drifts_ = drift >= kLeast_gray;
  return largest;
}

// How the light's curve of each colour, with each threshold of the dither, maps gray levels.
void SteadyLight::make_curves() {
  for (uint32_t colour = 0; colour < 3; ++colour) {
    std::array<float, 256> steady{};
    for (uint32_t gray = 0; gray < 256; ++gray)
      steady[gray] = static_cast<float>((gray - light_[colour].offset_gray) / light_[colour].gain);
    for (uint32_t k = 0; k < kBayer; ++k) {
      Curve& curve = curves_[colour][k];
      run_widest(Dither{steady.data(), raise_of(kThresholds[k / 4][k % 4]), most_gray_, curve.data()});
      for (uint32_t gray = saturation_gray_; gray < 256; ++gray) curve[gray] = static_cast<uint8_t>(gray);
    }
    find_line(colour);
  }
}

// Whole numbers that give the curves' very values, which are many times faster than a table; none where
// rounding stands against it.
void SteadyLight::find_line(uint32_t colour) {
  constexpr int64_t kMost = (int64_t{1} << 31) - (int64_t{1} << 24);
  Line& line = lines_[colour];
  line = {};
  const double per_gray = (1 << kFractionBits) / light_[colour].gain;
  const double offset = -light_[colour].offset_gray * per_gray;
  if (!(std::abs(per_gray) * 255 + std::abs(offset) < static_cast<double>(kMost))) return;
  const auto most = static_cast<int64_t>(most_gray_);
  for (const int32_t nudge : {0, 1, -1, 2, -2}) {
    line.per_gray = static_cast<int32_t>(std::lround(per_gray)) + nudge;
    // Offsets that raise each level far enough, and not too far.
    int64_t low = -kMost, high = kMost;
    for (uint32_t k = 0; k < kBayer; ++k)
      for (uint32_t gray = 0; gray < std::min(saturation_gray_, 256u); ++gray) {
        const int64_t level = curves_[colour][k][gray];
        const int64_t without = int64_t{gray} * line.per_gray + fixed_raise(kThresholds[k / 4][k % 4]);
        if (level > 0) low = std::max(low, (level << kFractionBits) - without);
        if (level < most) high = std::min(high, ((level + 1) << kFractionBits) - without);
      }
    line.exact = low < high;
    if (line.exact)
      line.offset = static_cast<int32_t>(std::clamp<int64_t>(std::llround(offset), low, high - 1));
    if (line.exact) return;
  }
}

void SteadyLight::apply_line(const Line& line, uint32_t y, std::span<const uint8_t> from,
                             std::span<uint8_t> to) const {
  std::array<int32_t, 4> offsets{};
  for (uint32_t x = 0; x < 4; ++x) offsets[x] = line.offset + fixed_raise(kThresholds[y % 4][x]);
  run_widest(SteadyRow{from.data(), to.data(), static_cast<uint32_t>(from.size()), line.per_gray, offsets,
                       static_cast<int32_t>(most_gray_), static_cast<int32_t>(saturation_gray_)});
}

void SteadyLight::correct(const Frame& frame) {
  if (!drifts_) make_curves();
  for (uint32_t colour = 0; colour < 3; ++colour) {
    const float per_gain = 1 / static_cast<float>(light_[colour].gain);
    const auto offset = static_cast<float>(light_[colour].offset_gray);
    for (uint32_t y = 0; y < format_.height; ++y) {
      const uint8_t* from = frame.row(colour, y);
      uint8_t* to = corrected_.row(colour, y);
      if (!drifts_ && lines_[colour].exact) {
        apply_line(lines_[colour], y, {from, format_.width}, {to, format_.width});
        continue;
      }
      if (!drifts_) {
        const Curve* curves = &curves_[colour][(y % 4) * 4];
        for (uint32_t x = 0; x < format_.width; ++x) to[x] = curves[x % 4][from[x]];
        continue;
      }
      drift_along(colour, y);
      for (uint32_t x = 0; x < format_.width; ++x)
        to[x] = from[x] >= saturation_gray_
                    ? from[x]
                    : dithered((static_cast<float>(from[x]) - offset - row_[x]) * per_gain,
                               raise_of(kThresholds[y % 4][x % 4]), most_gray_);
    }
  }
}

// Linear between the places' middles, into row_.
void SteadyLight::drift_along(uint32_t colour, uint32_t y) {
  struct Between {
    uint32_t first, second;
    float share;  // of the second
  };
  const auto between = [this](uint32_t at, uint32_t places) {
    const float place = (static_cast<float>(at) - 0.5f * (kSide - 1)) / static_cast<float>(step_);
    const float inside = std::clamp(place, 0.0f, static_cast<float>(places - 1));
    const auto first = static_cast<uint32_t>(inside);
    return Between{first, std::min(first + 1, places - 1), inside - static_cast<float>(first)};
  };
  const Between v = between(y, places_y_);
  const float* above = drift_[colour].data() + size_t{v.first} * places_x_;
  const float* below = drift_[colour].data() + size_t{v.second} * places_x_;
  for (uint32_t x = 0; x < format_.width; ++x) {
    const Between u = between(x, places_x_);
    const float upper = above[u.first] + u.share * (above[u.second] - above[u.first]);
    const float lower = below[u.first] + u.share * (below[u.second] - below[u.first]);
    row_[x] = upper + v.share * (lower - upper);
  }
}

}  // namespace palpate
