#include "engine/measure/picture/pad_flaws.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "engine/base/statistics.h"
#include "engine/base/text.h"
#include "engine/numeric/islands.h"

namespace palpate {
namespace {

constexpr uint32_t kCell = 8;      // px, of the places that show the light
constexpr size_t kNoiseStep = 13;  // one pixel in so many shows the noise
constexpr size_t kLeast_px = 8;
constexpr float kFoot = 0.5f;  // of the limit, down to which a flaw reaches
constexpr float kHalo =
    0.25f;  // of the largest near by: less is what a strong flaw leaves in means around it
constexpr float kFewestSeen = 0.05f;  // of a place's pixels: fewer do not show it
constexpr uint32_t kRim_px = 2;
constexpr float kAlike = 0.5f;  // scatter of a flaw over pictures, over its mean

std::vector<uint8_t> widened(const std::vector<uint8_t>& mask, const FrameFormat& format, uint32_t reach) {
  std::vector<uint8_t> wide(mask.size());
  for (uint32_t y = 0; y < format.height; ++y)
    for (uint32_t x = 0; x < format.width; ++x) {
      if (mask[size_t{y} * format.width + x] == 0) continue;
      for (uint32_t v = y - std::min(y, reach); v <= std::min(y + reach, format.height - 1); ++v)
        for (uint32_t u = x - std::min(x, reach); u <= std::min(x + reach, format.width - 1); ++u)
          wide[size_t{v} * format.width + u] = 1;
    }
  return wide;
}

bool any(const std::vector<uint8_t>& mask) {
  return std::ranges::find_if(mask, [](uint8_t one) { return one != 0; }) != mask.end();
}

double share_of(const std::vector<uint8_t>& mask) {
  return static_cast<double>(std::ranges::count(mask, 1)) / static_cast<double>(mask.size());
}

// Places of `mask` that lie within a pixel of each other, from 1, and how many they are.
uint32_t number_places(const std::vector<uint8_t>& mask, const FrameFormat& format,
                       std::vector<uint32_t>& labels) {
  return find_islands(widened(mask, format, 1), format.width, format.height, {}, &labels).count;
}

}  // namespace

std::string FlawSummary::describe() const {
  if (places == 0) return {};
  return text(
      "the pad no longer looks as in its untouched image in %u thin place%s, %llu px in all, the largest "
      "%u x %u px at (%u, %u) px (a scratch, dust or a hair that came after it, or an old one that went): "
      "filled from around, so that no dent comes of %s; a new --background of the clean pad measures there "
      "too",
      places, places == 1 ? "" : "s", static_cast<unsigned long long>(px), largest.width, largest.height,
      largest.x, largest.y, places == 1 ? "it" : "them");
}

PadFlaws::PadFlaws(const FrameFormat& format, bool separate)
    : format_(format), separate_(separate), wide_(std::max(4u, (format.width + 20) / 40)) {
  assert(format.bit_depth == 8);
}

void PadFlaws::set_background(const Frame& untouched) {
  const size_t pixels = size_t{format_.width} * format_.height;
  rest_.assign(format_.channels, Plane(pixels));
  change_ = even_ = rest_;
  for (Plane* plane : {&strength_, &fine_, &scratch_, &weight_, &weighted_}) plane->resize(pixels);
  for (uint32_t c = 0; c < format_.channels; ++c)
    for (uint32_t y = 0; y < format_.height; ++y)
      std::copy_n(untouched.row(c, y), format_.width, rest_[c].begin() + size_t{y} * format_.width);
  flaws_.clear();
  sure_.clear();
  frames_ = 0;
  settled_ = judged_ = false;
  for (auto* plane : {&sum_, &squares_}) plane->assign(separate_ ? pixels : 0, 0.0f);
  for (auto* counts : {&seen_, &shown_}) counts->assign(separate_ ? pixels : 0, uint16_t{0});
}

bool PadFlaws::look_at(const Frame& frame) {
  const bool compares = compares_next();
  ++frames_;
  if (!compares) return false;
  if (separate_) return frames_ <= UINT16_MAX && compare(frame) && look_at_picture();
  if (!compare(frame) || share_of(calm_) < kUntouched) {
    settled_ = true;
    return false;
  }
  judged_ = true;
  return look_at_following();
}

// Flaws are what the first frame shows and the next ones too; once settled, places of which half is still
// seen.
bool PadFlaws::look_at_following() {
  if (frames_ == 1) {
    sure_ = clear_;
  } else if (!settled_) {
    for (size_t i = 0; i < sure_.size(); ++i) sure_[i] &= clear_[i];
  } else {
    std::vector<uint32_t> labels;
    const uint32_t places = number_places(sure_, format_, labels);
    std::vector<size_t> all(places + 1), left(places + 1);
    for (size_t i = 0; i < sure_.size(); ++i)
      if (sure_[i] != 0) ++all[labels[i]], left[labels[i]] += clear_[i];
    for (size_t i = 0; i < sure_.size(); ++i)
      if (2 * left[labels[i]] < all[labels[i]]) sure_[i] = 0;
  }
  keep_thin(sure_);
  settled_ = settled_ || frames_ >= kLooks || !any(sure_);
  return set_flaws(sure_);
}

bool PadFlaws::look_at_picture() {
  std::vector<uint8_t> touched(calm_.size());
  for (size_t i = 0; i < calm_.size(); ++i) touched[i] = calm_[i] == 0;
  touched = widened(touched, format_, wide_);
  std::vector<uint8_t> mask(calm_.size());
  for (size_t i = 0; i < calm_.size(); ++i) {
    if (touched[i] == 0) {
      ++seen_[i];
      shown_[i] = static_cast<uint16_t>(shown_[i] + clear_[i]);
      sum_[i] += strength_[i];
      squares_[i] += strength_[i] * strength_[i];
    }
    if (seen_[i] < kFewest) continue;
    judged_ = true;
    if (shown_[i] < kShare * seen_[i]) continue;
    const float mean = sum_[i] / seen_[i], variance = squares_[i] / seen_[i] - mean * mean;
    mask[i] = variance < kAlike * kAlike * mean * mean;
  }
  keep_thin(mask);
  return set_flaws(std::move(mask));
}

bool PadFlaws::set_flaws(std::vector<uint8_t> mask) {
  sure_ = std::move(mask);
  if (!any(sure_)) sure_.clear();
  std::vector<uint8_t> wide = sure_.empty() ? sure_ : widened(sure_, format_, kRim_px);
  return std::exchange(flaws_, std::move(wide)) != flaws_;
}

// What differs from around it, and where the rest is untouched; false where too much differs to be flaws.
bool PadFlaws::compare(const Frame& frame) {
  for (uint32_t c = 0; c < format_.channels; ++c) take_light_out(frame, c);
  const double least_gray = separate_ ? kSteady_gray : kClear_gray;
  std::fill(weight_.begin(), weight_.end(), 1.0f);
  find_bands();
  find_clear(least_gray);
  if (any(clear_)) {
    const std::vector<uint8_t> out = widened(clear_, format_, 1);
    for (size_t i = 0; i < out.size(); ++i) weight_[i] = out[i] != 0 ? 0.0f : 1.0f;
    find_bands();
    find_clear(least_gray);
  }
  box_mean(weight_, wide_, scratch_);
  calm_.resize(clear_.size());
  for (size_t i = 0; i < calm_.size(); ++i) {
    bool calm = scratch_[i] >= kFewestSeen;
    for (const Plane& even : even_) calm = calm && std::abs(double{even[i]}) < kCalm_gray;
    calm_[i] = calm;
  }
  return share_of(clear_) <= kMost;
}

void PadFlaws::take_light_out(const Frame& frame, uint32_t channel) {
  const uint32_t width = format_.width;
  const Plane& rest = rest_[channel];
  Plane& change = change_[channel];
  std::vector<float> was, differs;
  for (uint32_t y = 0; y < format_.height; ++y) {
    const uint8_t* row = frame.row(channel, y);
    for (uint32_t x = 0; x < width; ++x) {
      const size_t i = size_t{y} * width + x;
      change[i] = static_cast<float>(row[x]) - rest[i];
    }
  }
  for (uint32_t y = 0; y + kCell <= format_.height; y += kCell)
    for (uint32_t x = 0; x + kCell <= width; x += kCell) {
      float before = 0, by = 0;
      for (uint32_t v = 0; v < kCell; ++v)
        for (uint32_t u = 0; u < kCell; ++u) {
          const size_t i = size_t{y + v} * width + x + u;
          before += rest[i], by += change[i];
        }
      was.push_back(before / (kCell * kCell));
      differs.push_back(by / (kCell * kCell));
    }
  if (was.empty()) return;
  const LightChange light = LightEstimate(was.size()).find(differs, was);
  const auto gain = static_cast<float>(light.gain - 1), offset = static_cast<float>(light.offset_gray);
  for (size_t i = 0; i < change.size(); ++i) change[i] -= gain * rest[i] + offset;
}

// Mean over up to 2 reach + 1 pixels each way, fewer at the border.
void PadFlaws::box_mean(const Plane& from, uint32_t reach, Plane& to) {
  const uint32_t width = format_.width, height = format_.height;
  Plane rows(from.size());
  for (uint32_t y = 0; y < height; ++y) {
    const float* row = from.data() + size_t{y} * width;
    double sum = 0;
    uint32_t first = 0, last = 0;  // in the sum: from the first up to the last
    for (uint32_t x = 0; x < width; ++x) {
      for (; last < std::min(x + reach + 1, width); ++last) sum += double{row[last]};
      for (; first + reach < x; ++first) sum -= double{row[first]};
      rows[size_t{y} * width + x] = static_cast<float>(sum / (last - first));
    }
  }
  std::vector<double> sums(width);
  uint32_t first = 0, last = 0;
  for (uint32_t y = 0; y < height; ++y) {
    for (; last < std::min(y + reach + 1, height); ++last)
      for (uint32_t x = 0; x < width; ++x) sums[x] += double{rows[size_t{last} * width + x]};
    for (; first + reach < y; ++first)
      for (uint32_t x = 0; x < width; ++x) sums[x] -= double{rows[size_t{first} * width + x]};
    for (uint32_t x = 0; x < width; ++x)
      to[size_t{y} * width + x] = static_cast<float>(sums[x] / (last - first));
  }
}

// Means of what has weight, about each place.
void PadFlaws::find_bands() {
  box_mean(weight_, wide_, scratch_);
  for (size_t c = 0; c < change_.size(); ++c) {
    for (size_t i = 0; i < weighted_.size(); ++i) weighted_[i] = weight_[i] * change_[c][i];
    box_mean(weighted_, wide_, even_[c]);
    for (size_t i = 0; i < scratch_.size(); ++i) even_[c][i] /= std::max(scratch_[i], kFewestSeen);
  }
}

void PadFlaws::find_clear(double least_gray) {
  const uint32_t width = format_.width, height = format_.height;
  std::fill(strength_.begin(), strength_.end(), 0.0f);
  for (size_t c = 0; c < change_.size(); ++c) {
    box_mean(change_[c], 1, fine_);
    std::vector<float> noise;
    for (size_t i = 0; i < fine_.size(); ++i) fine_[i] -= even_[c][i];
    for (size_t i = 0; i < fine_.size(); i += kNoiseStep) noise.push_back(std::abs(fine_[i]));
    const double sd = double{median_in_place(noise)} / 0.6745;
    const auto per_limit = static_cast<float>(1 / std::max(kSigmas * sd, least_gray));
    for (size_t i = 0; i < fine_.size(); ++i)
      if (const float value = fine_[i] * per_limit; std::abs(value) > std::abs(strength_[i]))
        strength_[i] = value;
  }
  // Largest of blocks; that of a block and its neighbours is the largest near by.
  const uint32_t across = (width + wide_ - 1) / wide_, down = (height + wide_ - 1) / wide_;
  std::vector<float> blocks(size_t{across} * down);
  for (uint32_t y = 0; y < height; ++y)
    for (uint32_t x = 0; x < width; ++x) {
      float& largest = blocks[size_t{y / wide_} * across + x / wide_];
      largest = std::max(largest, std::abs(strength_[size_t{y} * width + x]));
    }
  std::vector<float> near(blocks.size());
  for (uint32_t j = 0; j < down; ++j)
    for (uint32_t i = 0; i < across; ++i)
      for (uint32_t v = j - std::min(j, 1u); v <= std::min(j + 1, down - 1); ++v)
        for (uint32_t u = i - std::min(i, 1u); u <= std::min(i + 1, across - 1); ++u)
          near[size_t{j} * across + i] =
              std::max(near[size_t{j} * across + i], blocks[size_t{v} * across + u]);
  clear_.assign(strength_.size(), 0);
  for (uint32_t y = 0; y < height; ++y)
    for (uint32_t x = 0; x < width; ++x) {
      const size_t i = size_t{y} * width + x;
      clear_[i] =
          std::abs(strength_[i]) > std::max(kFoot, kHalo * near[size_t{y / wide_} * across + x / wide_]);
    }
  if (!any(clear_)) return;
  std::vector<uint32_t> labels;
  std::vector<float> peak(number_places(clear_, format_, labels) + 1);
  std::vector<size_t> px(peak.size());
  for (size_t i = 0; i < clear_.size(); ++i)
    if (clear_[i] != 0) {
      peak[labels[i]] = std::max(peak[labels[i]], std::abs(strength_[i]));
      ++px[labels[i]];
    }
  for (size_t i = 0; i < clear_.size(); ++i)
    if (clear_[i] != 0) clear_[i] = peak[labels[i]] > 1 && px[labels[i]] >= kLeast_px;
}

// Leaves out places that are too few pixels, or that hold a square wider than a flaw.
void PadFlaws::keep_thin(std::vector<uint8_t>& mask) const {
  if (!any(mask)) return;
  const uint32_t width = format_.width, height = format_.height;
  std::vector<uint32_t> labels;
  const uint32_t places = number_places(mask, format_, labels);
  std::vector<size_t> px(places + 1);
  std::vector<uint8_t> thick(places + 1);
  // Side of the largest square whose last corner is a pixel.
  std::vector<uint32_t> above(width), here(width);
  for (uint32_t y = 0; y < height; ++y) {
    for (uint32_t x = 0; x < width; ++x) {
      const size_t i = size_t{y} * width + x;
      here[x] = 0;
      if (mask[i] == 0) continue;
      here[x] = x == 0 || y == 0 ? 1 : std::min({here[x - 1], above[x], above[x - 1]}) + 1;
      ++px[labels[i]];
      if (here[x] > wide_) thick[labels[i]] = 1;
    }
    std::swap(above, here);
  }
  for (size_t i = 0; i < mask.size(); ++i)
    if (mask[i] != 0) mask[i] = thick[labels[i]] == 0 && px[labels[i]] >= kLeast_px;
}

FlawSummary PadFlaws::summary() const {
  FlawSummary summary;
  if (flaws_.empty()) return summary;
  struct Place {
    uint64_t px = 0;
    uint32_t left = UINT32_MAX, top = UINT32_MAX, right = 0, bottom = 0;
  };
  std::vector<uint32_t> labels;
  summary.places = find_islands(flaws_, format_.width, format_.height, {}, &labels).count;
  std::vector<Place> places(summary.places + 1);
  for (uint32_t y = 0; y < format_.height; ++y)
    for (uint32_t x = 0; x < format_.width; ++x) {
      const size_t i = size_t{y} * format_.width + x;
      if (flaws_[i] == 0) continue;
      Place& place = places[labels[i]];
      ++place.px, ++summary.px;
      place.left = std::min(place.left, x), place.right = std::max(place.right, x);
      place.top = std::min(place.top, y), place.bottom = std::max(place.bottom, y);
    }
  const Place& most = *std::ranges::max_element(places, {}, &Place::px);
  summary.largest = {most.left, most.top, most.right - most.left + 1, most.bottom - most.top + 1};
  return summary;
}

}  // namespace palpate
