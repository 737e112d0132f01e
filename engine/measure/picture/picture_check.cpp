#include "engine/measure/picture/picture_check.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <numeric>
#ifdef __SSE2__
#include <emmintrin.h>
#endif

#include "engine/base/nth_value.h"
#include "engine/base/simd.h"
#include "engine/measure/picture/colour_order.h"

namespace palpate {
namespace {

// Gray levels of 8 bits; deeper frames have as many times more.
constexpr double kShown_gray = 12;       // untouched: black there is no fault
constexpr double kOtherColour_gray = 6;  // from the untouched image, of a part of one colour
constexpr double kFlatShare = 0.01;      // of the frame's blocks, in one colour
constexpr double kExchanged_gray = 2.5;  // least change of most places, for colours that are exchanged
constexpr double kExchangedFit = 0.4;    // of that, which the exchange leaves

template <typename Pixel>
const Pixel* row_of(const Frame& frame, uint32_t channel, uint32_t y) {
  return reinterpret_cast<const Pixel*>(frame.row(channel, y));
}

/// One colour from `x` on, over `count` pixels of each channel.
bool is_flat(const Frame& frame, uint32_t y, uint32_t x, uint32_t count) {
  const size_t bytes = frame.format.bytes_per_pixel();
  for (uint32_t c = 0; c < frame.format.channels; ++c) {
    const uint8_t* row = frame.row(c, y) + x * bytes;
    if (std::memcmp(row, row + bytes, (count - 1) * bytes) != 0) return false;
  }
  return true;
}

}  // namespace

PictureCheck::PictureCheck(const FrameFormat& format, uint32_t saturation_gray,
                           const std::optional<PadOutline>& pad)
    : format_(format),
      saturation_gray_(saturation_gray),
      parts_(std::max(1u, format.width / kPart)),
      bands_(std::clamp(format.height / kPart, 1u, 16u)),
      band_rows_(format.height / bands_),
      places_(format, pad, kPart, bands_, band_rows_) {
  const size_t places = size_t{format.height} * parts_;
  for (uint32_t y = 0; y + kPart <= format.height; y += kPart) {
    uint32_t blocks = 0;
    for (uint32_t i = 0; i < parts_; ++i) blocks += places_.has(i, y, kPart);
    widest_ = std::max(widest_, blocks);
  }
  steps_.resize(format.channels * places);
  pad_.resize(places);
  for (uint32_t y = 1; y < format.height; ++y)
    for (uint32_t i = 0; i < parts_; ++i)
      pad_[size_t{y} * parts_ + i] = places_.has(i, y - 1, 2) ? 1.0f : 0.0f;
  of_pad_.resize(size_t{format.height / kRows} * parts_);
  for (uint32_t y = 0; y + kRows <= format.height; y += kRows)
    for (uint32_t i = 0; i < parts_; ++i) of_pad_[size_t{y / kRows} * parts_ + i] = places_.has(i, y, kRows);
  largest_.resize(parts_);
  change_.resize(parts_);
  scratch_.reserve(std::max(
      {places / 4, format.channels * places / 12, size_t{format.width} + 1, size_t{format.height} + 1}));
}

namespace {

uint32_t sum_of_16(const uint8_t* pixels) {
#ifdef __SSE2__
  const __m128i words =
      _mm_sad_epu8(_mm_loadu_si128(reinterpret_cast<const __m128i*>(pixels)), _mm_setzero_si128());
  return static_cast<uint32_t>(_mm_cvtsi128_si32(words) + _mm_extract_epi16(words, 4));
#else
  return std::accumulate(pixels, pixels + 16, 0u);
#endif
}
uint32_t sum_of_16(const uint16_t* pixels) {
  return std::accumulate(pixels, pixels + 16, 0u);
}

/// Adds a row of pixels to the sums of its columns.
template <typename Pixel>
struct AddRow {
  const Pixel* row;
  uint32_t* columns;
  uint32_t width;

