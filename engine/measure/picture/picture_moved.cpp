// The parts of PictureCheck that compare lines: pictures that are shifted, doubled or torn.
#include <algorithm>
#include <array>
#include <cmath>

#include "engine/base/simd.h"
#include "engine/measure/picture/picture_check.h"

namespace palpate {
namespace {

// Gray levels of 8 bits; deeper frames have as many times more.
constexpr double kMoved_gray = 2;     // least change of most of a line, for one that has moved
constexpr double kMovedFit = 0.3;     // of that, which the move leaves
constexpr double kMovedLeast = 0.02;  // of the line's length
constexpr double kMovedLines = 0.2;   // of the lines, which move alike
constexpr double kTorn_gray = 4;      // least step across a tear
constexpr double kTornNoise = 8;      // times the noise of such steps
constexpr float kTornBeside = 0.34f;  // of the step, most in the rows beside
constexpr double kTornShare = 0.25;   // of a row

}  // namespace

/// Difference of value `i` of a line from the untouched line rolled by `shift`, of the channel where it is
/// largest.
static float difference(const PictureLine& line, uint32_t channels, size_t shift, size_t i) {
  const size_t from = i >= shift ? i - shift : i + line.length - shift;
  float largest = 0;
  for (uint32_t c = 0; c < channels; ++c)
    largest = std::max(largest, std::abs(line.frame[c * line.channel_step + i * line.step] -
                                         line.untouched[c * line.channel_step + from * line.step]));
  return largest;
}

/// Differences of some values from `from` to `to`, into scratch_.
void PictureCheck::differences_of(const PictureLine& line, size_t shift, size_t from, size_t to) {
  scratch_.clear();
  const size_t stride = std::max<size_t>(1, line.length / 160);
  for (size_t i = from; i < to; i += stride) scratch_.push_back(difference(line, format_.channels, shift, i));
}

/// `share` quantile of them.
double PictureCheck::misfit_of(const PictureLine& line, size_t shift, size_t from, size_t to, double share) {
  differences_of(line, shift, from, to);
  return quantile(share);
}

namespace {

/// Adds the change of one value of a line, from the untouched value that would come there, to the sums of
/// many shifts.
struct AddChanges {
  std::array<float, 3> values;
  std::array<const float*, 3> untouched;  ///< by rising shift; channels may repeat
  float most;
  float* sums;
  size_t count;