  PALPATE_INLINE void run() const {
    const Pixel* const from = row;
    uint32_t* const to = columns;
    const uint32_t end = width;
    PALPATE_INDEPENDENT
    for (uint32_t x = 0; x < end; ++x) to[x] += from[x];
  }
};

}  // namespace

/// Parts of rows and columns of bands in one pass over the pixels.
template <typename Pixel>
void PictureCheck::add(const Frame& frame, Sums& sums) {
  static_assert(kPart == 16);
  const uint32_t width = format_.width, count = std::min(kPart, width);
  sums.parts.resize(size_t{format_.channels} * format_.height * parts_);
  sums.columns.resize(size_t{format_.channels} * bands_ * width);
  column_.resize(width);
  float *part = sums.parts.data(), *column = sums.columns.data();
  for (uint32_t c = 0; c < format_.channels; ++c) {
    std::fill(column_.begin(), column_.end(), 0u);
    for (uint32_t y = 0; y < format_.height; ++y) {
      const Pixel* row = row_of<Pixel>(frame, c, y);
      if (count == kPart)
        for (uint32_t i = 0; i < parts_; ++i)
          part[i] = static_cast<float>(sum_of_16(row + kPart * i)) / static_cast<float>(kPart);
      else
        part[0] = static_cast<float>(std::accumulate(row, row + count, 0u)) / static_cast<float>(count);
      part += parts_;
      if (y >= bands_ * band_rows_) continue;
      run_widest(AddRow<Pixel>{row, column_.data(), width});
      if ((y + 1) % band_rows_ != 0) continue;
      for (const uint32_t sum : column_) *column++ = static_cast<float>(sum) / static_cast<float>(band_rows_);
      std::fill(column_.begin(), column_.end(), 0u);
    }
  }
}

void PictureCheck::sum(const Frame& frame, Sums& sums) {
  if (format_.bytes_per_pixel() == 1)
    add<uint8_t>(frame, sums);
  else
    add<uint16_t>(frame, sums);
  // In gray levels of 8 bits, whatever the depth.
  const float scale = 255.0f / static_cast<float>(format_.max_gray());
  if (scale == 1) return;
  for (auto* values : {&sums.parts, &sums.columns})
    for (float& value : *values) value *= scale;
}

void PictureCheck::set_reference(const Frame& untouched) {
  sum(untouched, untouched_);
  unlike_.assign(bands_, std::nullopt);
  reference_ = untouched;
  if (untouched.leased) {
    reference_.reshape(format_);
    std::copy_n(untouched.pixels(), format_.frame_bytes(), reference_.bytes.begin());
  }
}

void PictureCheck::note_repeats(const Frame& frame) {
  constexpr uint64_t kPrime = 0x9E3779B97F4A7C15u;
  const uint8_t* bytes = frame.pixels();
  const size_t count = format_.frame_bytes();
  constexpr size_t kLanes = 8;  // multiplications that do not wait for each other
  std::array<uint64_t, kLanes> hash{1, 2, 3, 4, 5, 6, 7, 8};
  size_t at = 0;
  for (; at + 8 * kLanes <= count; at += 8 * kLanes)
    for (size_t lane = 0; lane < kLanes; ++lane) {
      uint64_t word = 0;
      std::memcpy(&word, bytes + at + 8 * lane, 8);
      hash[lane] = (hash[lane] ^ word) * kPrime;
      hash[lane] ^= hash[lane] >> 29;
    }
  for (; at < count; ++at) hash[0] = (hash[0] ^ bytes[at]) * kPrime;
  uint64_t whole = 0;
  for (const uint64_t of_lane : hash) whole = (whole ^ of_lane) * kPrime;
  repeats_ = any_ && whole == last_hash_;
  any_ = true;
  last_hash_ = whole;
}

PictureFault PictureCheck::look_at(const Frame& frame) {
  note_repeats(frame);
  sum(frame, now_);
  if (has_one_colour(frame)) return PictureFault::OneColour;
  if (colours_exchanged()) return PictureFault::ColourOrder;
  if (moved()) return PictureFault::Moved;
  if (torn()) return PictureFault::Torn;
  return PictureFault::None;
}

/// Whether the frame's block has one colour, which goes to `colour`.
bool PictureCheck::is_flat_block(const Frame& frame, uint32_t x, uint32_t y,
                                 std::array<uint32_t, 3>& colour) const {
  const uint32_t width = std::min(kPart, format_.width);
  for (uint32_t v = 0; v < kPart; ++v) {
    if (!is_flat(frame, y + v, x, width)) return false;
    for (uint32_t c = 0; c < format_.channels; ++c) {
      const uint32_t gray = frame.at(c, x, y + v);
      if (v > 0 && gray != colour[c]) return false;
      colour[c] = gray;
    }
  }
  return true;
}

/// Whether a block of that colour is neither what the untouched image shows there, nor dark or saturated.
bool PictureCheck::is_foreign(const std::array<uint32_t, 3>& colour, uint32_t i, uint32_t y) const {
  const double scale = 255.0 / format_.max_gray();
  const size_t plane = size_t{format_.height} * parts_;
  bool saturated = true, dark = true, other = false;
  for (uint32_t c = 0; c < format_.channels; ++c) {
    double untouched = 0;
    for (uint32_t v = 0; v < kPart; ++v)
      untouched += untouched_.parts[c * plane + size_t{y + v} * parts_ + i] / kPart;
    saturated = saturated && colour[c] >= saturation_gray_;
    dark = dark && untouched < kShown_gray && colour[c] * scale < kShown_gray;
    other = other || std::abs(colour[c] * scale - untouched) > kOtherColour_gray;
  }
  return other && !saturated && !dark;
}

/// Blocks of kPart x kPart px in one colour, the most frequent one, where the untouched image has structure,
/// or most of the frame has.
bool PictureCheck::has_one_colour(const Frame& frame) const {
  struct Found {
    uint32_t blocks = 0, structured = 0;
  };
  std::map<std::array<uint32_t, 3>, Found> colours;
  uint32_t all = 0, flat = 0, rows = 0, whole_rows = 0;
  for (uint32_t y = 0; y + kPart <= format_.height; y += kPart) {
    std::array<uint32_t, 3> of_row{};
    uint32_t of_pad = 0, in_row = 0;
    for (uint32_t i = 0; i < parts_; ++i) {
      const uint32_t x = i * kPart;
      std::array<uint32_t, 3> colour{}, untouched{};
      const size_t place = size_t{y / kRows} * parts_ + i;
      if (of_pad_[place] == 0 || of_pad_[place + parts_] == 0) continue;
      const bool first = of_pad++ == 0;
      if (!is_flat_block(frame, x, y, colour)) continue;
      ++flat;
      if (!is_foreign(colour, i, y)) continue;
      Found& found = colours[colour];
      ++found.blocks;
      found.structured += !is_flat_block(reference_, x, y, untouched);
      if (first) of_row = colour;
      in_row += colour == of_row;
    }
    all += of_pad;
    rows += of_pad > 0;
    // Few blocks of a pad's corner may be what an object leaves.
    whole_rows += in_row == of_pad && 2 * of_pad >= widest_;
  }
  if (whole_rows > 0 && whole_rows < rows) return true;
  const auto least = static_cast<uint32_t>(std::max(3.0, kFlatShare * all));
  return std::any_of(colours.begin(), colours.end(), [&](const auto& one) {
    const auto& [blocks, structured] = one.second;
    return structured >= least || (blocks >= least && 2 * (all - flat) > all - blocks);
  });
}

/// The value of scratch_, which is overwritten, below which `share` of the others lie; 0 of none.
double PictureCheck::quantile(double share) {
  if (scratch_.empty()) return 0;
  return double{nth_value(scratch_, static_cast<size_t>(share * static_cast<double>(scratch_.size() - 1)))};
}

/// Whether the median of scratch_ is, without looking for it.
bool PictureCheck::most_are_below(double gray) const {
  const auto small = std::ranges::count_if(scratch_, [&](float change) { return change < gray; });
  return 2 * small > std::ssize(scratch_) - 1;
}

static void add_difference(const float* now, const float* untouched, std::span<float> sums) {
  for (size_t i = 0; i < sums.size(); ++i) sums[i] += now[i] - untouched[i];
}

/// By all places together, or by the median over places of the colour that differs most.
bool PictureCheck::colours_exchanged() {
  if (format_.channels != 3) return false;
  if (follows_another_order(now_.parts, untouched_.parts)) return true;
  const size_t plane = size_t{format_.height} * parts_;
  std::array<double, 6> misfit{};
  for (size_t order = 0; order < kChannelOrders.size(); ++order) {
    scratch_.clear();
    for (uint32_t y = 0; y + kRows <= format_.height; y += kRows) {
      std::ranges::fill(largest_, 0.0f);
      for (size_t c = 0; c < 3; ++c) {
        std::ranges::fill(change_, 0.0f);
        for (uint32_t v = 0; v < kRows; ++v) {
          const size_t at = size_t{y + v} * parts_;
          add_difference(now_.parts.data() + kChannelOrders[order][c] * plane + at,
                         untouched_.parts.data() + c * plane + at, change_);
        }
        for (uint32_t i = 0; i < parts_; ++i)
          largest_[i] = std::max(largest_[i], std::abs(change_[i]) / kRows);
      }
      for (uint32_t i = 0; i < parts_; ++i)
        if (of_pad_[size_t{y / kRows} * parts_ + i] != 0) scratch_.push_back(largest_[i]);
    }
    if (order == 0 && most_are_below(kExchanged_gray)) return false;
    misfit[order] = quantile(0.5);
  }
  return *std::min_element(misfit.begin() + 1, misfit.end()) < kExchangedFit * misfit[0];
}

}  // namespace palpate