  PALPATE_INLINE void run() const {
    const float v0 = values[0], v1 = values[1], v2 = values[2], limit = most;
    const float *const u0 = untouched[0], *const u1 = untouched[1], *const u2 = untouched[2];
    float* const to = sums;
    const size_t end = count;
    PALPATE_INDEPENDENT
    for (size_t i = 0; i < end; ++i)
      to[i] += std::min(limit,
                        std::max(std::max(std::abs(v0 - u0[i]), std::abs(v1 - u1[i])), std::abs(v2 - u2[i])));
  }
};

}  // namespace

/// The untouched line of channel `c`, backwards, twice, and by phases of `step`: values of shifts that are
/// `step` apart lie side by side.
void PictureCheck::lay_out(const PictureLine& line, uint32_t c, size_t step) {
  const size_t length = line.length, phase = 2 * length / step + 1;
  laid_out_.resize(size_t{format_.channels} * step * phase);
  const float* const from = line.untouched + c * line.channel_step;
  for (size_t p = 0; p < step; ++p) {
    float* to = laid_out_.data() + (c * step + p) * phase;
    for (size_t i = p; i < 2 * length; i += step)
      *to++ = from[(i < length ? length - 1 - i : 2 * length - 1 - i) * line.step];
  }
}

/// The shift that leaves least of the line's change; 0: none is clearly better than none.
size_t PictureCheck::likely_shift(const PictureLine& line, double still) {
  constexpr size_t kValues = 64, kShifts = 160;
  const auto least = std::max<size_t>(2, static_cast<size_t>(kMovedLeast * static_cast<double>(line.length)));
  if (line.length < 2 * least) return 0;
  const size_t stride = std::max<size_t>(1, (line.to - line.from) / kValues);
  const auto most = static_cast<float>(2 * still);
  const auto sum_at = [&](size_t shift) {
    float sum = 0;
    for (size_t i = line.from; i < line.to; i += stride)
      sum += std::min(most, difference(line, format_.channels, shift, i));
    return sum;
  };
  const size_t step = std::max<size_t>(1, line.length / kShifts);
  const size_t phase = 2 * line.length / step + 1, shifts = (line.length - 2 * least) / step + 1;
  for (uint32_t c = 0; c < format_.channels; ++c) lay_out(line, c, step);
  scratch_.assign(shifts, 0);
  for (size_t i = line.from; i < line.to; i += stride) {
    const size_t first = line.length - 1 - i + least;
    AddChanges add{{}, {}, most, scratch_.data(), shifts};
    for (uint32_t k = 0; k < 3; ++k) {
      const uint32_t c = std::min(k, format_.channels - 1);
      add.values[k] = line.frame[c * line.channel_step + i * line.step];
      add.untouched[k] = laid_out_.data() + (c * step + first % step) * phase + first / step;
    }
    run_widest(add);
  }
  const auto lowest = std::ranges::min_element(scratch_);
  float smallest = *lowest;
  if (!(smallest < sum_at(0))) return 0;
  const size_t coarse = least + step * static_cast<size_t>(lowest - scratch_.begin());
  size_t best = coarse;
  for (size_t shift = std::max(least, coarse - std::min(coarse, step)); shift < coarse + step; ++shift) {
    if (shift + least > line.length) break;
    const float sum = sum_at(shift);
    if (sum < smallest) smallest = sum, best = shift;
  }
  return best;
}

/// Both parts of the line, before and beyond the seam, have to fit where they come from, and not where they
/// are.
bool PictureCheck::line_moved(const PictureLine& line) {
  differences_of(line, 0, line.from, line.to);
  if (most_are_below(kMoved_gray) || changed_evenly(line)) return false;
  const double still = quantile(0.5);
  const size_t shift = likely_shift(line, still);
  if (shift == 0) return false;
  const double most = std::max(0.5 * kMoved_gray, kMovedFit * still);
  // Where the pad lies on one side of the seam, what is around it says whether there is one.
  const auto fits = [&](size_t from, size_t to) {
    const size_t first = std::max(from, line.from), end = std::min(to, line.to);
    return misfit_of(line, shift, first < end ? first : from, first < end ? end : to, 0.5) < most;
  };
  return misfit_of(line, shift, line.from, line.to, 0.5) < kMovedFit * still && fits(0, shift) &&
         fits(shift, line.length) && misfit_of(line, shift, line.from, line.to, 0.75) < 2 * most;
}

/// As light changes a line, and no roll does: by nearly the same everywhere.
bool PictureCheck::changed_evenly(const PictureLine& line) const {
  const size_t stride = std::max<size_t>(1, line.length / 160);
  for (uint32_t c = 0; c < format_.channels; ++c) {
    float least = 1e9f, most = -1e9f;
    for (size_t i = line.from; i < line.to; i += stride) {
      const size_t at = c * line.channel_step + i * line.step;
      const float change = line.frame[at] - line.untouched[at];
      least = std::min(least, change);
      most = std::max(most, change);
    }
    if (most - least > 2 * kMoved_gray) return false;
  }
  return true;
}

/// Both halves are alike, which those of the untouched image are not.
bool PictureCheck::line_doubled(const PictureLine& line, std::optional<double>& of_untouched) {
  const size_t half = line.length / 2;
  if (line.from + half >= line.to) return false;
  const auto unlike = [&](const float* values, size_t shift) {
    PictureLine itself = line;
    itself.frame = itself.untouched = values;
    return misfit_of(itself, shift, line.from, std::min(half, line.to - half), 0.75);
  };
  if (!of_untouched) of_untouched = unlike(line.untouched, half);
  const double untouched = *of_untouched;
  // Dark or saturated halves are alike as well.
  return untouched > 2 * kMoved_gray && unlike(line.frame, half / 2) > 0.4 * untouched &&
         unlike(line.frame, half) < std::max(0.5 * kMoved_gray, 0.2 * untouched);
}

bool PictureCheck::moved() {
  // A line that hardly touches the pad says little.
  const auto is_long = [](const PadRun& run, size_t length) { return 4 * size_t{run.length()} >= length; };
  uint32_t bands = 0, rows = 0, columns = 0, doubled = 0;
  for (uint32_t b = 0; b < bands_; ++b) {
    const PadRun run = places_.columns[b];
    if (!is_long(run, format_.width)) continue;
    const size_t at = size_t{b} * format_.width;
    const PictureLine line{now_.columns.data() + at,
                           untouched_.columns.data() + at,
                           size_t{bands_} * format_.width,
                           1,
                           format_.width,
                           run.from,
                           run.to};
    ++bands;
    rows += line_moved(line);
    doubled += line_doubled(line, unlike_[b]);
  }
  if (2 * doubled > bands) return true;
  if (rows >= std::max(1.0, kMovedLines * bands)) return true;
  const uint32_t apart = std::max(1u, parts_ / 8);
  uint32_t looked_at = 0;
  for (uint32_t i = 0; i < parts_; i += apart) {
    const PadRun run = places_.rows_of_part[i];
    if (!is_long(run, format_.height)) continue;
    ++looked_at;
    columns += line_moved({now_.parts.data() + i, untouched_.parts.data() + i,
                           size_t{format_.height} * parts_, parts_, format_.height, run.from, run.to});
  }
  return columns >= std::max(1.0, kMovedLines * looked_at);
}

/// Change of the steps from row `y` - 1 to `y`, against the untouched image's, where `pad` is 1.
static void steps_to(const float* now, const float* untouched, const float* pad, std::span<float> steps) {
  const size_t parts = steps.size();
  const float *now_before = now - parts, *untouched_before = untouched - parts;
  for (size_t i = 0; i < parts; ++i)
    steps[i] = pad[i] * std::abs((now[i] - now_before[i]) - (untouched[i] - untouched_before[i]));
}

/// Steps from row to row over a quarter of the row at a stretch and near both its ends, that the rows next to
/// them do not have; nor those at the next borders of a codec's blocks, where what changes evenly has such
/// steps too.
bool PictureCheck::torn() {
  const uint32_t height = format_.height;
  if (height < 8 || parts_ < 4) return false;
  const size_t plane = size_t{height} * parts_;
  scratch_.clear();
  for (uint32_t c = 0; c < format_.channels; ++c)
    for (uint32_t y = 1; y < height; ++y) {
      const size_t row = size_t{y} * parts_, at = c * plane + row;
      steps_to(now_.parts.data() + at, untouched_.parts.data() + at, pad_.data() + row,
               {steps_.data() + at, parts_});
      for (uint32_t i = 0; y % 5 == 0 && i < parts_; i += 3)
        if (pad_[row + i] > 0) scratch_.push_back(steps_[at + i]);
    }
  const double usual = quantile(0.5);
  if (usual == 0) return false;  // a picture without noise may have edges as sharp as a tear
  // The median of a normal deviate's size is 0.67 of its standard deviation.
  const auto least = static_cast<float>(std::max(kTorn_gray, kTornNoise * usual / 0.67));
  for (uint32_t y = 3; y + 2 < height; ++y) {
    const uint32_t of_pad = places_.parts_of_row[y].length();
    const auto long_enough = std::max(3u, static_cast<uint32_t>(std::ceil(kTornShare * of_pad)));
    uint32_t large = 0;
    if (of_pad < 4) continue;
    for (uint32_t c = 0; c < format_.channels; ++c) {
      const float* steps = steps_.data() + c * plane + size_t{y} * parts_;
      for (uint32_t i = 0; i < parts_; ++i) large += steps[i] >= least;
    }
    if (large >= long_enough && torn_at(y, least, long_enough)) return true;
  }
  return false;
}

bool PictureCheck::torn_at(uint32_t y, float least, uint32_t long_enough) const {
  const size_t plane = size_t{format_.height} * parts_;
  const PadRun pad = places_.parts_of_row[y];
  const uint32_t outer = std::max(1u, pad.length() / 8);
  uint32_t run = 0;
  bool long_run = false, left = false, right = false;
  for (uint32_t i = pad.from; i < pad.to; ++i) {
    bool sharp = false;
    for (uint32_t c = 0; c < format_.channels && !sharp; ++c) {
      const size_t at = c * plane + size_t{y} * parts_ + i;
      if (steps_[at] < least) continue;
      float beside = 0;
      for (const int rows : {-16, -8, -2, -1, 1, 2, 8, 16}) {
        const int64_t there = int64_t{y} + rows;
        if (there >= 1 && there < format_.height)
          beside = std::max(beside, steps_[c * plane + static_cast<size_t>(there) * parts_ + i]);
      }
      sharp = beside < kTornBeside * steps_[at];
    }
    run = sharp ? run + 1 : 0;
    long_run = long_run || run >= long_enough;
    left = left || (sharp && i < pad.from + outer);
    right = right || (sharp && i + outer >= pad.to);
  }
  // The straight edge of an object ends within the pad.
  return long_run && left && right;
}

}  // namespace palpate
